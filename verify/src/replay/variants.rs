//! Logged values that are the feature with one of its filters made otherwise.
//!
//! Each variant runs over the whole log and has to give nearly every row: a filter that is named is one that explains the column.

use policy::{Feature, Policy};

use super::chain::{Integral, Link, Rule, Start, observation};
use super::explain::{Course, FeatureCourse, Logged, number};

/// Longest moving average that is tried, rows.
const LONGEST_AVERAGE: usize = 32;
/// Time constants that are tried first, in control periods: from a thousandth, which is no filter, to ten thousand, which is none of a
/// converter, twelve a decade.
// with six a decade the finer search still ended at the same time constants; twelve leave a margin
const TAUS: [f64; 3] = [1e-3, 1e4, 12.0];
/// Rows over which time constants are searched; all rows judge the one that was found.
const SEARCHED: usize = 5_000;

/// What is tried in the place of a feature's filters.
pub(super) struct Trial<'a> {
    feature: &'a Feature,
    own: &'a FeatureCourse,
    course: &'a Course,
    logged: &'a Logged<'a>,
    period: f64,
    links: Vec<Link>,
}

impl<'a> Trial<'a> {
    pub fn new(
        policy: &Policy,
        feature: &'a Feature,
        own: &'a FeatureCourse,
        course: &'a Course,
        logged: &'a Logged<'a>,
    ) -> Self {
        Self {
            feature,
            own,
            course,
            logged,
            period: policy.sample_period,
            links: feature.filters.iter().copied().map(Link::from).collect(),
        }
    }

    /// An integral that adds by another rule or ends elsewhere, in words.
    pub fn of_integral_rule(&self) -> Option<String> {
        self.of_integrals(false)
    }

    /// The filter that would explain the log, in words; `None` if none of those tried does.
    pub fn of_filter(&self) -> Option<String> {
        if !self.logged.moves() {
            return None;
        }
        self.of_integrals(true)
            .or_else(|| self.with_other_numbers())
            .or_else(|| self.without_one())
            .or_else(|| self.with_one_more())
    }

    fn of_integrals(&self, with_initial: bool) -> Option<String> {
        let links = self.links.iter().enumerate();
        let mut integrals = links.filter_map(|(at, link)| match link {
            Link::Integral(integral) => Some((at, *integral)),
            _ => None,
        });
        integrals.find_map(|(at, integral)| self.of_integral(at, integral, with_initial))
    }

    /// A filter with another time constant or number of samples.
    fn with_other_numbers(&self) -> Option<String> {
        (0..self.links.len()).find_map(|at| match self.links[at] {
            Link::LowPass { tau, .. } => self.of_low_pass(at, tau),
            Link::Derivative { .. } => {
                let tau = self.tau(|tau| self.with(at, Link::Derivative { tau }))?;
                let key = format!("{{ filtered_derivative = {{ time_constant = {} }} }}", number(tau));
                Some(format!(
                    "its filtered derivative has another time constant: {key} fits the log"
                ))
            }
            Link::Average(_) => self.of_average(at),
            Link::Delay(_) | Link::Difference | Link::Integral(_) => None,
        })
    }

    fn with(&self, at: usize, link: Link) -> Vec<Link> {
        let mut links = self.links.clone();
        links[at] = link;
        links
    }

    fn fits(&self, links: &[Link]) -> bool {
        let made = self.observation(links, self.own.source.len());
        self.logged.is(&made)
    }

    fn observation(&self, links: &[Link], rows: usize) -> Vec<f64> {
        let source = self.own.source.get(..rows).unwrap_or(&self.own.source);
        observation(self.feature, links, source, &self.course.begins, self.period)
    }

    /// The time constant with which `links` come nearest to the log, if they explain it.
    fn tau(&self, links: impl Fn(f64) -> Vec<Link>) -> Option<f64> {
        let rows = self.own.source.len().min(SEARCHED);
        // a sum of sizes and not of squares: a few odd rows must not draw it away
        let off = |exponent: f64| -> f64 {
            let made = self.observation(&links(exponent.exp() * self.period), rows);
            let pairs = made.iter().zip(self.logged.values);
            pairs.map(|(made, logged)| (made - logged).abs()).sum()
        };
        let [low, high, of_decade] = TAUS;
        let step = std::f64::consts::LN_10 / of_decade;
        let count = ((high / low).ln() / step) as usize;
        let grid = (0..=count).map(|n| low.ln() + n as f64 * step);
        let best = grid.min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
        let tau = golden_section(best - step, best + step, off).exp();
        // at an end of the grid it is another filter
        let is_inside = (2.0 * low..0.5 * high).contains(&tau);
        (is_inside && self.fits(&links(tau * self.period))).then_some(tau * self.period)
    }

    fn of_low_pass(&self, at: usize, tau: f64) -> Option<String> {
        if self.fits(&self.with(at, Link::LowPass { tau, from_zero: true })) {
            return Some("its low-pass starts from 0, the contract's from the first sample of an episode".to_owned());
        }
        [false, true].into_iter().find_map(|from_zero| {
            let tau = self.tau(|tau| self.with(at, Link::LowPass { tau, from_zero }))?;
            let start = if from_zero {
                ", from 0 at the start of an episode"
            } else {
                ""
            };
            let key = format!("{{ low_pass = {{ time_constant = {} }} }}", number(tau));
            Some(format!(
                "its low-pass has another time constant: {key} fits the log{start}"
            ))
        })
    }

    fn of_average(&self, at: usize) -> Option<String> {
        let samples = (2..=LONGEST_AVERAGE).find(|samples| self.fits(&self.with(at, Link::Average(*samples))))?;
        Some(format!(
            "its moving average is over another number of samples: {{ moving_average = {samples} }} fits the log"
        ))
    }

    /// A filter that the log does not have.
    fn without_one(&self) -> Option<String> {
        let at = (0..self.links.len()).find(|at| {
            let mut links = self.links.clone();
            links.remove(*at);
            self.fits(&links)
        })?;
        let word = match self.links[at] {
            Link::Delay(_) => "delay",
            Link::Difference => "backward difference",
            Link::LowPass { .. } => "low-pass",
            Link::Derivative { .. } => "filtered derivative",
            Link::Average(_) => "moving average",
            Link::Integral(_) => "integrator",
        };
        Some(format!("it is without the {word} of the contract"))
    }

    /// A filter that the contract does not have.
    fn with_one_more(&self) -> Option<String> {
        let behind = |link: Link| {
            let mut links = self.links.clone();
            links.push(link);
            links
        };
        for from_zero in [false, true] {
            if let Some(tau) = self.tau(|tau| behind(Link::LowPass { tau, from_zero })) {
                let start = if from_zero {
                    ", from 0 at the start of an episode"
                } else {
                    ""
                };
                let key = format!("{{ low_pass = {{ time_constant = {} }} }}", number(tau));
                return Some(format!("it is low-pass filtered: {key} more fits the log{start}"));
            }
        }
        let samples = (2..=LONGEST_AVERAGE).find(|samples| self.fits(&behind(Link::Average(*samples))))?;
        Some(format!(
            "it is averaged: {{ moving_average = {samples} }} more fits the log"
        ))
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
                for winds_up in [false, true] {
                    let (min, max) = (*min, *max);
                    let other = Integral {
                        min,
                        max,
                        rule,
                        start,
                        winds_up,
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
            .filter(|other| *other != integral && other.min <= other.initial && other.initial <= other.max)
            .find(|other| self.fits(&self.with(at, Link::Integral(*other))))?;
        Some(self.words(&integral, &found))
    }

    /// The clamps that an integral may have: the contract's, the ends that the log does not pass, none.
    fn clamps(&self, at: usize, integral: Integral) -> Vec<[f64; 2]> {
        let own = [integral.min, integral.max];
        // only a delay behind it leaves the ends as they are
        let is_last = self.links[at + 1..].iter().all(|link| matches!(link, Link::Delay(_)));
        let Some(ends) = self.logged.clip.filter(|_| is_last) else {
            return vec![own, [f64::NEG_INFINITY, f64::INFINITY]];
        };
        let unscaled = |end: Option<f64>| Some((end? - self.feature.offset) / self.feature.scale);
        let [mut low, mut high] = ends.map(unscaled);
        if self.feature.scale < 0.0 {
            (low, high) = (high, low);
        }
        let lows = [Some(own[0]), low, Some(f64::NEG_INFINITY)].into_iter().flatten();
        let highs = [Some(own[1]), high, Some(f64::INFINITY)];
        let pairs = lows.flat_map(|low| highs.into_iter().flatten().map(move |high| [low, high]));
        pairs.filter(|[low, high]| low < high).collect()
    }

    /// The value before the first row that the log begins with.
    fn initial(&self, at: usize, integral: Integral) -> Option<f64> {
        // what is behind it does not pass the first value on as it is
        (at + 1 == self.links.len()).then_some(())?;
        let first = (self.logged.values.first()? - self.feature.offset) / self.feature.scale;
        let made = self.observation(&self.with(at, Link::Integral(integral)), 1);
        let made = (made.first()? - self.feature.offset) / self.feature.scale;
        let initial = integral.initial + first - made;
        // the last digit of a log is no other start
        let is_other = ((initial - integral.initial) * self.feature.scale).abs() > 2.0 * self.logged.allowed;
        (is_other && initial.is_finite()).then_some(initial)
    }

    fn words(&self, own: &Integral, other: &Integral) -> String {
        let mut words = Vec::new();
        match (other.rule, other.start) {
            (Rule::Rectangle, Start::Whole) => {}
            (Rule::Rectangle, _) => words.push(
                "it leaves out the first sample of an episode, which the contract adds at once (T x, a constant over the episode)".to_owned(),
            ),
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
            (Rule::Before, _) => words.push(
                "it adds the sample of the row before: { delay = 1 } behind the integrator fits the log from the second row of an \
                 episode on"
                    .to_owned(),
            ),
        }
        let ends = [(own.min, other.min, "min"), (own.max, other.max, "max")];
        let keys: Vec<String> = ends
            .into_iter()
            .filter(|(own, other, _)| own != other)
            .map(|(_, other, key)| match other.is_finite() {
                true => format!("{key} = {}", number(other)),
                false => format!("no {key}"),
            })
            .collect();
        if !keys.is_empty() {
            words.push(format!("it is clamped elsewhere: {} fits the log", keys.join(", ")));
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
    rule + clamp + usize::from(own.winds_up != other.winds_up) + 2 * usize::from(own.initial != other.initial)
}

/// The place of the least value between two ends.
fn golden_section(mut low: f64, mut high: f64, value: impl Fn(f64) -> f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_8;
    let at = |low: f64, high: f64, share: f64| low + share * (high - low);
    let (mut a, mut b) = (at(low, high, 1.0 - SHARE), at(low, high, SHARE));
    let (mut of_a, mut of_b) = (value(a), value(b));
    // 0.4 e-folds shrink to 1e-8 of a time constant
    for _ in 0..36 {
        if of_a < of_b {
            (high, b, of_b) = (b, a, of_a);
            a = at(low, high, 1.0 - SHARE);
            of_a = value(a);
        } else {
            (low, a, of_a) = (a, b, of_b);
            b = at(low, high, SHARE);
            of_b = value(b);
        }
    }
    0.5 * (low + high)
}
