//! Logged values that are the feature itself on another line, and where they end.

use policy::{Feature, Filter};

use super::explain::{FeatureCourse, Line, Logged, number};
use super::values::ends;

/// Where a log ends: at a value that is told, or nowhere.
pub(super) struct Clip {
    /// Lower and upper end that fit the log.
    ends: [Option<f64>; 2],
    /// Whether an end is seen in the log.
    shown: [bool; 2],
    /// Least and largest value of the log.
    reach: [f64; 2],
    /// Whether the contract has a clip.
    is_own: bool,
}

impl Clip {
    /// The ends with which these values, one for each row, are the log; `None` if they are not.
    // a line is drawn without the rows at an end: where no clip makes them, something else does, and the line is no reason
    pub fn of(feature: &Feature, logged: &Logged<'_>, unclipped: &[f64]) -> Option<Self> {
        let fits = |[low, high]: [Option<f64>; 2]| {
            let [low, high] = [low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY)];
            let made: Vec<f64> = unclipped.iter().map(|x| x.max(low).min(high)).collect();
            logged.is(&made)
        };
        let cut = logged.cut_off(unclipped);
        if !fits(cut) {
            return None;
        }
        let mut ends_told = cut;
        if let Some(own) = feature.clip {
            // the contract's end is left only where the log stays within it
            if cut[0].is_none() && fits([Some(own.low), cut[1]]) {
                ends_told[0] = Some(own.low);
            }
            if cut[1].is_none() && fits([ends_told[0], Some(own.high)]) {
                ends_told[1] = Some(own.high);
            }
        }
        Some(Self {
            ends: ends_told,
            shown: cut.map(|end| end.is_some()),
            reach: ends(logged.values),
            is_own: feature.clip.is_some(),
        })
    }

    /// Whether the contract may leave its clip, or the lack of one, as it is.
    fn is_kept(&self) -> bool {
        self.shown == [false, false] && self.ends.iter().all(|end| end.is_some() == self.is_own)
    }

    /// What the contract has to say in the place of its clip; `None` if nothing.
    pub fn key(&self) -> Option<String> {
        if self.is_kept() {
            return None;
        }
        let [least, most] = self.reach.map(number);
        Some(match (self.ends.map(|end| end.map(number)), self.is_own) {
            ([Some(low), Some(high)], _) => format!("clip = [{low}, {high}]"),
            ([Some(low), None], false) => {
                format!("a clip that begins at {low} (the log does not come to its upper end)")
            }
            ([None, Some(high)], false) => {
                format!("a clip that ends at {high} (the log does not come to its lower end)")
            }
            ([Some(low), None], true) => {
                format!("a clip that begins at {low} and has no upper end (the log goes up to {most})")
            }
            ([None, Some(high)], true) => {
                format!("a clip that ends at {high} and has no lower end (the log goes down to {least})")
            }
            ([None, None], _) => format!("no clip (the log goes from {least} to {most})"),
        })
    }

    fn is_none(&self) -> bool {
        self.ends == [None, None]
    }
}

/// The feature with another sign, scale, offset or clip, in words.
pub(super) fn of_itself(feature: &Feature, line: Line, own: &FeatureCourse, logged: &Logged<'_>) -> Option<String> {
    let unclipped: Vec<f64> = own.unclipped.iter().map(|x| line.s * x + line.o).collect();
    let clip = Clip::of(feature, logged, &unclipped)?;
    let (scale, offset) = (line.s * feature.scale, line.s * feature.offset + line.o);
    let mut keys = Vec::new();
    let head = if line.s == 1.0 && line.o == 0.0 {
        if clip.is_kept() {
            // nothing that would differ
            return None;
        }
        if clip.is_none() {
            return Some("it is not clipped".to_owned());
        }
        "it ends elsewhere".to_owned()
    } else {
        if line.s != 1.0 {
            keys.push(format!("scale = {}", number(scale)));
        }
        if offset != feature.offset {
            keys.push(format!("offset = {}", number(offset)));
        }
        match (line.s, line.o) {
            (-1.0, 0.0) => "it has the other sign".to_owned(),
            (s, 0.0) => format!("it is {} times the contract's", number(s)),
            (1.0, o) => format!("it is the contract's plus {}", number(o)),
            (s, o) => format!("it is {} times the contract's plus {}", number(s), number(o)),
        }
    };
    keys.extend(clip.key());
    let is_integral = feature
        .filters
        .iter()
        .any(|filter| matches!(filter, Filter::Integrator { .. }));
    let begun = match is_integral && line.s == 1.0 && line.o != 0.0 {
        true => ". A log that begins in mid-run shows the same: the integral has a past there",
        false => "",
    };
    Some(match keys.is_empty() {
        true => head,
        false => format!("{head}: {} fits the log{begun}", keys.join(", ")),
    })
}
