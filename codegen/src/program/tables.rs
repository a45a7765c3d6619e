//! Constant tables as data: what they hold, and how the loops read them.
//!
//! ```text
//!  weights of 20 outputs, blocks of 16, 3 inputs       strips: 16 weights of input 0, 16 of input 1, 16 of input 2  \ times 1
//!  ┌────────────────────────────┬───────────┐
//!  │ 3 x 16                     │ 3 x 4     │                  4 weights of input 0, 4 of input 1, 4 of input 2    times 3
//!  └────────────────────────────┴───────────┘
//! ```
//!
//! The one invariant: the values stand in the order in which the loops read them, so that a language with pointers moves one
//! pointer on and never computes an index. C prints a table as one array. Rust prints each slice as an array of arrays, which
//! its iterators walk without an index that could panic.

use policy::Scalar;

use super::literal::Literal;

/// What a table holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Element {
    /// Floats of a width.
    Float(Scalar),
    /// Signed integers of so many bytes.
    Integer {
        /// 1, 2 or 4.
        bytes: usize,
    },
    /// Words of 32 bits, printed in hexadecimal digits.
    Word,
}

impl Element {
    /// Bytes of a value.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Element::Float(scalar) => 4 * scalar.words(),
            Element::Integer { bytes } => bytes,
            Element::Word => 4,
        }
    }

    /// The words of a value that the integrity check takes, the low one first: narrow integers are widened with their sign.
    pub fn words(self, value: Literal) -> impl Iterator<Item = u32> {
        let (value, count) = (value.value(), self.bytes().div_ceil(4));
        let bits = match self {
            Element::Float(Scalar::F32) => (value as f32).to_bits().into(),
            Element::Float(Scalar::F64) => value.to_bits(),
            Element::Integer { .. } => (value as i32).cast_unsigned().into(),
            Element::Word => value as u64,
        };
        [bits as u32, (bits >> 32) as u32].into_iter().take(count)
    }
}

/// One array of arrays among those that a table is cut into.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Slice {
    /// Before the table's name, in capitals: empty, `TAIL_`, ...
    pub prefix: &'static str,
    /// Lengths of one item, the outermost first; none for a single value.
    pub item: Vec<usize>,
}

/// A stretch of a table: `times` times one item of each slice.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Strip {
    /// Items of each slice.
    pub times: usize,
    /// One slice, or two that alternate.
    pub slices: Vec<Slice>,
}

impl Strip {
    /// A strip of one slice.
    #[must_use]
    pub fn of(prefix: &'static str, times: usize, item: Vec<usize>) -> Self {
        let slices = vec![Slice { prefix, item }];
        Self { times, slices }
    }

    fn len(&self) -> usize {
        let item = |slice: &Slice| slice.item.iter().product::<usize>();
        self.times * self.slices.iter().map(item).sum::<usize>()
    }
}

/// A constant table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Name in small letters, with the number of the layer.
    pub name: String,
    /// What it holds.
    pub element: Element,
    /// The values in the order in which they are read.
    pub values: Vec<Literal>,
    /// How the values are cut, in their order.
    pub strips: Vec<Strip>,
    /// Bytes to which the table is aligned, if to more than its elements.
    pub alignment: Option<u32>,
    /// Whether the integrity check covers it.
    pub is_checked: bool,
}

impl Table {
    /// A plain array that the integrity check does not cover.
    #[must_use]
    pub fn plain(name: &str, element: Element, values: impl IntoIterator<Item = Literal>) -> Self {
        let values: Vec<Literal> = values.into_iter().collect();
        Self {
            name: name.to_owned(),
            element,
            strips: vec![Strip::of("", values.len(), Vec::new())],
            values,
            alignment: None,
            is_checked: false,
        }
    }

    /// A plain array of 32-bit words.
    #[must_use]
    pub fn words(name: &str, words: &[u32]) -> Self {
        Self::plain(name, Element::Word, words.iter().map(|word| Literal::exact(*word)))
    }

    /// The words that the integrity check takes, in order.
    pub fn checked_words(&self) -> impl Iterator<Item = u32> + '_ {
        self.values.iter().flat_map(|value| self.element.words(*value))
    }

    /// Each slice with its lengths (that of the whole first) and its values.
    #[must_use]
    pub fn slices(&self) -> Vec<(&'static str, Vec<usize>, Vec<Literal>)> {
        let mut rest = self.values.as_slice();
        let mut all = Vec::new();
        for strip in &self.strips {
            let (part, after) = rest.split_at(strip.len().min(rest.len()));
            rest = after;
            // two slices of a strip alternate: each takes its part of every period
            let period = strip.len() / strip.times.max(1);
            let mut first = 0;
            for slice in &strip.slices {
                let length: usize = slice.item.iter().product();
                let items = part.chunks(period.max(1));
                let values = items.flat_map(|item| &item[first..first + length]).copied().collect();
                let lengths = std::iter::once(strip.times).chain(slice.item.iter().copied());
                all.push((slice.prefix, lengths.collect(), values));
                first += length;
            }
        }
        all
    }
}
