//! Does a control step fit into its period? From a model of the processor's cycles, never from a measurement.

use std::fmt;

use ::targets::TargetSpec;
use codegen::Output;
use codegen::output::languages;
use policy::{NumericFormat, Policy};
use serde::Serialize;
use verify::measure::Costs;

use super::costs::Measured;
use crate::Failure;
use report::grouped;

/// A clock from the command line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    pub hz: f64,
}

/// Frequencies that a processor could have, in Hz.
const PLAUSIBLE: (f64, f64) = (1e3, 1e11);

impl Clock {
    /// `168MHz`, `48 MHz`, `1.2GHz`, `32768Hz`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let unit = text.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
        let number = &text[..text.len() - unit.len()];
        let factor = match unit.trim().to_ascii_lowercase().as_str() {
            "hz" => 1.0,
            "khz" => 1e3,
            "mhz" => 1e6,
            "ghz" => 1e9,
            "" => return Err("a unit is missing: expected a frequency such as 168MHz (Hz, kHz, MHz, GHz)".to_owned()),
            _ => {
                return Err("expected a frequency such as 168MHz (Hz, kHz, MHz, GHz), with a decimal point".to_owned());
            }
        };
        let number: f64 = number
            .parse()
            .map_err(|_| "a number is missing: expected a frequency such as 168MHz".to_owned())?;
        let hz = number * factor;
        if (PLAUSIBLE.0..=PLAUSIBLE.1).contains(&hz) {
            Ok(Self { hz })
        } else {
            Err(format!(
                "{hz} Hz is no clock of a processor: expected 1 kHz to 100 GHz, such as 168MHz"
            ))
        }
    }
}

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (factor, unit) = match self.hz {
            hz if hz >= 1e9 => (1e9, "GHz"),
            hz if hz >= 1e6 => (1e6, "MHz"),
            hz if hz >= 1e3 => (1e3, "kHz"),
            _ => (1.0, "Hz"),
        };
        write!(f, "{} {unit}", self.hz / factor)
    }
}

/// Whether the model says that a step fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fit {
    /// Even with the most cycles of the model.
    Met,
    /// With the fewest cycles of the model, not with the most.
    Doubtful,
    /// Not even with the fewest.
    Missed,
}

/// A build's model cycles beside those of a control period.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Budget {
    /// Clock in Hz.
    pub clock_hz: f64,
    /// Cycles of a control period at that clock.
    pub period_cycles: f64,
    /// Least and largest share of the period that the model says.
    pub share: (f64, f64),
    /// What follows.
    pub fit: Fit,
}

impl Budget {
    /// `None` where the target has no cycle model.
    pub fn of(costs: &Costs, clock: Clock, period: f64) -> Option<Self> {
        let (least, most) = costs.model_cycles?;
        let period_cycles = clock.hz * period;
        let share = (least as f64 / period_cycles, most as f64 / period_cycles);
        Some(Self {
            clock_hz: clock.hz,
            period_cycles,
            share,
            fit: match share {
                (_, most) if most <= 1.0 => Fit::Met,
                (least, _) if least <= 1.0 => Fit::Doubtful,
                _ => Fit::Missed,
            },
        })
    }

    /// One line for a build.
    pub fn text(&self, build: &str) -> String {
        let (least, most) = (100.0 * self.share.0, 100.0 * self.share.1);
        let period = grouped(self.period_cycles as u64);
        let clock = Clock { hz: self.clock_hz };
        let verdict = match self.fit {
            Fit::Met => format!(
                "met; {:.0} % of the period is left for everything else at the worst",
                100.0 - most
            ),
            Fit::Doubtful => "in doubt: the model's fewest cycles fit, its most do not".to_owned(),
            Fit::Missed => "NOT met".to_owned(),
        };
        format!(
            "  {build}: control period {verdict}; {least:.0} to {most:.0} % of {period} cycles at {clock} (model, never measured)"
        )
    }
}

/// What can be said without a model: how many cycles there are, and how many instructions.
fn unmodelled(target: &TargetSpec, measured: &Measured, clock: Clock, period: f64) -> String {
    let cycles = clock.hz * period;
    let mut text = format!(
        "  cannot be said: no cycles are modelled for {} (`policyc targets` says for which they are); a control period is {} cycles at {clock}",
        target.name,
        grouped(cycles as u64)
    );
    let least = measured.measured().min_by_key(|costs| costs.instructions_max);
    if let Some(costs) = least {
        let instructions = costs.instructions_max;
        text += &format!(
            ", and {} instructions in the shortest build, {}: it fits if the processor does {:.2} a cycle or more, with its wait states",
            grouped(instructions),
            costs.build,
            instructions as f64 / cycles
        );
    }
    text
}

/// A format that fits where the policy's own does not.
struct Proposal {
    format: NumericFormat,
    build: String,
    share: (f64, f64),
}

/// What is said about the budget, one line each.
pub fn lines(
    policy: &Policy,
    target: &'static TargetSpec,
    outputs: &[Output],
    measured: &Measured,
    clock: Clock,
) -> Result<Vec<String>, Failure> {
    let period = policy.sample_period;
    let mut lines = vec![format!(
        "budget of {} in {}:",
        policy.name,
        policy.numeric_format.name()
    )];
    let budgets = measured
        .measured()
        .filter_map(|costs| Some((costs.build.as_str(), Budget::of(costs, clock, period)?)));
    let budgets: Vec<(&str, Budget)> = budgets.collect();
    lines.extend(budgets.iter().map(|(build, budget)| budget.text(build)));
    if budgets.is_empty() {
        lines.push(match target.cycles {
            None => unmodelled(target, measured, clock, period),
            Some(_) => "  cannot be said: no step ran under the target's emulator here".to_owned(),
        });
        return Ok(lines);
    }
    if policy.numeric_format == NumericFormat::F32Fma {
        lines.push("  note: the model does not know fused operations; it says too little".to_owned());
    }
    if budgets.iter().any(|(_, budget)| budget.fit == Fit::Met) {
        return Ok(lines);
    }
    lines.push(match proposal(policy, target, outputs, clock)? {
        Some(Proposal { format, build, share }) => format!(
            "  = hint: --format {} takes {:.0} to {:.0} % with {build}{}",
            format.name(),
            100.0 * share.0,
            100.0 * share.1,
            if format.is_integer() {
                "; `policyc certify` says what it does to the decision"
            } else {
                ""
            }
        ),
        None => "  = hint: no numeric format fits: a faster clock, a longer period or a smaller network is needed"
            .to_owned(),
    });
    Ok(lines)
}

/// What may be proposed, the most exact first; the cycle models do not know fused operations.
const EXACT_FIRST: [NumericFormat; 4] = [
    NumericFormat::F64,
    NumericFormat::F32,
    NumericFormat::I16,
    NumericFormat::I8,
];

/// The most exact of the other formats that fits in every build that can be made here.
fn proposal(
    policy: &Policy,
    target: &'static TargetSpec,
    outputs: &[Output],
    clock: Clock,
) -> Result<Option<Proposal>, Failure> {
    let languages = languages(outputs);
    let cores: Vec<Output> = languages.iter().map(|language| language.core()).collect();
    // binary64 from a library takes longer than anything else; whether it does, the target knows
    let natural = |format: &NumericFormat| *format != NumericFormat::F64 || target.fpu.has(true);
    let others = EXACT_FIRST.into_iter().filter(natural);
    for format in others.filter(|format| *format != policy.numeric_format) {
        let policy = policy.clone().with_format(format);
        let files = codegen::sources(&policy, target, &cores, None)?.files;
        let measured = Measured::of(&policy, target, &languages, &files);
        let budgets = measured
            .measured()
            .filter_map(|costs| Some((costs, Budget::of(costs, clock, policy.sample_period)?)));
        let best = budgets
            .filter(|(_, budget)| budget.fit == Fit::Met)
            .min_by(|(_, a), (_, b)| a.share.1.total_cmp(&b.share.1));
        if let Some((Costs { build, .. }, Budget { share, .. })) = best {
            let build = build.clone();
            return Ok(Some(Proposal { format, build, share }));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_are_read_with_their_unit() {
        for (text, hz) in [
            ("168MHz", 168e6),
            ("48 mhz", 48e6),
            ("1.2GHz", 1.2e9),
            ("32768Hz", 32_768.0),
            (" 8000kHz ", 8e6),
        ] {
            assert_eq!(Clock::parse(text), Ok(Clock { hz }), "{text}");
        }
        for text in [
            "168",
            "MHz",
            "168 M",
            "-168MHz",
            "1,68GHz",
            "0Hz",
            "1e3MHz",
            "",
            "1.2.3GHz",
            "999999GHz",
        ] {
            assert!(Clock::parse(text).is_err(), "{text}");
        }
        assert_eq!(Clock { hz: 168e6 }.to_string(), "168 MHz");
    }

    #[test]
    fn a_step_fits_if_the_most_cycles_do() {
        let costs = |cycles| Costs {
            build: String::new(),
            flash_bytes: 0,
            static_ram_bytes: 0,
            stack_bytes: 0,
            instructions_min: 0,
            instructions_max: 0,
            model_cycles: cycles,
            steps: 1,
            library_calls: Vec::new(),
        };
        // 100 us at 100 MHz are 10,000 cycles
        let fit = |cycles| Budget::of(&costs(Some(cycles)), Clock { hz: 1e8 }, 1e-4).map(|budget| budget.fit);
        assert_eq!(fit((5_000, 9_999)), Some(Fit::Met));
        assert_eq!(fit((5_000, 10_001)), Some(Fit::Doubtful));
        assert_eq!(fit((10_001, 20_000)), Some(Fit::Missed));
        assert_eq!(Budget::of(&costs(None), Clock { hz: 1e8 }, 1e-4), None);
    }
}
