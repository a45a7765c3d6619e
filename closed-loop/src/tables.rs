//! Findings as text.

use std::fmt::Write;

use crate::load_step::LoadStep;
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

/// Findings as a table for people: worst sampling instant / worst of all instants.
#[must_use]
pub fn table(findings: &[Finding]) -> String {
    let header = [
        "load step",
        "deviation V",
        "settling ms",
        "tail max V",
        "tail mean V",
        "before V",
        "ripple V",
    ];
    let mut out = line(&header.map(str::to_owned));
    for finding in findings {
        let (a, b) = (&finding.at_sample, &finding.worst);
        let pair = |x: f64, y: f64, digits: usize| format!("{x:.digits$} / {y:.digits$}");
        out.push_str(&line(&[
            finding.step().to_string(),
            pair(a.deviation, b.deviation, 2),
            pair(1e3 * a.settling, 1e3 * b.settling, 2),
            pair(a.tail_max, b.tail_max, 3),
            pair(a.tail_mean, b.tail_mean, 3),
            pair(a.pre_error, b.pre_error, 3),
            pair(a.ripple, b.ripple, 3),
        ]));
    }
    out
}

fn line(columns: &[String]) -> String {
    let padded: String = columns.iter().map(|column| format!("{column:<16}")).collect();
    format!("{}\n", padded.trim_end())
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
