//! Profile likelihood: how well the data hold each parameter when all others may follow.

use crate::attribute::Attribution;
use crate::causes::Search;
use crate::exact::Exact;
use crate::level::ACCURACY;
use crate::problem::Problem;
use crate::progress::{self, Listener};

/// 95 % of a chi-square of one degree of freedom.
const LEVEL: f64 = 3.841;
/// The same in standard deviations.
const TWO_SIDED: f64 = 1.96;
/// How often the reach of a flat curve is doubled: to 16 standard deviations. Flatter still, the interval is said to reach the
/// bound. A convention.
const FURTHER: usize = 3;
/// How far beside the best the counts of a duty counter are tried: doubled from a shift so small that hardly a
/// duty is rounded to another count. Conventions.
const LEAST_COUNTS: f64 = 5e-3;
const MOST_COUNTS: f64 = 10.0;
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

    /// Cost of a value that was tried.
    fn cost(&self, value: f64) -> f64 {
        // exact: the ends of the curve come from the same expression
        let tried = self.curve.iter().find(|(x, _)| *x == value);
        tried.map_or(0.0, |(_, cost)| *cost)
    }
}

/// Profiles of all parameters of the best explanation. The intervals allow for the accuracy of the plant too.
#[must_use]
pub fn profiles(problem: &Problem, attribution: &Attribution, say: Listener<'_>) -> Vec<Profile> {
    let Some(best) = &attribution.best else {
        return Vec::new();
    };
    let fitter = attribution.fitter(problem);
    let places = fitter.places(&best.causes);
    let numbers: Vec<usize> = (0..places.len()).collect();
    progress::map(say, "intervals", &numbers, |number| {
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
        let sigma = (best.covariance[*number][*number] * attribution.inflation).sqrt();
        let [low, high, _] = fitter.range(place);
        let at_value = |x: f64| {
            let mut values = best.values.clone();
            values[*number] = x;
            let fit = fitter.holding(&best.causes, &values, &best.state, Some(*number));
            ((fit.state.chi2 - best.state.chi2) / attribution.inflation).max(0.0)
        };
        if matches!(candidate.form.search, Search::Counter(_)) {
            profile.interval = [-1.0, 1.0].map(|side| alike(value, side, &at_value));
        }
        // without a slope there is no scale at which to try other values
        if !fitter.is_smooth(place) || sigma.is_nan() || sigma <= 0.0 {
            return profile;
        }
        for at in PLACES {
            let x = (value + at * sigma).clamp(low, high);
            profile.curve.push((x, at_value(x)));
        }
        for (side, at) in [(0, -2.0), (1, 2.0)] {
            let mut far = (value + at * sigma).clamp(low, high);
            let mut cost = profile.cost(far);
            // the curve may be flatter than at its lowest point
            for _ in 0..FURTHER {
                if cost >= 1.0 || far <= low || far >= high {
                    break;
                }
                far = (value + 2.0 * (far - value)).clamp(low, high);
                cost = at_value(far);
                profile.curve.push((far, cost));
            }
            // below a third of what one standard deviation costs, after three doublings: no data on this side
            let statistical = match cost > 0.3 {
                // the parabola through the best value and this one, carried to the level
                true => (far - value) * (LEVEL / cost).sqrt(),
                false => at.signum() * (high - low),
            };
            // a simulator that is off by a share of a response puts the parameter off by that share of its change
            let systematic = TWO_SIDED * ACCURACY * (value - profile.own);
            // without the cause, chi-square is what its evidence says: the interval ends before that
            let none = profile.own - value;
            let size = place.1 < candidate.sizes() && candidate.sizes() == 1 && none.signum() == at.signum();
            let statistical = match attribution.evidence.get(profile.member) {
                Some(lost) if size && lost / attribution.inflation > LEVEL => {
                    let before = none.abs() * (LEVEL * attribution.inflation / lost).sqrt();
                    at.signum() * statistical.abs().min(before)
                }
                _ => statistical,
            };
            // noise and the simulator's error have nothing to do with each other: they add in squares
            let reach = at.signum() * statistical.hypotenuse(systematic);
            profile.interval[side] = (value + reach).clamp(low, high);
        }
        profile.curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        profile
    })
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
