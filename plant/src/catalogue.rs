//! The list of all parameters: key, unit, meaning, allowed and typical values, and how to read and set each by its key.
//! The reader of `plant.toml`, the check, randomisation and diagnosis work from this list.

use crate::effects::ALL;
use crate::parameters::{Carrier, Model, Parameters, Rectifier, ShortPulse};

/// A physical effect and its parameters.
#[derive(Debug, Clone, Copy)]
pub struct Effect {
    /// A short name, such as `esr`.
    pub name: &'static str,
    /// What it is, in one sentence.
    pub meaning: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
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
    pub allowed: (f64, f64),
    /// What converters of 10 W to 10 kW usually have.
    pub typical: (f64, f64),
    /// The value of a converter without the effect; the default.
    pub neutral: f64,
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

    /// The words of a choice, in order; nothing for a number.
    #[must_use]
    pub fn choices(&self) -> &'static [&'static str] {
        match self.field {
            Field::Choice(words, _, _) => words,
            _ => &[],
        }
    }
}

/// Every effect, the circuit itself first.
pub fn effects() -> impl Iterator<Item = &'static Effect> {
    std::iter::once(&CIRCUIT).chain(ALL.iter().copied())
}

/// Every parameter.
pub fn parameters() -> impl Iterator<Item = &'static Parameter> {
    effects().flat_map(|effect| effect.parameters)
}

/// The parameter with this key.
#[must_use]
pub fn parameter(key: &str) -> Option<&'static Parameter> {
    parameters().find(|p| p.key == key)
}

/// A number: `number!(capacitor.esr, "capacitor.esr", "ohm", "meaning", allowed, typical, neutral)`.
macro_rules! number {
    ($($field:ident).+, $key:expr, $unit:expr, $meaning:expr, $allowed:expr, $typical:expr, $neutral:expr) => {
        $crate::catalogue::Parameter {
            key: $key,
            unit: $unit,
            meaning: $meaning,
            allowed: $allowed,
            typical: $typical,
            neutral: $neutral,
            field: $crate::catalogue::Field::Number(|p| p.$($field).+, |p, value| p.$($field).+ = value),
        }
    };
}
pub(crate) use number;

/// A choice among the variants of an enumeration, in the order of `$words`.
macro_rules! choice {
    ($($field:ident).+, $key:expr, $meaning:expr, $kind:ident: $($variant:ident = $word:literal),+) => {
        $crate::catalogue::Parameter {
            key: $key,
            unit: "1",
            meaning: $meaning,
            allowed: (0.0, [$($word),+].len() as f64 - 1.0),
            typical: (0.0, [$($word),+].len() as f64 - 1.0),
            neutral: 0.0,
            field: $crate::catalogue::Field::Choice(
                &[$($word),+],
                |p| p.$($field).+ as usize,
                |p, index| p.$($field).+ = *[$($kind::$variant),+].get(index).unwrap_or(&$kind::default()),
            ),
        }
    };
}

/// The circuit the paper writes down, and how it is modulated and sampled.
const CIRCUIT: Effect = Effect {
    name: "converter",
    meaning: "the loss-free buck converter, its modulator and its sampling instant",
    parameters: &[
        choice!(converter.model, "converter.model", "switching intervals, or mean values over the period",
            Model: Switched = "switched", Averaged = "averaged"),
        choice!(converter.rectifier, "converter.rectifier", "what carries the current while the switch is off",
            Rectifier: Diode = "diode", Synchronous = "synchronous"),
        number!(
            converter.v_in,
            "converter.v_in",
            "V",
            "source voltage",
            (1e-3, 1e6),
            (12.0, 400.0),
            200.0
        ),
        number!(
            converter.inductance,
            "converter.inductance",
            "H",
            "inductance at no current",
            (1e-9, 10.0),
            (1e-6, 1e-2),
            2e-3
        ),
        number!(
            converter.capacitance,
            "converter.capacitance",
            "F",
            "capacitance at no voltage",
            (1e-9, 10.0),
            (1e-6, 1e-2),
            1.5e-3
        ),
        number!(
            converter.f_sw,
            "converter.f_sw",
            "Hz",
            "switching and control frequency",
            (1.0, 1e8),
            (1e4, 1e6),
            10e3
        ),
        choice!(pwm.carrier, "pwm.carrier", "where in the period the on-interval lies: first, last, in the middle",
            Carrier: Trailing = "trailing", Leading = "leading", Centre = "centre"),
        number!(
            pwm.sampling_phase,
            "pwm.sampling_phase",
            "1",
            "sampling instant as a fraction of the PWM period",
            (0.0, 1.0 - 1e-9),
            (0.0, 0.5),
            0.0
        ),
        choice!(pwm.short_pulse, "pwm.short_pulse", "what becomes of a pulse shorter than pwm.min_on_time",
            ShortPulse: Drop = "drop", Extend = "extend"),
    ],
};
