//! What is allowed but worth a look.

use std::collections::BTreeMap;

use crate::model::{Estimate, Feature, Golden, Head, Input, Limits, Mapping, Observer, Signal};

/// Golden observations that the controller never sees, because the training left the range of a signal.
pub fn left_out(golden: &Golden) -> Option<String> {
    let (outside, all) = (golden.outside, golden.count + golden.outside);
    (outside > 0).then(|| {
        format!(
            "{outside} of {all} golden observations are left out, as golden_outside allows: no state of this controller gives them. Where they \
             were measured, and not drawn, it holds the last sample there and then commands the fallback"
        )
    })
}

/// What the limits and the mapping make of the duties, where a reader may not expect it.
pub fn on_duties(limits: &Limits, duties: &[f64], mapping: Option<&Mapping>, features: &[Feature]) -> Vec<String> {
    let mut notes: Vec<String> = outside_at_first(limits).into_iter().collect();
    notes.extend(starts_below(limits));
    notes.extend(unlike_any_action(limits, duties, features));
    match only_duty(limits, duties, mapping) {
        Some(duty) => notes.push(format!(
            "every action commands the duty {duty}: the limits leave no other, and nothing is left to control with"
        )),
        None => notes.extend(beyond_limits(limits, duties, mapping)),
    }
    if let Some(mapping) = mapping {
        notes.extend(beyond_mapping(limits, duties, mapping));
    }
    notes
}

/// A soft start that begins where no duty may lie: the limits come last, so the lowest of them is commanded at once.
fn starts_below(limits: &Limits) -> Option<String> {
    let (from, low) = (limits.soft_start.as_ref()?.from, limits.duty.low);
    (from < low).then(|| {
        format!(
            "the soft start begins at {from}, below the smallest duty {low}: the first step commands {low} all the same, and the ramp shows \
             from there on"
        )
    })
}

/// A first observation with a duty that the training hardly had.
fn unlike_any_action(limits: &Limits, duties: &[f64], features: &[Feature]) -> Option<String> {
    let first = limits.initial_duty;
    let (low, high) = (duties.iter()).fold((1.0_f64, 0.0_f64), |(low, high), duty| {
        (low.min(*duty), high.max(*duty))
    });
    let duties = [Input::PreviousDuty, Input::PreviousCommand];
    let is_read = features
        .iter()
        .any(|feature| duties.iter().any(|duty| feature.source.reads(*duty)));
    (is_read && !(low..=high).contains(&first)).then(|| {
        format!(
            "the first observation has the duty {first}, which lies outside of all actions, {low} to {high}: the duty before the \
             first step of the training is initial_duty in [limits]"
        )
    })
}

/// A converter of which the plausible range uses less than this share of its codes is looked at.
// a gain that is ten times too large leaves a tenth at most
const USED: f64 = 1.0 / 8.0;
/// Where the contract says no bits: fewer codes than these in the plausible range are looked at.
// seven bits: a step of 1 % of the range is coarser than the error that a converter's control corrects
const FEWEST_CODES: f64 = 128.0;

/// Converters whose gain and plausible range do not go together. What lies beyond a converter's last code is a fault already.
pub(crate) fn on_converters(signals: &[Signal]) -> Vec<String> {
    let note = |signal: &Signal| {
        let adc = signal.adc?;
        let codes = (signal.range.high - signal.range.low) / adc.gain.abs();
        let range = format!("{} to {} {}", signal.range.low, signal.range.high, signal.unit);
        let range = range.trim_end();
        let name = &signal.name;
        let step = format!("one code is {} {}", adc.gain.abs(), signal.unit);
        let step = step.trim_end();
        match adc.bits {
            Some(bits) => {
                let all = 2.0_f64.powi(i32::try_from(bits).ok()?);
                (codes < USED * all).then(|| {
                    format!(
                        "signal `{name}`: the plausible range {range} takes {codes:.0} of the {all:.0} codes of its converter; {step}: is \
                         the gain right?"
                    )
                })
            }
            None => (codes < FEWEST_CODES).then(|| {
                format!("signal `{name}`: the plausible range {range} has {codes:.0} codes alone; {step}: is the gain right?")
            }),
        }
    };
    signals.iter().filter_map(note).collect()
}

/// Signals and parameters that nothing refers to.
pub(crate) fn unused(
    parameters: &BTreeMap<String, f64>,
    signals: &[Signal],
    observers: &[Observer],
    head: &Head,
    features: &[Feature],
    mapping: Option<&Mapping>,
) -> Vec<String> {
    let mut notes = Vec::new();
    // the features are faulty: what nobody reads cannot be told
    if features.is_empty() {
        return notes;
    }
    let read = |index: usize| {
        features
            .iter()
            .any(|feature| feature.source.reads(Input::Signal(index)))
            || head.sources().any(|source| source.tree.reads(Input::Signal(index)))
            || observers
                .iter()
                .any(|observer| observer.signals().any(|own| own == index))
            || mapping.is_some_and(|mapping| mapping.load_current == index)
    };
    let idle = signals.iter().enumerate().filter(|(index, _)| !read(*index));
    notes.extend(idle.map(|(_, signal)| {
        format!(
            "signal `{}` feeds no feature; its plausible range still guards every step",
            signal.name
        )
    }));
    // parameters are folded into the tree: the text alone still names them
    let word = |text: &str, name: &str| {
        text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
            .any(|w| w == name)
    };
    let idle = parameters
        .keys()
        .filter(|name| !features.iter().any(|feature| word(&feature.source_text, name)))
        .filter(|name| !head.sources().any(|source| word(&source.text, name)));
    let estimate = |index: usize, each| {
        let input = Input::Estimate(index, each);
        features.iter().any(|own| own.source.reads(input)) || head.sources().any(|own| own.tree.reads(input))
    };
    let blind = observers
        .iter()
        .enumerate()
        .filter(|(index, _)| !Estimate::ALL.iter().any(|each| estimate(*index, *each)));
    let blind = blind.map(|(_, observer)| format!("nothing reads an estimate of observer `{}`", observer.name));
    notes.extend(blind.collect::<Vec<_>>());
    notes.extend(idle.map(|name| format!("parameter `{name}` is not used")));
    notes
}

/// Actions outside the range of the mapping, and mapped duties that the limits cut off.
///
/// The mapping applies outside its range, too: the status bit says so. Both ends of the range of the load current are looked
/// at, since a mapped duty is linear in it.
fn beyond_mapping(limits: &Limits, duties: &[f64], mapping: &Mapping) -> Vec<String> {
    let mut notes = Vec::new();
    let range = mapping.valid_d_sim;
    let outside = |duty: &&f64| **duty < range.low || **duty > range.high;
    let beyond: Vec<String> = duties.iter().filter(outside).map(f64::to_string).collect();
    if !beyond.is_empty() {
        notes.push(format!(
            "duties outside the range of the mapping, d_sim {} to {}: {}",
            range.low,
            range.high,
            beyond.join(", ")
        ));
    }
    let ends = [mapping.valid_i_out.low, mapping.valid_i_out.high];
    let all = (duties.iter()).flat_map(|duty| ends.map(|i| mapped(mapping, *duty, i)));
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), duty| {
        (low.min(duty), high.max(duty))
    });
    if low < limits.duty.low || high > limits.duty.high {
        notes.push(format!(
            "mapped, the duties reach from {low:.3} to {high:.3} within the mapping's range of load; the limits {} to {} cut them off",
            limits.duty.low, limits.duty.high
        ));
    }
    notes
}

/// The duty that the limits make of all actions, if these differ and nobody asked for a fixed duty by equal limits. A mapped duty is linear in the load current: if both
/// ends of its range leave the same one, so does everything between.
fn only_duty(limits: &Limits, duties: &[f64], mapping: Option<&Mapping>) -> Option<f64> {
    let own = *duties.first()?;
    if limits.duty.low == limits.duty.high || duties.iter().all(|duty| *duty == own) {
        return None;
    }
    // without a mapping the current has no effect, and any two values do
    let ends = mapping.map_or([0.0; 2], |m| [m.valid_i_out.low, m.valid_i_out.high]);
    let limited = |duty: f64, i: f64| {
        let duty = mapping.map_or(duty, |mapping| mapped(mapping, duty, i));
        duty.clamp(limits.duty.low, limits.duty.high)
    };
    let first = limited(own, ends[0]);
    let all = duties.iter().flat_map(|duty| ends.map(|i| limited(*duty, i)));
    all.into_iter().all(|duty| duty == first).then_some(first)
}

fn mapped(mapping: &Mapping, d: f64, i: f64) -> f64 {
    let c = mapping.coefficients;
    // binary64 is near enough for a note: the controller rounds each step
    c.a * d + c.b * i + c.c + c.r.unwrap_or(0.0) * d * i
}

/// Actions that the duty limits cut off even without a mapping.
fn beyond_limits(limits: &Limits, duties: &[f64], mapping: Option<&Mapping>) -> Option<String> {
    if mapping.is_some() {
        return None;
    }
    // the ends of a command are binary32, and those of the limits as they were written: a rounding is no cut
    let rounding = f64::from(f32::EPSILON);
    let cut = |duty: &&f64| **duty < limits.duty.low - rounding || **duty > limits.duty.high + rounding;
    let beyond: Vec<_> = duties.iter().filter(cut).map(f64::to_string).collect();
    (!beyond.is_empty()).then(|| format!("duties outside the limits are cut off: {}", beyond.join(", ")))
}

/// A duty before the first step that the limits do not hold.
fn outside_at_first(limits: &Limits) -> Option<String> {
    let (duty, range) = (limits.initial_duty, limits.duty);
    // 0 is what a fallback of 0 leaves here, and a fallback may lie outside of the limits
    let is_outside = duty != 0.0 && !(range.low..=range.high).contains(&duty);
    is_outside.then(|| {
        format!(
            "initial_duty {duty} lies outside of the limits {} to {}: no step ever commands it",
            range.low, range.high
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Coefficients, Interval};

    fn interval(low: f64, high: f64) -> Interval {
        Interval { low, high }
    }

    fn mapping(valid_d_sim: Interval) -> Mapping {
        let coefficients = Coefficients {
            a: 1.0,
            b: 0.01,
            c: 0.0,
            r: None,
        };
        Mapping {
            coefficients,
            load_current: 0,
            valid_i_out: interval(0.0, 5.0),
            valid_d_sim,
            adjust_a: interval(0.5, 2.0),
            adjust_b: interval(0.0, 0.02),
            adjust_c: interval(-0.1, 0.1),
            adjust_r: interval(0.0, 0.0),
            simulation: None,
        }
    }

    #[test]
    fn limits_that_leave_one_duty_are_found_with_and_without_mapping() {
        let limits = |low, high| Limits {
            duty: interval(low, high),
            slew: None,
            soft_start: None,
            initial_duty: 0.3,
        };
        let actions = [0.4, 0.5];
        assert_eq!(only_duty(&limits(0.6, 0.9), &actions, None), Some(0.6));
        assert_eq!(only_duty(&limits(0.3, 0.45), &actions, None), None, "0.4 and 0.45");
        assert_eq!(
            only_duty(&limits(0.6, 0.6), &actions, None),
            None,
            "a fixed duty is asked for"
        );
        assert_eq!(
            only_duty(&limits(0.6, 0.9), &[actions[0]; 2], None),
            None,
            "by the actions alone"
        );
        // 0.01 i at up to 5 A lifts 0.5 to 0.55
        let mapping = mapping(interval(0.0, 1.0));
        assert_eq!(only_duty(&limits(0.56, 0.9), &actions, Some(&mapping)), Some(0.56));
        assert_eq!(only_duty(&limits(0.54, 0.9), &actions, Some(&mapping)), None);
    }

    fn notes(duties: &[f64], valid: Interval, limits: Interval) -> Vec<String> {
        let limits = Limits {
            duty: limits,
            slew: None,
            soft_start: None,
            initial_duty: 0.3,
        };
        beyond_mapping(&limits, duties, &mapping(valid))
    }

    #[test]
    fn a_soft_start_below_the_smallest_duty_is_told() {
        let said = |from: f64| {
            starts_below(&Limits {
                duty: interval(0.4, 0.6),
                slew: None,
                soft_start: Some(crate::model::SoftStart { from, steps: 500 }),
                initial_duty: 0.5,
            })
        };
        assert!(said(0.05).is_some_and(|note| note.contains("the first step commands 0.4")));
        assert_eq!((said(0.4), said(0.5)), (None, None));
    }

    #[test]
    fn a_mapping_that_covers_the_duties_has_no_note() {
        assert!(notes(&[0.3, 0.5], interval(0.2, 0.6), interval(0.2, 0.6)).is_empty());
    }

    #[test]
    fn duties_that_reach_the_limits_are_not_cut_off() {
        // mapped, 0.3 to 0.5 become 0.3 to 0.5 and 0.05 at 5 A
        let mapped = |low, high| notes(&[0.3, 0.5], interval(0.0, 1.0), interval(low, high)).len();
        assert_eq!((mapped(0.3, 0.56), mapped(0.301, 0.56), mapped(0.3, 0.549)), (0, 1, 1));
        let limits = |low, high| Limits {
            duty: interval(low, high),
            slew: None,
            soft_start: None,
            initial_duty: 0.3,
        };
        let cut = |low, high| beyond_limits(&limits(low, high), &[0.3, 0.5], None);
        assert_eq!(cut(0.3, 0.5), None);
        assert!(cut(0.3, 0.49).is_some_and(|note| note.ends_with(": 0.5")));
        assert!(cut(0.31, 0.5).is_some_and(|note| note.ends_with(": 0.3")));
        // the ends of a command are rounded to binary32: so much is no cut, and twice as much is one
        let rounding = f64::from(f32::EPSILON);
        let beside = |by: f64| beyond_limits(&limits(0.25, 0.5), &[0.25 - by, 0.5 + by], None);
        assert_eq!(beside(rounding), None);
        assert!(beside(2.0 * rounding).is_some());
        // of several that are cut off all are named, and with a mapping its own note says it
        let both = "duties outside the limits are cut off: 0.3, 0.5";
        assert_eq!(cut(0.4, 0.45).as_deref(), Some(both));
        let mapping = mapping(interval(0.0, 1.0));
        assert_eq!(beyond_limits(&limits(0.4, 0.45), &[0.3, 0.5], Some(&mapping)), None);
    }

    #[test]
    fn a_mapped_duty_has_four_terms() {
        let mut mapping = mapping(interval(0.0, 1.0));
        mapping.coefficients = Coefficients {
            a: 1.25,
            b: 0.0625,
            c: 0.03125,
            r: Some(-0.125),
        };
        // 0.625 + 0.25 + 0.03125 - 0.25
        assert_eq!(mapped(&mapping, 0.5, 4.0), 0.656_25);
        mapping.coefficients.r = None;
        assert_eq!(mapped(&mapping, 0.5, 4.0), 0.906_25);
    }

    #[test]
    fn an_initial_duty_that_no_step_commands_is_told() {
        let said = |initial_duty: f64| {
            outside_at_first(&Limits {
                duty: interval(0.25, 0.75),
                slew: None,
                soft_start: None,
                initial_duty,
            })
        };
        assert_eq!([0.0, 0.25, 0.5, 0.75].map(said), [None, None, None, None]);
        let outside = "initial_duty 0.125 lies outside of the limits 0.25 to 0.75: no step ever commands it";
        assert_eq!(said(0.125).as_deref(), Some(outside));
        assert!(said(0.875).is_some());
    }

    #[test]
    fn duties_outside_the_mapping_and_mapped_duties_outside_the_limits_are_named() {
        let said = notes(&[0.1, 0.58], interval(0.2, 0.6), interval(0.05, 0.6)).join("\n");
        assert!(said.contains("d_sim 0.2 to 0.6: 0.1"), "{said}");
        // 0.58 + 0.01 * 5 A
        assert!(said.contains("from 0.100 to 0.630"), "{said}");
    }
}
