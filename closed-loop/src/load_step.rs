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

/// What may be the source of a step of the source, V; as far apart as [`LoadKind::range`].
pub const SOURCE_RANGE: RangeInclusive<f64> = 1e-3..=1e6;

/// A load before and after, shown as `200 -> 500 W`; or a load that stays while the source steps, shown as
/// `v_in 180 -> 220 V`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadStep {
    /// What the values are.
    pub kind: LoadKind,
    /// Before and after, in the unit of the kind.
    pub values: [f64; 2],
    /// Voltage of the source before and after, V, if it is the source that steps. It steps right behind a sampling instant, the
    /// worst there is, since a controller learns of it a whole period later.
    pub source: Option<[f64; 2]>,
}

impl LoadStep {
    /// The loads before and after.
    #[must_use]
    pub fn loads(&self) -> [Load; 2] {
        self.values.map(|value| self.kind.load(value))
    }

    /// A step of the source, V, at a load that stays.
    #[must_use]
    pub fn of_source(source: [f64; 2], kind: LoadKind, load: f64) -> Self {
        Self {
            kind,
            values: [load; 2],
            source: Some(source),
        }
    }

    /// What steps, before and after, and its unit: W, A or ohm of a load, V of the source.
    #[must_use]
    pub fn stepped(&self) -> ([f64; 2], &'static str) {
        self.source
            .map_or((self.values, self.kind.unit()), |source| (source, "V"))
    }

    /// Start of the names of its files: `200-500W`, or `v_in-180-220V`.
    #[must_use]
    pub fn stem(&self) -> String {
        let ([from, to], unit) = self.stepped();
        let what = if self.source.is_some() { "v_in-" } else { "" };
        format!("{what}{from}-{to}{unit}")
    }

    /// Where in a period the step is at an instant of this phase: that of a source begins with the period.
    #[must_use]
    pub fn phase(&self, phase: f64) -> f64 {
        if self.source.is_some() { 0.0 } else { phase }
    }
}

impl From<[f64; 2]> for LoadStep {
    /// Constant power before and after, W.
    fn from(values: [f64; 2]) -> Self {
        Self {
            kind: LoadKind::Power,
            values,
            source: None,
        }
    }
}

impl fmt::Display for LoadStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([from, to], unit) = (self.values, self.kind.unit());
        match self.source {
            None => write!(f, "{from} -> {to} {unit}"),
            Some([before, after]) => write!(f, "v_in {before} -> {after} V"),
        }
    }
}
