//! Profile likelihood: how well the data hold each parameter when all others may follow.

use crate::attribute::Attribution;
use crate::parallel;
use crate::problem::Problem;

/// 95 % of a chi-square of one degree of freedom.
const LEVEL: f64 = 3.841;
/// Places of the profile, in standard deviations.
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

/// Profiles of all parameters of the best explanation.
#[must_use]
pub fn profiles(problem: &Problem, attribution: &Attribution) -> Vec<Profile> {
    let Some(best) = &attribution.best else {
        return Vec::new();
    };
    let fitter = attribution.fitter(problem);
    let places = fitter.places(&best.causes);
    let numbers: Vec<usize> = (0..places.len()).collect();
    parallel::map(&numbers, |number| {
        let place = places[*number];
        let candidate = &attribution.candidates[place.0];
        let knob = &candidate.cause.knobs[place.1];
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
        if !fitter.is_smooth(place) || sigma.is_nan() || sigma <= 0.0 {
            return profile;
        }
        let [low, high, _] = fitter.range(place);
        let others = places.len() > 1;
        for at in PLACES {
            let mut values = best.values.clone();
            values[*number] = (value + at * sigma).clamp(low, high);
            let fit = match others {
                true => fitter.holding(&best.causes, &values, &best.state, Some(*number)),
                false => fitter.holding(&best.causes, &values, &best.state, Some(0)),
            };
            let cost = ((fit.state.chi2 - best.state.chi2) / attribution.inflation).max(0.0);
            profile.curve.push((values[*number], cost));
        }
        profile.curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (side, at) in [(0, -2.0), (1, 2.0)] {
            let far = (value + at * sigma).clamp(low, high);
            let cost = profile
                .curve
                .iter()
                .find(|(x, _)| *x == far)
                .map_or(0.0, |(_, cost)| *cost);
            // a parabola through the far point; a flat profile is open up to the bound
            let reach = if cost > 0.3 {
                (far - value) * (LEVEL / cost).sqrt()
            } else {
                at.signum() * (high - low)
            };
            profile.interval[side] = (value + reach).clamp(low, high);
        }
        profile
    })
}
