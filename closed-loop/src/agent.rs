//! Between the plant and the network: the policy's own controller turns measurements into observations and actions into
//! duties. What is trained is what is compiled.

use interp::{Command, Controller, Real, Sample, State, Trace};
use plant::Signals;
use policy::{Policy, Scalar};
use toml_input::Message;

use crate::controller::Answer;
use crate::faults::Error;

/// The names that a contract's signals may have: what is measured, and the voltage to hold, which the firmware sets.
const SIGNALS: [&str; 5] = ["v_out", "i_l", "i_out", "v_in", REFERENCE];
/// The signal that is no measurement.
pub const REFERENCE: &str = "v_ref";

/// A policy's controller at a plant, in the floats `T`: those of the policy's format, or binary32 where the last bit does
/// not matter.
#[derive(Debug, Clone)]
pub struct Agent<T> {
    controller: Controller<T>,
    trace: Trace<T>,
    inputs: Inputs,
    /// Index of the output whose duty is the plant's.
    output: usize,
    /// What the others answered last.
    others: Vec<Answer>,
}

/// A plant's measurements in the words of a contract.
#[derive(Debug, Clone)]
pub struct Inputs {
    scalar: Scalar,
    inputs: Vec<Input>,
    samples: Vec<Sample>,
    /// Voltage to hold, V; no number until it is set.
    reference: f64,
}

/// Where a signal comes from.
#[derive(Debug, Clone, Copy)]
struct Input {
    /// Index into [`SIGNALS`].
    signal: usize,
    adc: Option<policy::Adc>,
}

impl Inputs {
    /// The signals of `policy`.
    ///
    /// # Errors
    /// If the contract measures something that the plant does not have.
    pub fn new(policy: &Policy) -> Result<Self, Error> {
        let input = |signal: &policy::Signal| -> Result<Input, Error> {
            match SIGNALS.iter().position(|name| *name == signal.name) {
                Some(index) => Ok(Input {
                    signal: index,
                    adc: signal.adc,
                }),
                None => {
                    let message = Message::new(format!("the plant has no signal `{}`", signal.name));
                    let message = message.expected(format!("one of {}", SIGNALS.join(", ")));
                    let message =
                        message.hint("call it so in a copy of the contract: the plant is measured by these names");
                    Err(message.did_you_mean(&signal.name, SIGNALS).into())
                }
            }
        };
        let inputs = policy.signals.iter().map(input).collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            scalar: policy.numeric_format.scalar(),
            samples: vec![Sample::Code(0); inputs.len()],
            inputs,
            reference: f64::NAN,
        })
    }

    /// The voltage to hold, V, of a contract that has it as its signal `v_ref`.
    pub fn set_reference(&mut self, v_ref: f64) {
        self.reference = v_ref;
    }

    /// The samples of a measurement, in the order of the contract: numbers, or the codes of its converters.
    pub fn samples(&mut self, measured: &Signals) -> &[Sample] {
        let values = [
            measured.v_out,
            measured.i_l,
            measured.i_out,
            measured.v_in,
            self.reference,
        ];
        for (sample, input) in self.samples.iter_mut().zip(&self.inputs) {
            let x = values[input.signal];
            *sample = match (input.adc, self.scalar) {
                (None, Scalar::F32) => Sample::Physical(x as f32),
                (None, Scalar::F64) => Sample::Wide(x),
                // `as` saturates; a code out of range is the controller's to judge
                (Some(adc), _) => Sample::Code(((x - adc.offset) / adc.gain).round() as i32),
            };
        }
        &self.samples
    }
}

impl<T: Real> Agent<T> {
    /// The controller of `policy` in its initial state.
    ///
    /// # Errors
    /// If the contract measures something that the plant does not have, or wants to be told the voltage to hold.
    pub fn new(policy: &Policy) -> Result<Self, Error> {
        if policy.signals.iter().any(|signal| signal.name == REFERENCE) {
            let message = Message::new("nothing sets the signal `v_ref` here");
            let hint = "`simulate` does; make it a number in [parameters] of a copy, and train that";
            return Err(message.hint(hint).into());
        }
        Self::told(policy)
    }

    /// The same, of a contract that may have the voltage to hold as a signal: whoever runs it sets it.
    ///
    /// # Errors
    /// If the contract measures something that the plant does not have.
    pub fn told(policy: &Policy) -> Result<Self, Error> {
        Self::driving(policy, 0)
    }

    /// [`Agent::told`] of a contract with several outputs, of which the one of that index drives the plant.
    ///
    /// # Errors
    /// As [`Agent::told`].
    pub fn driving(policy: &Policy, output: usize) -> Result<Self, Error> {
        let controller = Controller::new(policy);
        Ok(Self {
            trace: controller.blank_trace(),
            inputs: Inputs::new(policy)?,
            controller,
            output,
            others: Vec::new(),
        })
    }

    /// What the observer of this index in the contract estimated in the last [`Agent::sense`]: current in A, voltage and bias in V.
    pub(crate) fn estimates(&self, observer: usize) -> [f64; 3] {
        let [current, voltage, bias, _] = self.trace.estimates[observer];
        [current, voltage, bias].map(T::to_f64)
    }

    /// The signal of this index in the contract, as the last [`Agent::sense`] took it.
    pub(crate) fn signal(&self, index: usize) -> f64 {
        self.trace.signals[index].to_f64()
    }

    pub(crate) fn inputs_mut(&mut self) -> &mut Inputs {
        &mut self.inputs
    }

    /// Forgets everything, as a controller does that is switched on.
    pub fn reset(&mut self) {
        self.controller.reset();
    }

    /// Takes in a measurement; [`Agent::observation`] is what the network sees.
    ///
    /// # Errors
    /// Never, unless the plant's signals do not fit the contract.
    pub fn sense(&mut self, measured: &Signals) -> Result<(), Error> {
        let samples = self.inputs.samples(measured);
        Ok(self.controller.sense_into(samples, &mut self.trace)?)
    }

    /// The observation of the last [`Agent::sense`].
    #[must_use]
    pub fn observation(&self) -> &[T] {
        // one dimension, owned: always a slice
        self.trace.observation.as_slice().unwrap_or_default()
    }

    /// Takes an action on what was sensed last and moves the filters on. Returns the duty behind mapping and limits.
    pub fn act(&mut self, action: u32) -> f64 {
        self.controller.choose(&mut self.trace, action);
        self.controller.commit_trace(&self.trace);
        self.trace.command.duty.to_f64()
    }

    /// [`Agent::act`] with a duty before the mapping in the place of an action, for a policy that commands a number.
    pub fn give(&mut self, duty_sim: T) -> f64 {
        self.controller.give(&mut self.trace, duty_sim);
        self.controller.commit_trace(&self.trace);
        self.trace.command.duty.to_f64()
    }

    /// One step of the whole controller with its own network, as the compiled code makes it.
    ///
    /// # Errors
    /// As [`Agent::sense`].
    pub fn step(&mut self, measured: &Signals) -> Result<f64, Error> {
        let samples = self.inputs.samples(measured);
        self.controller.step_into(samples, &mut self.trace)?;
        self.others.clear();
        let others = self
            .trace
            .commands()
            .enumerate()
            .filter(|(index, _)| *index != self.output);
        self.others.extend(others.map(|(_, command)| Answer::of(&command)));
        Ok(self.command().duty.to_f64())
    }

    /// The command of the last step, of several outputs that of the one that drives the plant.
    #[must_use]
    pub fn command(&self) -> Command<T> {
        self.trace.commands().nth(self.output).unwrap_or(self.trace.command)
    }

    /// What the other outputs answered in the last [`Agent::step`], in the order of the contract.
    #[must_use]
    pub fn others(&self) -> &[Answer] {
        &self.others
    }

    /// Duty of the step before, 0..1.
    #[must_use]
    pub fn previous_duty(&self) -> f64 {
        self.controller.state().previous_command.to_f64()
    }

    /// What the controller remembers.
    #[must_use]
    pub fn state(&self) -> &State<T> {
        self.controller.state()
    }

    /// Puts back a state; `false` and no change if it is of another contract.
    pub fn restore(&mut self, state: &State<T>) -> bool {
        self.controller.restore(state)
    }
}
