//! Modulator, load box and sensors around a circuit that is computed elsewhere.

use serde::{Deserialize, Serialize};
use toml_input::Faults;

use crate::catalogue;
use crate::check::check;
use crate::effects::duty_delay::Queue;
use crate::effects::{duty_offset, duty_quantisation, load_setting, minimum_on_time};
use crate::parameters::Parameters;
use crate::plain::Plain;
use crate::sensing::{Memory, Sensing, array};
use crate::signals::{Load, Signals};

/// What of a plant needs no circuit: it acts at sampling instants alone.
// a delay or a low-pass of a sensor follows its signal through the period, which a circuit elsewhere does not show
const EFFECTS: [&str; 11] = [
    "cpl_fold",
    "load_setting",
    "bleed",
    "duty_delay",
    "duty_offset",
    "duty_quantisation",
    "minimum_on_time",
    "sensor_gain",
    "sensor_offset",
    "sensor_noise",
    "sensor_quantisation",
];

/// Modulator, load box and sensors of a plant, without its circuit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Surroundings {
    parameters: Parameters,
    sensing: Sensing,
    queue: Queue,
    memory: Memory,
}

impl Surroundings {
    /// Whether a number of the plant belongs here, by its key.
    #[must_use]
    pub fn has(key: &str) -> bool {
        let own = catalogue::effects().filter(|effect| EFFECTS.contains(&effect.name));
        // how short pulses are treated stands among the numbers of the circuit
        key == "pwm.short_pulse"
            || own
                .flat_map(|effect| effect.parameters)
                .any(|parameter| parameter.key == key)
    }

    /// Those of a plant; what else it has is left out.
    ///
    /// # Errors
    /// As [`crate::Plant::new`].
    pub fn new(parameters: &Parameters) -> Result<Self, Faults> {
        check(parameters)?;
        let mut own = Self {
            sensing: Sensing::new(parameters),
            queue: Queue::default(),
            memory: Memory::new(parameters.sensors.seed, [0.0; 4]),
            parameters: parameters.clone(),
        };
        // a plant has looked once when it has been made: the noise of both is the same from here on
        own.show(&Signals::default());
        Ok(own)
    }

    /// At a sampling instant at rest: delayed duties are those that would hold the voltage, as after [`crate::Plant::reset_at`].
    pub fn reset_at(&mut self, signals: &Signals) {
        let duty = self.parameters.converter.topology.duty(signals.v_in, signals.v_out);
        self.queue = Queue::filled(duty);
        self.memory.refill(array(signals));
    }

    /// The duty at the switch for a commanded one, 0..1.
    pub fn modulate(&mut self, duty: f64) -> f64 {
        let pwm = &self.parameters.pwm;
        // not `clamp`: a duty that is NaN must not reach the circuit
        let clamped = if duty > 0.0 { duty.min(1.0) } else { 0.0 };
        let shifted = duty_offset::shift(self.queue.pass(clamped, pwm.duty_delay), pwm);
        minimum_on_time::limit(
            duty_quantisation::round(shifted, pwm.duty_lsb),
            pwm,
            self.parameters.t_sw(),
        )
    }

    /// What the load box draws when `set` is set.
    #[must_use]
    pub fn drawn(&self, set: &Load) -> Load {
        load_setting::drawn(&self.parameters.load, set)
    }

    /// The current that a drawn load takes at `v_out` V, A.
    #[must_use]
    pub fn load_current(&self, drawn: &Load, v_out: f64) -> f64 {
        let p = &self.parameters;
        Plain::new(&p.converter, 0.0, p.load.v_fold).load_current(drawn, v_out)
    }

    /// What the sensors show of the true signals.
    pub fn show(&mut self, signals: &Signals) -> Signals {
        // no sensor here has a low-pass, so what would be behind it is not looked at
        self.sensing.show(&mut self.memory, signals, array(signals))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Plant;

    /// The plant has the same modulator and sensors: at duties that end a period where it began nothing but they act.
    #[test]
    fn sensors_show_what_those_of_a_plant_show() {
        let mut parameters = Parameters::paper_model();
        parameters.sensors.v_out.noise = 0.1;
        parameters.sensors.v_out.lsb = 0.05;
        parameters.sensors.i_out.gain = 1.1;
        parameters.sensors.seed = 7;
        let (mut plant, load) = (Plant::new(&parameters).unwrap(), Load::resistor(20.0));
        let mut around = Surroundings::new(&parameters).unwrap();
        for period in 0..20 {
            let sample = match period {
                0 => plant.reset_at(100.0, 5.0, &load),
                _ => plant.step(0.5, &load),
            };
            if period == 0 {
                around.reset_at(&sample.signals());
            }
            assert_eq!(around.show(&sample.signals()), sample.measured, "period {period}");
        }
    }

    #[test]
    fn what_needs_the_circuit_is_not_here() {
        for key in [
            "inductor.dcr",
            "switch.v_f",
            "sensors.v_out.delay",
            "sensors.v_out.low_pass",
            "switch.dead_time",
        ] {
            assert!(crate::parameter(key).is_some() && !Surroundings::has(key), "{key}");
        }
        for key in [
            "pwm.duty_delay",
            "pwm.duty_lsb",
            "sensors.v_out.noise",
            "sensors.seed",
            "load.v_fold",
        ] {
            assert!(crate::parameter(key).is_some() && Surroundings::has(key), "{key}");
        }
    }
}
