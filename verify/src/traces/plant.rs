//! A surrogate plant that answers the duty, so that closed-loop values and sequences appear in the stream.
//!
//! It need not be the plant of the policy: it has to move every signal through its plausible range as a converter does.

use policy::{Interval, Policy};
use random::{Random, SplitMix};

#[derive(Debug, Clone)]
pub(super) struct Plant {
    buck: Option<Buck>,
    /// Per signal: range, value, gain on the duty and bias of its first-order response.
    responses: Vec<Response>,
}

#[derive(Debug, Clone)]
struct Response {
    range: Interval,
    /// Relative position in the range.
    value: f64,
    gain: f64,
    bias: f64,
}

/// Averaged buck converter with a load that steps.
#[derive(Debug, Clone)]
struct Buck {
    v_out: usize,
    i_l: usize,
    i_out: usize,
    v_in: f64,
    inductance: f64,
    capacitance: f64,
    resistance: f64,
    period: f64,
    v: f64,
    i: f64,
    power: f64,
    max_power: f64,
}

/// Euler steps per sample period.
// this and all figures below are conventions: they have to move signals, not to be those of a converter
const SUBSTEPS: usize = 8;
/// Measurement noise relative to the range.
const NOISE: f64 = 5e-4;

impl Plant {
    pub fn new(policy: &Policy, rng: &mut SplitMix) -> Self {
        let responses = policy
            .signals
            .iter()
            .map(|signal| Response {
                range: signal.range,
                value: rng.uniform(0.2, 0.8),
                gain: rng.uniform(-1.0, 1.0),
                bias: rng.uniform(0.2, 0.8),
            })
            .collect();
        Self {
            buck: Buck::new(policy, rng),
            responses,
        }
    }

    /// One sample period under `duty`; the values at its end with noise, one per signal.
    pub fn advance(&mut self, duty: f64, rng: &mut SplitMix) -> Vec<f64> {
        let mut values: Vec<f64> = self
            .responses
            .iter_mut()
            .map(|response| {
                // a load or source that changes now and then, so that the signal does not settle for good
                if rng.one_in(100) {
                    response.bias = rng.uniform(0.1, 0.9);
                }
                response.value += 0.1 * (response.bias + response.gain * (duty - 0.5) - response.value);
                response.range.low + response.value * (response.range.high - response.range.low)
            })
            .collect();
        if let Some(buck) = &mut self.buck {
            let i_out = buck.advance(duty, rng);
            values[buck.v_out] = buck.v;
            values[buck.i_l] = buck.i;
            values[buck.i_out] = i_out;
        }
        for (value, response) in values.iter_mut().zip(&self.responses) {
            *value += NOISE * (response.range.high - response.range.low) * rng.sum_of_twelve();
        }
        values
    }
}

impl Buck {
    /// `None` unless the signals have the names of a buck converter.
    fn new(policy: &Policy, rng: &mut SplitMix) -> Option<Self> {
        let find = |name: &str| policy.signals.iter().position(|signal| signal.name == name);
        // by their names alone: nothing else in a contract says what a signal is
        let (v_out, i_l, i_out) = (find("v_out")?, find("i_l")?, find("i_out")?);
        let period = policy.sample_period;
        let v_max = policy.signals[v_out].range.high;
        let i_max = policy.signals[i_out].range.high;
        let capacitance = policy
            .parameters
            .get("c_out")
            .copied()
            .filter(|c| *c > 0.0)
            .unwrap_or(1.5e-3);
        // resonance 100 periods long: slow against the control, fast against a segment
        let omega = std::f64::consts::TAU / (100.0 * period);
        let v_in = 0.8 * v_max;
        let v = v_in * rng.uniform(0.3, 0.7);
        let max_power = 0.3 * v_in * i_max;
        Some(Self {
            v_out,
            i_l,
            i_out,
            v_in,
            inductance: 1.0 / (omega * omega * capacitance),
            capacitance,
            resistance: 0.05 * v_in / i_max,
            period,
            v,
            i: 0.2 * i_max,
            power: max_power * rng.uniform(0.1, 0.7),
            max_power,
        })
    }

    /// One period; the load current at its end.
    fn advance(&mut self, duty: f64, rng: &mut SplitMix) -> f64 {
        if rng.one_in(120) {
            self.power = self.max_power * rng.uniform(0.05, 0.7);
        }
        let dt = self.period / SUBSTEPS as f64;
        // constant power above a tenth of the input voltage, a resistor below
        let knee = 0.1 * self.v_in;
        let power = self.power;
        let load = |v: f64| if v > knee { power / v } else { power * v / (knee * knee) };
        for _ in 0..SUBSTEPS {
            let slope = (duty * self.v_in - self.v - self.resistance * self.i) / self.inductance;
            // the diode lets no current flow back
            self.i = (self.i + dt * slope).max(0.0);
            self.v = (self.v + dt * (self.i - load(self.v)) / self.capacitance).clamp(0.0, 1.5 * self.v_in);
        }
        load(self.v)
    }
}
