//! What one more cause, too small to be named, would do to the values of the named ones.
//!
//! The search names as few causes as the records need. A small resistance of the switch beside one of the winding may stay below what
//! they show, and the winding's value then holds both. At first order that is known without a fit: a note says it, and no verdict
//! follows from it.

use crate::attribute::Attribution;
use crate::fit::Fitter;
use crate::normal::{Normal, solve};
use crate::problem::Problem;
use crate::profile::Profile;
use crate::words::{si, unit};

/// An interval is spoken of where another cause makes it this many times as wide. A convention: every cause widens every other a
/// little.
const WIDER: f64 = 3.0;
/// Other causes named for a parameter at most: the rest says the same.
const MOST: usize = 2;
/// Standard deviations of an interval of 95 %.
const TWO_SIDED: f64 = 1.96;

/// What another cause beside the explanation would do to one of its parameters.
struct Widened {
    other: usize,
    /// What the other one could be.
    reach: [f64; 2],
    /// What the parameter could be then.
    interval: [f64; 2],
}

/// A sentence for each parameter whose interval holds only as long as no other cause is there.
#[must_use]
pub fn notes(problem: &Problem, attribution: &Attribution, profiles: &[Profile]) -> Vec<String> {
    let Some(best) = &attribution.best else {
        return Vec::new();
    };
    // what initial states explain is taken where the fit ends: the drops that it found are not in the model as given
    let basis = problem.basis(&best.state.model, &best.state.starts, &best.state.residual);
    let fitter = Fitter {
        basis: &basis,
        ..attribution.fitter(problem)
    };
    let places = fitter.places(&best.causes);
    let columns: Vec<Vec<f64>> = best
        .causes
        .iter()
        .flat_map(|cause| fitter.sensitivity(*cause, &best.state))
        .collect();
    // counts and whole periods have no columns; without a profile for each there is no interval to speak of
    if columns.len() != places.len() || profiles.len() != places.len() {
        return Vec::new();
    }
    let is_other = |cause: &usize| {
        let candidate = &attribution.candidates[*cause];
        let is_single = candidate.form.begins_at_own() && candidate.own.len() == 1;
        is_single && best.causes.iter().all(|known| !attribution.same(*known, *cause))
    };
    let others: Vec<usize> = (0..attribution.candidates.len()).filter(is_other).collect();
    let sensitivities = crate::parallel::map(&others, |cause| fitter.sensitivity(*cause, &best.state));
    let mut notes = Vec::new();
    for (number, (place, profile)) in places.iter().zip(profiles).enumerate() {
        let scale = fitter.range(*place)[2];
        let mut widened: Vec<Widened> = Vec::new();
        for (other, own) in others.iter().zip(&sensitivities) {
            // a rival has been told as one
            let is_rival = attribution.rivals[profile.member]
                .iter()
                .any(|fit| fit.causes.contains(other));
            let ([column], false) = (&own[..], is_rival) else {
                continue;
            };
            let all = [&columns[..], std::slice::from_ref(column)].concat();
            let joint = joint(&all, &best.state.residual, number, attribution.inflation);
            let [low, high, step] = fitter.range((*other, 0));
            let at = attribution.candidates[*other].own[0];
            let reach =
                [-TWO_SIDED, TWO_SIDED].map(|side| (at + step * (joint.other + side * joint.scatter)).clamp(low, high));
            // along the ridge on which both fit as well
            let mut ends = reach
                .map(|value| profile.value + scale * (joint.shift + joint.slope * ((value - at) / step - joint.other)));
            ends.sort_by(f64::total_cmp);
            let [below, above] = [profile.value - profile.interval[0], profile.interval[1] - profile.value];
            // a line leads anywhere; no value lies beyond what the parameter can be
            let [least, most, _] = fitter.range(*place);
            let interval = [
                (ends[0] - below).max(least).min(profile.interval[0]),
                (ends[1] + above).min(most).max(profile.interval[1]),
            ];
            if reach[0] < reach[1] && interval[1] - interval[0] > WIDER * (below + above) {
                widened.push(Widened {
                    other: *other,
                    reach,
                    interval,
                });
            }
        }
        widened.sort_by(|a, b| (b.interval[1] - b.interval[0]).total_cmp(&(a.interval[1] - a.interval[0])));
        widened.truncate(MOST);
        notes.extend(sentence(attribution, profile, &widened));
    }
    notes
}

/// A fit of the explanation and one more parameter, in the steps of both.
struct Joint {
    /// How far the parameter moves.
    shift: f64,
    /// Where the other one ends, and its standard deviation.
    other: f64,
    scatter: f64,
    /// The parameter's move for a step of the other one, all else following.
    slope: f64,
}

fn joint(columns: &[Vec<f64>], residual: &[f64], number: usize, inflation: f64) -> Joint {
    let last = columns.len() - 1;
    let normal = Normal::new(columns, residual);
    let unit: Vec<f64> = (0..=last).map(|n| if n == last { 1.0 } else { 0.0 }).collect();
    let (step, covariance) = (normal.solved(), solve(normal.matrix(), &unit));
    let variance = covariance[last].max(0.0);
    Joint {
        shift: step[number],
        other: step[last],
        scatter: (variance * inflation).sqrt(),
        slope: if variance > 0.0 {
            covariance[number] / variance
        } else {
            0.0
        },
    }
}

fn sentence(attribution: &Attribution, profile: &Profile, widened: &[Widened]) -> Option<String> {
    if widened.is_empty() {
        return None;
    }
    let id = attribution
        .best
        .as_ref()
        .map_or("", |best| attribution.id(best.causes[profile.member]));
    let name = if profile.name == id {
        id.to_owned()
    } else {
        format!("{} of {id}", profile.name)
    };
    let range = |ends: [f64; 2], of: &'static str| format!("{} to {}", si(ends[0], unit(of)), si(ends[1], unit(of)));
    // forms of one cause may say the same
    let mut with: Vec<String> = Vec::new();
    for one in widened {
        let knob = &attribution.candidates[one.other].form.knobs[0];
        let (other, reach) = (attribution.id(one.other), range(one.reach, knob.unit()));
        let said = format!("{} with {other} beside it ({reach})", range(one.interval, profile.unit));
        if !with.contains(&said) {
            with.push(said);
        }
    }
    Some(format!(
        "{name} from {} holds if nothing else is off; to first order these records also allow {}",
        range(profile.interval, profile.unit),
        with.join(", or ")
    ))
}

#[cfg(test)]
mod tests {
    use super::joint;

    #[test]
    fn two_nearly_equal_effects_share_what_is_there() {
        // one effect, and the same with a small part of its own, of which nothing is seen
        let first: Vec<f64> = (0..100).map(|n| f64::from(n % 10)).collect();
        let second: Vec<f64> = (0..100)
            .map(|n| f64::from(n % 10) + if n % 2 == 0 { 0.1 } else { -0.1 })
            .collect();
        let residual = vec![0.0; 100];
        let found = joint(&[first.clone(), second.clone()], &residual, 0, 1.0);
        // a hundred rows of 0.1, but for what the first effect explains of them: a standard deviation near 1
        assert!((found.scatter - 1.0).abs() < 0.05, "{}", found.scatter);
        // a step of the second is one of the first less
        assert!((found.slope + 1.0).abs() < 0.05, "{}", found.slope);
        assert!(found.other.abs() < 1e-9 && found.shift.abs() < 1e-9);
    }
}
