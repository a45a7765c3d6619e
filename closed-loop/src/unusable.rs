//! Control periods in which a controller did without its measurement: what looks like a bad policy may be a range of a signal
//! that is too narrow for the plant.

use interp::status::{FALLBACK, HELD};
use plant::Signals;
use policy::Policy;

use crate::controller::{Period, Trajectory};

/// What a trajectory says of them, in a sentence without a full stop; nothing if every measurement was used.
#[must_use]
pub fn unusable(trajectory: &Trajectory, policy: &Policy) -> Option<String> {
    let with = |bits: u32| {
        trajectory
            .periods
            .iter()
            .filter(move |period| period.answer.status & bits != 0)
    };
    let first = with(HELD | FALLBACK).next()?;
    let (fallbacks, of) = (with(FALLBACK).count(), trajectory.periods.len());
    let bridged = with(HELD | FALLBACK).count() - fallbacks;
    let what = match (fallbacks, bridged) {
        (0, held) => format!("{held} of {of} control periods ran on held samples"),
        (fallbacks, _) => format!("{fallbacks} of {of} control periods commanded the fallback"),
    };
    let why = outside(first, policy).map_or_else(String::new, |why| format!(": {why}"));
    Some(format!(
        "{what}, the first sample {:.2} ms from the step{why}",
        1e3 * first.record.time
    ))
}

/// The first signal of a period that lies outside its range.
fn outside(period: &Period, policy: &Policy) -> Option<String> {
    let Signals {
        v_out,
        i_l,
        i_out,
        v_in,
    } = period.record.sample.measured;
    let value = |name: &str| match name {
        "v_out" => Some(v_out),
        "i_l" => Some(i_l),
        "i_out" => Some(i_out),
        "v_in" => Some(v_in),
        _ => None,
    };
    policy.signals.iter().find_map(|signal| {
        let (x, range) = (value(&signal.name)?, signal.range);
        // in this form NaN is outside as well
        (!(range.low..=range.high).contains(&x)).then(|| {
            format!(
                "`{}` is {x:.2} {unit}, outside of its range {} to {} {unit}",
                signal.name,
                range.low,
                range.high,
                unit = signal.unit
            )
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Answer, scenario};

    fn period(i_l: f64, status: u32) -> Period {
        let mut sample = plant::Sample::default();
        sample.measured.i_l = i_l;
        let answer = Answer {
            duty: 0.0,
            action: Some(0),
            status,
        };
        let record = scenario::Record {
            time: 1e-3,
            sample,
            duty: 0.0,
            load: plant::Load::default(),
        };
        Period { record, answer }
    }

    #[test]
    fn the_signal_that_was_refused_is_named() {
        let example = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/buck12/policy.toml");
        let policy = policy::load(&example).unwrap();
        let trajectory = |periods: Vec<Period>| Trajectory {
            instant: scenario::Instant { periods: 0, phase: 0.0 },
            metrics: scenario::Metrics::default(),
            periods,
            others: Vec::new(),
        };
        assert_eq!(unusable(&trajectory(vec![period(1.0, 0)]), &policy), None);
        let range = policy.signals.iter().find(|signal| signal.name == "i_l").unwrap().range;
        let below = range.low - 1.0;
        let said = unusable(
            &trajectory(vec![period(1.0, 0), period(below, HELD), period(below, FALLBACK)]),
            &policy,
        );
        let said = said.unwrap();
        assert!(
            said.starts_with("1 of 3 control periods commanded the fallback"),
            "{said}"
        );
        assert!(
            said.contains("`i_l` is") && said.contains("outside of its range"),
            "{said}"
        );
    }
}
