//! The list of all parameters: key, unit, meaning, allowed and typical values, and how to read and set each by its key.
//! The reader of `plant.toml`, the check, randomisation and diagnosis work from this list.

use crate::effects::ALL;
use crate::entry::{Effect, Parameter, Way, choice, detail, number};
use crate::parameters::{Carrier, Model, Parameters, Rectifier, ShortPulse, Topology};

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

/// The way that a plant needs: the furthest of all effects that are on.
pub(crate) fn way(parameters: &Parameters) -> Way {
    let on = effects().filter(|effect| effect.is_on(parameters));
    // nothing is on: the loss-free converter
    on.map(|effect| effect.needs).max().unwrap_or(Way::Batch)
}

/// The loss-free converter of the paper: what is off stands nowhere but here.
impl Default for Parameters {
    fn default() -> Self {
        let mut neutral = Parameters::blank();
        for parameter in parameters() {
            parameter.set(&mut neutral, parameter.neutral);
        }
        neutral
    }
}

/// The circuit the paper writes down, and how it is modulated and sampled.
const CIRCUIT: Effect = Effect {
    name: "converter",
    meaning: "the loss-free converter, its modulator and its sampling instant",
    // another carrier or sampling instant moves the edges in the step; the averaged model has no edges at all
    needs: Way::Walk,
    parameters: &[
        // a row of numbers, known to every way
        choice!(converter.topology, switches_on = false, "what the leg connects the inductor to",
            Topology: Buck = "buck", Boost = "boost", BuckBoost = "buck-boost"),
        choice!(converter.model, switches_on = true, "switching intervals, or mean values over the period",
            Model: Switched = "switched", Averaged = "averaged"),
        // both rectifiers are known to every way, so neither asks for a slower one
        choice!(converter.rectifier, switches_on = false, "what carries the current while the switch is off",
            Rectifier: Diode = "diode", Synchronous = "synchronous"),
        // the four neutral numbers are the paper's; a file cannot lean on them (`reader::REQUIRED`)
        detail!(converter.v_in, "V", "source voltage", (1e-3, 1e6), (12.0, 400.0), 200.0),
        detail!(
            converter.inductance,
            "H",
            "inductance at no current",
            (1e-9, 10.0),
            (1e-6, 1e-2),
            2e-3
        ),
        detail!(
            converter.capacitance,
            "F",
            "capacitance at no voltage",
            (1e-9, 10.0),
            (1e-6, 1e-2),
            1.5e-3
        ),
        detail!(
            converter.f_sw,
            "Hz",
            "switching and control frequency",
            (1.0, 1e8),
            (1e4, 1e6),
            10e3
        ),
        choice!(pwm.carrier, switches_on = true, "where in the period the on-interval lies: first, last, in the middle",
            Carrier: Trailing = "trailing", Leading = "leading", Centre = "centre"),
        number!(
            pwm.sampling_phase,
            "1",
            "sampling instant as a fraction of the PWM period",
            // ranges are closed, and this one must end below 1: a whole period later is phase 0 of the next one
            (0.0, 1.0 - 1e-9),
            (0.0, 0.5),
            0.0
        ),
        choice!(pwm.short_pulse, switches_on = false, "what becomes of a pulse shorter than pwm.min_on_time",
            ShortPulse: Drop = "drop", Extend = "extend"),
    ],
};
