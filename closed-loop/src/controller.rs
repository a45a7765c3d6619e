//! What can stand at the controller's place, and its run over a load step.

use interp::{Command, Real, Sample as Word};
use plant::{Sample, Signals};
use policy::{Policy, Scalar};
use toml_input::Message;

use crate::agent::{Agent, Inputs};
use crate::baselines::Baseline;
use crate::environment::Environment;
use crate::faults::Error;
use crate::load_step::LoadStep;
use crate::scenario::{Instant, Metrics, Record, Task, load_step};

/// What a controller answers to a measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Answer {
    /// Commanded duty, 0..1.
    pub duty: f64,
    /// Index of the chosen action; nothing from a controller without actions.
    pub action: Option<u32>,
    /// Status bits of the contract; 0 from others.
    pub status: u32,
}

impl Answer {
    /// What a controller of a contract commands.
    pub(crate) fn of<T: Real>(command: &Command<T>) -> Self {
        Self {
            duty: command.duty.to_f64(),
            action: Some(command.action_index),
            status: command.status,
        }
    }
}

/// A controller that can be switched on again and again.
pub trait Controller {
    /// As switched on.
    ///
    /// # Errors
    /// If it cannot be started.
    fn restart(&mut self) -> Result<(), Error>;

    /// The voltage to hold from now on, V, for those that are told.
    fn set_reference(&mut self, _v_ref: f64) {}

    /// One control period.
    ///
    /// # Errors
    /// If it does not answer.
    fn step(&mut self, measured: &Signals) -> Result<Answer, Error>;

    /// What the outputs that do not drive the plant answered in the last step, in the order of the contract; empty of a
    /// controller with one duty.
    fn others(&self) -> &[Answer] {
        &[]
    }
}

impl<T: Real> Controller for Agent<T> {
    fn restart(&mut self) -> Result<(), Error> {
        self.reset();
        Ok(())
    }

    fn set_reference(&mut self, v_ref: f64) {
        self.inputs_mut().set_reference(v_ref);
    }

    fn step(&mut self, measured: &Signals) -> Result<Answer, Error> {
        Agent::step(self, measured)?;
        Ok(Answer::of(&self.command()))
    }

    fn others(&self) -> &[Answer] {
        Agent::others(self)
    }
}

/// The interpreter of `policy` in the floats of its format.
///
/// # Errors
/// If the contract measures something that the plant does not have.
pub fn interpreter(policy: &Policy) -> Result<Box<dyn Controller>, Error> {
    interpreter_driving(policy, 0)
}

/// [`interpreter`] of a contract with several outputs, of which the one of that index drives the plant.
///
/// # Errors
/// As [`interpreter`].
pub fn interpreter_driving(policy: &Policy, output: usize) -> Result<Box<dyn Controller>, Error> {
    Ok(match policy.numeric_format.scalar() {
        Scalar::F32 => Box::new(Agent::<f32>::driving(policy, output)?),
        Scalar::F64 => Box::new(Agent::<f64>::driving(policy, output)?),
    })
}

/// A classical controller that is started from its design.
#[derive(Debug, Clone)]
pub struct Classical {
    design: Baseline,
    running: Baseline,
}

impl From<Baseline> for Classical {
    fn from(design: Baseline) -> Self {
        Self {
            running: design.clone(),
            design,
        }
    }
}

impl Controller for Classical {
    fn restart(&mut self) -> Result<(), Error> {
        self.running = self.design.clone();
        Ok(())
    }

    fn step(&mut self, measured: &Signals) -> Result<Answer, Error> {
        Ok(Answer {
            duty: self.running.control(measured),
            action: None,
            status: 0,
        })
    }
}

/// What is asked of a controller that runs elsewhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Call<'a> {
    /// Start anew; there is nothing to answer.
    Restart,
    /// One control period with the contract's samples.
    Step(&'a [Word]),
}

/// A policy's controller outside of this program, such as compiled code in a process of its own.
pub struct External<F> {
    inputs: Inputs,
    ask: F,
    /// Index of the output whose duty is the plant's.
    output: usize,
    /// What the others answered last.
    others: Vec<Answer>,
}

impl External<()> {
    /// `ask` passes on calls.
    ///
    /// # Errors
    /// If the contract measures something that the plant does not have.
    #[expect(clippy::type_complexity, reason = "a type alias cannot name the closure")]
    pub fn new<F: FnMut(Call<'_>) -> Result<Option<Answer>, Error>>(
        policy: &Policy,
        mut ask: F,
    ) -> Result<External<impl FnMut(Call<'_>) -> Result<Vec<Answer>, Error>>, Error> {
        Self::driving(policy, 0, move |call: Call<'_>| Ok(ask(call)?.into_iter().collect()))
    }

    /// [`External::new`] of a contract with several outputs, of which the one of the index `output` drives the plant; `ask` gives
    /// an answer for each, in the order of the contract.
    ///
    /// # Errors
    /// As [`External::new`].
    pub fn driving<F: FnMut(Call<'_>) -> Result<Vec<Answer>, Error>>(
        policy: &Policy,
        output: usize,
        ask: F,
    ) -> Result<External<F>, Error> {
        Ok(External {
            inputs: Inputs::new(policy)?,
            ask,
            output,
            others: Vec::new(),
        })
    }
}

impl<F: FnMut(Call<'_>) -> Result<Vec<Answer>, Error>> Controller for External<F> {
    fn restart(&mut self) -> Result<(), Error> {
        (self.ask)(Call::Restart).map(|_| ())
    }

    fn set_reference(&mut self, v_ref: f64) {
        self.inputs.set_reference(v_ref);
    }

    fn step(&mut self, measured: &Signals) -> Result<Answer, Error> {
        let samples = self.inputs.samples(measured);
        let mut answers = (self.ask)(Call::Step(samples))?;
        if self.output >= answers.len() {
            return Err(Message::new("a control step was not answered").into());
        }
        let own = answers.remove(self.output);
        self.others = answers;
        Ok(own)
    }

    fn others(&self) -> &[Answer] {
        &self.others
    }
}

/// One control period of a trajectory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period {
    /// What the plant did.
    pub record: Record,
    /// What the controller said to `record.sample`.
    pub answer: Answer,
}

/// A load step at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// When the load stepped.
    pub instant: Instant,
    /// Its figures.
    pub metrics: Metrics,
    /// Every control period from the start.
    pub periods: Vec<Period>,
    /// By control period, what [`Controller::others`] gave.
    pub others: Vec<Vec<Answer>>,
}

impl Trajectory {
    /// The first period in which two trajectories differ in a bit.
    #[must_use]
    pub fn first_difference(&self, other: &Self) -> Option<usize> {
        let bits = |period: &Period| {
            let Record {
                time,
                sample,
                duty,
                load,
            } = period.record;
            let numbers = [
                time,
                duty,
                sample.v_out,
                sample.i_l,
                sample.i_out,
                sample.v_in,
                sample.v_min,
                sample.v_max,
                sample.i_min,
                sample.i_max,
                load.power,
                load.current,
                load.conductance,
            ];
            // as bits: two NaN are equal here, and zeros of both signs are not
            (numbers.map(f64::to_bits), period.answer.action, period.answer.status)
        };
        let (a, b) = (&self.periods, &other.periods);
        let differs = a.iter().zip(b).position(|(a, b)| bits(a) != bits(b));
        let beside = |answers: &Vec<Answer>| -> Vec<_> {
            let bits = answers.iter().map(|answer| (answer.duty.to_bits(), answer.action));
            bits.collect()
        };
        let others = self.others.iter().zip(&other.others);
        let others = others.into_iter().position(|(a, b)| beside(a) != beside(b));
        let differs = [differs, others].into_iter().flatten().min();
        differs.or((a.len() != b.len()).then_some(a.len().min(b.len())))
    }
}

/// A load step at one instant, from a fresh start of plant and controller.
///
/// # Errors
/// If plant or controller cannot be started, or the controller does not answer.
pub fn follow<E: Environment>(
    environment: &E,
    controller: &mut dyn Controller,
    v_ref: f64,
    task: &Task,
    step: LoadStep,
    instant: Instant,
) -> Result<Trajectory, Error> {
    controller.restart()?;
    let [before, after] = step.held(v_ref);
    controller.set_reference(before);
    let lead = task.lead + instant.periods;
    let (mut answers, mut others, mut failure) = (Vec::new(), Vec::new(), None);
    let ask = |sample: &Sample| {
        let blank = Answer {
            duty: f64::NAN,
            action: None,
            status: 0,
        };
        // the sample at the step is the first that finds the new one
        if answers.len() == lead && step.reference.is_some() {
            controller.set_reference(after);
        }
        // the run goes to its end, but a controller that has failed is not asked again
        let answer = if failure.is_some() {
            blank
        } else {
            controller.step(&sample.measured).unwrap_or_else(|error| {
                failure = Some(error);
                blank
            })
        };
        answers.push(answer);
        others.push(controller.others().to_vec());
        answer.duty
    };
    let (metrics, records) = load_step(environment.clone(), ask, v_ref, task, step, instant)?;
    if let Some(error) = failure {
        return Err(error);
    }
    let periods = records.into_iter().zip(answers);
    Ok(Trajectory {
        instant,
        metrics,
        periods: periods.map(|(record, answer)| Period { record, answer }).collect(),
        others,
    })
}
