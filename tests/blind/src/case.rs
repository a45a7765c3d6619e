//! Measures a planned case: ngspice runs, sensors, files and the truth about it.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fmt::Write;

use serde::{Deserialize, Serialize};

use crate::bench::{Bench, PLANT, T_SW};
use crate::experiment::Record;
use crate::netlist::{T_FINE, netlist};
use crate::ngspice::{self, Signals};
use crate::plan::{Kind, Plan};
use crate::rivals::{self, Explanation};
use crate::rng::Rng;
use crate::sensing::{self, COLUMNS, Samples};

/// A measured case: path in its folder and text of every file, and what is true about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Path in the folder of the case, text.
    pub files: Vec<(String, String)>,
    /// What `truth.json` says.
    pub truth: Truth,
}

/// What is hidden in a case, and what can be known of it from the data.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    /// Seed of the set.
    pub seed: u64,
    /// Number in the set.
    pub case: usize,
    /// Kind of the case.
    pub kind: Kind,
    /// What is hidden.
    pub effects: Vec<Hidden>,
    /// Squared distance of the training records from those of the nominal bench, in units of the noise.
    pub chi2: f64,
    /// The least that any one or two listed causes leave of it.
    pub chi2_listed: f64,
    /// Every smallest set of at most two listed causes that leaves no more than noise: the truth and its rivals.
    pub explanations: Vec<Vec<String>>,
    /// What a perfect model could gain, for each record in open loop and column.
    pub records: Vec<Reducible>,
}

/// An effect with its hidden values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Hidden {
    /// Id.
    pub id: String,
    /// On the list of causes.
    pub listed: bool,
    /// Squared distance of the training records from those without this effect, in units of the noise.
    pub chi2: f64,
    /// Hidden values by name.
    pub parameters: BTreeMap<String, Value>,
}

/// A hidden value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Value {
    /// At the hidden bench.
    pub value: f64,
    /// At the nominal one.
    pub nominal: f64,
    /// Unit of both.
    pub unit: String,
}

/// Error of a record's column, split into what a model can explain and what it cannot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reducible {
    /// Path of the record in the case.
    pub record: String,
    /// Column.
    pub column: String,
    /// Root mean square of noise and rounding, V or A.
    pub floor: f64,
    /// Root mean square distance of the noise-free record from that of the nominal bench, V or A.
    pub reducible: f64,
}

/// Runs of a case; benches that differ in their sensors only share theirs.
pub(crate) struct Runs<'a> {
    pub plan: &'a Plan,
    done: BTreeMap<String, Signals>,
}

impl<'a> Runs<'a> {
    pub fn new(plan: &'a Plan) -> Self {
        Self {
            plan,
            done: BTreeMap::new(),
        }
    }

    /// True signals of a record.
    fn signals(&mut self, bench: &Bench, record: &Record) -> Result<&Signals, String> {
        let plan = self.plan;
        let periods = record.lead + record.duty.len();
        let rows = (periods as f64 * T_SW / T_FINE) as usize - 1;
        let text = netlist(bench, record, &mut self.random(record));
        Ok(match self.done.entry(text) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                let signals =
                    ngspice::run(entry.key(), rows).map_err(|error| format!("seed {}: {error}", plan.seed))?;
                entry.insert(signals)
            }
        })
    }

    fn random(&self, record: &Record) -> Rng {
        let number = self.plan.records.iter().position(|other| other.name == record.name);
        Rng::new(self.plan.seed, &[5, self.plan.index as u64, number.unwrap_or(0) as u64])
    }

    /// The noise-free record.
    pub fn exact(&mut self, bench: &Bench, record: &Record) -> Result<Samples, String> {
        let mut random = self.random(record);
        Ok(sensing::exact(bench, record, self.signals(bench, record)?, &mut random))
    }

    /// The column of the duty.
    fn duty(&mut self, bench: &Bench, record: &Record) -> Result<Vec<f64>, String> {
        Ok(sensing::duty(record, self.signals(bench, record)?))
    }
}

/// Runs the bench of the case and its nominal twin, and finds what else would explain the data if `with_rivals` (twenty
/// times as long).
///
/// # Errors
/// If ngspice is missing or fails.
pub fn measure(plan: &Plan, with_rivals: bool) -> Result<Case, String> {
    let nominal = Bench::nominal();
    let mut runs = Runs::new(plan);
    let mut files = vec![("plant.toml".to_owned(), PLANT.to_owned())];
    let (mut reducible, mut training) = (Vec::new(), Vec::new());
    for (number, record) in plan.records.iter().enumerate() {
        let hidden = runs.exact(&plan.bench, record)?;
        let duty = runs.duty(&plan.bench, record)?;
        let mut noise = Rng::new(plan.seed, &[6, plan.index as u64, number as u64]);
        let shown = sensing::recorded(&plan.bench, &hidden, &mut noise);
        let folder = if record.heldout { "heldout" } else { "train" };
        let path = format!("{folder}/{}.csv", record.name);
        files.push((path.clone(), csv(plan, record, &duty, &shown)));
        if record.closed {
            // a nominal twin would be driven to other duties
            continue;
        }
        let twin = runs.exact(&nominal, record)?;
        for (column, name) in COLUMNS.iter().enumerate().filter(|&(column, _)| recorded(plan, column)) {
            reducible.push(Reducible {
                record: path.clone(),
                column: (*name).to_owned(),
                floor: rounded(distance(&shown, &hidden, column)),
                reducible: rounded(distance(&hidden, &twin, column)),
            });
        }
        if !record.heldout {
            training.push((record, hidden, twin));
        }
    }
    let Explanation {
        chi2,
        chi2_listed,
        sets,
    } = rivals::explanations(&mut runs, &training, with_rivals)?;
    let mut effects = Vec::new();
    for effect in &plan.effects {
        let mut without = plan.bench.clone();
        for parameter in effect.parameters {
            parameter.set(&mut without, parameter.get(&nominal));
        }
        let chi2 = rivals::distance(&mut runs, &training, &without)?;
        effects.push(hidden(effect, plan, chi2));
    }
    let truth = Truth {
        seed: plan.seed,
        case: plan.index,
        kind: plan.kind,
        effects,
        chi2: rounded(chi2),
        chi2_listed: rounded(chi2_listed),
        explanations: sets,
        records: reducible,
    };
    let text = serde_json::to_string_pretty(&truth).map_err(|error| error.to_string())?;
    files.push(("truth.json".to_owned(), text + "\n"));
    Ok(Case { files, truth })
}

/// Whether this one of [`COLUMNS`] is in the records.
pub(crate) fn recorded(plan: &Plan, column: usize) -> bool {
    COLUMNS[column] != "v_in" || plan.has_v_in
}

fn hidden(effect: &crate::effects::Effect, plan: &Plan, chi2: f64) -> Hidden {
    let value = |parameter: &crate::effects::Parameter| {
        let value = Value {
            value: parameter.get(&plan.bench),
            nominal: parameter.get(&Bench::nominal()),
            unit: parameter.unit.to_owned(),
        };
        (parameter.name.to_owned(), value)
    };
    Hidden {
        id: effect.id.to_owned(),
        listed: effect.listed,
        chi2: rounded(chi2),
        parameters: effect.parameters.iter().map(value).collect(),
    }
}

fn distance(a: &Samples, b: &Samples, column: usize) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a[column] - b[column]).powi(2));
    (squares.sum::<f64>() / a.len().max(1) as f64).sqrt()
}

/// Four significant digits: what lies behind them is numerical noise.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

fn csv(plan: &Plan, record: &Record, duty: &[f64], samples: &Samples) -> String {
    let columns = if plan.has_v_in { 4 } else { 3 };
    let mut text = format!("t,d,{},r_load,i_load,p_load\n", COLUMNS[..columns].join(","));
    for (row, sample) in samples.iter().enumerate() {
        let load = record.load[row];
        let phase = if record.closed { 0.0 } else { 0.5 };
        let time = (row as f64 + phase) * T_SW;
        let _ = write!(text, "{time:.5},{:.6}", duty[row]);
        for value in &sample[..columns] {
            let _ = write!(text, ",{value:.5}");
        }
        let r_load = match load.conductance > 0.0 {
            true => format!("{:.3}", 1.0 / load.conductance),
            false => "1e+06".to_owned(),
        };
        let _ = writeln!(text, ",{r_load},{},{}", load.current, load.power);
    }
    text
}
