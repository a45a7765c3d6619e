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

/// What may be the voltage to hold around a step of it, V; as far apart as [`LoadKind::range`].
pub const REFERENCE_RANGE: RangeInclusive<f64> = 1e-3..=1e6;

/// A load before and after, shown as `200 -> 500 W`; or a load that stays while the source steps, shown as
/// `v_in 180 -> 220 V`, or the reference, `v_ref 10 -> 12 V`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadStep {
    /// What the values are.
    pub kind: LoadKind,
    /// Before and after, in the unit of the kind.
    pub values: [f64; 2],
    /// Voltage of the source before and after, V, if it is the source that steps. It steps right behind a sampling instant, the
    /// worst there is, since a controller learns of it a whole period later.
    pub source: Option<[f64; 2]>,
    /// Voltage to hold before and after, V, if it is the reference that steps. The controller is told between two samples: the
    /// new one is in force at a sampling instant.
    pub reference: Option<[f64; 2]>,
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
            reference: None,
        }
    }

    /// A step of the voltage to hold, V, at a load that stays.
    #[must_use]
    pub fn of_reference(reference: [f64; 2], kind: LoadKind, load: f64) -> Self {
        Self {
            kind,
            values: [load; 2],
            source: None,
            reference: Some(reference),
        }
    }

    /// The voltages to hold before and after, V; `v_ref` where it stays.
    #[must_use]
    pub fn held(&self, v_ref: f64) -> [f64; 2] {
        self.reference.unwrap_or([v_ref; 2])
    }

    /// Whether the load stays, and something else steps.
    #[must_use]
    pub fn keeps_load(&self) -> bool {
        self.source.is_some() || self.reference.is_some()
    }

    /// What steps, before and after, and its unit: W, A or ohm of a load, V of the source or the reference.
    #[must_use]
    pub fn stepped(&self) -> ([f64; 2], &'static str) {
        let volts = self.source.or(self.reference);
        volts.map_or((self.values, self.kind.unit()), |volts| (volts, "V"))
    }

    /// Start of the names of its files: `200-500W`, `v_in-180-220V` or `v_ref-10-12V`.
    #[must_use]
    pub fn stem(&self) -> String {
        let ([from, to], unit) = self.stepped();
        let what = match (self.source, self.reference) {
            (Some(_), _) => "v_in-",
            (None, Some(_)) => "v_ref-",
            (None, None) => "",
        };
        format!("{what}{from}-{to}{unit}")
    }

    /// Where in a period the step is at an instant of this phase: that of a source or a reference begins with the period.
    #[must_use]
    pub fn phase(&self, phase: f64) -> f64 {
        if self.keeps_load() { 0.0 } else { phase }
    }
}

impl From<[f64; 2]> for LoadStep {
    /// Constant power before and after, W.
    fn from(values: [f64; 2]) -> Self {
        Self {
            kind: LoadKind::Power,
            values,
            source: None,
            reference: None,
        }
    }
}

impl fmt::Display for LoadStep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([from, to], unit) = self.stepped();
        let what = match (self.source, self.reference) {
            (Some(_), _) => "v_in ",
            (None, Some(_)) => "v_ref ",
            (None, None) => "",
        };
        write!(f, "{what}{from} -> {to} {unit}")
    }
}
