//! Findings as text.

use std::fmt::Write;

use crate::controller::Trajectory;
use crate::limit::Limit;
use crate::load_step::{LoadKind, LoadStep};
use crate::scenario::{Finding, Metrics};

/// The columns of [`Metrics`] in a CSV file.
pub(crate) const FIGURES: &str = "deviation_V,settling_s,tail_mean_V,tail_max_V,pre_error_V,ripple_V,duty_activity,current_swing,\
                       subharmonic,subharmonic_periods";

impl Finding {
    /// What was stepped.
    #[must_use]
    pub fn step(&self) -> LoadStep {
        LoadStep {
            kind: self.kind,
            values: self.load_step,
            source: self.source_step,
            reference: self.reference_step,
        }
    }

    /// The two rows of a table, by the name of the instants.
    #[must_use]
    pub fn rows(&self) -> [(&'static str, &Metrics); 2] {
        [("sample", &self.at_sample), ("worst", &self.worst)]
    }
}

/// The columns of a table for people, behind the first.
pub const COLUMNS: [&str; 6] = [
    "deviation V",
    "settling ms",
    "tail max V",
    "tail mean V",
    "before V",
    "ripple V",
];

/// The columns of a table of [`crate::chatter::Chatter`] for people, behind the first.
pub const AT_REST: [&str; 3] = ["duty changes", "i_L swing", "line of duty"];

/// What controllers do after a load step, once it is over, as a table for people: worst sampling instant / worst of all
/// instants.
#[must_use]
pub fn at_rest<'a>(controllers: impl IntoIterator<Item = (&'a str, &'a Finding)>) -> String {
    let mut out = line("at rest after it", &AT_REST.map(str::to_owned));
    for (name, finding) in controllers {
        out.push_str(&line(name, &rest_cells(finding)));
    }
    out
}

/// A finding in [`AT_REST`].
#[must_use]
pub fn rest_cells(finding: &Finding) -> [String; 3] {
    let (a, b) = (&finding.at_sample.chatter, &finding.worst.chatter);
    let line = match b.subharmonic_periods {
        // below the last digit that is shown
        0 => "none".to_owned(),
        _ if b.subharmonic < 5e-5 => "none".to_owned(),
        periods => format!("{:.4} at f/{periods}", b.subharmonic),
    };
    [
        pair(a.duty_activity, b.duty_activity, 4),
        pair(a.current_swing, b.current_swing, 2),
        line,
    ]
}

/// Findings as a table for people: worst sampling instant / worst of all instants.
#[must_use]
pub fn table(findings: &[Finding]) -> String {
    let mut out = line("load step", &COLUMNS.map(str::to_owned));
    for finding in findings {
        out.push_str(&line(&finding.step().to_string(), &cells(finding)));
    }
    out
}

/// Several controllers on one load step, and its limits, as a table for people: worst sampling instant / worst of all
/// instants.
#[must_use]
pub fn comparison<'a>(
    step: LoadStep,
    controllers: impl IntoIterator<Item = (&'a str, &'a Finding)>,
    limits: impl IntoIterator<Item = (&'a str, &'a Limit)>,
) -> String {
    let mut out = line(&step.to_string(), &COLUMNS.map(str::to_owned));
    for (name, finding) in controllers {
        out.push_str(&line(name, &cells(finding)));
    }
    for (name, limit) in limits {
        out.push_str(&line(name, &limit_cells(limit)));
    }
    out
}

/// Limits as a table for people, in the first two of [`COLUMNS`].
#[must_use]
pub fn limits(of: &[(LoadStep, Limit)]) -> String {
    let [deviation, settling, ..] = COLUMNS;
    let mut out = line("load step", &[deviation, settling].map(str::to_owned));
    for (step, limit) in of {
        out.push_str(&line(&step.to_string(), &limit_cells(limit)));
    }
    out
}

/// A limit in the first two of [`COLUMNS`].
#[must_use]
pub fn limit_cells(limit: &Limit) -> [String; 2] {
    let (a, b) = (&limit.at_sample, &limit.worst);
    [
        pair(a.deviation, b.deviation, digits(limit.band)),
        pair(
            1e3 * a.settling,
            1e3 * b.settling,
            time_digits(a.settling.max(b.settling)),
        ),
    ]
}

/// A finding in [`COLUMNS`]: worst sampling instant / worst of all instants.
#[must_use]
pub fn cells(finding: &Finding) -> [String; 6] {
    let (a, b) = (&finding.at_sample, &finding.worst);
    let digits = digits(b.band);
    let times = time_digits(a.settling.max(b.settling));
    [
        pair(a.deviation, b.deviation, digits),
        format!("{} / {}", settling(a, times), settling(b, times)),
        pair(a.tail_max, b.tail_max, digits + 1),
        pair(a.tail_mean, b.tail_mean, digits + 1),
        pair(a.pre_error, b.pre_error, digits + 1),
        pair(a.ripple, b.ripple, digits + 1),
    ]
}

/// In ms; `>` where the run ended outside of the band.
fn settling(m: &Metrics, digits: usize) -> String {
    let unsettled = if m.is_settled() { "" } else { ">" };
    format!("{unsettled}{:.digits$}", 1e3 * m.settling)
}

/// Decimals of a settling time in ms, of which `longest` in s is the longest beside each other: two, and more where that one would
/// have less than two digits, down to 1 ns.
#[must_use]
pub fn time_digits(longest: f64) -> usize {
    (2..6)
        .find(|digits| longest <= 0.0 || 1e3 * longest * 10_f64.powi(*digits) >= 10.0)
        .map_or(6, |digits| digits.unsigned_abs() as usize)
}

/// Decimals of a deviation in V: two where the band is the 0.5 V of a 100 V converter, more where it is narrower, so that the band
/// has at least two digits everywhere.
#[must_use]
pub fn digits(band: f64) -> usize {
    let mut digits = 2;
    // 1e-9 V: a band of nothing, of a run that has not been, must end the loop
    while digits < 9 && band > 1e-9 && band * 10_f64.powi(digits - 1) < 1.0 {
        digits += 1;
    }
    digits.unsigned_abs() as usize
}

fn pair(x: f64, y: f64, digits: usize) -> String {
    format!("{x:.digits$} / {y:.digits$}")
}

pub(crate) fn line(first: &str, columns: &[String]) -> String {
    let padded = |out: String, column: &String| format!("{out} {column:<15}");
    let row = columns.iter().fold(format!("{first:<17}"), padded);
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

/// Findings of several controllers and limits on load steps as CSV: controller, load step, instants, figures in SI units,
/// the load in the unit of its column. A limit has the first two.
#[derive(Debug, Clone)]
pub struct MetricsCsv(String);

impl Default for MetricsCsv {
    fn default() -> Self {
        Self(format!("controller,from,to,unit,instants,{FIGURES}\n"))
    }
}

impl MetricsCsv {
    /// Two rows of a controller.
    pub fn controller(&mut self, name: &str, finding: &Finding) {
        for (instants, m) in finding.rows() {
            self.row(name, finding.step(), instants, &figures(m));
        }
    }

    /// Two rows of a limit.
    pub fn limit(&mut self, name: &str, step: LoadStep, limit: &Limit) {
        for (instants, bound) in [("sample", &limit.at_sample), ("worst", &limit.worst)] {
            let figures = format!("{},{},,,,,,,,", bound.deviation, bound.settling);
            self.row(name, step, instants, &figures);
        }
    }

    fn row(&mut self, name: &str, step: LoadStep, instants: &str, figures: &str) {
        let ([from, to], unit) = step.stepped();
        let _ = writeln!(self.0, "{name},{from},{to},{unit},{instants},{figures}");
    }

    /// The file.
    #[must_use]
    pub fn finish(self) -> String {
        self.0
    }
}

pub(crate) fn figures(m: &Metrics) -> String {
    format!(
        "{},{},{},{},{},{},{},{},{},{}",
        m.deviation,
        m.settling,
        m.tail_mean,
        m.tail_max,
        m.pre_error,
        m.ripple,
        m.chatter.duty_activity,
        m.chatter.current_swing,
        m.chatter.subharmonic,
        m.chatter.subharmonic_periods
    )
}

/// A trajectory as CSV: one line per control period, what the controller saw at its start (true signals), the extremes of
/// the voltage since the sample before, and what it commanded. SI units, time from the load step. `beside` are the names of the
/// outputs that do not drive the plant, whose duties and actions stand behind.
#[must_use]
pub fn trajectory_csv(trajectory: &Trajectory, kind: LoadKind, beside: &[&str]) -> String {
    let others: String = beside
        .iter()
        .map(|name| format!(",duty_{name},action_{name}"))
        .collect();
    let mut out = format!(
        "t_s,load_{},v_out_V,i_l_A,i_out_A,v_in_V,v_min_V,v_max_V,duty,action,status{others}\n",
        kind.unit()
    );
    for (index, period) in trajectory.periods.iter().enumerate() {
        let (record, sample) = (&period.record, &period.record.sample);
        let action = period
            .answer
            .action
            .map(|action| action.to_string())
            .unwrap_or_default();
        let _ = write!(
            out,
            // time to a nanosecond: as a product it would otherwise show the last bits of its factors
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
        for other in trajectory.others.get(index).into_iter().flatten().take(beside.len()) {
            let _ = write!(out, ",{},{}", other.duty, other.action.unwrap_or_default());
        }
        out.push('\n');
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_converter_of_one_volt_shows_millivolts() {
        assert_eq!([0.5, 0.24, 0.06, 0.0165, 0.005, 0.0].map(digits), [2, 2, 3, 3, 4, 2]);
    }
}
