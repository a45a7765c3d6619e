//! Profile likelihood: how well the data hold each parameter when all others may follow.

use std::cell::RefCell;

use crate::attribute::Attribution;
use crate::causes::{Candidate, Search};
use crate::exact::Exact;
use crate::fit::Fit;
use crate::level::ACCURACY;
use crate::problem::Problem;
use crate::progress::{self, Listener};

/// 95 % of a chi-square of one degree of freedom.
pub(crate) const LEVEL: f64 = 3.841;
/// The same in standard deviations.
const TWO_SIDED: f64 = 1.96;
/// Values that are tried beside those of [`PLACES`] until one lies near the end of an interval. A flat curve is doubled, to more than 16
/// standard deviations; flatter still, the interval is said to reach the bound. A convention.
const FURTHER: usize = 4;
/// As near to [`TWO_SIDED`], in standard deviations, the curve between two values is a parabola for every purpose. A convention.
const NEAR: f64 = 0.35;
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
/// that of the explanation, its fit had not come to its end: it goes on from there. Behind the end of the budget they are [`parabolas`].
#[must_use]
pub fn profiles(problem: &Problem, attribution: &mut Attribution, say: Listener<'_>) -> Vec<Profile> {
    if attribution.best.is_none() || !problem.work.may_seek_intervals() {
        return parabolas(problem, attribution);
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
            return parabolas(problem, attribution);
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
    let places = fitter.places(&best.causes);
    let numbers: Vec<usize> = (0..places.len()).collect();
    let each = progress::map(say, "intervals", &numbers, |number| {
        let place = places[*number];
        let candidate = &attribution.candidates[place.0];
        let knob = &candidate.form.knobs[place.1];
        let value = best.values[*number];
        let mut profile = Profile {
            member: best.causes.iter().position(|cause| *cause == place.0).unwrap_or(0),
            name: knob.name,
            unit: knob.unit(),
            value,
            interval: [value, value],
            own: candidate.own[place.1],
            curve: vec![(value, 0.0)],
        };
        let [low, high, step] = fitter.range(place);
        let sigma = (best.covariance[*number][*number] * attribution.inflation).sqrt();
        let sigma = scale(candidate, sigma, step);
        let lower: RefCell<Option<Fit>> = RefCell::new(None);
        let at_value = |x: f64| {
            let mut values = best.values.clone();
            values[*number] = x;
            let fit = fitter.holding(&best.causes, &values, &best.state, Some(*number));
            let cost = (fit.state.chi2 - best.state.chi2) / attribution.inflation;
            let least = lower
                .borrow()
                .as_ref()
                .map_or(best.state.chi2 - BETTER * attribution.inflation, |fit| fit.state.chi2);
            if fit.state.chi2 < least {
                lower.replace(Some(fit));
            }
            cost.max(0.0)
        };
        if matches!(candidate.form.search, Search::Counter(_)) {
            profile.interval = [-1.0, 1.0].map(|side| alike(value, side, &at_value));
        }
        if !fitter.is_smooth(place) {
            return (profile, None);
        }
        for at in PLACES {
            let x = (value + at * sigma).clamp(low, high);
            profile.curve.push((x, at_value(x)));
        }
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let none = profile.own - value;
            // without the cause, chi-square is what its evidence says: the interval ends before that
            let is_size = place.1 < candidate.sizes() && candidate.sizes() == 1 && none.signum() == sign;
            let lost = attribution.evidence.get(profile.member).filter(|_| is_size);
            let lost = lost.map(|lost| (profile.own, lost / attribution.inflation));
            let mut side_of = Side {
                value,
                sign,
                range: [low, high],
                inner: (value, 0.0),
                outer: lost.filter(|end| end.1 > LEVEL),
            };
            let end = side_of.end(&mut profile.curve, &at_value);
            // a simulator that is off by a share of a response puts the parameter off by that share of its change
            let systematic = TWO_SIDED * ACCURACY * none;
            // noise and the simulator's error have nothing to do with each other: they add in squares
            let reach = sign * (end - value).hypotenuse(systematic);
            profile.interval[side] = (value + reach).clamp(low, high);
        }
        profile.curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        (profile, lower.into_inner())
    });
    let (profiles, lower): (Vec<Profile>, Vec<Option<Fit>>) = each.into_iter().unzip();
    let lowest = lower
        .into_iter()
        .flatten()
        .min_by(|a, b| a.state.chi2.total_cmp(&b.state.chi2));
    (profiles, lowest)
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
        let reach = TWO_SIDED
            * (best.covariance[number][number] * attribution.inflation)
                .max(0.0)
                .sqrt();
        Profile {
            member: best.causes.iter().position(|cause| *cause == place.0).unwrap_or(0),
            name: knob.name,
            unit: knob.unit(),
            value,
            interval: [value - reach, value + reach].map(|end| end.clamp(low, high)),
            own: candidate.own[place.1],
            curve: vec![(value, 0.0)],
        }
    };
    fitter.places(&best.causes).iter().enumerate().map(of).collect()
}

/// The curve on one side of the best value.
struct Side {
    value: f64,
    /// 1 above the value, -1 below.
    sign: f64,
    range: [f64; 2],
    /// The farthest value known that costs less than [`LEVEL`], and its cost.
    inner: (f64, f64),
    /// The nearest that costs more, if one is known.
    outer: Option<(f64, f64)>,
}

impl Side {
    /// Where the cost comes to [`LEVEL`]. What is tried is added to the curve.
    // the parabola of the covariance alone would do where the curve is one; two parameters that do nearly the same follow each other along
    // a bent valley, and the curve is steeper on one side
    fn end(&mut self, curve: &mut Vec<(f64, f64)>, cost: &dyn Fn(f64) -> f64) -> f64 {
        for point in curve.iter() {
            self.learn(*point);
        }
        for _ in 0..FURTHER {
            let Some(next) = self.next() else { break };
            let point = (next, cost(next));
            curve.push(point);
            self.learn(point);
        }
        let (x, cost) = self.inner;
        match self.outer {
            Some(_) => self.crossing(),
            None if self.is_at_end(x) => x,
            // below a third of what one standard deviation costs, after all doublings: no data on this side
            None if cost > 0.3 => self.by_parabola().clamp(self.range[0], self.range[1]),
            None => self.range[usize::from(self.sign > 0.0)],
        }
    }

    fn distance(&self, x: f64) -> f64 {
        self.sign * (x - self.value)
    }

    fn is_at_end(&self, x: f64) -> bool {
        x <= self.range[0] && self.sign < 0.0 || x >= self.range[1] && self.sign > 0.0
    }

    fn learn(&mut self, (x, cost): (f64, f64)) {
        let is_before = |outer: (f64, f64)| self.distance(x) < self.distance(outer.0);
        if self.distance(x) <= 0.0 || !self.outer.is_none_or(is_before) {
            return;
        }
        match cost < LEVEL {
            true if self.distance(x) > self.distance(self.inner.0) => self.inner = (x, cost),
            true => {}
            false => self.outer = Some((x, cost)),
        }
        // a curve that rises and falls again ends where it first comes to the level
        if self.distance(self.inner.0) >= self.outer.map_or(f64::INFINITY, |outer| self.distance(outer.0)) {
            self.inner = (self.value, 0.0);
        }
    }

    /// The value to try next; none where the end is known well enough.
    fn next(&self) -> Option<f64> {
        let (x, cost) = self.inner;
        let Some(outer) = self.outer else {
            let next = (self.value + 2.0 * (x - self.value)).clamp(self.range[0], self.range[1]);
            return (!self.is_at_end(x) && next != x).then_some(next);
        };
        let is_near = TWO_SIDED - cost.sqrt() < NEAR || outer.1.sqrt() - TWO_SIDED < NEAR;
        let next = self.crossing();
        (!is_near && next != x && next != outer.0).then_some(next)
    }

    /// The parabola through the best value and the farthest one, carried to the level.
    fn by_parabola(&self) -> f64 {
        let (x, cost) = self.inner;
        self.value + (x - self.value) * (LEVEL / cost).sqrt()
    }

    /// Where the curve crosses the level: between two values that are not far from each other, else by the parabola, or between them where
    /// that leads beyond what is known to cost more.
    fn crossing(&self) -> f64 {
        let (x, cost) = self.inner;
        let Some((far, more)) = self.outer else {
            return self.by_parabola();
        };
        let is_wide = self.distance(far) > 2.0 * self.distance(x);
        let carried = self.by_parabola();
        if is_wide && cost > 0.0 && self.distance(carried) < self.distance(far) {
            return carried;
        }
        let (near, beyond) = (cost.sqrt(), more.sqrt());
        x + (far - x) * (TWO_SIDED - near) / (beyond - near)
    }
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
    use super::{LEVEL, PLACES, Side, alike};

    /// The end of an interval around 0 of a curve whose covariance says 1.
    fn end(sign: f64, range: [f64; 2], outer: Option<(f64, f64)>, cost: &dyn Fn(f64) -> f64) -> (f64, usize) {
        let places = PLACES.map(|x| x.clamp(range[0], range[1]));
        let mut curve: Vec<(f64, f64)> = places.map(|x| (x, cost(x))).to_vec();
        let mut side = Side {
            value: 0.0,
            sign,
            range,
            inner: (0.0, 0.0),
            outer,
        };
        let found = side.end(&mut curve, cost);
        (found, curve.len() - places.len())
    }

    #[test]
    fn an_interval_ends_where_the_cost_comes_to_the_level_whatever_the_curve() {
        const WIDE: [f64; 2] = [-100.0, 100.0];
        let level = LEVEL.sqrt();
        for sign in [-1.0, 1.0] {
            let (found, tried) = end(sign, WIDE, None, &|x| x * x);
            assert!((found - sign * level).abs() < 0.01 && tried == 0, "{found}, {tried}");
            // steeper on the far side of one standard deviation, as where another parameter is at its end
            let bent = |x: f64| x * x + 30.0 * (x.abs() - 1.0).max(0.0).powi(2);
            let (found, _) = end(sign, WIDE, None, &bent);
            assert!((bent(found) - LEVEL).abs() < 0.6, "{found}: {}", bent(found));
            // flatter than at its lowest point
            let flat = |x: f64| 0.02 * x * x;
            let (found, _) = end(sign, WIDE, None, &flat);
            assert!((flat(found) - LEVEL).abs() < 0.1, "{found}");
            let (found, _) = end(sign, WIDE, None, &|x| 1e-9 * x.abs());
            assert_eq!(found, 100.0 * sign);
            let (found, _) = end(sign, [-1.5, 1.5], None, &|x| x * x);
            assert_eq!(found, 1.5 * sign, "cut off");
        }
        // without the cause chi-square is far worse, which says nothing of how flat the curve is beside the value
        let (found, _) = end(-1.0, WIDE, Some((-30.0, 1e6)), &|x| x * x);
        assert!((found + level).abs() < 0.01, "{found}");
        // ... and where the curve is flat all the way, the interval ends before it
        let (found, _) = end(-1.0, WIDE, Some((-3.0, 20.0)), &|x| 0.1 * x * x);
        assert!(found > -3.0 && found < -1.3, "{found}");
    }

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
