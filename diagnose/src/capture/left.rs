//! What a model leaves of captures: structure in a shape, or a number that is off.

use crate::fit::State;
use crate::level::ACCURACY;
use crate::noise;
use crate::problem::Problem;
use crate::record::{CHANNEL_NAMES, CHANNEL_UNITS};
use crate::shape::Structure;
use crate::words::si;

/// A mean or level that is further off than this is no error of an instrument, standard deviations.
const FAR: f64 = 4.0;
/// Mean square of a shape that noise and what a simulator gets wrong may have: half the bins of a parabola against a triangle.
const WILD: f64 = 2.5;

/// Structure that a state leaves in the captures; `null` is the model as given.
#[must_use]
pub fn structures(problem: &Problem, null: &State, state: &State) -> Vec<Structure> {
    let mut found = Vec::new();
    for (index, record) in problem.records.iter().enumerate() {
        let (Some(capture), Some(range)) = (&record.capture, problem.tail(index)) else {
            continue;
        };
        let (left, before) = (&state.residual[range.clone()], &null.residual[range]);
        let mut add = |channel: usize, square: f64, slow: f64, lag1: f64, shape: String| {
            found.push(Structure {
                record: record.name.clone(),
                channel: CHANNEL_NAMES[channel],
                mean_square: square,
                slow,
                correlation: lag1,
                shape,
            });
        };
        for channel in super::terms::SHAPED {
            let Some(bins) = capture.bins_of(channel) else { continue };
            let (now, was) = (noise::left(&left[bins.clone()]), noise::left(&before[bins]));
            if now.square > WILD + ACCURACY * ACCURACY * was.square {
                let fold = capture.folds[channel].as_ref();
                let sd = fold.map_or(0.0, |fold| {
                    let known = || fold.sd.iter().filter(|sd| sd.is_finite());
                    known().sum::<f64>() / known().count().max(1) as f64
                });
                let size = si(now.square.sqrt() * sd, CHANNEL_UNITS[channel]);
                add(
                    channel,
                    now.square,
                    now.slow,
                    now.lag1,
                    format!("a shape within the period, {size}"),
                );
            }
        }
        for (place, what) in capture.scalars() {
            let (now, was) = (left[place].abs(), before[place].abs());
            if now > FAR + ACCURACY * was {
                let channel = usize::from(what.contains("i_l"));
                add(
                    channel,
                    now * now,
                    0.0,
                    0.0,
                    format!("{what} is {now:.0} standard deviations off"),
                );
            }
        }
    }
    found
}
