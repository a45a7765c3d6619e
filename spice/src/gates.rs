//! From a duty to the edges of the gates, from the description of the modulator in docs/reference/plant-file.md.

use plant::{Carrier, Parameters, Rectifier};

use crate::host::{Edge, Source};

/// Rise and fall time of a gate, s. The switch conducts from the first percent of it, so a falling gate ends in time and a
/// rising one starts in time.
pub(crate) const RISE: f64 = 0.5e-9;

/// The modulator between controller and gates.
#[derive(Debug, Clone)]
pub(crate) struct Modulator {
    /// Duties commanded and not yet in force, oldest first.
    waiting: Vec<f64>,
}

impl Modulator {
    /// Until the first command is in force the duty holds `duty`.
    pub fn new(p: &Parameters, duty: f64) -> Self {
        Self {
            waiting: vec![duty; p.pwm.duty_delay as usize],
        }
    }

    /// Edges of the next PWM period, which starts with this control period or, sampled later, within it.
    pub fn edges(&mut self, p: &Parameters, command: f64) -> Vec<Edge> {
        self.waiting.push(command);
        let duty = real(p, self.waiting.remove(0));
        let t = p.t_sw();
        let phase = p.pwm.sampling_phase;
        pulse(p, duty, if phase > 0.0 { (1.0 - phase) * t } else { 0.0 })
    }
}

/// What the modulator makes of a duty.
fn real(p: &Parameters, duty: f64) -> f64 {
    // written anew, not taken from the plant: a shared line could be wrong in both and the comparison would not see it
    let duty = if duty.is_nan() { 0.0 } else { duty.clamp(0.0, 1.0) };
    let has_edges = duty > 0.0 && duty < 1.0;
    let duty = if has_edges {
        (duty + p.pwm.duty_offset).clamp(0.0, 1.0)
    } else {
        duty
    };
    let lsb = p.pwm.duty_lsb;
    let duty = if lsb > 0.0 { (duty / lsb).round() * lsb } else { duty };
    if duty * p.t_sw() < p.pwm.min_on_time {
        0.0
    } else {
        duty.min(1.0)
    }
}

/// Edges of a PWM period from `start` on.
pub(crate) fn pulse(p: &Parameters, duty: f64, start: f64) -> Vec<Edge> {
    let (t, s) = (p.t_sw(), &p.switch);
    let late = s.dead_time + s.turn_on_delay;
    let on = duty * t;
    if on <= 0.0 {
        return Vec::new();
    }
    let from = start
        + match p.pwm.carrier {
            Carrier::Trailing => 0.0,
            Carrier::Leading => t - on,
            Carrier::Centre => 0.5 * (t - on),
        };
    let edge = |source, time, level| Edge {
        source,
        time,
        rise: RISE,
        level,
    };
    let mut edges = vec![
        edge(Source::UpperGate, from + late, 1.0),
        edge(Source::UpperGate, from + on + s.turn_off_delay - RISE, 0.0),
    ];
    if p.converter.rectifier == Rectifier::Synchronous {
        edges.push(edge(Source::LowerGate, from + s.turn_off_delay - RISE, 0.0));
        edges.push(edge(Source::LowerGate, from + on + late, 1.0));
    }
    edges
}
