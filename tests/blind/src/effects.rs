//! Every effect that may be hidden, with the sizes it is drawn from.

use crate::bench::Bench;
use crate::rng::Rng;

/// A number of the bench that an effect changes.
#[derive(Debug)]
pub struct Parameter {
    /// Its name in `diagnosis.json`.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// How the size is drawn.
    pub size: Size,
    field: fn(&mut Bench) -> &mut f64,
}

/// How a hidden value comes from the nominal one; sizes are drawn uniformly in the logarithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Size {
    /// Nominal plus the size.
    Plus(f64, f64),
    /// Nominal plus or minus the size.
    Either(f64, f64),
    /// Nominal times one plus or minus the size.
    Share(f64, f64),
    /// The size itself, which the nominal bench has too but without consequence.
    Value(f64, f64),
}

/// Something that the model does not know.
#[derive(Debug)]
pub struct Effect {
    /// Id, for a listed effect that of `diagnosis.json`.
    pub id: &'static str,
    /// On the list of causes that a diagnosis may name.
    pub listed: bool,
    /// What is changed. The first one is the size: at 0 change the effect is absent.
    pub parameters: &'static [Parameter],
    /// The measured input voltage is left out of the records.
    pub hides_v_in: bool,
}

impl Parameter {
    /// Its value at this bench.
    #[must_use]
    pub fn get(&self, bench: &Bench) -> f64 {
        *(self.field)(&mut bench.clone())
    }

    /// Sets its value.
    pub fn set(&self, bench: &mut Bench, value: f64) {
        *(self.field)(bench) = value;
    }

    /// A hidden value: `scale` shrinks its distance from the nominal one.
    fn draw(&self, nominal: f64, scale: f64, rng: &mut Rng) -> f64 {
        let mut sign = || if rng.chance(0.5) { 1.0 } else { -1.0 };
        let value = match self.size {
            Size::Plus(low, high) => nominal + scale * rng.log_uniform(low, high),
            Size::Either(low, high) => nominal + sign() * scale * rng.log_uniform(low, high),
            Size::Share(low, high) => nominal * (1.0 + sign() * scale * rng.log_uniform(low, high)),
            Size::Value(low, high) => rng.log_uniform(low, high),
        };
        rounded(value)
    }

    /// A hidden value of middle size, always in the same direction.
    #[must_use]
    pub fn middle(&self, nominal: f64) -> f64 {
        let (Size::Plus(low, high) | Size::Either(low, high) | Size::Share(low, high) | Size::Value(low, high)) =
            self.size;
        let size = libm::sqrt(low * high);
        match self.size {
            Size::Plus(..) | Size::Either(..) => nominal + size,
            Size::Share(..) => nominal * (1.0 + size),
            Size::Value(..) => size,
        }
    }
}

/// Four significant digits, so that a truth file reads well.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

impl Effect {
    /// Puts the effect into the bench with a size drawn at random; `scale` below 1 makes it that much smaller.
    pub fn hide(&self, bench: &mut Bench, scale: f64, rng: &mut Rng) {
        for parameter in self.parameters {
            let nominal = parameter.get(&Bench::nominal());
            let value = parameter.draw(nominal, scale, rng);
            parameter.set(bench, value);
        }
        if self.id == "duty_delay" {
            self.parameters[0].set(bench, 1.0 + rng.below(2) as f64);
        }
        if self.id == "duty_quantisation" {
            // a counter has whole counts
            bench.modulator.duty_lsb = 1.0 / (1.0 / bench.modulator.duty_lsb).round();
        }
    }
}

macro_rules! number {
    ($($field:ident).+, $name:literal, $unit:literal, $kind:ident $low:literal $high:literal) => {
        Parameter { name: $name, unit: $unit, size: Size::$kind($low, $high), field: |bench| &mut bench.$($field).+ }
    };
}

const fn listed(id: &'static str, parameters: &'static [Parameter]) -> Effect {
    Effect {
        id,
        listed: true,
        parameters,
        hides_v_in: false,
    }
}

const fn unlisted(id: &'static str, parameters: &'static [Parameter]) -> Effect {
    Effect {
        id,
        listed: false,
        parameters,
        hides_v_in: false,
    }
}

/// The effects of the list of causes, then those of nobody's list.
pub const EFFECTS: &[Effect] = &[
    listed("dcr", &[number!(circuit.dcr, "dcr", "ohm", Plus 0.1 0.6)]),
    listed("r_ds_on", &[number!(circuit.r_ds_on, "r_ds_on", "ohm", Plus 0.1 0.8)]),
    listed(
        "diode",
        &[
            number!(circuit.v_f, "v_f", "V", Plus 0.3 1.5),
            number!(circuit.r_d, "r_d", "ohm", Plus 0.01 0.1),
        ],
    ),
    listed(
        "dead_time",
        &[number!(modulator.dead_time, "dead_time", "s", Plus 3e-7 3e-6)],
    ),
    listed(
        "turn_on_delay",
        &[number!(modulator.turn_on_delay, "turn_on_delay", "s", Plus 2e-7 2e-6)],
    ),
    listed("esr", &[number!(circuit.esr, "esr", "ohm", Plus 0.08 0.5)]),
    listed("esl", &[number!(circuit.esl, "esl", "H", Plus 3e-8 3e-7)]),
    listed(
        "l_wrong",
        &[number!(circuit.inductance, "inductance", "H", Share 0.06 0.3)],
    ),
    listed(
        "c_wrong",
        &[number!(circuit.capacitance, "capacitance", "F", Share 0.06 0.3)],
    ),
    listed(
        "l_saturation",
        &[
            number!(circuit.saturation, "saturation", "1", Plus 0.2 0.6),
            number!(circuit.i_sat, "i_sat", "A", Value 4.0 12.0),
        ],
    ),
    listed(
        "c_derating",
        &[
            number!(circuit.derating, "derating", "1", Plus 0.15 0.6),
            number!(circuit.v_half, "v_half", "V", Value 60.0 150.0),
        ],
    ),
    listed(
        "source_impedance",
        &[number!(circuit.source_resistance, "resistance", "ohm", Plus 0.1 1.0)],
    ),
    Effect {
        hides_v_in: true,
        ..listed("v_in_wrong", &[number!(circuit.v_in, "v_in", "V", Either 1.5 8.0)])
    },
    listed(
        "sensor_low_pass",
        &[number!(sensors.low_pass, "time_constant", "s", Plus 2e-5 2e-4)],
    ),
    listed(
        "sampling_delay",
        &[number!(sensors.delay, "delay", "s", Either 4e-6 3.5e-5)],
    ),
    listed("v_gain", &[number!(sensors.v_gain, "gain", "1", Either 0.006 0.03)]),
    listed("v_offset", &[number!(sensors.v_offset, "offset", "V", Either 0.3 1.5)]),
    listed("i_gain", &[number!(sensors.i_gain, "gain", "1", Either 0.01 0.05)]),
    listed("i_offset", &[number!(sensors.i_offset, "offset", "A", Either 0.05 0.3)]),
    listed(
        "adc_quantisation",
        &[
            number!(sensors.v_lsb, "v_lsb", "V", Plus 0.3 1.5),
            number!(sensors.i_lsb, "i_lsb", "A", Plus 0.15 0.6),
        ],
    ),
    listed(
        "duty_delay",
        &[number!(modulator.duty_delay, "periods", "1", Value 1.0 2.0)],
    ),
    listed(
        "duty_quantisation",
        &[number!(modulator.duty_lsb, "duty_lsb", "1", Plus 0.004 0.025)],
    ),
    listed(
        "cpl_bandwidth",
        &[number!(circuit.cpl_time_constant, "time_constant", "s", Plus 1.5e-4 1.5e-3)],
    ),
    listed("cpl_fold", &[number!(circuit.v_fold, "v_fold", "V", Value 88.0 108.0)]),
    listed(
        "load_gain",
        &[number!(circuit.load_gain, "gain", "1", Either 0.02 0.08)],
    ),
    unlisted(
        "slow_turn_off",
        &[number!(circuit.odd.switch_node_capacitance, "node", "F", Plus 5e-9 3e-8)],
    ),
    unlisted(
        "edge_jitter",
        &[number!(modulator.jitter_per_ampere, "jitter", "s/A", Plus 1e-7 4e-7)],
    ),
    unlisted(
        "missing_pulses",
        &[number!(modulator.missing, "missing", "1", Plus 0.005 0.03)],
    ),
    unlisted(
        "magnetic_hysteresis",
        &[number!(circuit.odd.hysteresis_current, "hysteresis", "A", Plus 0.1 0.5)],
    ),
    unlisted(
        "resistance_drift",
        &[
            number!(circuit.odd.drift_resistance, "drift", "ohm", Plus 0.3 1.0),
            number!(circuit.odd.drift_time, "drift time", "s", Value 4e-3 1.5e-2),
        ],
    ),
    unlisted(
        "dielectric_absorption",
        &[
            number!(circuit.odd.absorption, "absorption", "1", Plus 0.3 1.0),
            number!(circuit.odd.absorption_resistance, "absorption resistance", "ohm", Value 3.0 15.0),
        ],
    ),
    unlisted(
        "eddy_currents",
        &[
            number!(circuit.odd.eddy_share, "eddy share", "1", Plus 0.2 0.5),
            number!(circuit.odd.eddy_resistance, "eddy resistance", "ohm", Value 0.5 4.0),
        ],
    ),
    unlisted(
        "cubic_sensor",
        &[number!(sensors.odd.cubic, "cubic", "V", Either 0.4 1.5)],
    ),
    unlisted(
        "mains_pickup",
        &[
            number!(sensors.odd.mains, "mains", "V", Plus 0.3 1.5),
            number!(sensors.odd.mains_phase, "mains phase", "1", Value 0.1 1.0),
        ],
    ),
    unlisted(
        "shift_in_record",
        &[number!(sensors.odd.shift, "shift", "V", Either 0.5 2.0)],
    ),
    unlisted(
        "outlier_burst",
        &[number!(sensors.odd.burst, "burst", "V", Plus 4.0 20.0)],
    ),
    unlisted(
        "load_cable",
        &[
            number!(circuit.odd.cable_inductance, "inductance", "H", Plus 3e-4 2e-3),
            number!(circuit.odd.cable_capacitance, "capacitance", "F", Value 2e-5 1e-4),
        ],
    ),
    Effect {
        hides_v_in: true,
        ..unlisted(
            "line_ripple",
            &[
                number!(circuit.odd.line_ripple, "ripple", "V", Plus 1.0 6.0),
                number!(circuit.odd.line_frequency, "frequency", "Hz", Value 100.0 360.0),
            ],
        )
    },
];

/// The effect with this id.
#[must_use]
pub fn effect(id: &str) -> Option<&'static Effect> {
    EFFECTS.iter().find(|effect| effect.id == id)
}

/// Ids of the list of causes, in order.
pub fn listed_effects() -> impl Iterator<Item = &'static Effect> {
    EFFECTS.iter().filter(|effect| effect.listed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hidden_effect_changes_its_parameters_and_nothing_else() {
        for effect in EFFECTS {
            let mut bench = Bench::nominal();
            effect.hide(&mut bench, 1.0, &mut Rng::new(5, &[]));
            for parameter in effect.parameters {
                let nominal = parameter.get(&Bench::nominal());
                assert_ne!(parameter.get(&bench), nominal, "{} {}", effect.id, parameter.name);
                parameter.set(&mut bench, nominal);
            }
            assert_eq!(bench, Bench::nominal(), "{}", effect.id);
        }
    }

    #[test]
    fn no_effect_has_the_place_of_another() {
        let mut keys: Vec<_> = EFFECTS.iter().map(|effect| effect.id).collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), EFFECTS.len());
        assert_eq!(listed_effects().count(), 25);
    }
}
