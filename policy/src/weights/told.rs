//! What an observation tells of the law of a gain schedule, so that a golden duty can be held against it.

use crate::model::{Expr, Factor, Feature, Policy, Schedule};

/// Where base and factors come from, in the order of the sum; empty where nothing is to be told.
#[derive(Default)]
pub(super) struct Told {
    values: Vec<From>,
}

#[derive(Clone, Copy)]
enum From {
    Constant(f64),
    /// The feature of that index behind its filters.
    Feature(usize),
}

impl Told {
    /// # Errors
    /// What the law reads and no feature passes on, as the contract has it.
    pub fn of(head: &Schedule, features: &[Feature]) -> Result<Self, String> {
        let source = |tree: &Expr, text: &str| {
            if let Expr::Constant(value) = tree {
                return Ok(From::Constant(*value));
            }
            let same = |feature: &Feature| feature.filters.is_empty() && feature.source == *tree;
            let index = features.iter().position(same);
            index.map(From::Feature).ok_or_else(|| text.to_owned())
        };
        let mut values = vec![source(&head.base.tree, &head.base.text)?];
        for gain in &head.gains {
            values.push(match &gain.factor {
                Factor::Source(own) => source(&own.tree, &own.text)?,
                Factor::Feature(index) => From::Feature(*index),
                Factor::One => From::Constant(1.0),
            });
        }
        Ok(Self { values })
    }

    /// Base and factors of each row.
    pub fn law(&self, observations: &[f32], features: &[Feature]) -> Vec<f64> {
        let rows = observations.chunks_exact(features.len().max(1));
        let row = |row: &[f32]| {
            let value = |from: &From| match from {
                From::Constant(value) => *value,
                From::Feature(index) => {
                    let known = row.get(*index).zip(features.get(*index));
                    known.map_or(f64::NAN, |(o, feature)| unscaled(f64::from(*o), feature))
                }
            };
            self.values.iter().map(value).collect::<Vec<f64>>()
        };
        rows.flat_map(row).collect()
    }
}

impl Policy {
    /// Whether a log of observations and of what was commanded says what the network answered: golden answers can be made of it.
    #[must_use]
    pub fn log_tells_answers(&self) -> bool {
        let told = |head| Told::of(head, &self.features).is_ok();
        self.head.schedule().is_none_or(told)
    }
}

/// Base and factors of a gain schedule in each row of observations, as [`Golden::law`](crate::Golden::law) has them.
///
/// # Errors
/// The first source of the law that no observation tells, as the contract has it.
pub fn law_told(head: &Schedule, features: &[Feature], observations: &[f32]) -> Result<Vec<f64>, String> {
    Ok(Told::of(head, features)?.law(observations, features))
}

/// The value before scale and offset; NaN at an end of the clip, behind which it may be any.
fn unscaled(o: f64, feature: &Feature) -> f64 {
    let hidden = feature.clip.is_some_and(|clip| {
        // the trainer clips in binary32 of its own
        let slack = 1e-6 * clip.low.abs().max(clip.high.abs());
        o <= clip.low + slack || o >= clip.high - slack
    });
    match hidden {
        true => f64::NAN,
        false => (o - feature.offset) / feature.scale,
    }
}
