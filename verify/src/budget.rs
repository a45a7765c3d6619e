//! Does a control step fit into its period? From a model of the processor's cycles, never from a measurement.

use std::fmt;

use report::grouped;
use serde::Serialize;

use crate::measure::Costs;

/// Clock of a processor, and the time that a step has at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Frequency, Hz.
    pub hz: f64,
    /// When a step has to be done.
    pub slot: Slot,
}

/// What a step has of its period, and when its duty acts: what the converter of a training had.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Slot {
    /// That converter is not known.
    #[default]
    Unknown,
    /// Sampled at the start of the period, where the duty acts at once, as no timer does.
    AtOnce,
    /// The duty acts from the next start on; this part of the period, 0..1, lies behind the sample.
    Behind(f64),
    /// The duty acts a whole period later.
    Later,
}

impl Slot {
    /// Part of the control period in which a step has to be done.
    #[must_use]
    pub fn part(self) -> f64 {
        match self {
            Self::Behind(part) => part,
            Self::Unknown | Self::AtOnce | Self::Later => 1.0,
        }
    }
}

/// Frequencies that a processor could have, in Hz.
// from watch crystals, with a factor of 30 below, to a factor of ten above any: a slip of a prefix lies beyond
const PLAUSIBLE: (f64, f64) = (1e3, 1e11);

impl Clock {
    /// `168MHz`, `48 MHz`, `1.2GHz`, `32768Hz`.
    ///
    /// # Errors
    /// If number or unit is missing, or no processor has such a clock.
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
            Ok(Self {
                hz,
                slot: Slot::Unknown,
            })
        } else {
            Err(format!(
                "{hz} Hz is no clock of a processor: expected 1 kHz to 100 GHz, such as 168MHz"
            ))
        }
    }
}

impl Clock {
    /// The same for steps that have to be done by then.
    #[must_use]
    pub fn with(self, slot: Slot) -> Self {
        Self { slot, ..self }
    }

    /// A frequency as it is written: `168 MHz`.
    #[must_use]
    pub fn shown(hz: f64) -> String {
        let (factor, unit) = match hz {
            hz if hz >= 1e9 => (1e9, "GHz"),
            hz if hz >= 1e6 => (1e6, "MHz"),
            hz if hz >= 1e3 => (1e3, "kHz"),
            _ => (1.0, "Hz"),
        };
        format!("{} {unit}", hz / factor)
    }
}

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&Self::shown(self.hz))
    }
}

/// Share of the period beyond which a step that is begun in its middle ends behind its end.
pub(crate) const HALF: f64 = 0.5;

/// Share of the period below which what is left is none: interrupt entry and exit, two conversions and a timer take some 100 cycles,
/// 1 % of a period of 100 us at 100 MHz.
pub(crate) const SCARCE: f64 = 0.01;

/// A share in percent, as `72`. Next to 100 with a decimal that is rounded away from it, so that what is read is what is judged.
pub(crate) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match share {
        _ if (share - 1.0).abs() >= SCARCE => format!("{percent:.0}"),
        share if share > 1.0 => format!("{:.1}", (10.0 * percent).ceil() / 10.0),
        share if share < 1.0 => format!("{:.1}", (10.0 * percent).floor() / 10.0),
        _ => "100".to_owned(),
    }
}

/// Least and most: `72 to 102`.
pub(crate) fn percents((least, most): (f64, f64)) -> String {
    format!("{} to {}", percent(least), percent(most))
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
    /// Cycles that a step has at that clock: of a control period, or of what is left of it behind the sample.
    pub period_cycles: f64,
    /// Which part of the control period these are.
    #[serde(skip_serializing_if = "is_whole")]
    pub part: f64,
    /// Least and largest share of these cycles that the model says.
    pub share: (f64, f64),
    /// What follows.
    pub fit: Fit,
}

/// Whether a step has the whole period.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "what serde calls")]
fn is_whole(part: &f64) -> bool {
    *part >= 1.0
}

impl Budget {
    /// That of a control period of `period` s; `None` where the target has no cycle model.
    #[must_use]
    pub fn of(costs: &Costs, clock: Clock, period: f64) -> Option<Self> {
        let (least, most) = costs.model_cycles?;
        let period_cycles = clock.hz * period * clock.slot.part();
        let share = (least as f64 / period_cycles, most as f64 / period_cycles);
        Some(Self {
            clock_hz: clock.hz,
            period_cycles,
            part: clock.slot.part(),
            share,
            fit: match share {
                (_, most) if most <= 1.0 => Fit::Met,
                (least, _) if least <= 1.0 => Fit::Doubtful,
                _ => Fit::Missed,
            },
        })
    }

    /// What becomes of half of the period, which is all that a policy has that samples in the middle.
    fn half(&self) -> &'static str {
        match self.share {
            (_, most) if most <= HALF => "and so is half of it",
            (least, _) if least <= HALF => "half of it in doubt",
            _ => "half of it NOT",
        }
    }

    /// One line for the build of this name.
    #[must_use]
    pub fn text(&self, build: &str, slot: Slot) -> String {
        let most = 100.0 * self.share.1;
        let period = grouped(self.period_cycles as u64);
        let clock = Clock::shown(self.clock_hz);
        let is_whole = is_whole(&self.part);
        let what = match is_whole {
            true => "control period".to_owned(),
            false => format!(
                "the {:.0} % of the control period behind the sample:",
                100.0 * self.part
            ),
        };
        let verdict = match self.fit {
            Fit::Met if 1.0 - self.share.1 < SCARCE => {
                "met, with nothing left for interrupt entry and drivers at the worst".to_owned()
            }
            Fit::Met if !is_whole => format!(
                "met; {:.0} % of that is left for everything else at the worst",
                100.0 - most
            ),
            // a duty that acts a period later leaves all of it, wherever the sample is
            Fit::Met if slot == Slot::Later => {
                format!(
                    "met; {:.0} % of the period is left for everything else at the worst",
                    100.0 - most
                )
            }
            Fit::Met => format!(
                "met, {}; {:.0} % of the period is left for everything else at the worst",
                self.half(),
                100.0 - most
            ),
            Fit::Doubtful if is_whole && slot != Slot::Later => {
                format!(
                    "in doubt, {}: the model's fewest cycles fit, its most do not",
                    self.half()
                )
            }
            Fit::Doubtful => "in doubt: the model's fewest cycles fit, its most do not".to_owned(),
            Fit::Missed => "NOT met".to_owned(),
        };
        format!(
            "  {build}: {what} {verdict}; {} % of {period} cycles at {clock} (model at 0 wait states, never measured)",
            percents(self.share)
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(hz: f64) -> Clock {
        Clock {
            hz,
            slot: Slot::Unknown,
        }
    }

    #[test]
    fn clocks_are_read_with_their_unit() {
        for (text, hz) in [
            ("168MHz", 168e6),
            ("48 mhz", 48e6),
            ("1.2GHz", 1.2e9),
            ("32768Hz", 32_768.0),
            (" 8000kHz ", 8e6),
        ] {
            assert_eq!(Clock::parse(text), Ok(at(hz)), "{text}");
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
        assert_eq!(at(168e6).to_string(), "168 MHz");
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
        let fit = |cycles| Budget::of(&costs(Some(cycles)), at(1e8), 1e-4).map(|budget| budget.fit);
        assert_eq!(fit((5_000, 9_999)), Some(Fit::Met));
        assert_eq!(fit((5_000, 10_001)), Some(Fit::Doubtful));
        assert_eq!(fit((10_001, 20_000)), Some(Fit::Missed));
        assert_eq!(Budget::of(&costs(None), at(1e8), 1e-4), None);
        // half of the period is NOT met where half of the fewest cycles do not fit
        let half = |cycles| {
            let clock = at(1e8).with(Slot::Behind(0.5));
            Budget::of(&costs(Some(cycles)), clock, 1e-4).unwrap()
        };
        assert_eq!(half((5_001, 5_002)).fit, Fit::Missed);
        assert_eq!(half((4_000, 5_002)).fit, Fit::Doubtful);
        assert!(
            half((2_000, 2_500))
                .text("gcc", Slot::Behind(0.5))
                .contains("the 50 % of the control period behind the sample: met; 50 % of that is left")
        );
        // what leaves less than interrupt entry takes leaves nothing
        let text = |cycles| {
            Budget::of(&costs(Some(cycles)), at(1e8), 1e-4)
                .unwrap()
                .text("gcc", Slot::Unknown)
        };
        assert!(text((5_000, 9_950)).contains("nothing left"));
        // of what is judged as another thing another figure is read
        assert!(text((5_000, 9_999)).contains("50 to 99.9 %"));
        assert!(text((5_000, 10_000)).contains("50 to 100 %"));
        assert!(text((5_000, 10_001)).contains("50 to 100.1 %"));
        assert!(text((5_000, 9_800)).contains("met, half of it in doubt; 2 % of the period is left"));
        assert!(text((5_100, 9_800)).contains("met, half of it NOT; 2 % of the period is left"));
        assert!(text((2_000, 5_000)).contains("met, and so is half of it; 50 % of the period is left"));
    }
}
