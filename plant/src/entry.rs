//! What the catalogue says of an effect and of a parameter, and the macros that write an entry.

use crate::parameters::Parameters;

/// A physical effect and its parameters.
#[derive(Debug, Clone, Copy)]
pub struct Effect {
    /// A short name, such as `esr`.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub meaning: &'static str,
    /// Which way of computing it asks for while it is on.
    pub needs: Way,
    /// Its parameters.
    pub parameters: &'static [Parameter],
}

/// The ways in which a plant is computed, from the fastest to the one that can do everything; each can do what those before
/// it can.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Way {
    /// Many plants side by side ([`crate::Batch`]): two states, a pulse at the period's start, nothing that is remembered.
    Batch,
    /// The same of one plant, and what waits from period to period.
    Step,
    /// Two states between instants anywhere in the period: late gates, late sensors, a sampler off the period's start.
    Walk,
    /// All states of the circuit, or an inductance and a capacitance that change.
    Full,
}

impl Way {
    /// Its word in the documentation.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Way::Batch => "batch",
            Way::Step => "step",
            Way::Walk => "walk",
            Way::Full => "full",
        }
    }
}

impl Effect {
    /// Whether a plant has it: a number that brings it is off its neutral value.
    #[must_use]
    pub fn is_on(&self, parameters: &Parameters) -> bool {
        let mut numbers = self.parameters.iter().filter(|parameter| parameter.switches_on);
        // without tolerance: an effect below a bound would be dropped (docs/decisions/0004-ways-of-computing.md)
        numbers.any(|parameter| parameter.get(parameters) != parameter.neutral)
    }
}

/// One parameter.
#[derive(Debug, Clone, Copy)]
pub struct Parameter {
    /// Where it stands in `plant.toml`, such as `capacitor.esr`.
    pub key: &'static str,
    /// SI unit; `1` for a ratio.
    pub unit: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Smallest and largest value a plant takes.
    // decades beyond any part: a slip of unit or sign is refused, a fit has room. Other reasons stand at the number
    pub allowed: (f64, f64),
    /// What converters of 10 W to 10 kW usually have.
    // classes of data sheets, rounded to 1, 2, 5: conventions that reach from the smallest part to the largest
    pub typical: (f64, f64),
    /// The value of a converter without the effect; the default.
    pub neutral: f64,
    /// Whether another value than the neutral one brings the effect; else it only shapes what another parameter brings.
    pub switches_on: bool,
    /// How to get at it.
    pub(crate) field: Field,
}

/// How to get at a parameter.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Field {
    Number(fn(&Parameters) -> f64, fn(&mut Parameters, f64)),
    Whole(fn(&Parameters) -> u64, fn(&mut Parameters, u64)),
    Choice(
        &'static [&'static str],
        fn(&Parameters) -> usize,
        fn(&mut Parameters, usize),
    ),
}

impl Parameter {
    /// Its value; a choice counts from 0 in the order of the documentation.
    #[must_use]
    pub fn get(&self, parameters: &Parameters) -> f64 {
        match self.field {
            Field::Number(get, _) => get(parameters),
            Field::Whole(get, _) => get(parameters) as f64,
            Field::Choice(_, get, _) => get(parameters) as f64,
        }
    }

    /// Sets it, unchecked; whole numbers and choices are rounded.
    pub fn set(&self, parameters: &mut Parameters, value: f64) {
        match self.field {
            Field::Number(_, set) => set(parameters, value),
            Field::Whole(_, set) => set(parameters, value.round() as u64),
            Field::Choice(_, _, set) => set(parameters, value.round() as usize),
        }
    }

    /// Whether it is a ratio, without a unit.
    #[must_use]
    pub fn is_pure(&self) -> bool {
        self.unit == "1"
    }

    /// Whether it takes whole numbers only.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        matches!(self.field, Field::Whole(..))
    }

    /// The words of a choice, in order; nothing for a number.
    #[must_use]
    pub fn choices(&self) -> &'static [&'static str] {
        match self.field {
            Field::Choice(words, _, _) => words,
            _ => &[],
        }
    }
}

/// A number that brings its effect: `number!(capacitor.esr, "ohm", "meaning", allowed, typical, neutral)`. Its key is the
/// field's path.
macro_rules! number {
    ($($path:tt).+, $($rest:expr),+ $(,)?) => {
        $crate::entry::entry!(true, $($path).+, $($rest),+)
    };
}
pub(crate) use number;

/// A number that only shapes an effect, or without which there is no converter.
macro_rules! detail {
    ($($path:tt).+, $($rest:expr),+ $(,)?) => {
        $crate::entry::entry!(false, $($path).+, $($rest),+)
    };
}
pub(crate) use detail;

macro_rules! entry {
    ($switches_on:expr, $first:ident $(.$then:ident)+,
     $unit:expr, $meaning:expr, $allowed:expr, $typical:expr, $neutral:expr) => {
        $crate::entry::Parameter {
            key: concat!(stringify!($first) $(, ".", stringify!($then))+),
            unit: $unit,
            meaning: $meaning,
            allowed: $allowed,
            typical: $typical,
            neutral: $neutral,
            switches_on: $switches_on,
            field: $crate::entry::Field::Number(|p| p.$first$(.$then)+, |p, value| p.$first$(.$then)+ = value),
        }
    };
}
pub(crate) use entry;

/// The same number of each sensor, with the units of voltages and currents, and what else belongs to the effect:
/// `of_each_sensor!(noise, ("V", "A"), "meaning", allowed, typical, neutral)`.
macro_rules! of_each_sensor {
    ($field:ident, ($volt:expr, $ampere:expr), $meaning:expr, $allowed:expr, $typical:expr, $neutral:expr
     $(, $more:expr)* $(,)?) => {
        &[
            $crate::entry::number!(sensors.v_out.$field, $volt, $meaning, $allowed, $typical, $neutral),
            $crate::entry::number!(sensors.i_l.$field, $ampere, $meaning, $allowed, $typical, $neutral),
            $crate::entry::number!(sensors.i_out.$field, $ampere, $meaning, $allowed, $typical, $neutral),
            $crate::entry::number!(sensors.v_in.$field, $volt, $meaning, $allowed, $typical, $neutral),
            $($more),*
        ]
    };
}
pub(crate) use of_each_sensor;

/// A choice among the variants of an enumeration, in the order of `$words`; the first is neutral.
macro_rules! choice {
    ($table:ident.$field:ident, switches_on = $switches_on:expr, $meaning:expr,
     $kind:ident: $($variant:ident = $word:literal),+) => {
        $crate::entry::Parameter {
            key: concat!(stringify!($table), ".", stringify!($field)),
            unit: "1",
            meaning: $meaning,
            allowed: (0.0, [$($word),+].len() as f64 - 1.0),
            typical: (0.0, [$($word),+].len() as f64 - 1.0),
            neutral: 0.0,
            switches_on: $switches_on,
            field: $crate::entry::Field::Choice(
                &[$($word),+],
                |p| p.$table.$field as usize,
                |p, index| p.$table.$field = *[$($kind::$variant),+].get(index).unwrap_or(&$kind::default()),
            ),
        }
    };
}
pub(crate) use choice;
