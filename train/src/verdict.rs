//! The specification, limit by limit: what the evaluation found beside what is allowed.

use std::fmt;

use closed_loop::scenario::Finding;
use serde::Serialize;

use crate::score::{Scoring, figures};
use crate::settings::{Instants, Requirement};

/// One limit of a `[[spec]]` at one load step.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// What is other than in the plant's file, in words; empty where nothing is.
    pub converter: String,
    /// Which `[[spec]]` of the converter, in the order of the training file, from 0.
    pub spec: usize,
    /// Load before and after, in `unit`.
    pub load_step: [f64; 2],
    /// Unit of the load.
    pub unit: &'static str,
    /// Over which instants.
    pub instants: Instants,
    /// Key of the limit in the training file.
    pub figure: &'static str,
    /// What was found, in SI units; the largest of the instants.
    pub found: f64,
    /// What is allowed.
    pub limit: f64,
}

impl Verdict {
    /// Whether the limit holds; a figure that is no number does not.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.found <= self.limit
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [from, to] = self.load_step;
        let instants = match self.instants {
            Instants::Sample => "at sampling instants",
            Instants::Worst => "at all instants",
        };
        let quantity = |value| report::quantity(value, unit(self.figure), 5);
        write!(
            f,
            "{from} -> {to} {} {instants}: {} {}, limit {}",
            self.unit,
            self.figure,
            quantity(self.found),
            quantity(self.limit)
        )?;
        match self.converter.as_str() {
            "" => Ok(()),
            converter => write!(f, " (on {converter})"),
        }
    }
}

/// Of a figure that is limited, by its key in the training file.
#[must_use]
pub fn unit(figure: &str) -> &'static str {
    match figure {
        "deviation" | "tail" => "V",
        "settling" => "s",
        _ => "",
    }
}

/// All limits of `specification` on a converter, at the load steps that they concern; `findings` are in the order of
/// `load_steps`.
#[must_use]
pub fn verdicts(
    converter: &str,
    specification: &[Requirement],
    load_steps: &[[f64; 2]],
    findings: &[Finding],
) -> Vec<Verdict> {
    let scoring = Scoring::new(load_steps, specification, 1.0);
    let mut all = Vec::new();
    for (spec, requirement) in specification.iter().enumerate() {
        for (n, finding) in findings.iter().enumerate() {
            if !scoring.concerns(requirement, n) {
                continue;
            }
            let metrics = match requirement.instants {
                Instants::Sample => &finding.at_sample,
                Instants::Worst => &finding.worst,
            };
            all.extend(
                figures(metrics, requirement)
                    .into_iter()
                    .map(|(figure, found, limit)| Verdict {
                        converter: converter.to_owned(),
                        spec,
                        load_step: finding.load_step,
                        unit: finding.kind.unit(),
                        instants: requirement.instants,
                        figure,
                        found,
                        limit,
                    }),
            );
        }
    }
    all
}

/// The limits that fail, the one that is exceeded most first.
#[must_use]
pub fn missed<'a>(verdicts: impl Iterator<Item = &'a Verdict>) -> Vec<&'a Verdict> {
    let mut missed: Vec<&Verdict> = verdicts.filter(|verdict| !verdict.holds()).collect();
    let excess = |verdict: &Verdict| verdict.found / verdict.limit;
    missed.sort_by(|a, b| excess(b).total_cmp(&excess(a)));
    missed
}
