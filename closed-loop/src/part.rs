//! A part of a PWM period, for a plant that is sampled inside of it.
//!
//! ```text
//!           sample                sample
//! ──┬─────────┬───────┬─────────────┬───────┬──   the duty commanded on a sample acts from the next start on
//!   start     phase   start         phase   start
//!             ├───────┤ the duty in force
//!                     ├─────────────┤ the first part of the next one
//! ```

use plant::{Carrier, Load, Model, Parameters, Plant};

use crate::faults::Error;

/// What becomes of voltage and current between two instants of a PWM period. Delays and sensors of the plant have no part in it.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    carrier: Carrier,
    averaged: bool,
    pieces: Vec<Piece>,
}

/// An interval in which the switch is on first or on last.
#[derive(Debug, Clone)]
struct Piece {
    /// Start and end as shares of the PWM period.
    from: f64,
    to: f64,
    /// With the interval as its period.
    plant: Plant,
}

impl Part {
    /// Of the periods of a plant with these parameters, from `from` to `to`, shares of the period.
    ///
    /// # Errors
    /// If the parameters are not those of a converter.
    pub fn new(parameters: &Parameters, from: f64, to: f64) -> Result<Self, Error> {
        let carrier = parameters.pwm.carrier;
        // a pulse in the middle of the period is one that comes last, and one that comes first
        let ends = match carrier {
            Carrier::Centre if from < 0.5 && to > 0.5 => vec![(from, 0.5), (0.5, to)],
            Carrier::Trailing | Carrier::Leading | Carrier::Centre => vec![(from, to)],
        };
        let mut pieces = Vec::with_capacity(ends.len());
        for (from, to) in ends.into_iter().filter(|(from, to)| to > from) {
            let mut own = parameters.clone();
            own.converter.f_sw /= to - from;
            own.pwm.sampling_phase = 0.0;
            own.pwm.duty_delay = 0;
            own.pwm.carrier = match carrier {
                Carrier::Trailing => Carrier::Trailing,
                Carrier::Leading => Carrier::Leading,
                Carrier::Centre if to <= 0.5 => Carrier::Leading,
                Carrier::Centre => Carrier::Trailing,
            };
            own.sensors = plant::Sensors::default();
            let plant = Plant::new(&own)?;
            pieces.push(Piece { from, to, plant });
        }
        Ok(Self {
            carrier,
            averaged: parameters.converter.model == Model::Averaged,
            pieces,
        })
    }

    /// Voltage and current at its end, from those at its start, under the duty of its period.
    pub fn pass(&mut self, v_out: f64, i_l: f64, duty: f64, load: &Load) -> (f64, f64) {
        let (mut v, mut i) = (v_out, i_l);
        for piece in &mut self.pieces {
            let share = match self.averaged {
                true => duty,
                false => on(self.carrier, duty, piece.from, piece.to) / (piece.to - piece.from),
            };
            piece.plant.reset_at(v, i, load);
            let sample = piece.plant.step(share, load);
            (v, i) = (sample.v_out, sample.i_l);
        }
        (v, i)
    }
}

/// How long the switch is on between two instants of a period, all as shares of it.
pub(crate) fn on(carrier: Carrier, duty: f64, from: f64, to: f64) -> f64 {
    let start = match carrier {
        Carrier::Trailing => 0.0,
        Carrier::Centre => 0.5 * (1.0 - duty),
        Carrier::Leading => 1.0 - duty,
    };
    (to.min(start + duty) - from.max(start)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The plant itself, sampled at the one instant and at the other, is the reference.
    #[test]
    fn two_parts_are_a_period_and_meet_the_plant_where_it_is_sampled() {
        let load = Load::power(400.0);
        for carrier in [Carrier::Trailing, Carrier::Centre, Carrier::Leading] {
            for phase in [0.1, 0.4, 0.5, 0.8] {
                let mut parameters = Parameters::paper_model();
                parameters.pwm.carrier = carrier;
                let mut whole = Plant::new(&parameters).unwrap();
                whole.reset_at(98.0, 3.0, &load);
                parameters.pwm.sampling_phase = phase;
                let mut first = Part::new(&parameters, 0.0, phase).unwrap();
                let mut rest = Part::new(&parameters, phase, 1.0).unwrap();
                let at_end = whole.step(0.47, &load);
                let (v, i) = first.pass(98.0, 3.0, 0.47, &load);
                let (v_end, i_end) = rest.pass(v, i, 0.47, &load);
                assert!(
                    (v_end - at_end.v_out).abs() < 1e-9 && (i_end - at_end.i_l).abs() < 1e-9,
                    "{carrier:?} {phase}: {v_end} {i_end}, {at_end:?}"
                );
                // sampled inside: the rest of the period under the duty in force, then the first part under the new one
                let mut sampled = Plant::new(&parameters).unwrap();
                sampled.reset_within(v, i, &load, &[0.47]);
                let next = sampled.step(0.52, &load);
                let (v_next, i_next) = first.pass(v_end, i_end, 0.52, &load);
                assert!(
                    (v_next - next.v_out).abs() < 1e-9 && (i_next - next.i_l).abs() < 1e-9,
                    "{carrier:?} {phase}: {v_next} {i_next}, {next:?}"
                );
            }
        }
    }
}
