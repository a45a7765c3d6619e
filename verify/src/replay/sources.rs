//! Logged values that are the contract's filters over another source.

use super::chain::{Integral, Link, filtered};
use super::explain::{Line, affine, all, number};
use super::itself::Clip;
use super::variants::Trial;

/// Rows whose input is less than this share of the largest say nothing of a factor: a digit of the log decides there.
const SMALL: f64 = 0.05;

impl Trial<'_> {
    /// The contract's filters over one of these, by their names, in words.
    pub(super) fn of_another_input(&self, candidates: &[(String, &Vec<f64>)]) -> Option<String> {
        // without a filter it is another source, which is searched further on
        if self.links.is_empty() || !self.logged.moves() {
            return None;
        }
        let integral = self.links.iter().position(|link| matches!(link, Link::Integral(_)));
        candidates.iter().find_map(|(name, values)| match integral {
            None => self.of_linear(name, values),
            Some(at) => self.of_integrand(at, name, values),
        })
    }

    /// Filters that are linear: a factor in front of them is one behind them.
    fn of_linear(&self, name: &str, values: &[f64]) -> Option<String> {
        // the contract's own source, perhaps that of another feature, too, is no other one
        if *values == self.own.source {
            return None;
        }
        let made = filtered(&self.links, values, &self.course.begins, self.period);
        let Line { s, o } = self.logged.line(&all(&made))?;
        let unclipped: Vec<f64> = made.iter().map(|y| s * y + o).collect();
        let clip = Clip::of(self.feature, self.logged, &unclipped)?;
        let mut keys = vec![format!("source = \"{name}\""), format!("scale = {}", number(s))];
        if o != 0.0 {
            keys.push(format!("offset = {}", number(o)));
        }
        keys.extend(clip.key());
        Some(format!(
            "its filters stand behind another source: {} fits the log",
            keys.join(", ")
        ))
    }

    /// An integral: the clamp in it makes a factor in front of it another thing than one behind it.
    fn of_integrand(&self, at: usize, name: &str, values: &[f64]) -> Option<String> {
        let Link::Integral(own) = self.links[at] else {
            return None;
        };
        if !self.is_last(at) {
            return None;
        }
        let s = self.factor(at, own, values)?;
        let source: Vec<f64> = values.iter().map(|x| s * x).collect();
        self.clamps(at, own).into_iter().find_map(|[min, max]| {
            let other = Integral { min, max, ..own };
            let links = self.with(at, Link::Integral(other));
            (self.allows(at, &other) && self.logged.is(&self.observation_of(&links, &source))).then(|| {
                let line = Line { s, o: 0.0 };
                let mut text = format!("it is the integral of {}", affine(line, name));
                if (min, max) != (own.min, own.max) {
                    text += &format!(", with min = {} and max = {}", number(min), number(max));
                }
                text
            })
        })
    }

    /// How much of these values the logged integral adds in a row: the median, for at the clamp it adds nothing.
    fn factor(&self, at: usize, own: Integral, values: &[f64]) -> Option<f64> {
        let behind: usize = self.links[at + 1..].iter().map(Link::words).sum();
        let added = filtered(&self.links[..at], values, &self.course.begins, self.period);
        let ages = self.course.ages();
        let largest = added.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let ratio = |row: usize| {
            let (now, before) = (
                self.logged.values.get(row)?,
                self.logged.values.get(row.checked_sub(1)?)?,
            );
            let x = *added.get(row.checked_sub(behind)?)?;
            let is_plain = *ages.get(row)? > behind && x.abs() > SMALL * largest;
            let step = self.unscaled(*now) - own.leak * self.unscaled(*before);
            // what does not move is held at the clamp
            (is_plain && now != before).then(|| step / (self.period * x))
        };
        let mut ratios: Vec<f64> = (0..self.logged.values.len()).filter_map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        let median = *ratios.get(ratios.len() / 2)?;
        // what is told is what is tried
        let told: f64 = number(median).parse().ok()?;
        (told.is_finite() && told != 0.0).then_some(told)
    }
}
