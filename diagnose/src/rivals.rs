//! A tie as a reader needs it: which member leads, the values that every member has, and intervals that hold whichever is true.

use serde::Serialize;

use crate::attribute::Attribution;
use crate::causes::{Kind, Knob};
use crate::doubts;
use crate::fit::Fit;
use crate::problem::Problem;
use crate::profile::Profile;
use crate::shape::structures;

/// 95 % of a chi-square of one degree of freedom: within it the data do not say which of two is better.
const LEVEL: f64 = 3.841;
/// The same in standard deviations.
const TWO_SIDED: f64 = 1.96;

/// A parameter of a rival.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RivalValue {
    /// Id of the cause.
    pub id: &'static str,
    /// Which parameter of it.
    pub parameter: &'static str,
    /// Where the rival fits best.
    pub value: f64,
    /// 95 % interval, as long as the rival is the explanation: of the parabola at the best value, within the reach.
    pub low: f64,
    /// Its upper end.
    pub high: f64,
    /// SI unit.
    pub unit: &'static str,
    /// The model's own value.
    pub model: f64,
}

/// The values that a rival needs.
#[must_use]
pub fn values(attribution: &Attribution, fit: &Fit) -> Vec<RivalValue> {
    let places =
        (fit.causes.iter()).flat_map(|cause| (0..attribution.candidates[*cause].own.len()).map(|k| (*cause, k)));
    let of = |(number, (cause, k)): (usize, (usize, usize))| {
        let candidate = &attribution.candidates[cause];
        let knob = &candidate.form.knobs[k];
        let [low, high] = interval(attribution, fit, number, candidate.ranges[k]);
        RivalValue {
            id: candidate.cause.id,
            parameter: knob.name,
            value: fit.values[number],
            low,
            high,
            unit: knob.unit(),
            model: candidate.own[k],
        }
    };
    places.enumerate().map(of).collect()
}

/// 95 % interval of one of the values of a fit, by its covariance.
fn interval(attribution: &Attribution, fit: &Fit, number: usize, [low, high, _]: [f64; 3]) -> [f64; 2] {
    let variance = fit.covariance[number][number].max(0.0) * attribution.inflation;
    [-TWO_SIDED, TWO_SIDED].map(|side| (fit.values[number] + side * variance.sqrt()).clamp(low, high))
}

/// Among members of a tie that the data cannot put in order the more usual one leads: copper and diode before the gain of a probe.
/// What it replaces becomes its rival. A member that ends at the limit of what is tried leads nothing that another explains as well:
/// it is no explanation, and no rival either.
pub fn most_usual_first(problem: &Problem, attribution: &mut Attribution) {
    let members = attribution.best.as_ref().map_or(0, |best| best.causes.len());
    for member in 0..members {
        let Some(best) = &attribution.best else { return };
        let own = attribution.usual(best, best.causes[member]);
        // a rival lies within a tie, whatever a member gains that may not go on
        let worst = match own.is_at_bound {
            true => f64::INFINITY,
            false => best.state.chi2 + LEVEL * attribution.inflation,
        };
        let leads = |fit: &&Fit| {
            // the rival of one cause stands last, behind those that are kept
            let other = fit.causes.last().map(|cause| attribution.usual(fit, *cause));
            stands_for(fit, best, member)
                && other.is_some_and(|other| other < own)
                && fit.state.chi2 <= worst
                && structures(problem, &attribution.null, &fit.state, attribution.inflation).is_empty()
        };
        let found = attribution.rivals[member].iter().filter(leads);
        let Some(leader) = found.min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2)).cloned() else {
            continue;
        };
        attribution.lead(member, leader, own.is_at_bound);
        // the others have moved a place
        return most_usual_first(problem, attribution);
    }
}

/// A number so many times as large as any that is typical is none of this part: a diode of an ohm where a tenth is much. Data sheets
/// differ by less, and converters of 400 V have other resistances than those of 5 V.
const UNTYPICAL: f64 = 5.0;

/// How usual a cause with its values is, the most usual first.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Usual {
    is_at_bound: bool,
    is_untypical: bool,
    kind: Kind,
}

impl Attribution {
    fn usual(&self, fit: &Fit, cause: usize) -> Usual {
        let candidate = &self.candidates[cause];
        let before: usize = (fit.causes.iter().take_while(|known| **known != cause))
            .map(|known| self.candidates[*known].own.len())
            .sum();
        let values: Vec<f64> = fit
            .values
            .iter()
            .skip(before)
            .take(candidate.own.len())
            .copied()
            .collect();
        let mut own = values.iter().zip(&candidate.own).zip(candidate.form.knobs);
        let is_untypical = |((value, model), knob): ((&f64, &f64), &Knob)| {
            let parameter = knob.keys.first().and_then(|key| plant::parameter(key));
            let most = parameter.map_or(f64::INFINITY, |parameter| parameter.typical.1.abs());
            value.abs() > UNTYPICAL * most.max(model.abs())
        };
        Usual {
            is_at_bound: doubts::is_at_bound(candidate, &values),
            is_untypical: own.any(is_untypical),
            kind: candidate.cause.kind,
        }
    }

    /// Puts `leader`, a rival of `member`, in the place of the best, which becomes a rival unless it `is_out`; its new cause stands
    /// last.
    pub(crate) fn lead(&mut self, member: usize, leader: Fit, is_out: bool) {
        let Some(best) = self.best.take() else { return };
        let same = |fit: &Fit| fit.causes == leader.causes;
        let mut rivals = without(&self.rivals, member);
        let others = self.rivals[member].iter().filter(|fit| !same(fit)).cloned();
        let before = (!is_out).then(|| best.clone());
        rivals.push(before.into_iter().chain(others).collect());
        let mut evidence = without(&self.evidence, member);
        evidence.push(self.evidence[member] - (leader.state.chi2 - best.state.chi2));
        (self.rivals, self.evidence, self.best) = (rivals, evidence, Some(leader));
    }
}

/// Rivals that stand in the place of one cause, beside the others, with that place.
pub(crate) fn in_one_place(attribution: &Attribution) -> impl Iterator<Item = (usize, &Fit)> {
    let rivals = attribution.rivals.iter().enumerate();
    let each = rivals.flat_map(|(member, fits)| fits.iter().map(move |fit| (member, fit)));
    each.filter(|(member, fit)| (attribution.best.as_ref()).is_some_and(|best| stands_for(fit, best, *member)))
}

/// Whether a rival has all of the best's causes but one, and its own last.
fn stands_for(rival: &Fit, best: &Fit, member: usize) -> bool {
    let kept = without(&best.causes, member);
    rival.causes.len() == kept.len() + 1 && rival.causes.starts_with(&kept)
}

fn without<T: Clone>(list: &[T], member: usize) -> Vec<T> {
    let mut kept = list.to_vec();
    kept.remove(member);
    kept
}

/// Takes out what ends where it is cut off: a steep fall of the inductance below every current is another inductance, and no explanation of
/// its own.
pub fn leave_out_cut_off(attribution: &mut Attribution) {
    let candidates = &attribution.candidates;
    let is_cut_off = |fit: &Fit| {
        let mut rest = &fit.values[..];
        fit.causes.iter().any(|cause| {
            let candidate = &candidates[*cause];
            let (own, others) = rest.split_at(candidate.own.len().min(rest.len()));
            rest = others;
            doubts::is_at_bound(candidate, own)
        })
    };
    for rivals in &mut attribution.rivals {
        rivals.retain(|fit| !is_cut_off(fit));
    }
}

/// Widens the intervals of causes that move the gate's edges by what stands beside every fit for the edges: of on-time that is lost or won,
/// nobody knows which part is whose. Only away from the model's own value, for what the trim takes back is less of the cause and not another.
pub fn widen_by_edges(problem: &Problem, attribution: &Attribution, profiles: &mut [Profile]) {
    let Some(best) = &attribution.best else { return };
    let converter = &problem.base.plant.converter;
    let late = best.state.starts.trim_or_none(converter.f_sw) * problem.bases.t_sw;
    for profile in profiles.iter_mut() {
        let Some(candidate) = best
            .causes
            .get(profile.member)
            .map(|cause| &attribution.candidates[*cause])
        else {
            continue;
        };
        let knobs = candidate.form.knobs.iter().zip(&candidate.ranges);
        for (knob, [low, high, _]) in knobs.filter(|(knob, _)| knob.name == profile.name) {
            // what ends a pulse late makes it longer; dead time, and what begins it late, shorter
            let by = match knob.keys {
                ["switch.turn_off_delay"] => late,
                ["switch.turn_on_delay" | "switch.dead_time"] => -late,
                _ => continue,
            };
            let [below, above] = &mut profile.interval;
            match profile.value > profile.own {
                true => *above = (*above + by.max(0.0)).min(*high),
                false => *below = (*below + by.min(0.0)).max(*low),
            }
        }
    }
}

/// Widens the interval of each parameter to the union over the explanations that have it: which of them is true, nobody knows.
pub fn widen(attribution: &Attribution, profiles: &mut [Profile]) {
    let Some(best) = &attribution.best else { return };
    let places: Vec<(usize, usize)> = (best.causes.iter())
        .flat_map(|cause| (0..attribution.candidates[*cause].own.len()).map(|k| (*cause, k)))
        .collect();
    if places.len() != profiles.len() {
        return;
    }
    for rival in attribution.rivals.iter().flatten() {
        let mut first = 0;
        for cause in &rival.causes {
            let candidate = &attribution.candidates[*cause];
            let ranges = candidate.ranges.iter().enumerate();
            let own: Vec<[f64; 2]> = ranges
                .map(|(k, range)| interval(attribution, rival, first + k, *range))
                .collect();
            first += own.len();
            // beside another it may be nothing, and that other is what stands in its place
            let mut sizes = own.iter().zip(&candidate.own).take(candidate.sizes());
            if candidate.sizes() > 0 && sizes.all(|([low, high], own)| (low..=high).contains(&own)) {
                continue;
            }
            for (k, [low, high]) in own.into_iter().enumerate() {
                if let Some(profile) = places.iter().position(|known| *known == (*cause, k)) {
                    let interval = &mut profiles[profile].interval;
                    *interval = [interval[0].min(low), interval[1].max(high)];
                }
            }
        }
    }
}
