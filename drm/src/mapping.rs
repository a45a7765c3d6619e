//! The mapping itself: apply, invert, write down.

use std::fmt::Write;

use policy::{Coefficients, Interval};
use serde::Serialize;

use crate::formula::Losses;

/// Duty ratio mapping `d_real = a d_sim + b i_out + c (+ r i_out d_sim)` with the box of `i_out` and `d_sim` in which it
/// was measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DutyRatioMap {
    /// a, b (1/A), c and, in the four-term form, r (1/A).
    pub coefficients: Coefficients,
    /// Load current, A.
    pub valid_i_out: Interval,
    /// Duty ratio of the simulation, 0..1.
    pub valid_d_sim: Interval,
}

impl From<&policy::Mapping> for DutyRatioMap {
    fn from(mapping: &policy::Mapping) -> Self {
        DutyRatioMap {
            coefficients: mapping.coefficients,
            valid_i_out: mapping.valid_i_out,
            valid_d_sim: mapping.valid_d_sim,
        }
    }
}

impl DutyRatioMap {
    /// The mapping that maps nothing, valid for every duty and any plausible current.
    pub const IDENTITY: DutyRatioMap = DutyRatioMap {
        coefficients: Coefficients {
            a: 1.0,
            b: 0.0,
            c: 0.0,
            r: None,
        },
        valid_i_out: Interval { low: -1e3, high: 1e3 },
        valid_d_sim: Interval { low: 0.0, high: 1.0 },
    };

    /// The duty ratio for the converter from `d_sim` at the load current `i_out` A.
    #[must_use]
    pub fn apply(&self, d_sim: f64, i_out: f64) -> f64 {
        let Coefficients { a, b, c, r } = self.coefficients;
        a * d_sim + b * i_out + c + r.unwrap_or(0.0) * i_out * d_sim
    }

    /// Derivative of the mapped duty ratio with respect to d_sim at `i_out` A: `a + r i_out`.
    #[must_use]
    pub fn slope(&self, i_out: f64) -> f64 {
        self.coefficients.a + self.coefficients.r.unwrap_or(0.0) * i_out
    }

    /// The inverse: d_sim that maps to `d_real` at `i_out` A.
    #[must_use]
    pub fn invert(&self, d_real: f64, i_out: f64) -> f64 {
        (d_real - self.coefficients.b * i_out - self.coefficients.c) / self.slope(i_out)
    }

    /// The voltage that the mapping expects of `d_real` at `i_out` A and `v_in` V, in V.
    #[must_use]
    pub fn v_out(&self, d_real: f64, i_out: f64, v_in: f64) -> f64 {
        v_in * self.invert(d_real, i_out)
    }

    /// Whether the mapped duty rises with d_sim all over the valid load current, and without load.
    #[must_use]
    pub fn rises(&self) -> bool {
        // the slope is a line in i_out, so its ends decide; a `drm.toml` whose a is not positive is not read
        let currents = [0.0, self.valid_i_out.low, self.valid_i_out.high];
        currents.into_iter().all(|i_out| self.slope(i_out) > 0.0)
    }

    /// Whether a point lies in the box of validity.
    #[must_use]
    pub fn covers(&self, d_sim: f64, i_out: f64) -> bool {
        let inside = |interval: Interval, x: f64| interval.low <= x && x <= interval.high;
        inside(self.valid_d_sim, d_sim) && inside(self.valid_i_out, i_out)
    }

    /// Lowest and highest mapped duty over the box: at its corners, for the form is linear in each of the two.
    #[must_use]
    pub fn duty_range(&self) -> Interval {
        let (i, d) = (self.valid_i_out, self.valid_d_sim);
        let corners = [(d.low, i.low), (d.low, i.high), (d.high, i.low), (d.high, i.high)];
        let start = Interval {
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        };
        corners.iter().fold(start, |range, (d_sim, i_out)| {
            let duty = self.apply(*d_sim, *i_out);
            Interval {
                low: range.low.min(duty),
                high: range.high.max(duty),
            }
        })
    }

    /// Every number as `drm.toml` holds it: nine digits, enough for each binary32 there is.
    #[must_use]
    pub fn rounded(&self) -> Self {
        let Coefficients { a, b, c, r } = self.coefficients;
        let interval = |i: Interval| Interval {
            low: nine_digits(i.low),
            high: nine_digits(i.high),
        };
        DutyRatioMap {
            coefficients: Coefficients {
                a: nine_digits(a),
                b: nine_digits(b),
                c: nine_digits(c),
                r: r.map(nine_digits),
            },
            valid_i_out: interval(self.valid_i_out),
            valid_d_sim: interval(self.valid_d_sim),
        }
    }

    /// The text of a `drm.toml`; `comment` is put above, line by line.
    #[must_use]
    pub fn to_toml(&self, comment: &str) -> String {
        let DutyRatioMap {
            coefficients: Coefficients { a, b, c, r },
            valid_i_out: i,
            valid_d_sim: d,
        } = self.rounded();
        let mut text = String::new();
        for line in comment.lines() {
            text.push_str(format!("# {line}").trim_end());
            text.push('\n');
        }
        let mut entry = |line: String| text.push_str(&(line + "\n"));
        let product = if r.is_some() { " + r i_out d_sim" } else { "" };
        entry(format!("# d_real = a d_sim + b i_out + c{product}"));
        // `{:?}`, because `{}` writes 1 for 1.0, which is an integer in TOML
        entry(format!("a = {a:?}"));
        entry(format!("b = {b:?}"));
        entry(format!("c = {c:?}"));
        if let Some(r) = r {
            entry(format!("r = {r:?}"));
        }
        entry(String::new());
        entry("[valid]".to_owned());
        entry(format!("i_out = [{:?}, {:?}]", i.low, i.high));
        entry(format!("d_sim = [{:?}, {:?}]", d.low, d.high));
        text
    }
}

/// `[simulation]` of a `drm.toml`: the converter that `d_sim` is a duty of. Losses of 0 are left out.
#[must_use]
pub fn simulation_toml(simulation: &Losses) -> String {
    let Losses {
        v_in,
        v_f,
        r_d,
        r_on,
        dcr,
        lost_duty,
        v_dead,
    } = *simulation;
    let losses = [
        ("v_f", v_f),
        ("r_d", r_d),
        ("r_on", r_on),
        ("dcr", dcr),
        ("lost_duty", lost_duty),
        ("v_dead", v_dead),
    ];
    let mut text = format!("\n[simulation]\nv_in = {v_in:?}\n");
    for (key, value) in losses.iter().filter(|(_, value)| *value != 0.0) {
        text += &format!("{key} = {value:?}\n");
    }
    text
}

impl From<&policy::Simulation> for Losses {
    fn from(simulation: &policy::Simulation) -> Self {
        let policy::Simulation {
            v_in,
            v_f,
            r_d,
            r_on,
            dcr,
            lost_duty,
            v_dead,
        } = *simulation;
        Losses {
            v_in,
            v_f,
            r_d,
            r_on,
            dcr,
            lost_duty,
            v_dead,
        }
    }
}

fn nine_digits(x: f64) -> f64 {
    let mut text = String::new();
    match write!(text, "{x:.8e}") {
        Ok(()) => text.parse().unwrap_or(x),
        Err(_) => x,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(r: Option<f64>) -> DutyRatioMap {
        DutyRatioMap {
            coefficients: Coefficients {
                a: 0.95,
                b: 0.002,
                c: 0.03,
                r,
            },
            valid_i_out: Interval { low: 2.0, high: 10.0 },
            valid_d_sim: Interval { low: 0.3, high: 0.7 },
        }
    }

    #[test]
    fn the_inverse_undoes_the_mapping_in_both_forms() {
        for r in [None, Some(0.004)] {
            let map = map(r);
            let d_real = map.apply(0.5, 6.0);
            assert!((map.invert(d_real, 6.0) - 0.5).abs() < 1e-15);
            assert!((map.v_out(d_real, 6.0, 200.0) - 100.0).abs() < 1e-12);
        }
        assert!((map(Some(0.004)).apply(0.5, 6.0) - (0.475 + 0.012 + 0.03 + 0.012)).abs() < 1e-15);
    }

    #[test]
    fn a_product_term_can_turn_the_mapping_around() {
        assert!(map(Some(-0.09)).rises());
        assert!(!map(Some(-0.096)).rises(), "a + r i = 0.95 - 0.96 at 10 A");
        let mut falls_without_load = map(Some(9.0));
        falls_without_load.coefficients.a = -8.0;
        assert!(
            !falls_without_load.rises(),
            "no contract takes a mapping whose a is not positive"
        );
    }

    #[test]
    fn the_duty_range_is_that_of_the_corners() {
        let range = map(None).duty_range();
        assert!((range.low - (0.285 + 0.004 + 0.03)).abs() < 1e-15, "{range:?}");
        assert!((range.high - (0.665 + 0.02 + 0.03)).abs() < 1e-15, "{range:?}");
    }

    #[test]
    fn the_simulation_survives_the_file() {
        let losses = Losses {
            v_f: 0.7,
            dcr: 0.1 + 0.2,
            v_dead: 0.016,
            ..Losses::none(100.0)
        };
        let text = map(None).to_toml("") + &simulation_toml(&losses);
        let mapping = policy::read_mapping(std::path::Path::new("drm.toml"), &text).unwrap();
        assert_eq!(mapping.simulation.as_ref().map(Losses::from), Some(losses));
    }

    #[test]
    fn numbers_survive_the_file_as_binary32() {
        let map = map(Some(0.1 + 0.2));
        let rounded = map.rounded().coefficients;
        assert_eq!(rounded.r.map(|r| r as f32), Some(0.3_f32));
        assert!(map.to_toml("").contains("r = 0.3\n"));
    }
}
