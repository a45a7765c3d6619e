//! MDF 4 files as records: the channels that were taken at the same times, by their names.
//!
//! ```text
//!   channel `v_out`, unit mV        a column `v_out [mV]`
//!   `v_out\XCP:1\buck`, `Root/v_out` a column `v_out`: devices stand behind the name, folders before it
//!   the master of the group         `t`
//! ```
//!
//! Groups whose times are the same to the bit are one table. Of several tables the one with the most channels is taken; what
//! was taken at other times is left out and said.

use ::mdf::{Channel, Error, File, Group, Limits};
use toml_input::{Faults, FileName, Message};

use crate::logged::{Vector, called, columns, with_unit};
use crate::sheet::Sheet;

const EXPORT: &str = "in Python: from asammdf import MDF; MDF('run.mf4').to_dataframe(raster=5e-5).to_csv('run.csv')";
const CONVERT: &str = "in Python: from asammdf import MDF; MDF('run.mf4').convert('4.11').save('run4.mf4')";
/// Channels at most; a table is held in memory as a whole.
const MOST_CHANNELS: usize = 10_000;
/// Names that are shown of what is left out.
const SHOWN: usize = 8;

/// Reads the bytes of an MDF file.
pub fn read(name: FileName, bytes: &[u8], most_bytes: u64) -> Result<Sheet, Faults> {
    let limits = Limits {
        most_bytes: usize::try_from(most_bytes).unwrap_or(usize::MAX),
        most_channels: MOST_CHANNELS,
    };
    let File { groups, left_out } = ::mdf::read(bytes, limits).map_err(|error| name.fault(told(error)))?;
    let mut tables = together(groups);
    let size = |table: &Vec<Group>| {
        let channels: usize = table.iter().map(|group| group.channels.len()).sum();
        (channels, rows(table))
    };
    // of equals the first of the file
    let best = (0..tables.len()).rev().max_by_key(|index| tables.get(*index).map(size));
    let Some(taken) = best.map(|index| tables.remove(index)).filter(|table| size(table).0 > 0) else {
        let message = Message::new("the MDF file holds no channels of numbers").expected("a channel for each quantity");
        let others = (!left_out.is_empty()).then(|| format!("left out: {}", few(&left_out)));
        return Err(name
            .fault(message.found(others.unwrap_or_else(|| "none".to_owned())).hint(EXPORT))
            .into());
    };
    let mut sheet = Sheet::numbered(name, columns(vectors(taken)));
    let others: Vec<String> = tables.iter().flat_map(|table| named(table)).collect();
    let mut repairs = Vec::new();
    if !others.is_empty() {
        repairs.push(format!(
            "left out of the MDF file, taken at other times than the {} rows of the others: {}",
            sheet.rows(),
            few(&others)
        ));
    }
    if !left_out.is_empty() {
        repairs.push(format!("left out of the MDF file: {}", few(&left_out)));
    }
    sheet.repairs.splice(0..0, repairs);
    Ok(sheet)
}

fn told(error: Error) -> Message {
    let packed = |message: Message| message.hint(CONVERT);
    match error {
        Error::Older(version) => packed(
            Message::new("this is an MDF file of an older version")
                .found(format!("version {version}"))
                .expected("MDF 4"),
        ),
        Error::Unfinished => packed(
            Message::new("the recorder stopped before it had finished this MDF file")
                .expected("a file that its recorder closed"),
        ),
        Error::Packed { kind } => packed(
            Message::new("the records of this MDF file are packed in a way that is not read")
                .found(format!("way {kind} of MDF 4.3"))
                .expected("deflate, or none"),
        ),
        Error::Unpacked { most } => Message::new("the records of the MDF file cannot be unpacked")
            .found(format!(
                "blocks that are damaged, or hold more than {most} bytes or values"
            ))
            .hint("save less of the record, or the file again"),
        Error::Parts => Message::new("the MDF file has more channels or blocks than a record has").hint(EXPORT),
        Error::Broken { block, at } => Message::new("this is not a sound MDF file")
            .found(format!("no {block} block at byte {at}"))
            .hint("copy or save the file again"),
    }
}

/// The groups that belong together: their times are the same to the bit.
fn together(groups: Vec<Group>) -> Vec<Vec<Group>> {
    let mut tables: Vec<Vec<Group>> = Vec::new();
    for group in groups {
        let alike = tables
            .iter_mut()
            .find(|table| table.first().is_some_and(|first| is_alike(first, &group)));
        match alike {
            Some(table) => table.push(group),
            None => tables.push(vec![group]),
        }
    }
    tables
}

fn is_alike(one: &Group, other: &Group) -> bool {
    match (&one.master, &other.master) {
        (Some(a), Some(b)) => {
            let mut both = a.values.iter().zip(&b.values);
            a.is_time && b.is_time && a.values.len() == b.values.len() && both.all(|(a, b)| a.to_bits() == b.to_bits())
        }
        _ => false,
    }
}

fn rows(table: &[Group]) -> usize {
    let first = table.first();
    let channel = first.and_then(|group| group.master.as_ref().or(group.channels.first()));
    channel.map_or(0, |channel| channel.values.len())
}

/// What is called there: without the device behind it and the folders before it.
fn label(channel: &Channel) -> String {
    let name = channel.name.split('\\').next().unwrap_or_default();
    called(name)
}

fn vectors(table: Vec<Group>) -> Vec<Vector> {
    let mut vectors = Vec::new();
    for (index, group) in table.into_iter().enumerate() {
        let folder = match group.name.as_str() {
            "" => format!("group {}", index + 1),
            name => name.to_owned(),
        };
        // the time is the same in all of them
        if let Some(master) = group.master.filter(|_| index == 0) {
            let name = match master.is_time {
                true => "t".to_owned(),
                false => with_unit(&label(&master), &master.unit),
            };
            vectors.push(Vector {
                path: format!("{folder}.{}", master.name),
                name,
                values: master.values,
            });
        }
        vectors.extend(group.channels.into_iter().map(|channel| Vector {
            path: with_unit(&format!("{folder}.{}", channel.name), &channel.unit),
            name: with_unit(&label(&channel), &channel.unit),
            values: channel.values,
        }));
    }
    vectors
}

/// The channels of a table, with its rows.
fn named(table: &[Group]) -> Vec<String> {
    let rows = rows(table);
    let channels = table.iter().flat_map(|group| &group.channels);
    channels
        .map(|channel| format!("`{}` ({rows})", label(channel)))
        .collect()
}

fn few(names: &[String]) -> String {
    let shown: Vec<&str> = names.iter().take(SHOWN).map(String::as_str).collect();
    match names.len().checked_sub(SHOWN).filter(|more| *more > 0) {
        None => shown.join(", "),
        Some(more) => format!("{} and {more} more", shown.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{ColumnMap, Options, VOCABULARY};

    fn fixture(name: &str) -> Sheet {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/records");
        Sheet::open(folder.join(name).as_path(), &Options::default()).unwrap()
    }

    fn numbers(sheet: &Sheet, quantity: &str) -> Vec<f64> {
        let located = sheet.locate(&VOCABULARY, &ColumnMap::default()).unwrap();
        let signal = located.signal(quantity).unwrap();
        let number = |row| signal.number(sheet, row).unwrap_or(f64::NAN);
        (0..sheet.rows()).map(number).collect()
    }

    /// Written by asammdf: counts with a factor, singles, both byte orders, packed and not.
    #[test]
    fn channels_of_every_kind_have_the_values_of_the_text() {
        let text = fixture("record.csv");
        for name in ["rasters.mf4", "packed.mf4"] {
            let sheet = fixture(name);
            assert_eq!(sheet.rows(), text.rows(), "{name}");
            for quantity in ["t", "duty", "v_out", "i_l", "r_load"] {
                let both = numbers(&sheet, quantity).into_iter().zip(numbers(&text, quantity));
                for (row, (found, expected)) in both.enumerate() {
                    if (name, quantity, row) == ("packed.mf4", "i_l", 7) {
                        assert!(found.is_nan(), "the value that is marked as invalid");
                        continue;
                    }
                    assert!(
                        (found - expected).abs() <= 1e-7 * expected.abs().max(1.0),
                        "{name}: {quantity}, {row}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_no_channel_of_the_table_is_left_out_and_said() {
        let sheet = fixture("rasters.mf4");
        let said = sheet.repairs.join("\n");
        assert!(
            said.contains("than the 60 rows of the others: `temperature` (6)"),
            "{said}"
        );
        assert!(said.contains("`mode` (text)"), "{said}");
        assert_eq!(
            sheet.headers().collect::<Vec<_>>(),
            ["t", "v_out [V]", "duty", "i_l [A]", "r_load [Ohm]"]
        );
        let said = |name: &str, bytes: Vec<u8>| {
            let sheet = Sheet::parse(Path::new(name), bytes, &Options::default());
            sheet.unwrap_err().to_string()
        };
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/records");
        let older = said("older.mdf", std::fs::read(folder.join("older.mdf")).unwrap());
        assert!(
            older.contains("version 3.30") && older.contains("convert('4.11')"),
            "{older}"
        );
        let mut whole = std::fs::read(folder.join("packed.mf4")).unwrap();
        for length in [9, 30, 64, 100, 1000, whole.len() / 2, whole.len() - 9] {
            let said = said("cut.mf4", whole[..length].to_vec());
            assert!(
                said.contains("cut.mf4") && said.contains("MDF file"),
                "{length}: {said}"
            );
        }
        whole[..8].copy_from_slice(b"UnFinMF ");
        assert!(said("run.mf4", whole).contains("before it had finished"));
    }
}
