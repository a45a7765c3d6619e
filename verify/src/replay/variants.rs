//! Logged values that are the feature with one of its filters made otherwise.
//!
//! Each variant runs over the whole log and has to give nearly every row: a filter that is named is one that explains the column.

use policy::{Feature, Policy};

use super::chain::{Link, observation};
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
    pub(super) feature: &'a Feature,
    pub(super) own: &'a FeatureCourse,
    pub(super) course: &'a Course,
    pub(super) logged: &'a Logged<'a>,
    pub(super) period: f64,
    pub(super) links: Vec<Link>,
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

    /// The filter that would explain the log, in words; `None` if none of those tried does.
    pub fn of_filter(&self) -> Option<String> {
        if !self.logged.moves() {
            return None;
        }
        self.of_leak()
            .or_else(|| self.of_integrals(true))
            .or_else(|| self.with_other_numbers())
            .or_else(|| self.without_one())
            .or_else(|| self.with_one_more())
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

    pub(super) fn with(&self, at: usize, link: Link) -> Vec<Link> {
        let mut links = self.links.clone();
        links[at] = link;
        links
    }

    pub(super) fn fits(&self, links: &[Link]) -> bool {
        let made = self.observation(links, self.own.source.len());
        self.logged.is(&made)
    }

    pub(super) fn observation(&self, links: &[Link], rows: usize) -> Vec<f64> {
        self.observation_of(links, self.own.source.get(..rows).unwrap_or(&self.own.source))
    }

    pub(super) fn observation_of(&self, links: &[Link], source: &[f64]) -> Vec<f64> {
        observation(self.feature, links, source, &self.course.begins, self.period)
    }

    /// The time constant with which `links` come nearest to the log, if they explain it.
    fn tau(&self, links: impl Fn(f64) -> Vec<Link>) -> Option<f64> {
        self.tau_among(TAUS, links)
    }

    /// [`Self::tau`] between two time constants in control periods, with so many a decade tried first.
    pub(super) fn tau_among(&self, [low, high, of_decade]: [f64; 3], links: impl Fn(f64) -> Vec<Link>) -> Option<f64> {
        let rows = self.own.source.len().min(SEARCHED);
        // a sum of sizes and not of squares: a few odd rows must not draw it away
        let off = |exponent: f64| -> f64 {
            let made = self.observation(&links(exponent.exp() * self.period), rows);
            let pairs = made.iter().zip(self.logged.values);
            pairs.map(|(made, logged)| (made - logged).abs()).sum()
        };
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
            let text = "its low-pass starts from 0, the contract's from the first sample of an episode";
            return Some(format!("{text}{}", self.start_left_out(at, tau)));
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

    /// How many rows the other start of a low-pass is seen in: it decays by tau/(tau + T) a row.
    fn start_left_out(&self, at: usize, tau: f64) -> String {
        let behind: Option<usize> = self.links[at + 1..]
            .iter()
            .map(|link| match link {
                Link::Delay(samples) => Some(*samples),
                _ => None,
            })
            .sum();
        let Some(behind) = behind else { return String::new() };
        let firsts = self
            .course
            .begins
            .iter()
            .zip(self.own.unclipped.iter().zip(self.logged.values));
        let firsts = firsts.filter(|(begins, _)| **begins);
        let start = firsts
            .map(|(_, (own, logged))| (own - logged).abs())
            .fold(0.0, f64::max);
        let rows = (self.logged.allowed / start).ln() / (tau / (tau + self.period)).ln();
        // one more: at the tolerance itself a digit of the log decides
        let rows = rows.max(0.0).ceil() as usize + behind + 1;
        let longest = self.course.ages().into_iter().max().unwrap_or(0);
        match rows <= longest {
            true => format!("; --skip {rows} leaves out the rows in which that is seen"),
            false => format!(
                "; it is seen for {rows} rows, and no episode of the log is longer: log more, and --skip {rows}"
            ),
        }
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
