//! Every combination of ADC codes: the first step of a fresh controller, in every build, against the interpreter.
//!
//! ```text
//! Grid (an axis a signal) ─► parts of 2^20 combinations ─► run() each ─► Row ─► shards
//! ```
//!
//! From a fresh controller the first measurement decides all: each filter begins with it. So the grid holds every answer that
//! the converters can give to the first step; later ones depend on memories, and the random stream is there for them.

use std::fmt;
use std::ops::Range;

use interp::Sample;
use policy::Policy;
use serde::Serialize;
use targets::TargetSpec;
use toml_input::Message;

use crate::report::{Outcome, Report};
use crate::shards::{Entry, Head};

/// Combinations of one part.
// most of a minute with the nine builds of a host, so that a kill loses little, and the compilers' seconds are few beside it
pub const PART: u64 = 1 << 20;

/// Most combinations of a grid.
// 2^40: a core-year; a larger number is a mistake rather than a plan
const MOST: u64 = 1 << 40;

/// The codes of a signal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Axis {
    /// Name of the signal.
    pub signal: String,
    /// First code, one below the range.
    pub first: i32,
    /// Last code, one above the range.
    pub last: i32,
}

impl Axis {
    fn len(&self) -> u64 {
        u64::from(self.last.abs_diff(self.first)) + 1
    }
}

/// All combinations of the codes of all signals; the last signal goes through its codes first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Grid {
    axes: Vec<Axis>,
    combinations: u64,
}

impl Grid {
    /// Of a policy whose signals all are ADC codes. The codes are those within each signal's range, and one beyond either end.
    ///
    /// # Errors
    /// If a signal has no ADC, or there are more than 2^40 combinations.
    pub fn of(policy: &Policy) -> Result<Self, Message> {
        let mut axes = Vec::new();
        for signal in &policy.signals {
            let Some(adc) = signal.adc else {
                let message = Message::new(format!("signal `{}` arrives as a number, not as a code", signal.name));
                return Err(message
                    .expected("adc = { gain = ..., offset = ... } for every signal")
                    .hint("leave --codes out: the stream of `policyc verify` tries numbers, their neighbours and their ends"));
            };
            let ends = [signal.range.low, signal.range.high].map(|end| (end - adc.offset) / adc.gain);
            // `as` saturates; the check of a contract has seen to it that codes fit
            let first = (ends[0].min(ends[1]).ceil() as i32).saturating_sub(1);
            let last = (ends[0].max(ends[1]).floor() as i32).saturating_add(1);
            let signal = signal.name.clone();
            axes.push(Axis { signal, first, last });
        }
        let product = axes
            .iter()
            .try_fold(1_u64, |product, axis| product.checked_mul(axis.len()));
        match product {
            Some(combinations) if combinations <= MOST => Ok(Self { axes, combinations }),
            _ => Err(Message::new("too many combinations of codes")
                .found(
                    axes.iter()
                        .map(|axis| axis.len().to_string())
                        .collect::<Vec<_>>()
                        .join(" x "),
                )
                .expected("at most 2^40")
                .hint("leave --codes out: the stream of `policyc verify` tries codes at random and at their ends")),
        }
    }

    /// An axis a signal.
    #[must_use]
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Number of combinations.
    #[must_use]
    pub fn combinations(&self) -> u64 {
        self.combinations
    }

    /// Number of parts.
    #[must_use]
    pub fn parts(&self) -> u64 {
        self.combinations.div_ceil(PART)
    }

    /// Combinations of a part.
    #[must_use]
    pub fn part(&self, part: u64) -> Range<u64> {
        let end = |part: u64| part.saturating_mul(PART).min(self.combinations);
        end(part)..end(part + 1)
    }

    /// The measurement of a combination.
    #[must_use]
    pub fn samples(&self, combination: u64) -> Vec<Sample> {
        let mut rest = combination;
        let mut samples: Vec<Sample> = Vec::with_capacity(self.axes.len());
        for axis in self.axes.iter().rev() {
            // below the length of the axis, so it fits
            let step = (rest % axis.len()) as i64;
            rest /= axis.len();
            samples.push(Sample::Code((i64::from(axis.first) + step) as i32));
        }
        samples.reverse();
        samples
    }

    /// What stands above the rows of a run.
    #[must_use]
    pub fn head(&self, policy: &Policy, target: &TargetSpec) -> Head {
        let digests = &policy.digests;
        let axes = self
            .axes
            .iter()
            .map(|axis| format!("{} {} to {}", axis.signal, axis.first, axis.last));
        let run = format!(
            "codes of {}, contract {}, weights {}, mapping {}, {}, {}: {}",
            policy.name,
            digests.contract,
            digests.weights,
            digests.mapping.as_deref().unwrap_or("none"),
            policy.numeric_format.name(),
            target.name,
            axes.collect::<Vec<_>>().join("; ")
        );
        Head::new(&run, "part,combinations,builds,checksum,outcome")
    }
}

/// The result of a part, as its line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Row {
    /// Number of the part, from 0.
    pub part: u64,
    /// Its combinations.
    pub combinations: u64,
    /// Builds that were compared.
    pub builds: u64,
    /// CRC-32 of the words that the interpreter expects.
    pub checksum: String,
    /// `equal`, or what is not.
    pub outcome: String,
}

impl Row {
    /// Of the report about a part.
    #[must_use]
    pub fn new(part: u64, report: &Report) -> Self {
        let mut compared = report.clone();
        compared
            .builds
            .retain(|build| !matches!(build.outcome, Outcome::Skipped { .. }));
        Self {
            part,
            combinations: report.steps,
            builds: compared.builds.len() as u64,
            checksum: report.checksum.clone(),
            // a message of a compiler would break the line
            outcome: compared.in_a_line().replace([',', '\n', '\r'], ";"),
        }
    }

    /// Whether every build gave the interpreter's bits.
    #[must_use]
    pub fn is_equal(&self) -> bool {
        self.outcome == "equal"
    }
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            part,
            combinations,
            builds,
            checksum,
            outcome,
        } = self;
        write!(f, "{part},{combinations},{builds},{checksum},{outcome}")
    }
}

impl Entry for Row {
    fn key(&self) -> u64 {
        self.part
    }

    fn read(line: &str) -> Option<Self> {
        let fields: Vec<&str> = line.split(',').collect();
        let [part, combinations, builds, checksum, outcome] = fields[..] else {
            return None;
        };
        Some(Self {
            part: part.parse().ok()?,
            combinations: combinations.parse().ok()?,
            builds: builds.parse().ok()?,
            checksum: checksum.into(),
            outcome: outcome.into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn policy() -> Policy {
        let path = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../tests/golden/cases/adc_mapping/policy.toml"
        );
        policy::load(path.as_ref()).unwrap_or_else(|faults| panic!("{faults}"))
    }

    #[test]
    fn a_grid_has_every_code_of_the_range_and_one_beyond_either_end() {
        let mut policy = policy();
        // 20 V in steps of 5 V / 1024 are 4096 codes and the end itself; 20 A in steps of 5 mA are 4000 and the end
        let grid = Grid::of(&policy).unwrap();
        let ends =
            |grid: &Grid| -> Vec<(i32, i32)> { grid.axes().iter().map(|axis| (axis.first, axis.last)).collect() };
        assert_eq!(ends(&grid), [(-1, 4097), (-1, 4001)]);
        assert_eq!(grid.combinations(), 4099 * 4003);
        assert_eq!(grid.parts(), 16);
        assert_eq!(grid.part(15), 15 * PART..4099 * 4003);
        // an inverting amplifier, whose ends lie between codes
        policy.signals[0].adc = Some(policy::Adc {
            gain: -0.3,
            offset: 20.1,
            bits: None,
        });
        assert_eq!(ends(&Grid::of(&policy).unwrap())[0], (0, 68));
    }

    #[test]
    fn every_combination_comes_once() {
        let mut policy = policy();
        for signal in &mut policy.signals {
            signal.adc = Some(policy::Adc {
                gain: 2.0,
                offset: 0.0,
                bits: None,
            });
        }
        let grid = Grid::of(&policy).unwrap();
        // 0..20 V: codes -1 to 11; -4..16 A: codes -3 to 9
        let code = |sample: &Sample| match sample {
            Sample::Code(code) => *code,
            other => panic!("{other:?}"),
        };
        let all: BTreeSet<Vec<i32>> = (0..grid.combinations())
            .map(|n| grid.samples(n).iter().map(code).collect())
            .collect();
        assert_eq!(all.len(), 13 * 13);
        assert_eq!(all.first().map(Vec::as_slice), Some([-1, -3].as_slice()));
        assert_eq!(all.last().map(Vec::as_slice), Some([11, 9].as_slice()));
    }

    #[test]
    fn numbers_and_endless_grids_are_refused() {
        let mut policy = policy();
        let fine = Some(policy::Adc {
            gain: 1e-8,
            offset: 0.0,
            bits: None,
        });
        policy.signals.iter_mut().for_each(|signal| signal.adc = fine);
        let message = toml_input::Faults::from(Grid::of(&policy).unwrap_err()).to_string();
        assert!(message.contains("too many combinations"), "{message}");
        policy.signals[1].adc = None;
        let message = toml_input::Faults::from(Grid::of(&policy).unwrap_err()).to_string();
        assert!(message.contains("`i_out` arrives as a number"), "{message}");
    }
}
