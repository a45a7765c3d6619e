//! Profile likelihood: how well the data hold each parameter when all others may follow.

mod scatter;
mod side;

use std::cell::{Cell, RefCell};

use crate::attribute::Attribution;
use crate::causes::Candidate;
use crate::exact::Exact;
use crate::fit::{Fit, Fitter};
use crate::problem::Problem;
use crate::progress::{self, Listener};
use side::Side;

/// 95 % of a chi-square of one degree of freedom.
pub(crate) const LEVEL: f64 = 3.841;
/// The same in standard deviations.
const TWO_SIDED: f64 = 1.96;
/// How far beside the best the counts of a duty counter are tried: doubled from a shift so small that hardly a
/// duty is rounded to another count. Conventions.
const LEAST_COUNTS: f64 = 5e-3;
const MOST_COUNTS: f64 = 10.0;
/// A value that lowers chi-square by this, over the scatter of the noise, is a better fit: an interval ends at 3.84, and is off by a
/// fifteenth of its width for that much.
const BETTER: f64 = 0.5;
/// How often a fit goes on from such a value. A convention: each costs the intervals again.
const ENDS: usize = 3;
/// Places of the profile, in standard deviations: the 95 % interval of a parabola ends at 1.96, so that the outer ones need hardly
/// be extended, and the inner ones show whether it is one.
const PLACES: [f64; 4] = [-2.0, -1.0, 1.0, 2.0];
/// The place that is tried first.
const FIRST: f64 = 1.0;
/// Standard deviation of what two simulators of one circuit make of one parameter, as a share of its change. Of the parameters of which [`crate::level::ACCURACY`]
/// had made most of the interval, 20 of 23 in ngspice's data lie within 1.96 of it, and 88 of 95 in those of a simulator of exact pieces; noise adds to that.
const SIMULATORS: f64 = 0.002;

/// The profile of one parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Which cause of the set.
    pub member: usize,
    /// Name of the parameter.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Best value.
    pub value: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// The model's own value.
    pub own: f64,
    /// Values and how much chi-square they cost, over the scatter of the noise.
    pub curve: Vec<(f64, f64)>,
}

impl Profile {
    /// Of a parameter of which only the value is known as yet.
    #[must_use]
    pub(crate) fn at(member: usize, value: f64) -> Self {
        Profile {
            member,
            name: "",
            unit: "",
            value,
            interval: [value, value],
            own: value,
            curve: Vec::new(),
        }
    }

    /// Whether the model's own value lies in the interval.
    #[must_use]
    pub fn holds_own(&self) -> bool {
        self.interval[0] <= self.own && self.own <= self.interval[1]
    }
}

/// Profiles of all parameters of the best explanation. The intervals allow for the accuracy of the plant too. Where another value fits better than
/// that of the explanation, its fit had not come to its end: it goes on from there. Behind the end of the budget they are [`parabolas`], where there is one.
#[must_use]
pub fn profiles(problem: &Problem, attribution: &mut Attribution, say: Listener<'_>) -> Vec<Profile> {
    if attribution.best.is_none() || !problem.work.may_seek_intervals() {
        return behind_the_budget(problem, attribution);
    }
    let mut found = of_best(problem, attribution, say);
    for _ in 0..ENDS {
        let (Some(best), Some(lower)) = (&attribution.best, found.1) else {
            break;
        };
        let fit = attribution
            .fitter(problem)
            .from(&best.causes, &lower.values, &lower.state);
        attribution.best = Some(if fit.state.chi2 < lower.state.chi2 { fit } else { lower });
        if !problem.work.may_seek_intervals() {
            return behind_the_budget(problem, attribution);
        }
        found = of_best(problem, attribution, say);
    }
    found.0
}

/// Profiles around where the explanation stands, and the fit that is better than it by most, if one is.
fn of_best(problem: &Problem, attribution: &Attribution, say: Listener<'_>) -> (Vec<Profile>, Option<Fit>) {
    let Some(best) = &attribution.best else {
        return (Vec::new(), None);
    };
    let fitter = attribution.fitter(problem);
    let numbers: Vec<usize> = (0..fitter.places(&best.causes).len()).collect();
    let each = progress::map(say, "intervals", &numbers, |number| {
        let along = Along::new(&fitter, best, *number, attribution.inflation);
        let profile = along.profile(attribution);
        (profile, along.lower.into_inner())
    });
    let (profiles, lower): (Vec<Profile>, Vec<Option<Fit>>) = each.into_iter().unzip();
    let lowest = lower
        .into_iter()
        .flatten()
        .min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
    (profiles, lowest)
}

/// One parameter moved, all others following.
struct Along<'a> {
    fitter: &'a Fitter<'a>,
    best: &'a Fit,
    number: usize,
    inflation: f64,
    /// The parameter's variance over that of the noise assumed.
    scatter: Cell<f64>,
    /// The best fit on the way that is better than the best.
    lower: RefCell<Option<Fit>>,
}

impl<'a> Along<'a> {
    fn new(fitter: &'a Fitter<'a>, best: &'a Fit, number: usize, inflation: f64) -> Self {
        Along {
            fitter,
            best,
            number,
            inflation,
            scatter: Cell::new(1.0),
            lower: RefCell::new(None),
        }
    }

    fn at(&self, x: f64) -> Fit {
        let mut values = self.best.values.clone();
        values[self.number] = x;
        let (best, number) = (self.best, Some(self.number));
        self.fitter.holding(&best.causes, &values, &best.state, number)
    }

    /// What a value costs, over the scatter of the noise.
    fn cost(&self, x: f64) -> f64 {
        self.cost_of(self.at(x))
    }

    fn cost_of(&self, fit: Fit) -> f64 {
        let best = self.best.state.chi2;
        let cost = (fit.state.chi2 - best) / self.inflation / self.scatter.get();
        let mut lower = self.lower.borrow_mut();
        let least = lower
            .as_ref()
            .map_or(best - BETTER * self.inflation, |fit| fit.state.chi2);
        if fit.state.chi2 < least {
            *lower = Some(fit);
        }
        cost.max(0.0)
    }

    fn profile(&self, attribution: &Attribution) -> Profile {
        let place = self.fitter.places(&self.best.causes)[self.number];
        let candidate = &attribution.candidates[place.0];
        let knob = &candidate.form.knobs[place.1];
        let value = self.best.values[self.number];
        let mut profile = Profile {
            member: self.best.causes.iter().position(|cause| *cause == place.0).unwrap_or(0),
            name: knob.name,
            unit: knob.unit(),
            value,
            interval: [value, value],
            own: candidate.own[place.1],
            curve: vec![(value, 0.0)],
        };
        let cost = |x: f64| self.cost(x);
        if candidate.form.cut().is_some() {
            profile.interval = [-1.0, 1.0].map(|side| alike(value, side, &cost));
        }
        if !self.fitter.is_smooth(place) {
            return profile;
        }
        let [low, high, step] = self.fitter.range(place);
        self.sample(&mut profile, candidate, [low, high, step]);
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let none = profile.own - value;
            // without the cause, chi-square is what its evidence says: the interval ends before that
            let is_size = place.1 < candidate.sizes() && candidate.sizes() == 1 && none.signum() == sign;
            let lost = attribution.evidence.get(profile.member).filter(|_| is_size);
            let lost = lost.map(|lost| (profile.own, lost / self.inflation / self.scatter.get()));
            let mut side_of = Side {
                value,
                sign,
                range: [low, high],
                inner: (value, 0.0),
                outer: lost.filter(|end| end.1 > LEVEL),
            };
            let end = side_of.end(&mut profile.curve, &cost);
            // a simulator that is off by a share of a response puts the parameter off by that share of its change
            let systematic = TWO_SIDED * SIMULATORS * none;
            // noise and the simulator's error have nothing to do with each other: they add in squares
            let reach = sign * (end - value).hypotenuse(systematic);
            profile.interval[side] = (value + reach).clamp(low, high);
        }
        profile.curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        profile
    }

    /// The curve at its [`PLACES`]; the first of them shows which channels hold the parameter, and so how it scatters.
    fn sample(&self, profile: &mut Profile, candidate: &Candidate, [low, high, step]: [f64; 3]) {
        let sigma = (self.best.covariance[self.number][self.number] * self.inflation).sqrt();
        let sigma = scale(candidate, sigma, step);
        let value = profile.value;
        let place = |share: f64, sigma: f64| (value + share * sigma).clamp(low, high);
        let first = place(FIRST, sigma);
        let fit = self.at(first);
        let moved = scatter::of(
            self.fitter.problem,
            &self.best.state.residual,
            &fit.state.residual,
            self.best.values.len(),
        );
        self.scatter.set(moved);
        profile.curve.push((first, self.cost_of(fit)));
        let sigma = sigma * self.scatter.get().sqrt();
        for share in PLACES {
            let x = place(share, sigma);
            if x != first {
                profile.curve.push((x, self.cost(x)));
            }
        }
    }
}

/// At which other values are tried, as a standard deviation of the parameter: `sigma` is what the covariance says, `step` the knob's own.
fn scale(candidate: &Candidate, sigma: f64, step: f64) -> f64 {
    match sigma > 0.0 {
        // a tangent next to that of the trim: what the two differ by is their curvature, and tells the covariance too much
        true if candidate.is_of_edges() => sigma.max(step),
        true => sigma,
        // the fit held it at an end, or it had no slope
        false => step,
    }
}

/// [`parabolas`], and the curve itself of a parameter that has none: a counter, or one that the fit held at an end. A few fits.
#[must_use]
pub fn behind_the_budget(problem: &Problem, attribution: &Attribution) -> Vec<Profile> {
    let mut all = parabolas(problem, attribution);
    let Some(best) = &attribution.best else { return all };
    let fitter = attribution.fitter(problem);
    for (number, profile) in all.iter_mut().enumerate() {
        // no variance is no certainty: without this its interval would be a point
        if best.covariance[number][number] <= 0.0 {
            *profile = Along::new(&fitter, best, number, attribution.inflation).profile(attribution);
        }
    }
    all
}

/// What covariances say of the parameters: intervals without a fit.
#[must_use]
pub fn parabolas(problem: &Problem, attribution: &Attribution) -> Vec<Profile> {
    let Some(best) = &attribution.best else {
        return Vec::new();
    };
    let fitter = attribution.fitter(problem);
    let of = |(number, place): (usize, &(usize, usize))| {
        let candidate = &attribution.candidates[place.0];
        let knob = &candidate.form.knobs[place.1];
        let (value, [low, high, _]) = (best.values[number], fitter.range(*place));
        let own = candidate.own[place.1];
        let variance = (best.covariance[number][number] * attribution.inflation).max(0.0);
        let reach = TWO_SIDED * variance.sqrt().hypotenuse(SIMULATORS * (value - own));
        Profile {
            member: best.causes.iter().position(|cause| *cause == place.0).unwrap_or(0),
            name: knob.name,
            unit: knob.unit(),
            value,
            interval: [value - reach, value + reach].map(|end| end.clamp(low, high)),
            own,
            curve: vec![(value, 0.0)],
        }
    };
    fitter.places(&best.causes).iter().enumerate().map(of).collect()
}

/// How far a step of a duty counter may be off on one side: within a piece of equal counts the cost grows smoothly, at its end
/// it jumps.
fn alike(step: f64, side: f64, cost: &dyn Fn(f64) -> f64) -> f64 {
    let moved = |counts: f64| (step.recip() - side * counts).recip();
    let (mut reached, mut counts) = (0.0, LEAST_COUNTS);
    while counts < MOST_COUNTS && moved(counts) > 0.0 {
        let cost = cost(moved(counts));
        if cost > LEVEL {
            let within = counts * (LEVEL / cost).sqrt();
            // not short of a shift that was tried and allowed
            return moved(within.max(reached));
        }
        reached = counts;
        counts *= 2.0;
    }
    moved(reached)
}

#[cfg(test)]
mod tests {
    use super::alike;

    #[test]
    fn a_counter_may_be_off_to_where_the_cost_is_reached_or_jumps() {
        // a count of 50 with a standard deviation of 0.1
        let smooth = |step: f64| ((step.recip() - 50.0) / 0.1).powi(2);
        let low = alike(1.0 / 50.0, -1.0, &smooth);
        assert!((low.recip() - 50.196).abs() < 0.01, "{}", low.recip());
        let jump = |step: f64| if step.recip() < 49.9 { 1e3 } else { 0.0 };
        let high = alike(1.0 / 50.0, 1.0, &jump).recip();
        assert!((49.9..49.95).contains(&high), "{high}");
    }
}
