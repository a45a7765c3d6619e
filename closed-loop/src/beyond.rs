//! Control periods outside of the range in which an empirical correction was fitted: there the plant is less sure than it looks.

use plant::Parameters;

use crate::controller::{Period, Trajectory};

/// What a trajectory says of them, in a sentence without a full stop; nothing if there are none, or no correction.
#[must_use]
pub fn beyond(trajectory: &Trajectory, plant: &Parameters) -> Option<String> {
    let of = trajectory.periods.len();
    let left: Vec<String> = plant
        .empirical
        .ranges()
        .into_iter()
        .filter_map(|(name, unit, [low, high])| {
            let value = |period: &Period| match name {
                "v_out" => period.record.sample.v_out,
                "i_l" => period.record.sample.i_l,
                _ => period.record.duty,
            };
            // what is no number is outside as well
            let count = trajectory
                .periods
                .iter()
                .filter(|period| !(low..=high).contains(&value(period)))
                .count();
            (count > 0).then(|| format!("`{name}` in {count} (fitted from {low:.4} to {high:.4}{unit})"))
        })
        .collect();
    (!left.is_empty()).then(|| {
        format!(
            "of {of} control periods the policy leaves the range of the plant's [empirical] correction: {}; there it stays what it is at the edge",
            left.join(", ")
        )
    })
}
