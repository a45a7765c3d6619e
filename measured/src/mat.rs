//! MAT files of all versions as records: vectors of one length, by their names.
//!
//! ```text
//!   v_out = [n x 1], log.v_out = [n x 1]      a column `v_out`
//!   data = [n x 3]                            `data_1`, `data_2`, `data_3`
//!   X.Data; Y(2).Name, Y(2).Data, Y(2).Unit   dSPACE ControlDesk: the time `t`, and a column of that name and unit
//!   time; signals(1).values, .label           Simulink's structure with time
//! ```
//!
//! The rows are as many as most of the vectors have; what has another length is left out and said.

use std::collections::BTreeMap;

use ::mat::{Error, Limits, Numbers, Value, Variable};
use toml_input::{Faults, FileName, Message};

use crate::logged::{Vector, called, columns, with_unit};
use crate::newer;
use crate::sheet::Sheet;

const SAVE: &str = "in MATLAB: v_out = v_out(:); save('run.mat', 't', 'v_out', '-v7'), with a vector for each quantity; or writetable(T, 'run.csv')";

/// Characters of a name: `Model Root/Plant/Buck/v_out{SubArray1}` and longer.
const MOST_NAME: usize = 256;
/// Columns of a matrix at most: one with more is a picture or a map, or lies on its side.
const MOST_COLUMNS: usize = 64;

/// Reads the bytes of a MAT file.
pub fn read(name: FileName, bytes: &[u8], most_bytes: u64) -> Result<Sheet, Faults> {
    let limits = Limits {
        most_bytes: usize::try_from(most_bytes).unwrap_or(usize::MAX),
        // a channel that stands still packs to a thousandth; the bytes above are the bound
        most_growth: 2000,
        most_name: MOST_NAME,
    };
    let variables = match newer::is_newer(bytes) {
        true => newer::read(bytes, limits).map_err(|error| name.fault(told_of_newer(error)))?,
        false => ::mat::read(bytes, limits).map_err(|error| name.fault(told(error)))?,
    };
    let mut found = Found::default();
    for Variable { name, value } in &variables {
        found.visit(value, name);
    }
    let Some(rows) = found.length() else {
        let message = Message::new("the MAT file holds no vectors of numbers").expected("a vector for each quantity");
        let objects =
            (!found.objects.is_empty()).then(|| format!("objects, which are not read: {}", found.objects.join(", ")));
        return Err(name
            .fault(message.found(objects.unwrap_or_else(|| "none".to_owned())).hint(SAVE))
            .into());
    };
    let (taken, left): (Vec<_>, Vec<_>) = found
        .vectors
        .into_iter()
        .partition(|vector| vector.values.len() == rows);
    let mut repairs = Vec::new();
    let mut leave = |names: Vec<String>, why: &str| {
        if !names.is_empty() {
            repairs.push(format!("left out of the MAT file, {why}: {}", names.join(", ")));
        }
    };
    let other = left
        .iter()
        .map(|vector| format!("`{}` ({})", vector.path, vector.values.len()));
    leave(other.collect(), &format!("not of {rows} rows as the others"));
    leave(found.objects, "an object of MATLAB");
    let mut sheet = Sheet::numbered(name, columns(taken));
    sheet.repairs.splice(0..0, repairs);
    Ok(sheet)
}

fn told(error: Error) -> Message {
    match error {
        // its first bytes would have sent it elsewhere
        Error::Newer => Message::new("this is a MAT file of version 7.3").hint(SAVE),
        Error::BigEndian => Message::new("the numbers of this MAT file are stored big-endian")
            .expected("little-endian")
            .hint(SAVE),
        Error::Unpacked { packed, most } => Message::new("a compressed variable of the MAT file cannot be read")
            .found(format!("{packed} bytes that are damaged, or hold more than {most}"))
            .hint("save less of the record, or the file again"),
        Error::Nested { name } | Error::Parts { name, .. } => {
            Message::new(format!("`{name}` has more parts than a record has")).hint(SAVE)
        }
        Error::Broken => Message::new("this is not a sound MAT file")
            .found("elements that do not hold together")
            .expected("a MAT file of version 7 or 6")
            .hint("copy or save the file again"),
    }
}

fn told_of_newer(error: newer::Error) -> Message {
    match error {
        newer::Error::Broken(said) => Message::new("this is not a sound MAT file of version 7.3")
            .found(said)
            .expected("HDF5 as MATLAB's save -v7.3 writes it")
            .hint("copy or save the file again, or save it with -v7"),
        newer::Error::Larger { name, most } => {
            Message::new(format!("`{name}` of the MAT file is larger than a record"))
                .expected(format!(
                    "at most {most} bytes in all variables, unpacked, for a file of this length"
                ))
                .hint("save less of the record")
        }
        newer::Error::Nested { name } => Message::new(format!("`{name}` has more parts than a record has")).hint(SAVE),
    }
}

#[derive(Default)]
struct Found {
    vectors: Vec<Vector>,
    objects: Vec<String>,
}

impl Found {
    /// The length that most vectors have; of several the longest.
    fn length(&self) -> Option<usize> {
        let mut counts: BTreeMap<usize, usize> = BTreeMap::new();
        for vector in &self.vectors {
            *counts.entry(vector.values.len()).or_default() += 1;
        }
        counts
            .into_iter()
            .max_by_key(|(length, count)| (*count, *length))
            .map(|(length, _)| length)
    }

    fn visit(&mut self, value: &Value, path: &str) {
        let name = path.rsplit('.').next().unwrap_or(path);
        match value {
            Value::Numbers(numbers) => self.numbers(numbers, path, name),
            Value::Cells(cells) => {
                for (index, cell) in cells.iter().enumerate() {
                    self.visit(cell, &format!("{path}_{}", index + 1));
                }
            }
            Value::Structs { names, rows } => {
                for (index, row) in rows.iter().enumerate() {
                    let own = match rows.len() {
                        1 => path.to_owned(),
                        _ => format!("{path}_{}", index + 1),
                    };
                    self.fields(names, row, &own);
                }
            }
            Value::Object => self.objects.push(format!("`{path}`")),
            Value::Text(_) | Value::Sparse => {}
        }
    }

    /// A struct: one channel of a logger, or a folder of values.
    fn fields(&mut self, names: &[String], row: &[Value], path: &str) {
        let field = |wanted: &[&str]| {
            let at = names.iter().position(|name| wanted.contains(&name.as_str()))?;
            row.get(at)
        };
        let text = |wanted: &[&str]| match field(wanted) {
            Some(Value::Text(text)) => text.trim().to_owned(),
            _ => String::new(),
        };
        let data = field(&["Data", "data", "values"]);
        if let (Some(Value::Numbers(numbers)), true) = (data, field(&["Name", "name", "label"]).is_some()) {
            let label = called(&text(&["Name", "name", "label"]));
            let unit = text(&["Unit", "unit"]);
            let is_axis = path.rsplit('.').next() == Some("X");
            let name = match (label.is_empty(), is_axis) {
                (true, true) => "t".to_owned(),
                (true, false) => path.rsplit('.').next().unwrap_or(path).to_owned(),
                (false, _) => with_unit(&label, &unit),
            };
            self.numbers(numbers, path, &name);
            return;
        }
        for (own, value) in names.iter().zip(row) {
            self.visit(value, &format!("{path}.{own}"));
        }
    }

    /// A vector is a column, and each column of a matrix is one. A single number is no measurement.
    fn numbers(&mut self, numbers: &Numbers, path: &str, name: &str) {
        let [rows, columns] = numbers.shape[..] else { return };
        if numbers.is_complex || numbers.values.len() < 2 {
            return;
        }
        if rows == 1 || columns == 1 {
            self.push(path, name, &numbers.values);
        } else if columns <= MOST_COLUMNS && columns < rows {
            for (index, column) in numbers.values.chunks(rows).enumerate() {
                let number = index + 1;
                self.push(&format!("{path}_{number}"), &format!("{name}_{number}"), column);
            }
        }
    }

    fn push(&mut self, path: &str, name: &str, values: &[f64]) {
        self.vectors.push(Vector {
            path: path.to_owned(),
            name: name.to_owned(),
            values: values.to_vec(),
        });
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::logged::headers;
    use crate::{ColumnMap, Options, VOCABULARY};

    /// Made by scipy, with the same table as text beside them.
    fn fixture(name: &str) -> Sheet {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/records");
        Sheet::open(folder.join(name).as_path(), &Options::default()).unwrap_or_else(|faults| panic!("{faults}"))
    }

    fn numbers(sheet: &Sheet, quantity: &str, map: &str) -> Option<Vec<f64>> {
        let located = sheet.locate(&VOCABULARY, &ColumnMap::parse(map).unwrap()).unwrap();
        let signal = located.signal(quantity)?;
        Some(
            (0..sheet.rows())
                .map(|row| signal.number(sheet, row).unwrap())
                .collect(),
        )
    }

    /// The quantities of a fixture are those of the text.
    fn holds(name: &str, map: &str, quantities: &[&str]) {
        let text = fixture("record.csv");
        let sheet = fixture(name);
        assert_eq!(sheet.rows(), text.rows(), "{name}");
        for quantity in quantities {
            let (found, expected) = (numbers(&sheet, quantity, map), numbers(&text, quantity, ""));
            let (found, expected) = (found.unwrap_or_else(|| panic!("{name}: {quantity}")), expected.unwrap());
            // single precision in one of them, millivolts in another
            let is_close = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-6 * b.abs();
            assert!(found.iter().zip(&expected).all(is_close), "{name}: {quantity}");
        }
    }

    #[test]
    fn every_layout_holds_the_record_of_the_text() {
        let inductor = "i_l=scope_1,r_load=scope_2";
        for (name, map, quantities) in [
            ("vectors.mat", "", &["t", "duty", "v_out", "i_l", "r_load"][..]),
            ("struct.mat", inductor, &["t", "duty", "v_out", "i_l", "r_load"]),
            ("controldesk.mat", "", &["t", "duty", "v_out", "i_l"]),
            ("structure_with_time.mat", "", &["t", "duty", "v_out"]),
        ] {
            holds(name, map, quantities);
        }
    }

    /// The same tables by another library, with MATLAB's header, classes and transposed arrays (fixtures/records/mat73.py).
    #[test]
    fn files_of_version_7_3_hold_the_record_of_the_text() {
        let inductor = "i_l=scope_1,r_load=scope_2";
        for (name, map, quantities) in [
            ("vectors_73.mat", "", &["t", "duty", "v_out", "i_l", "r_load"][..]),
            ("struct_73.mat", inductor, &["t", "duty", "v_out", "i_l", "r_load"]),
            ("controldesk_73.mat", "", &["t", "duty", "v_out", "i_l"]),
            ("cells_73.mat", "v_out=runs_1,duty=runs_2", &["t", "duty", "v_out"]),
        ] {
            holds(name, map, quantities);
        }
        // text, single numbers, squares, complex and empty matrices are no channels, in a file of either version
        let mut headers: Vec<String> = fixture("vectors_73.mat").headers().map(str::to_owned).collect();
        headers.sort();
        assert_eq!(headers, ["duty", "i_l", "r_load", "t", "v_out"]);
    }

    /// Whatever is cut off or turned over, the answer is a fault of the file or a table, at once.
    #[test]
    fn a_damaged_file_of_version_7_3_is_refused_at_once() {
        let whole =
            std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/records/controldesk_73.mat"));
        let whole = whole.unwrap();
        let begun = std::time::Instant::now();
        for length in [127, 128, 511, 512, 530, 700, 2000, whole.len() / 2, whole.len() - 9] {
            let cut = Sheet::parse(Path::new("cut.mat"), whole[..length].to_vec(), &Options::default());
            let said = cut.unwrap_err().to_string();
            assert!(
                said.contains("cut.mat") && said.contains("MAT file"),
                "{length}: {said}"
            );
        }
        for place in (512..whole.len()).step_by(37) {
            let mut turned = whole.clone();
            turned[place] ^= 0xff;
            let _ = Sheet::parse(Path::new("turned.mat"), turned, &Options::default());
        }
        assert!(begun.elapsed().as_secs_f64() < 20.0);
    }

    /// Each byte of each file in three ways: about a hundred thousand files.
    #[test]
    #[ignore = "a minute; the fuzzer has the same files"]
    fn no_changed_byte_makes_the_reader_of_version_7_3_panic_or_dawdle() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/records");
        let (mut longest, mut read) = (0.0_f64, 0);
        for name in ["vectors_73.mat", "struct_73.mat", "controldesk_73.mat", "cells_73.mat"] {
            let whole = std::fs::read(folder.join(name)).unwrap();
            for place in 0..whole.len() {
                for pattern in [0xff, 0x01, 0x80] {
                    let mut turned = whole.clone();
                    turned[place] ^= pattern;
                    let begun = std::time::Instant::now();
                    read += usize::from(Sheet::parse(Path::new("turned.mat"), turned, &Options::default()).is_ok());
                    longest = longest.max(begun.elapsed().as_secs_f64());
                }
            }
        }
        println!("{read} read, the slowest in {longest:.3} s");
        assert!(read > 0 && longest < 2.0, "{read} {longest}");
    }

    /// A dataset of a terabyte of which no byte is stored, and one that claims four billion rows.
    #[test]
    fn a_file_that_claims_more_than_it_can_hold_is_refused_before_it_is_read() {
        let whole =
            std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/records/hollow_73.mat"));
        let begun = std::time::Instant::now();
        let said = Sheet::parse(Path::new("hollow.mat"), whole.unwrap(), &Options::default())
            .unwrap_err()
            .to_string();
        assert!(
            said.contains("`v_out` of the MAT file is larger than a record"),
            "{said}"
        );
        assert!(begun.elapsed().as_secs_f64() < 1.0);
    }

    #[test]
    fn what_is_no_vector_of_the_record_is_left_out_and_said() {
        let sheet = fixture("vectors.mat");
        // text and single numbers are no channels; a square is neither rows nor columns
        assert_eq!(
            sheet.headers().collect::<Vec<_>>(),
            ["t", "duty", "v_out", "i_l", "r_load"]
        );
        assert_eq!(sheet.repairs, [""; 0]);
        let mut found = Found::default();
        let vector = |length: usize| {
            Value::Numbers(Numbers {
                shape: vec![length, 1],
                values: vec![1.0; length],
                is_complex: false,
                is_integer: false,
            })
        };
        let names = ["a", "b", "c"].map(str::to_owned).to_vec();
        found.visit(
            &Value::Structs {
                names,
                rows: vec![vec![vector(5), vector(5), vector(9)]],
            },
            "log",
        );
        assert_eq!(found.length(), Some(5));
        // two loggers with a `v_out` each are told apart by their paths
        found.visit(&vector(5), "other.a");
        assert_eq!(headers(&found.vectors), ["log.a", "b", "c", "other.a"]);
    }

    #[test]
    fn a_file_without_vectors_says_what_it_holds() {
        let objects = Found {
            vectors: Vec::new(),
            objects: vec!["`logsout`".to_owned()],
        };
        assert_eq!(objects.length(), None);
        let whole = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/fixtures/records/vectors.mat"));
        let whole = whole.unwrap();
        for length in [20, 127, 130, 200, whole.len() - 9] {
            let cut = Sheet::parse(Path::new("cut.mat"), whole[..length].to_vec(), &Options::default());
            let said = cut.unwrap_err().to_string();
            assert!(
                said.contains("cut.mat") && said.contains("MAT file"),
                "{length}: {said}"
            );
        }
    }
}
