//! Drawn converters as figures: median and worst of each controller, and how the policy stands beside the others.

use serde::Serialize;

use super::Spreads;
use crate::scenario::Metrics;
use crate::simulation::POLICY;

/// Median and largest value over all converters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Over {
    pub median: f64,
    pub worst: f64,
}

/// A controller over all converters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Summed {
    pub deviation: Over,
    pub settling: Over,
    pub tail_max: Over,
    /// Converters on which a run ended outside of the band.
    pub unsettled: usize,
}

/// In how many of the six figures the policy does better and worse than another controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub(crate) struct Standing {
    pub better: usize,
    pub worse: usize,
}

impl Over {
    /// Of one value for each converter.
    fn new(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let middle = values.len() / 2;
        let at = |n: usize| values.get(n).copied().unwrap_or(f64::NAN);
        let median = match values.len() % 2 {
            1 => at(middle),
            // of two infinite values the mean is infinite, too
            _ => 0.5 * (at(middle.saturating_sub(1)) + at(middle)),
        };
        Self {
            median,
            worst: at(values.len().saturating_sub(1)),
        }
    }
}

impl Summed {
    /// The six figures that are compared.
    pub fn six(&self) -> [f64; 6] {
        let [a, b, c] = [self.deviation, self.settling, self.tail_max];
        [a.median, a.worst, b.median, b.worst, c.median, c.worst]
    }
}

impl Spreads {
    /// Of every controller, in their order.
    pub(super) fn summed(&self) -> Vec<(&str, Summed)> {
        let of = |name: &'_ str, figure: fn(&Metrics) -> f64| Over::new(self.of_controller(name).map(figure).collect());
        let summed = |name| {
            let summed = Summed {
                deviation: of(name, |m| m.deviation),
                settling: of(name, |m| m.settling),
                tail_max: of(name, |m| m.tail_max),
                unsettled: self.of_controller(name).filter(|m| !m.is_settled()).count(),
            };
            (name, summed)
        };
        self.controllers().map(summed).collect()
    }
}

/// The policy beside each of the others, and beside the best of them in each figure.
pub(super) fn standings<'a>(summed: &[(&'a str, Summed)]) -> Option<(Vec<(&'a str, Standing)>, Standing)> {
    let own = summed.iter().find(|(name, _)| *name == POLICY)?.1.six();
    let others: Vec<(&str, [f64; 6])> = summed
        .iter()
        .filter(|(name, _)| *name != POLICY)
        .map(|(name, summed)| (*name, summed.six()))
        .collect();
    let least = |n: usize| others.iter().map(|(_, six)| six[n]).min_by(f64::total_cmp);
    let best: Vec<f64> = (0..own.len()).filter_map(least).collect();
    let best: [f64; 6] = best.try_into().ok()?;
    let each = others.iter().map(|(name, six)| (*name, beside(&own, six))).collect();
    Some((each, beside(&own, &best)))
}

/// As they are: two figures that round to the same may differ.
fn beside(own: &[f64; 6], other: &[f64; 6]) -> Standing {
    let count = |better: fn(&f64, &f64) -> bool| own.iter().zip(other).filter(|(a, b)| better(a, b)).count();
    Standing {
        better: count(|a, b| a < b),
        worse: count(|a, b| a > b),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_count_is_the_mean_of_the_middle_two() {
        assert_eq!(
            Over::new(vec![4.0, 1.0, 3.0, 2.0]),
            Over {
                median: 2.5,
                worst: 4.0
            }
        );
        assert_eq!(
            Over::new(vec![5.0, 1.0, 3.0]),
            Over {
                median: 3.0,
                worst: 5.0
            }
        );
        let lost = Over::new(vec![f64::INFINITY, 1.0, f64::INFINITY, f64::INFINITY]);
        assert_eq!(
            lost,
            Over {
                median: f64::INFINITY,
                worst: f64::INFINITY
            }
        );
    }

    #[test]
    fn the_best_of_the_others_is_taken_figure_by_figure() {
        let over = |median, worst| Over { median, worst };
        let of = |a, b, c| Summed {
            deviation: a,
            settling: b,
            tail_max: c,
            unsettled: 0,
        };
        let summed = [
            ("policy", of(over(1.0, 2.0), over(3.0, 4.0), over(5.0, 6.0))),
            ("pid", of(over(0.5, 3.0), over(3.0, 5.0), over(6.0, 7.0))),
            ("deadbeat", of(over(2.0, 2.0), over(4.0, 3.0), over(7.0, 8.0))),
        ];
        let (each, best) = standings(&summed).unwrap();
        assert_eq!(each[0], ("pid", Standing { better: 4, worse: 1 }));
        assert_eq!(each[1], ("deadbeat", Standing { better: 4, worse: 1 }));
        assert_eq!(best, Standing { better: 2, worse: 2 });
    }
}
