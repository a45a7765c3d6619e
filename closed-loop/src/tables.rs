//! Findings as text.

use std::fmt::Write;

use crate::controller::Trajectory;
use crate::limit::Limit;
use crate::load_step::{LoadKind, LoadStep};
use crate::scenario::{Finding, Metrics};

/// The columns of [`Metrics`] in a CSV file.
const FIGURES: &str = "deviation_V,settling_s,tail_mean_V,tail_max_V,pre_error_V,ripple_V";

impl Finding {
    /// What was stepped.
    #[must_use]
    pub fn step(&self) -> LoadStep {
        LoadStep {
            kind: self.kind,
            values: self.load_step,
        }
    }

    /// The two rows of a table, by the name of the instants.
    #[must_use]
    pub fn rows(&self) -> [(&'static str, &Metrics); 2] {
        [("sample", &self.at_sample), ("worst", &self.worst)]
    }
}

/// The columns of a table for people, behind the first.
const COLUMNS: [&str; 6] = [
    "deviation V",
    "settling ms",
    "tail max V",
    "tail mean V",
    "before V",
    "ripple V",
];

/// Findings as a table for people: worst sampling instant / worst of all instants.
#[must_use]
pub fn table(findings: &[Finding]) -> String {
    let mut out = line("load step", &COLUMNS.map(str::to_owned));
    for finding in findings {
        out.push_str(&line(&finding.step().to_string(), &cells(finding)));
    }
    out
}

/// Several controllers on one load step, and its limit, as a table for people: worst sampling instant / worst of all
/// instants.
#[must_use]
pub fn comparison<'a>(
    step: LoadStep,
    controllers: impl IntoIterator<Item = (&'a str, &'a Finding)>,
    limit: Option<&Limit>,
) -> String {
    let mut out = line(&step.to_string(), &COLUMNS.map(str::to_owned));
    for (name, finding) in controllers {
        out.push_str(&line(name, &cells(finding)));
    }
    if let Some(Limit {
        at_sample: a, worst: b, ..
    }) = limit
    {
        let cells = [
            pair(a.deviation, b.deviation, 2),
            pair(1e3 * a.settling, 1e3 * b.settling, 2),
        ];
        out.push_str(&line("limit", &cells));
    }
    out
}

fn cells(finding: &Finding) -> [String; 6] {
    let (a, b) = (&finding.at_sample, &finding.worst);
    [
        pair(a.deviation, b.deviation, 2),
        pair(1e3 * a.settling, 1e3 * b.settling, 2),
        pair(a.tail_max, b.tail_max, 3),
        pair(a.tail_mean, b.tail_mean, 3),
        pair(a.pre_error, b.pre_error, 3),
        pair(a.ripple, b.ripple, 3),
    ]
}

fn pair(x: f64, y: f64, digits: usize) -> String {
    format!("{x:.digits$} / {y:.digits$}")
}

fn line(first: &str, columns: &[String]) -> String {
    let padded = |out: String, column: &String| format!("{out} {column:<15}");
    let row = columns.iter().fold(format!("{first:<15}"), padded);
    format!("{}\n", row.trim_end())
}

/// Findings under constant power as CSV; SI units.
#[must_use]
pub fn evaluation_csv(findings: &[Finding]) -> String {
    let mut out = format!("from_W,to_W,instants,{FIGURES}\n");
    for finding in findings {
        let [from, to] = finding.load_step;
        for (name, m) in finding.rows() {
            // writing to a String cannot fail
            let _ = writeln!(out, "{from},{to},{name},{}", figures(m));
        }
    }
    out
}

/// Findings of several controllers as CSV; SI units, the load in the unit of its column.
#[must_use]
pub fn metrics_csv<'a>(controllers: impl IntoIterator<Item = (&'a str, &'a [Finding])>) -> String {
    let mut out = format!("controller,from,to,unit,instants,{FIGURES}\n");
    for (controller, findings) in controllers {
        for finding in findings {
            let ([from, to], unit) = (finding.load_step, finding.kind.unit());
            for (name, m) in finding.rows() {
                let _ = writeln!(out, "{controller},{from},{to},{unit},{name},{}", figures(m));
            }
        }
    }
    out
}

fn figures(m: &Metrics) -> String {
    format!(
        "{},{},{},{},{},{}",
        m.deviation, m.settling, m.tail_mean, m.tail_max, m.pre_error, m.ripple
    )
}

/// A trajectory as CSV: one line per control period, what the controller saw at its start (true signals), the extremes of
/// the voltage since the sample before, and what it commanded. SI units, time from the load step.
#[must_use]
pub fn trajectory_csv(trajectory: &Trajectory, kind: LoadKind) -> String {
    let mut out = format!(
        "t_s,load_{},v_out_V,i_l_A,i_out_A,v_in_V,v_min_V,v_max_V,duty,action,status\n",
        kind.unit()
    );
    for period in &trajectory.periods {
        let (record, sample) = (&period.record, &period.record.sample);
        let action = period
            .answer
            .action
            .map(|action| action.to_string())
            .unwrap_or_default();
        let _ = writeln!(
            out,
            "{:.9},{},{},{},{},{},{},{},{},{action},{}",
            record.time,
            kind.value(&record.load),
            sample.v_out,
            sample.i_l,
            sample.i_out,
            sample.v_in,
            sample.v_min,
            sample.v_max,
            record.duty,
            period.answer.status,
        );
    }
    out
}
