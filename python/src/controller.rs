//! The interpreter at work: one measurement at a time, or a table of them.

use interp::{Coefficients, Controller as Interpreter, Real, Sample, Trace};
use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{PyArray1, PyArray2, PyReadonlyArray2};
use policy::{Policy, Scalar};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml_input::Message;

use crate::faults::raise;
use crate::policy::NativePolicy;

/// What a step commands.
#[pyclass(frozen, get_all, module = "policyc")]
#[derive(Debug, Clone, Copy)]
pub struct Command {
    /// Duty to apply, 0..1.
    duty: f64,
    /// Duty before the mapping, 0..1.
    duty_sim: f64,
    /// Index of the chosen action; 0 of a continuous policy.
    action_index: u32,
    /// Bits of `Status`.
    status: u32,
}

#[pymethods]
impl Command {
    fn __repr__(&self) -> String {
        let Self {
            duty,
            duty_sim,
            action_index,
            status,
        } = self;
        format!("Command(duty={duty:?}, duty_sim={duty_sim:?}, action_index={action_index}, status={status:#x})")
    }
}

impl<T: Real> From<&interp::Command<T>> for Command {
    fn from(command: &interp::Command<T>) -> Self {
        Self {
            duty: command.duty.to_f64(),
            duty_sim: command.duty_sim.to_f64(),
            action_index: command.action_index,
            status: command.status,
        }
    }
}

/// A controller in the floats `T`, with room for a step.
struct Running<T> {
    interpreter: Interpreter<T>,
    trace: Trace<T>,
}

impl<T: Real> Running<T> {
    fn new(policy: &Policy) -> Self {
        let interpreter = Interpreter::new(policy);
        Self {
            trace: interpreter.blank_trace(),
            interpreter,
        }
    }

    fn step(&mut self, samples: &[Sample], output: usize) -> Result<Command, Message> {
        let stepped = self.interpreter.step_into(samples, &mut self.trace);
        stepped.map_err(|error| Message::new(error.to_string()))?;
        Ok(Command::from(&self.trace.decision(output).command))
    }

    fn commands(&self) -> Vec<Command> {
        self.trace.commands().map(|command| Command::from(&command)).collect()
    }

    fn observation(&self) -> Vec<f64> {
        self.trace.observation.iter().map(|value| value.to_f64()).collect()
    }

    fn outputs(&self) -> Vec<f64> {
        self.trace.q_values.iter().map(|value| value.to_f64()).collect()
    }
}

/// A controller in the floats of its policy's format.
enum Any {
    F32(Box<Running<f32>>),
    F64(Box<Running<f64>>),
}

/// Calls the same of either.
macro_rules! either {
    ($any:expr, $running:ident => $call:expr) => {
        match $any {
            Any::F32($running) => $call,
            Any::F64($running) => $call,
        }
    };
}

/// The reference interpreter of a policy, with its state.
#[pyclass(module = "policyc._policyc")]
pub struct Controller {
    running: Any,
    /// Name of each signal, and whether it arrives as a code.
    signals: Vec<(String, bool)>,
    samples: Vec<Sample>,
    /// Index of the output whose command a step returns; 0 of a policy with one.
    output: usize,
}

/// A number as a signal takes it.
fn sample(name: &str, is_code: bool, value: f64) -> Result<Sample, Message> {
    if !is_code {
        return Ok(Sample::Wide(value));
    }
    let code = value as i32;
    match f64::from(code) == value {
        true => Ok(Sample::Code(code)),
        false => Err(
            Message::new(format!("signal `{name}` arrives as a code of its converter"))
                .found(value.to_string())
                .expected("a whole number of 32 bits"),
        ),
    }
}

/// The columns of a table of steps.
struct Columns {
    duty: Vec<f64>,
    duty_sim: Vec<f64>,
    action_index: Vec<u32>,
    status: Vec<u32>,
    observation: Vec<f64>,
    outputs: Vec<f64>,
}

impl Controller {
    fn fill(&mut self, row: &ArrayView1<'_, f64>) -> Result<(), Message> {
        let filled = self.samples.iter_mut().zip(&self.signals).zip(row);
        for ((place, (name, is_code)), value) in filled {
            *place = sample(name, *is_code, *value)?;
        }
        Ok(())
    }

    fn run(&mut self, table: &ArrayView2<'_, f64>) -> Result<Columns, Message> {
        let count = table.nrows();
        let mut columns = Columns {
            duty: Vec::with_capacity(count),
            duty_sim: Vec::with_capacity(count),
            action_index: Vec::with_capacity(count),
            status: Vec::with_capacity(count),
            observation: Vec::new(),
            outputs: Vec::new(),
        };
        for row in table.rows() {
            self.fill(&row)?;
            let (samples, output) = (&self.samples, self.output);
            let command = either!(&mut self.running, running => running.step(samples, output))?;
            columns.duty.push(command.duty);
            columns.duty_sim.push(command.duty_sim);
            columns.action_index.push(command.action_index);
            columns.status.push(command.status);
            either!(&self.running, running => {
                columns.observation.extend(running.trace.observation.iter().map(|value| value.to_f64()));
                columns.outputs.extend(running.trace.q_values.iter().map(|value| value.to_f64()));
            });
        }
        Ok(columns)
    }
}

/// Duties, simulated duties, actions, status bits, observations and outputs of a table of steps.
type Table<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
);

#[pymethods]
impl Controller {
    #[new]
    #[pyo3(signature = (policy, output=None))]
    fn new(policy: &NativePolicy, output: Option<&str>) -> PyResult<Self> {
        let policy = &policy.policy;
        let output = policy
            .chosen_output(output)
            .map_err(|message| match policy.output_names().first() {
                Some(name) if output.is_none() => raise(message.hint(format!("Controller(policy, output=\"{name}\")"))),
                _ => raise(message),
            })?;
        Ok(Self {
            output,
            running: match policy.numeric_format.scalar() {
                Scalar::F32 => Any::F32(Box::new(Running::new(policy))),
                Scalar::F64 => Any::F64(Box::new(Running::new(policy))),
            },
            signals: policy
                .signals
                .iter()
                .map(|signal| (signal.name.clone(), signal.adc.is_some()))
                .collect(),
            samples: vec![Sample::Code(0); policy.signals.len()],
        })
    }

    fn commands(&self) -> Vec<Command> {
        either!(&self.running, running => running.commands())
    }

    fn signals(&self) -> Vec<&str> {
        self.signals.iter().map(|(name, _)| name.as_str()).collect()
    }

    fn reset(&mut self) {
        either!(&mut self.running, running => running.interpreter.reset());
    }

    fn step(&mut self, measurement: &Bound<'_, PyAny>) -> PyResult<Command> {
        let expected = self.signals.len();
        let numbers: Vec<f64> = match measurement.cast::<PyDict>() {
            Ok(named) => {
                let number = |(name, _): &(String, bool)| match named.get_item(name)? {
                    Some(value) => value.extract(),
                    None => Err(raise(Message::new(format!("no measurement of the signal `{name}`")))),
                };
                self.signals.iter().map(number).collect::<PyResult<_>>()?
            }
            Err(_) => measurement.extract()?,
        };
        if numbers.len() != expected {
            let message = Message::new("a measurement has one number for each signal");
            let message = message.found(format!("{} numbers", numbers.len()));
            return Err(raise(message.expected(self.signals().join(", "))));
        }
        self.fill(&ArrayView1::from(&numbers)).map_err(raise)?;
        let (samples, output) = (&self.samples, self.output);
        either!(&mut self.running, running => running.step(samples, output)).map_err(raise)
    }

    fn step_batch<'py>(&mut self, py: Python<'py>, table: PyReadonlyArray2<'py, f64>) -> PyResult<Table<'py>> {
        let table = table.as_array();
        let expected = self.signals.len();
        if table.ncols() != expected {
            let message = Message::new("a table of measurements has one column for each signal");
            let message = message.found(format!("{} columns", table.ncols()));
            return Err(raise(message.expected(self.signals().join(", "))));
        }
        let count = table.nrows();
        let columns = py.detach(|| self.run(&table)).map_err(raise)?;
        let wide = |values: Vec<f64>, width: usize| {
            let shaped = numpy::ndarray::Array2::from_shape_vec((count, width), values);
            let shaped = shaped.map_err(|error| raise(Message::new(error.to_string())))?;
            Ok::<_, PyErr>(PyArray2::from_owned_array(py, shaped))
        };
        let (inputs, outputs) = either!(&self.running, running => (
            running.trace.observation.len(),
            running.trace.q_values.len()
        ));
        Ok((
            PyArray1::from_vec(py, columns.duty),
            PyArray1::from_vec(py, columns.duty_sim),
            PyArray1::from_vec(py, columns.action_index),
            PyArray1::from_vec(py, columns.status),
            wide(columns.observation, inputs)?,
            wide(columns.outputs, outputs)?,
        ))
    }

    fn observation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, either!(&self.running, running => running.observation()))
    }

    fn outputs<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, either!(&self.running, running => running.outputs()))
    }

    fn set_mapping(&mut self, a: f64, b: f64, c: f64, r: Option<f64>) -> bool {
        let output = self.output;
        match &mut self.running {
            Any::F32(running) => {
                let [a, b, c] = [a, b, c].map(|x| x as f32);
                let r = r.map(|r| r as f32);
                running.interpreter.set_mapping_of(output, Coefficients { a, b, c, r })
            }
            Any::F64(running) => running.interpreter.set_mapping_of(output, Coefficients { a, b, c, r }),
        }
    }

    fn state_words(&self) -> Vec<u32> {
        either!(&self.running, running => running.interpreter.state_words())
    }
}
