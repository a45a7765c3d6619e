//! Which converters a spread has: every value of one number or two, or numbers that are drawn.

use random::{Random, Xoshiro};
use toml_input::Message;

use crate::faults::Error;
use crate::read::no_number;

/// Values of a number of the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Its key, such as `converter.inductance`.
    pub key: String,
    /// Ascending, in the unit of the key.
    pub values: Vec<f64>,
    /// Whether it was said how many values there are.
    is_counted: bool,
}

/// Converters whose numbers are drawn from between the ends of their spreads, each independently and uniformly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Draws {
    /// Converters.
    pub count: usize,
    /// The same seed, the same converters; more of them begin with the fewer.
    pub seed: u64,
}

/// Values of a spread unless their number is given.
// with the nominal value in the middle, where the ends are equally far away
const USUAL: usize = 5;
/// Values of a spread at most.
// 21 by 21 converters under five controllers take minutes
const MOST: usize = 21;
/// Drawn converters at most.
// of the paper's six load steps 200 converters under six controllers take minutes, and 10,000 hours
pub(super) const MOST_DRAWN: usize = 10_000;

impl Spread {
    /// From `KEY=LOW,HIGH` or `KEY=LOW,HIGH,N`.
    ///
    /// # Errors
    /// If it is none, the plant has no such number, or the values are no range.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let wrong = |found: &str| -> Error {
            let message = Message::new("--spread is no range of a number of the plant").found(found.to_owned());
            let message = message.expected(format!("KEY=LOW,HIGH or KEY=LOW,HIGH,N with 2 to {MOST} values"));
            message.hint("--spread converter.inductance=57.8e-6,78.2e-6").into()
        };
        let (key, range) = text.split_once('=').ok_or_else(|| wrong(text))?;
        let parameter = plant::parameter(key).ok_or_else(|| no_number(key))?;
        let parts: Vec<&str> = range.split(',').map(str::trim).collect();
        let (ends, count) = match parts.as_slice() {
            [low, high] => ([low, high], Some(USUAL)),
            [low, high, count] => ([low, high], count.parse().ok()),
            _ => return Err(wrong(text)),
        };
        let [low, high] = ends.map(|end| end.parse::<f64>().ok().filter(|x| x.is_finite()));
        let (Some(low), Some(high), Some(count)) = (low, high, count) else {
            return Err(wrong(text));
        };
        if low >= high || !(2..=MOST).contains(&count) {
            return Err(wrong(text));
        }
        let step = (high - low) / (count - 1) as f64;
        Ok(Self {
            key: parameter.key.to_owned(),
            values: (0..count).map(|n| low + n as f64 * step).collect(),
            is_counted: parts.len() == 3,
        })
    }

    /// Smallest and largest value.
    #[must_use]
    pub fn ends(&self) -> [f64; 2] {
        [self.values.first(), self.values.last()].map(|end| end.copied().unwrap_or_default())
    }
}

/// # Errors
/// If the spreads are too many, one stands twice, or they do not go with the draws.
pub(in crate::simulation) fn check(spread: &[Spread], draws: Option<Draws>) -> Result<(), Error> {
    let keys = || spread.iter().map(|spread| spread.key.as_str()).collect::<Vec<_>>();
    let twice = (1..spread.len()).any(|n| keys()[..n].contains(&keys()[n]));
    let Some(draws) = draws else {
        if spread.len() > 2 || twice {
            let message = Message::new("a spread is of one number or of two").found(keys().join(", "));
            let message = message.expected("--spread once or twice, with different keys");
            return Err(message
                .hint("--spread-draws draws converters from as many numbers as you like")
                .into());
        }
        return Ok(());
    };
    if spread.is_empty() {
        let message = Message::new("--spread-draws without a number that is drawn");
        return Err(message.hint("--spread converter.inductance=57.8e-6,78.2e-6").into());
    }
    if twice {
        let message = Message::new("a number of the plant is drawn twice").found(keys().join(", "));
        return Err(message.expected("--spread with different keys").into());
    }
    if let Some(counted) = spread.iter().find(|spread| spread.is_counted) {
        let message = Message::new("a number of the plant cannot be drawn and have a count of values");
        let message = message.found(format!("{} with {} values", counted.key, counted.values.len()));
        return Err(message.expected("KEY=LOW,HIGH with --spread-draws").into());
    }
    if !(1..=MOST_DRAWN).contains(&draws.count) {
        let message = Message::new("--spread-draws is no number of converters").found(draws.count.to_string());
        return Err(message.expected(format!("1 to {MOST_DRAWN}")).into());
    }
    Ok(())
}

/// The numbers of every converter, in the order of the keys: of a grid the first key runs fastest.
pub(super) fn converters(spread: &[Spread], draws: Option<Draws>) -> Vec<Vec<f64>> {
    if let Some(draws) = draws {
        let drawn = |n: usize| {
            // a stream each: how many there are does not move one of them
            let mut random = Xoshiro::stream(draws.seed, n as u64);
            let number = |spread: &Spread| {
                let [low, high] = spread.ends();
                random.uniform(low, high)
            };
            spread.iter().map(number).collect()
        };
        return (0..draws.count).map(drawn).collect();
    }
    let [first, others @ ..] = spread else {
        return Vec::new();
    };
    let rows: Vec<Option<f64>> = match others.first() {
        None => vec![None],
        Some(second) => second.values.iter().copied().map(Some).collect(),
    };
    let row = |row: Option<f64>| {
        let columns = first.values.iter();
        columns.map(move |column| [Some(*column), row].into_iter().flatten().collect())
    };
    rows.into_iter().flat_map(row).collect()
}
