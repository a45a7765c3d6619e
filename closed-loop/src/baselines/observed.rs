//! A classical controller that measures no more than a policy: it stands behind the observer of the policy's contract.
//!
//! ```text
//!  v_out, i_out ─► observer ─► current, voltage, bias ─► controller ─► duty - bias / span ─► mapping, limits ─┬─► command
//!                      ▲                                                                                      │
//!                      └────────────────────────────── duty of the period ────────────────────────────────────┘
//! ```
//!
//! What stands before the controller and behind it is the contract's own code. An observer with `compute_delay` estimates the
//! instant at which the duty begins, so the controller is designed without that delay.

use interp::Real;
use plant::{Model, Parameters, Signals};
use policy::{Policy, Scalar};

use super::{Baseline, Design, Kind};
use crate::agent::Agent;
use crate::controller::{Answer, Controller};
use crate::faults::Error;

/// A classical controller on the estimates of an observer.
#[derive(Debug, Clone)]
struct Observed<T> {
    agent: Agent<T>,
    /// Index of the observer in the contract.
    observer: usize,
    /// Index of the load current among the signals of the contract.
    load_current: usize,
    design: Baseline,
    running: Baseline,
    /// Source voltage of the design, V.
    v_in: f64,
    /// Duty that makes up for a volt at the inductor: what the observer calls bias is known, and not left to an integral.
    by_bias: f64,
}

/// The controller `kind` for `v_ref` V and load currents up to `i_out` A, designed for the nominal values of `parameters`, behind
/// the observer of this index in the contract.
///
/// # Errors
/// As of [`Baseline::new`]; and if the contract measures something that the plant does not have.
pub fn observed(
    policy: &Policy,
    observer: usize,
    kind: Kind,
    parameters: &Parameters,
    (v_ref, i_out): (f64, f64),
) -> Result<Box<dyn Controller>, Error> {
    let (delay, load_current) = policy
        .observers
        .get(observer)
        .map_or((0, 0), |own| (own.compute_delay, own.load_current));
    let mut parameters = parameters.clone();
    parameters.pwm.duty_delay = parameters.pwm.duty_delay.saturating_sub(delay);
    // the estimates are those at the start of a switching period, wherever the plant is sampled
    parameters.pwm.sampling_phase = 0.0;
    parameters.converter.model = Model::Switched;
    let design = Baseline::new(kind, &parameters, v_ref, i_out)?;
    let by_bias = 1.0 / Design::new(&parameters, v_ref, i_out).span();
    let numbers = (parameters.converter.v_in, by_bias);
    Ok(match policy.numeric_format.scalar() {
        Scalar::F32 => Box::new(Observed::<f32>::new(policy, [observer, load_current], design, numbers)?),
        Scalar::F64 => Box::new(Observed::<f64>::new(policy, [observer, load_current], design, numbers)?),
    })
}

impl<T: Real> Observed<T> {
    fn new(
        policy: &Policy,
        [observer, load_current]: [usize; 2],
        design: Baseline,
        (v_in, by_bias): (f64, f64),
    ) -> Result<Self, Error> {
        Ok(Self {
            agent: Agent::told(policy)?,
            observer,
            load_current,
            running: design.clone(),
            design,
            v_in,
            by_bias,
        })
    }
}

impl<T: Real> Controller for Observed<T> {
    fn restart(&mut self) -> Result<(), Error> {
        self.agent.reset();
        self.running = self.design.clone();
        Ok(())
    }

    fn step(&mut self, measured: &Signals) -> Result<Answer, Error> {
        self.agent.sense(measured)?;
        let [i_l, v_out, bias] = self.agent.estimates(self.observer);
        let seen = Signals {
            v_out,
            i_l,
            i_out: self.agent.signal(self.load_current),
            v_in: self.v_in,
        };
        let wanted = self.running.control(&seen) - self.by_bias * bias;
        // as the sum of a law and an offset is clamped before the mapping
        let duty = self.agent.give(T::nearest(wanted.clamp(0.0, 1.0)));
        Ok(Answer {
            duty,
            action: None,
            status: self.agent.command().status,
        })
    }
}
