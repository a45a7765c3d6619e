//! What goes wrong between the bench and the file, and tables that no converter gives.

use crate::independent::board::Load;
use crate::independent::draw::Design;
use crate::independent::instruments::{CHANNELS, I_L, I_OUT, V_IN, V_OUT};
use crate::independent::program::Table;
use crate::rng::Rng;

/// A fault of the bench, and what a right answer says of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    pub id: &'static str,
    pub what: String,
    /// Words of a right answer: all of one group, in any order and in upper or lower case.
    pub words: Vec<Vec<&'static str>>,
    /// Listed causes that are right for it.
    pub causes: Vec<&'static str>,
    /// The records are right once this is mended: `consistent` is right, too.
    pub harmless: bool,
}

/// Faults that are in the tables; the others are in how the case is put together.
pub const TABLE_FAULTS: [&str; 10] = [
    "sign",
    "times_10",
    "times_1000",
    "exchanged",
    "one_minus_d",
    "shifted",
    "clipped",
    "lost_rows",
    "spikes",
    "times_2",
];

/// Faults of the bench or of the plant file.
pub const OTHER_FAULTS: [&str; 5] = [
    "sampling_instant",
    "wrong_load",
    "wrong_source",
    "heldout_is_training",
    "wrong_topology",
];

fn fault(id: &'static str, what: String, words: &[&[&'static str]]) -> Fault {
    Fault {
        id,
        what,
        words: words.iter().map(|group| group.to_vec()).collect(),
        causes: vec![],
        harmless: false,
    }
}

fn recorded(tables: &[Table]) -> Vec<usize> {
    (0..4).filter(|index| !tables[0].values[*index].is_empty()).collect()
}

/// Spoils all tables of a case in one of [`TABLE_FAULTS`]; none where the recorded channels have no place for it.
pub fn spoil(id: &'static str, design: &Design, tables: &mut [Table], random: &mut Rng) -> Option<Fault> {
    let channels = recorded(tables);
    let channel = channels[random.below(channels.len())];
    let name = CHANNELS[channel];
    let scale = |tables: &mut [Table], factor: f64| {
        for value in tables.iter_mut().flat_map(|table| &mut table.values[channel]) {
            *value *= factor;
        }
    };
    let fault = match id {
        "sign" => {
            scale(tables, -1.0);
            fault(
                id,
                format!("{name} has the turned sign"),
                &[&["turned sign"], &["*-1"], &["polarity"], &["other way round"]],
            )
        }
        "times_2" => {
            scale(tables, 2.0);
            let words: [&[&str]; 3] = [&["*0.5"], &["twice"], &["probe"]];
            fault(id, format!("{name} twice its value"), &words)
        }
        "times_10" => {
            let factor = if random.chance(0.5) { 10.0 } else { 0.1 };
            scale(tables, factor);
            fault(
                id,
                format!("{name} times {factor}"),
                &[&["probe"], &["*0.1"], &["*10"], &["10 times"], &["ten times"]],
            )
        }
        "times_1000" => {
            scale(tables, 1000.0);
            fault(
                id,
                format!("{name} in thousandths of its unit"),
                &[&["[mv]"], &["[ma]"], &["not in v"], &["not in a"], &["1000 times"]],
            )
        }
        "exchanged" => {
            let pairs = [(I_L, I_OUT), (V_OUT, V_IN), (V_OUT, I_L)];
            let (a, b) = *pairs
                .iter()
                .find(|(a, b)| channels.contains(a) && channels.contains(b))?;
            for table in tables.iter_mut() {
                table.values.swap(a, b);
            }
            let what = format!("{} and {} exchanged", CHANNELS[a], CHANNELS[b]);
            fault(id, what, &[&["exchanged"], &["swapped"], &["each other"]])
        }
        "one_minus_d" => {
            for duty in tables.iter_mut().flat_map(|table| &mut table.duty) {
                *duty = libm::round((1.0 - *duty) * 1e5) / 1e5;
            }
            fault(
                id,
                "the duty is that of the lower switch".to_owned(),
                &[&["lower switch"], &["1 - d"], &["1-d"], &["complement"]],
            )
        }
        _ => return spoil_rows(id, design, tables, channel, random),
    };
    Some(fault)
}

fn spoil_rows(
    id: &'static str,
    design: &Design,
    tables: &mut [Table],
    channel: usize,
    random: &mut Rng,
) -> Option<Fault> {
    let name = CHANNELS[channel];
    if tables[0].t.is_empty() {
        return None;
    }
    match id {
        "shifted" => {
            let rows = 1 + random.below(4);
            let early = random.chance(0.5);
            for table in tables.iter_mut() {
                for values in table.values.iter_mut().filter(|values| !values.is_empty()) {
                    shift(values, rows, early);
                }
            }
            let words: [&[&str]; 4] = [&["shift"], &["row", "late"], &["row", "early"], &["rows later"]];
            let way = if early { "early" } else { "late" };
            let mut fault = fault(id, format!("measured columns {rows} rows {way}"), &words);
            fault.causes = if early {
                vec![]
            } else if rows <= 2 {
                vec!["duty_delay", "sampling_delay", "sensor_delay"]
            } else {
                vec!["duty_delay"]
            };
            Some(fault)
        }
        "clipped" => {
            let mut all: Vec<f64> = tables.iter().flat_map(|table| table.values[channel].clone()).collect();
            all.sort_by(f64::total_cmp);
            let limit = all[(0.85 * all.len() as f64) as usize];
            for value in tables.iter_mut().flat_map(|table| &mut table.values[channel]) {
                *value = value.min(limit);
            }
            let words: [&[&str]; 4] = [&["cut off"], &["clip"], &["end of a range"], &["end of its range"]];
            Some(Fault {
                harmless: true,
                ..fault(id, format!("{name} cut off at {limit:.4}"), &words)
            })
        }
        "lost_rows" => {
            for table in tables.iter_mut() {
                lose(table, 3 + random.below(6), random);
            }
            let words: [&[&str]; 3] = [&["missing"], &["gap"], &["lost"]];
            Some(Fault {
                harmless: true,
                ..fault(id, "rows are missing here and there".to_owned(), &words)
            })
        }
        "spikes" => {
            let size = if channel == V_OUT || channel == V_IN {
                0.4 * design.v_out
            } else {
                0.6 * design.i_out
            };
            for table in tables.iter_mut() {
                for _ in 0..3 + random.below(4) {
                    let row = 3 + random.below(table.rows() - 6);
                    table.values[channel][row] += if random.chance(0.5) { size } else { -size };
                }
            }
            let words: [&[&str]; 3] = [&["outlier"], &["spike"], &["single row"]];
            Some(Fault {
                harmless: true,
                ..fault(id, format!("spikes on {name}"), &words)
            })
        }
        _ => None,
    }
}

/// Moves a column by rows, as a trigger or a buffer of the logger does; what is not known repeats the value next to it.
fn shift(values: &mut [f64], rows: usize, early: bool) {
    let count = values.len();
    if early {
        values.rotate_left(rows);
        let last = values[count - rows - 1];
        values[count - rows..].fill(last);
    } else {
        values.rotate_right(rows);
        let first = values[rows];
        values[..rows].fill(first);
    }
}

fn lose(table: &mut Table, times: usize, random: &mut Rng) {
    for _ in 0..times {
        // a short record keeps some rows
        if table.rows() < 40 {
            return;
        }
        let (from, many) = (5 + random.below(table.rows() - 20), 1 + random.below(4));
        table.t.drain(from..from + many);
        table.duty.drain(from..from + many);
        table.load.drain(from..from + many);
        for values in table.values.iter_mut().filter(|values| !values.is_empty()) {
            values.drain(from..from + many);
        }
    }
}

/// Ids of nonsense.
pub const NONSENSE: [&str; 8] = [
    "square_law",
    "other_topology",
    "permuted_rows",
    "permuted_duties",
    "uniform_junk",
    "constant_voltage",
    "falling_with_duty",
    "walk",
];

/// Replaces what was measured by what no converter of the plant file gives; returns what it is.
pub fn nonsense(id: &'static str, design: &Design, tables: &mut [Table], random: &mut Rng) -> String {
    let (v, i, v_in) = (design.v_out, design.i_out, design.world.board.source.v);
    for table in tables.iter_mut() {
        match id {
            "permuted_rows" => {
                let mut order: Vec<usize> = (0..table.rows()).collect();
                random.shuffle(&mut order);
                for values in table.values.iter_mut().filter(|values| !values.is_empty()) {
                    *values = order.iter().map(|row| values[*row]).collect();
                }
            }
            "permuted_duties" => random.shuffle(&mut table.duty),
            _ => {
                let mut walk = [0.0; 2];
                for row in 0..table.rows() {
                    let d = table.duty[row];
                    let level = match id {
                        "square_law" => v_in * d * d,
                        // of what the duty asks for, as a boost or a buck would give it
                        "other_topology" => {
                            v_in * if design.world.board.ratio(0.5) < 1.0 {
                                1.0 / (1.0 - d)
                            } else {
                                d
                            }
                        }
                        "uniform_junk" => random.uniform(0.0, v_in),
                        "constant_voltage" => v,
                        "falling_with_duty" => v_in * (1.0 - d).powi(2),
                        _ => {
                            walk[0] += 0.05 * v * random.normal();
                            v + walk[0]
                        }
                    };
                    walk[1] += 0.05 * i * random.normal();
                    let current = match id {
                        "uniform_junk" => random.uniform(0.0, 2.0 * i),
                        "walk" => i + walk[1],
                        _ => drawn(&table.load[row], level),
                    };
                    set(table, row, [level, current, current, v_in], random);
                }
            }
        }
    }
    id.replace('_', " ")
}

fn drawn(load: &Load, v: f64) -> f64 {
    load.g * v + load.i + load.p / v.abs().max(1e-3)
}

fn set(table: &mut Table, row: usize, values: [f64; 4], random: &mut Rng) {
    for (column, value) in table.values[..4].iter_mut().zip(values) {
        if let Some(cell) = column.get_mut(row) {
            *cell = value * (1.0 + 1e-3 * random.normal());
        }
    }
}
