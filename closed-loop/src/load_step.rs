//! What changes at a load step.

use std::fmt;
use std::ops::RangeInclusive;

use plant::Load;

/// What kind of load a number sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LoadKind {
    /// Constant power, W.
    #[default]
    Power,
    /// Constant current, A.
    Current,
    /// Resistance, ohm.
    Resistance,
}

impl LoadKind {
    /// Unit of the number, such as `W`.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Power => "W",
            Self::Current => "A",
            Self::Resistance => "ohm",
        }
    }

    /// What a load step may be between, in [`LoadKind::unit`].
    #[must_use]
    pub fn range(self) -> RangeInclusive<f64> {
        // decades beyond any bench: a slip of unit or sign is refused
        match self {
            Self::Power => 0.0..=1e7,
            Self::Current => 0.0..=1e6,
            Self::Resistance => 1e-6..=1e12,
        }
    }

    /// The load of this kind with `value` in [`LoadKind::unit`].
    #[must_use]
    pub fn load(self, value: f64) -> Load {
        match self {
            Self::Power => Load::power(value),
            Self::Current => Load::current(value),
            Self::Resistance => Load::resistor(value),
        }
    }

    /// The number that sets `load`, the inverse of [`LoadKind::load`].
    #[must_use]
    pub fn value(self, load: &Load) -> f64 {
        match self {
            Self::Power => load.power,
            Self::Current => load.current,
            Self::Resistance => 1.0 / load.conductance,
        }
    }
}

/// A load before and after; shown as `200 -> 500 W`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadStep {
    /// What the values are.
    pub kind: LoadKind,
    /// Before and after, in the unit of the kind.
    pub values: [f64; 2],
}

impl LoadStep {
    /// The loads before and after.
    #[must_use]
    pub fn loads(&self) -> [Load; 2] {
        self.values.map(|value| self.kind.load(value))
    }

    /// Start of the names of its files: `200-500W`.
    #[must_use]
    pub fn stem(&self) -> String {
        let [from, to] = self.values;
        format!("{from}-{to}{}", self.kind.unit())
    }
}

impl From<[f64; 2]> for LoadStep {
    /// Constant power before and after, W.
    fn from(values: [f64; 2]) -> Self {
        Self {
            kind: LoadKind::Power,
            values,
        }
    }
}

impl fmt::Display for LoadStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [from, to] = self.values;
        write!(f, "{from} -> {to} {}", self.kind.unit())
    }
}
