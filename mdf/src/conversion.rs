//! CC: from the stored number to the physical one.

use crate::Error;
use crate::block::{Blocks, Link};

/// Pairs of a table, at most.
const MOST_VALUES: usize = 100_000;

/// How a physical value is made. Numbers of the types in brackets are those of the format.
#[derive(Debug, Clone, PartialEq)]
pub enum Conversion {
    /// None, or [0].
    Same,
    /// [1] `offset + factor x`.
    Linear([f64; 2]),
    /// [2] `(a x^2 + b x + c) / (d x^2 + e x + f)`.
    Rational([f64; 6]),
    /// [4] and [5] keys, rising, and their values; between two of them a line, or the nearer one.
    Table {
        /// (key, value).
        pairs: Vec<(f64, f64)>,
        /// Whether there is a line between two keys.
        is_line: bool,
    },
    /// [6] ranges of keys with a value each, and the value of all others.
    Ranges {
        /// (from, to, value).
        ranges: Vec<(f64, f64, f64)>,
        /// Outside of them.
        default: f64,
        /// Floats: the upper end belongs to the next range.
        is_half_open: bool,
    },
    /// Texts, or a formula as a text: no number.
    Words,
}

impl Conversion {
    /// `is_float` is the type of what is stored.
    pub fn read(blocks: &Blocks<'_>, link: Option<Link>, is_float: bool) -> Result<(Self, Option<Link>), Error> {
        let Some(link) = link else {
            return Ok((Self::Same, None));
        };
        let block = blocks.at(link, &["CC"])?;
        let unit = block.link(1);
        let kind = block.byte(0)?;
        let count = usize::from(block.half(6)?);
        // behind type, precision, flags, counts, and both ends of the physical range
        let value = |index: usize| block.real(24 + 8 * index);
        let all = || {
            (0..count.min(MOST_VALUES))
                .map(value)
                .collect::<Result<Vec<f64>, Error>>()
        };
        let conversion = match kind {
            0 => Self::Same,
            1 => Self::Linear([value(0)?, value(1)?]),
            2 => Self::Rational([value(0)?, value(1)?, value(2)?, value(3)?, value(4)?, value(5)?]),
            4 | 5 => {
                let (pairs, _) = all()?
                    .as_chunks::<2>()
                    .0
                    .iter()
                    .map(|[key, value]| (*key, *value))
                    .fold(
                        (Vec::new(), f64::NEG_INFINITY),
                        |(mut pairs, last), (key, value)| match key > last {
                            true => {
                                pairs.push((key, value));
                                (pairs, key)
                            }
                            // one that does not rise is no table
                            false => (Vec::new(), f64::INFINITY),
                        },
                    );
                match pairs.is_empty() {
                    true => return Err(block.short()),
                    false => Self::Table {
                        pairs,
                        is_line: kind == 4,
                    },
                }
            }
            6 => {
                let values = all()?;
                let (threes, rest) = values.as_chunks::<3>();
                Self::Ranges {
                    ranges: threes.iter().map(|[from, to, value]| (*from, *to, *value)).collect(),
                    default: rest.first().copied().ok_or(block.short())?,
                    is_half_open: is_float,
                }
            }
            _ => Self::Words,
        };
        Ok((conversion, unit))
    }

    /// The physical value of `x`.
    pub fn of(&self, x: f64) -> f64 {
        match self {
            Self::Same | Self::Words => x,
            Self::Linear([offset, factor]) => factor * x + offset,
            Self::Rational([a, b, c, d, e, f]) => ((a * x + b) * x + c) / ((d * x + e) * x + f),
            Self::Table { pairs, is_line } => table(pairs, *is_line, x),
            Self::Ranges {
                ranges,
                default,
                is_half_open,
            } => {
                let holds = |(from, to, _): &&(f64, f64, f64)| match is_half_open {
                    true => (*from..*to).contains(&x),
                    false => (*from..=*to).contains(&x),
                };
                ranges.iter().find(holds).map_or(*default, |(.., value)| *value)
            }
        }
    }
}

fn table(pairs: &[(f64, f64)], is_line: bool, x: f64) -> f64 {
    let above = pairs.partition_point(|(key, _)| *key <= x);
    let (Some(first), Some(last)) = (pairs.first(), pairs.last()) else {
        return f64::NAN;
    };
    let Some(low) = above.checked_sub(1).and_then(|index| pairs.get(index)) else {
        return if x.is_nan() { x } else { first.1 };
    };
    let Some(high) = pairs.get(above) else { return last.1 };
    let share = (x - low.0) / (high.0 - low.0);
    match is_line {
        true => low.1 + share * (high.1 - low.1),
        // in the middle the lower one
        false if share <= 0.5 => low.1,
        false => high.1,
    }
}
