//! A tie as a reader needs it: which member leads, the values that every member has, and intervals that hold whichever is true.

use serde::Serialize;

use crate::attribute::{Attribution, searcher};
use crate::causes::Kind;
use crate::doubts;
use crate::fit::{Fit, State};
use crate::problem::Problem;
use crate::profile::Profile;
use crate::progress::{self, Listener};
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

/// Among explanations of as many causes that the data cannot put in order the most usual one leads, of these the one with the fewest numbers:
/// copper and diode before the gain of a probe and a counter of few counts, one conductance before a gain for each resistor. What it replaces
/// becomes its rival. One that ends at the limit of what is tried leads nothing that another explains as well: it is no explanation, and no rival
/// either.
pub fn most_usual_first(problem: &Problem, attribution: &mut Attribution, say: Listener<'_>) {
    let crossed = crossed(problem, attribution, say);
    for (member, fit) in crossed {
        attribution.rivals[member].push(fit);
    }
    let Some(best) = &attribution.best else { return };
    let own = attribution.least_usual_first(best);
    let is_out = |of: &[Usual]| of.first().is_some_and(|least| least.is_at_bound);
    let price = libm::log(problem.count() as f64);
    // a rival lies within a tie, whatever one gains that may not go on; a number less is worth what the search asks for a number more
    let worst = |fit: &Fit| match is_out(&own) {
        true => f64::INFINITY,
        false => {
            let fewer = best.values.len().saturating_sub(fit.values.len()) as f64;
            best.state.chi2 + LEVEL * attribution.inflation + price * fewer
        }
    };
    let leads = |(fit, usual): &(&Fit, Vec<Usual>)| {
        fit.causes.len() == best.causes.len()
            && (usual, fit.values.len()) < (&own, best.values.len())
            && fit.state.chi2 <= worst(fit)
            && structures(problem, &attribution.null, &fit.state, attribution.inflation).is_empty()
    };
    let all = attribution.rivals.iter().flatten();
    let found = all.map(|fit| (fit, attribution.least_usual_first(fit))).filter(leads);
    let order = |a: &(&Fit, Vec<Usual>), b: &(&Fit, Vec<Usual>)| {
        let numbers = a.0.values.len().cmp(&b.0.values.len());
        (a.1.cmp(&b.1).then(numbers)).then(a.0.state.chi2.total_cmp(&b.0.state.chi2))
    };
    let Some((leader, usual)) = found.min_by(order).map(|(fit, usual)| (fit.clone(), usual)) else {
        return;
    };
    let is_out = is_out(&own) && !is_out(&usual);
    let shared = |fit: &Fit| leader.causes.iter().filter(|cause| fit.causes.contains(cause)).count();
    let is_of_one = shared(best) + 1 == leader.causes.len();
    attribution.lead(leader, is_out);
    if !is_of_one {
        // nothing of the evidence was for these
        attribution.weigh_again(problem, say);
    }
}

/// Sets with the most usual rivals of two causes in the places of both, where that is more usual than what leads: each was tried beside the other cause
/// alone. With the place of the first.
fn crossed(problem: &Problem, attribution: &Attribution, say: Listener<'_>) -> Vec<(usize, Fit)> {
    let Some(best) = &attribution.best else {
        return Vec::new();
    };
    let mut each: Vec<(usize, usize, &Fit)> = in_one_place(attribution).collect();
    each.sort_by_cached_key(|(member, other, fit)| (*member, attribution.usual(fit, *other)));
    let two = each
        .iter()
        .enumerate()
        .flat_map(|(n, one)| each[n + 1..].iter().map(move |other| (one, other)));
    let is_new = |(one, other): &(&(usize, usize, &Fit), &(usize, usize, &Fit))| {
        let rank = |of: &(usize, usize, &Fit)| {
            each.iter()
                .filter(|known| known.0 == of.0)
                .position(|known| known.1 == of.1)
        };
        let is_first = |of| rank(of).is_some_and(|place| place < CROSSED);
        one.0 != other.0 && !attribution.same(one.1, other.1) && is_first(one) && is_first(other)
    };
    let sets: Vec<_> = two.filter(is_new).collect();
    let fitter = attribution.fitter(problem);
    let search = searcher(
        problem,
        &attribution.candidates,
        &attribution.basis,
        &attribution.null,
        say,
    );
    let fits = progress::map(say, "rivals of two causes", &sets, |(one, other)| {
        let own = |cause: usize, fit: &Fit| {
            let places = fitter.places(&fit.causes);
            let values = places
                .iter()
                .zip(&fit.values)
                .filter(move |(place, _)| place.0 == cause);
            values.map(|(_, value)| *value).collect::<Vec<f64>>()
        };
        let member = |(member, cause): (usize, &usize)| match member {
            _ if member == one.0 => (one.1, own(one.1, one.2)),
            _ if member == other.0 => (other.1, own(other.1, other.2)),
            _ => (*cause, own(*cause, best)),
        };
        let (causes, values): (Vec<usize>, Vec<Vec<f64>>) = best.causes.iter().enumerate().map(member).unzip();
        // where the rival has them: what the edges do of themselves would be the trim's again
        let begun = State {
            model: attribution.null.model.clone(),
            ..one.2.state.clone()
        };
        (
            one.0,
            search.without_trim(fitter.from(&causes, &values.concat(), &begun)),
        )
    });
    let usual = attribution.least_usual_first(best);
    let worst = best.state.chi2 + LEVEL * attribution.inflation;
    let leads = |(_, fit): &(usize, Fit)| fit.state.chi2 <= worst && attribution.least_usual_first(fit) < usual;
    fits.into_iter().filter(leads).collect()
}

/// Rivals of each place that are tried in two places at once, the most usual ones. A convention: each pair of them costs a fit.
const CROSSED: usize = 2;

/// How usual a cause with its values is, the most usual first.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
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
        let mut own = (values.iter().zip(&candidate.own)).zip(candidate.form.knobs.iter().zip(&candidate.ranges));
        Usual {
            is_at_bound: doubts::is_at_bound(candidate, &values),
            is_untypical: own.any(|((value, model), (knob, range))| knob.is_untypical(*value, *model, range)),
            kind: candidate.cause.kind,
        }
    }

    /// How usual the causes of a set are, the least usual first: an explanation is as usual as that.
    fn least_usual_first(&self, fit: &Fit) -> Vec<Usual> {
        let mut list: Vec<Usual> = fit.causes.iter().map(|cause| self.usual(fit, *cause)).collect();
        list.sort_by(|a, b| b.cmp(a));
        list
    }

    /// Whether something that is as usual could stand in the place of the whole of a cause.
    pub(crate) fn could_be_another(&self, member: usize) -> bool {
        let Some(best) = &self.best else { return false };
        let own = self.usual(best, best.causes[member]);
        let is_new = |cause: &&usize| best.causes.iter().all(|known| !self.same(*known, **cause));
        self.rivals[member].iter().any(|fit| {
            let is_whole = fit.causes.iter().all(|cause| !self.same(*cause, best.causes[member]));
            let mut new = fit.causes.iter().filter(is_new);
            is_whole && new.all(|cause| self.usual(fit, *cause) <= own)
        })
    }

    /// Puts `leader`, one of the rivals, in the place of the best, which becomes a rival unless it `is_out`. Each rival stands at the first cause
    /// that it has not.
    pub(crate) fn lead(&mut self, leader: Fit, is_out: bool) {
        let Some(best) = self.best.take() else { return };
        let more = leader.state.chi2 - best.state.chi2;
        let place = |cause: &usize| best.causes.iter().position(|known| known == cause);
        let old: Vec<Option<usize>> = leader.causes.iter().map(place).collect();
        let replaced = (0..best.causes.len()).find(|member| !leader.causes.contains(&best.causes[*member]));
        let of_replaced = replaced.map_or(0.0, |member| self.evidence[member]) - more;
        let evidence = old
            .iter()
            .map(|place| place.map_or(of_replaced, |place| self.evidence[place]));
        self.evidence = evidence.collect();
        let mut rivals = vec![Vec::new(); leader.causes.len()];
        let before = (!is_out).then_some((usize::MAX, best));
        let others = std::mem::take(&mut self.rivals).into_iter().enumerate();
        let others = others.flat_map(|(member, fits)| fits.into_iter().map(move |fit| (member, fit)));
        for (member, fit) in before.into_iter().chain(others) {
            let lacks = |cause: &usize| fit.causes.iter().all(|own| !self.same(*own, *cause));
            // what has all of them and more stands beside one of them, if it is still there
            let own = leader.causes.iter().position(lacks);
            let Some(place) = own.or_else(|| old.iter().position(|place| *place == Some(member))) else {
                continue;
            };
            if fit.causes.len() != leader.causes.len() || own.is_some() {
                rivals[place].push(fit);
            }
        }
        (self.rivals, self.best) = (rivals, Some(leader));
    }

    /// The evidence of each cause: chi-square lost without it.
    fn weigh_again(&mut self, problem: &Problem, say: Listener<'_>) {
        let Some(best) = &self.best else { return };
        let members: Vec<usize> = (0..best.causes.len()).collect();
        let lost = progress::map(say, "evidence", &members, |member| {
            let kept = without(&best.causes, *member);
            let own = kept.iter().flat_map(|cause| self.candidates[*cause].own.clone());
            let fit = self.fitter(problem).from(&kept, &own.collect::<Vec<f64>>(), &self.null);
            fit.state.chi2 - best.state.chi2
        });
        self.evidence = lost;
    }
}

/// Rivals that stand in the place of one cause, beside the others, with that place and the cause that stands there.
pub(crate) fn in_one_place(attribution: &Attribution) -> impl Iterator<Item = (usize, usize, &Fit)> {
    let rivals = attribution.rivals.iter().enumerate();
    let each = rivals.flat_map(|(member, fits)| fits.iter().map(move |fit| (member, fit)));
    each.filter_map(|(member, fit)| {
        let kept = without(&attribution.best.as_ref()?.causes, member);
        let is_kept = kept.iter().all(|cause| fit.causes.contains(cause));
        let other = fit.causes.iter().find(|cause| !kept.contains(cause));
        (is_kept && fit.causes.len() == kept.len() + 1).then_some((member, *other?, fit))
    })
}

fn without<T: Clone>(list: &[T], member: usize) -> Vec<T> {
    let mut kept = list.to_vec();
    kept.remove(member);
    kept
}

/// Sorts what could stand in each place, the most usual first: a reader is told the first of a list.
pub fn sort_by_use(attribution: &mut Attribution) {
    let mut rivals = std::mem::take(&mut attribution.rivals);
    for list in &mut rivals {
        list.sort_by_cached_key(|fit| {
            let numbers = fit.values.len();
            (fit.causes.len(), attribution.least_usual_first(fit), numbers)
        });
    }
    attribution.rivals = rivals;
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
