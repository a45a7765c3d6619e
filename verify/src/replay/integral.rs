//! Logged values that are an integral over time made otherwise: rule, first sample, clamp, leak, and value before the first row.

use super::chain::{Integral, Link, Rule, Start};
use super::explain::{FEWEST_ROWS, number};
use super::values::ends;
use super::variants::Trial;

/// Time constants of a leak that are tried first, in control periods, and how many a decade: a slow one adds up over a long log.
// a share of a millionth is the last one that a contract in binary32 can tell from none by its second digit
const LEAKS: [f64; 3] = [1e-3, 1e6, 12.0];

impl Trial<'_> {
    /// An integral that adds by another rule or ends elsewhere, in words.
    pub fn of_integral_rule(&self) -> Option<String> {
        self.of_integrals(false)
    }

    pub(super) fn of_integrals(&self, with_initial: bool) -> Option<String> {
        self.integrals()
            .find_map(|(at, integral)| self.of_integral(at, integral, with_initial))
    }

    fn integrals(&self) -> impl Iterator<Item = (usize, Integral)> + '_ {
        self.links.iter().enumerate().filter_map(|(at, link)| match link {
            Link::Integral(integral) => Some((at, *integral)),
            _ => None,
        })
    }

    /// Rule, first sample, clamp and initial value: the fewest changes that explain the log.
    fn of_integral(&self, at: usize, integral: Integral, with_initial: bool) -> Option<String> {
        let rules = [
            (Rule::Rectangle, Start::Whole),
            (Rule::Rectangle, Start::Nothing),
            (Rule::Trapezoid, Start::Whole),
            (Rule::Trapezoid, Start::Half),
            (Rule::Trapezoid, Start::Nothing),
            (Rule::Before, Start::Nothing),
            (Rule::Before, Start::Whole),
        ];
        let clamps = self.clamps(at, integral);
        let mut trials = Vec::new();
        for (rule, start) in rules {
            for [min, max] in &clamps {
                // 1: the log may keep what the contract lets go
                let leaks = [integral.leak, 1.0]
                    .into_iter()
                    .take(if integral.leak == 1.0 { 1 } else { 2 });
                for (leak, winds_up) in leaks.flat_map(|leak| [(leak, false), (leak, true)]) {
                    let (min, max) = (*min, *max);
                    let other = Integral {
                        min,
                        max,
                        rule,
                        start,
                        winds_up,
                        leak,
                        ..integral
                    };
                    trials.push(other);
                    let initial = with_initial.then(|| self.initial(at, other)).flatten();
                    trials.extend(initial.map(|initial| Integral { initial, ..other }));
                }
            }
        }
        // stable: of as many changes the ones that are met more often come first
        trials.sort_by_key(|other| changes(&integral, other));
        let found = trials
            .into_iter()
            .filter(|other| *other != integral && self.allows(at, other))
            .filter(|other| other.min <= other.initial && other.initial <= other.max)
            .find(|other| self.fits(&self.with(at, Link::Integral(*other))))?;
        Some(self.words(&integral, &found))
    }

    /// The clamps that an integral may have: the contract's, none, the ends that the log does not pass.
    // none before an end of the log: any log has a largest value, and only a clamp that holds it makes a difference
    pub(super) fn clamps(&self, at: usize, integral: Integral) -> Vec<[f64; 2]> {
        let own = [integral.min, integral.max];
        let Some(ends) = self.logged.clip.filter(|_| self.is_last(at)) else {
            let lows = [own[0], f64::NEG_INFINITY];
            return lows
                .into_iter()
                .flat_map(|low| [[low, own[1]], [low, f64::INFINITY]])
                .collect();
        };
        let [mut low, mut high] = ends.map(|end| Some(self.unscaled(end?)));
        if self.feature.scale < 0.0 {
            (low, high) = (high, low);
        }
        let lows = [Some(own[0]), Some(f64::NEG_INFINITY), low].into_iter().flatten();
        let highs = [Some(own[1]), Some(f64::INFINITY), high];
        let pairs = lows.flat_map(|low| highs.into_iter().flatten().map(move |high| [low, high]));
        pairs.filter(|[low, high]| low < high).collect()
    }

    /// The value before the first row that the log begins with.
    fn initial(&self, at: usize, integral: Integral) -> Option<f64> {
        // what is behind it does not pass the first value on as it is
        (at + 1 == self.links.len()).then_some(())?;
        let first = self.unscaled(*self.logged.values.first()?);
        let made = self.observation(&self.with(at, Link::Integral(integral)), 1);
        let made = self.unscaled(*made.first()?);
        let initial = integral.initial + first - made;
        // the last digit of a log is no other start
        let is_other = ((initial - integral.initial) * self.feature.scale).abs() > 2.0 * self.logged.allowed;
        (is_other && initial.is_finite()).then_some(initial)
    }

    pub(super) fn unscaled(&self, value: f64) -> f64 {
        (value - self.feature.offset) / self.feature.scale
    }

    /// Whether the log shows the integral's ends: only a delay behind it leaves them as they are.
    pub(super) fn is_last(&self, at: usize) -> bool {
        self.links[at + 1..].iter().all(|link| matches!(link, Link::Delay(_)))
    }

    /// Whether the log stays within the clamp of an integral.
    pub(super) fn allows(&self, at: usize, integral: &Integral) -> bool {
        let slack = 2.0 * self.logged.allowed / self.feature.scale.abs();
        let inside = integral.min - slack..=integral.max + slack;
        let is_beyond = |value: &&f64| !inside.contains(&self.unscaled(**value));
        !self.is_last(at) || self.logged.values.iter().filter(is_beyond).count() < FEWEST_ROWS
    }

    /// An integral that keeps less than all of itself in each period, in words.
    pub(super) fn of_leak(&self) -> Option<String> {
        self.integrals().find_map(|(at, integral)| {
            let starts = [
                (Rule::Rectangle, Start::Whole),
                (Rule::Rectangle, Start::Nothing),
                (Rule::Before, Start::Whole),
                (Rule::Before, Start::Nothing),
            ];
            let clamps = self.clamps(at, integral);
            let mut trials = starts
                .into_iter()
                .flat_map(|(rule, start)| clamps.iter().map(move |[min, max]| (rule, start, *min, *max)));
            trials.find_map(|(rule, start, min, max)| {
                let with = |tau: f64, digits: usize| Integral {
                    min,
                    max,
                    rule,
                    start,
                    leak: kept(tau / (tau + self.period), digits),
                    ..integral
                };
                let link = |other: Integral| self.with(at, Link::Integral(other));
                let tau = self.tau_among(LEAKS, |tau| link(with(tau, 5)))?;
                // the fifth digit is that of the log's rounding where four do as well
                let told = [4, 5].map(|digits| with(tau, digits));
                let other = told.into_iter().find(|other| self.fits(&link(*other)))?;
                self.allows(at, &other).then(|| self.words(&integral, &other))
            })
        })
    }

    /// An end of the clamp that is another, in words.
    fn end_words(&self, key: &str, own: f64, other: f64) -> String {
        if other.is_finite() {
            return format!("it is clamped elsewhere: {key} = {} fits the log", number(other));
        }
        let [a, b] = ends(self.logged.values).map(|end| self.unscaled(end));
        let (shown, far, further) = match key {
            "min" => (a.min(b), "down", "less"),
            _ => (a.max(b), "up", "more"),
        };
        if (key == "min" && shown >= own) || (key == "max" && shown <= own) {
            return format!("it is clamped elsewhere: no {key} fits the log");
        }
        format!(
            "the log goes beyond {key} = {}, {far} to {end}: {key} = {end} or {further} fits the log",
            number(own),
            end = number(outward(shown, key)),
        )
    }

    fn words(&self, own: &Integral, other: &Integral) -> String {
        let mut words = Vec::new();
        match (other.rule, other.start) {
            (Rule::Rectangle, Start::Whole) => {}
            (Rule::Rectangle, _) => words.push(format!(
                "it leaves out the first sample of an episode, which the contract adds at once (T x, {}); no filter does that: \
                 let the training add it, too, or take the difference for what it is",
                match other.leak == 1.0 {
                    true => "a constant over the episode",
                    false => "which the leak forgets",
                }
            )),
            (Rule::Trapezoid, Start::Whole) => words.push("it adds trapezoids, T (x + x1) / 2, the contract T x".to_owned()),
            (Rule::Trapezoid, Start::Half) => words.push(
                "it adds trapezoids, T (x + x1) / 2, with 0 before the first sample; the contract adds T x".to_owned(),
            ),
            (Rule::Trapezoid, Start::Nothing) => words.push(
                "it adds trapezoids, T (x + x1) / 2, and nothing in the first row of an episode; the contract adds T x".to_owned(),
            ),
            (Rule::Before, Start::Whole) => words.push(
                "it adds the sample of the row before: { delay = 1 } in front of the integrator fits the log".to_owned(),
            ),
            // a leak takes of the initial value once more than with a delay behind it
            (Rule::Before, _) if other.initial != 0.0 && other.leak != 1.0 => words.push(
                "it adds the sample of the row before, and nothing in the first row of an episode; the contract adds T x at once"
                    .to_owned(),
            ),
            (Rule::Before, _) => words.push(
                "it adds the sample of the row before: { delay = 1 } behind the integrator fits the log from the second row of an \
                 episode on"
                    .to_owned(),
            ),
        }
        let ends = [("min", own.min, other.min), ("max", own.max, other.max)];
        let others = ends.into_iter().filter(|(_, own, other)| own != other);
        words.extend(others.map(|(key, own, other)| self.end_words(key, own, other)));
        if other.leak != own.leak {
            words.push(match (other.leak == 1.0, own.leak == 1.0) {
                (true, _) => "it does not leak: without leak it fits the log".to_owned(),
                (false, true) => format!("it leaks, leak = {} a period", other.leak),
                (false, false) => format!("it leaks otherwise: leak = {} a period fits the log", other.leak),
            });
        }
        if other.winds_up != own.winds_up {
            words.push("the sum goes on behind the clamp (it winds up), the contract's stops there".to_owned());
        }
        if other.initial != own.initial {
            words.push(format!(
                "it starts elsewhere: initial = {} fits the log",
                number(other.initial)
            ));
        }
        format!("of the integral: {}", words.join("; "))
    }
}

/// In how many ways an integral is another one.
fn changes(own: &Integral, other: &Integral) -> usize {
    let rule = usize::from((own.rule, own.start) != (other.rule, other.start));
    let clamp = usize::from(own.min != other.min) + usize::from(own.max != other.max);
    // a fitted value can stand for much: it comes behind what has none
    let leak = usize::from(own.leak != other.leak);
    rule + clamp + leak + usize::from(own.winds_up != other.winds_up) + 2 * usize::from(own.initial != other.initial)
}

/// A share of a sum as it is told: what it lacks to 1 with so many digits.
fn kept(share: f64, digits: usize) -> f64 {
    let places = digits.saturating_sub(1);
    let lost: f64 = format!("{:.places$e}", 1.0 - share).parse().unwrap_or(1.0 - share);
    // 1 - 0.002 in binary has more digits than a contract should
    let digits = (places as f64 - lost.log10().floor()).max(0.0) as usize;
    format!("{:.digits$}", 1.0 - lost).parse().unwrap_or(1.0 - lost)
}

/// The number of four digits next to a value, below it for a `min` and above it for a `max`: one within would cut the value off.
fn outward(value: f64, key: &str) -> f64 {
    if value == 0.0 {
        return value;
    }
    let step = 10f64.powf(value.abs().log10().floor() - 3.0);
    // what is such a number already is off a whole one by a rounding
    match key {
        "min" => (value / step + 1e-6).floor() * step,
        _ => (value / step - 1e-6).ceil() * step,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clamp_that_is_proposed_holds_all_of_the_log_whatever_its_sign() {
        for value in [0.012_345_6, -0.012_345_6, 98.765_43, -98.765_43, 0.002, -0.002] {
            let [min, max] = ["min", "max"].map(|key| number(outward(value, key)).parse::<f64>().unwrap());
            assert!(min <= value && value <= max, "{value}: {min} to {max}");
            assert!(max - min <= 1.001e-3 * value.abs(), "{value}: {min} to {max}");
        }
        assert_eq!(outward(0.0, "min"), 0.0);
    }
}
