//! What a policy decides around its rest, and how it moves there.
//!
//! ```text
//!  plant at one load ─► policy, until it rests ─┬─► the samples that follow: a point, or a limit cycle
//!                                               └─► its memory ─► with other voltages and currents ─► duties
//! ```

use interp::Real;
use plant::{Load, Parameters, Sample, Signals};
use policy::{Policy, Scalar};

use crate::agent::Agent;
use crate::baselines::Design;
use crate::converter::Converter;
use crate::environment::{Environment, LoadPath, Start};
use crate::faults::Error;

/// Duties over error and charging current, and the samples of a policy at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct RestMap {
    /// Errors of the output voltage, V: the columns.
    pub errors: Vec<f64>,
    /// Currents that charge the output capacitor, mean of a period at the duty of rest, A: the rows.
    pub currents: Vec<f64>,
    /// What is commanded before mapping and limits, row by row.
    pub duties: Vec<f64>,
    /// Error in V and charging current in A of one sampling instant after the other, without noise.
    pub cycle: Vec<[f64; 2]>,
}

/// Control periods until a policy is at rest. An observer's bias forgets in some sixty.
const SETTLING: usize = 600;
/// Samples of its rest: a line at a half, a third or a quarter of the sampling frequency goes round fifty times.
const WATCHED: usize = 200;

/// The map of `policy` at `converter` under `load`: `errors` in V around `v_ref`, `currents` in A. In a cell the policy meets this
/// voltage and this current, also in the estimates of its observers; filters and duties before are those of its rest.
///
/// # Errors
/// If the contract measures something that the plant does not have.
pub fn rest_map(
    policy: &Policy,
    converter: &Converter,
    v_ref: f64,
    load: Load,
    [errors, currents]: [Vec<f64>; 2],
) -> Result<RestMap, Error> {
    match policy.numeric_format.scalar() {
        Scalar::F32 => map::<f32>(policy, converter, v_ref, load, [errors, currents]),
        Scalar::F64 => map::<f64>(policy, converter, v_ref, load, [errors, currents]),
    }
}

fn map<T: Real>(
    policy: &Policy,
    converter: &Converter,
    v_ref: f64,
    load: Load,
    [errors, currents]: [Vec<f64>; 2],
) -> Result<RestMap, Error> {
    let mut agent = Agent::<T>::told(policy)?;
    agent.inputs_mut().set_reference(v_ref);
    let charging = Charging::new(converter.parameters(), v_ref);
    let (cycle, last) = at_rest(&mut agent, converter, v_ref, load, charging)?;
    let rest = agent.state().clone();
    let mut duties = Vec::with_capacity(errors.len() * currents.len());
    for current in &currents {
        for error in &errors {
            let (v_out, i_l) = (v_ref + error, charging.i_l(*current, last.i_out));
            let mut moved = rest.clone();
            observe(policy, &mut moved.memory, [i_l, v_out]);
            agent.restore(&moved);
            agent.step(&Signals {
                v_out,
                i_l,
                i_out: last.i_out,
                v_in: last.v_in,
            })?;
            duties.push(agent.command().duty_sim.to_f64());
        }
    }
    Ok(RestMap {
        errors,
        currents,
        duties,
        cycle,
    })
}

/// Lets every observer estimate this current and voltage. Its words are the first of the memory (contract, section 1).
fn observe<T: Real>(policy: &Policy, memory: &mut [T], [i_l, v_out]: [f64; 2]) {
    let mut first = 0;
    for observer in &policy.observers {
        let estimates = [(policy::Estimate::Current, i_l), (policy::Estimate::Voltage, v_out)];
        for (word, (estimate, value)) in memory[first..].iter_mut().zip(estimates) {
            let range = observer.range(estimate);
            *word = T::nearest(value.clamp(range.low, range.high));
        }
        first += observer.words();
    }
}

/// Runs the policy until it rests; the samples that follow, and the last of them.
fn at_rest<T: Real>(
    agent: &mut Agent<T>,
    converter: &Converter,
    v_ref: f64,
    load: Load,
    charging: Charging,
) -> Result<(Vec<[f64; 2]>, Sample), Error> {
    let mut converter = converter.clone();
    let mut sample = converter.restart(&Start {
        v_out: v_ref,
        i_l: converter.holding_current(v_ref, load.at(v_ref)),
        load,
        seed: 0,
        varied: &[],
    })?;
    let mut cycle = Vec::with_capacity(WATCHED);
    for n in 0..SETTLING + WATCHED {
        let duty = agent.step(&sample.measured)?;
        sample = converter.step(duty, &LoadPath::constant(load));
        if n >= SETTLING {
            cycle.push([sample.v_out - v_ref, charging.of(&sample)]);
        }
    }
    Ok((cycle, sample))
}

/// Between the sampled current of the inductor and what charges the capacitor.
#[derive(Debug, Clone, Copy)]
struct Charging {
    below_mean: f64,
    give: f64,
}

impl Charging {
    fn new(parameters: &Parameters, v_ref: f64) -> Self {
        let design = Design::new(parameters, v_ref, 0.0);
        Self {
            below_mean: design.below_mean(),
            give: design.give(),
        }
    }

    fn of(self, sample: &Sample) -> f64 {
        self.give * (sample.i_l + self.below_mean) - sample.i_out
    }

    fn i_l(self, charging: f64, i_out: f64) -> f64 {
        (charging + i_out) / self.give - self.below_mean
    }
}
