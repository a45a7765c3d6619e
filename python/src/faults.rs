//! Faults of the input as an exception.

use pyo3::create_exception;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use toml_input::Place;

create_exception!(
    policyc,
    Faults,
    PyValueError,
    "Bad input. Its text shows each place with a caret, what was found, what was expected and what to do; `faults` is the list \
     of them as `Fault`. Nothing was written."
);

/// One fault of the input.
#[pyclass(frozen, get_all, module = "policyc")]
#[derive(Debug, Clone)]
pub struct Fault {
    /// The file as it was named; None for values that a program gave.
    file: Option<String>,
    /// Line, from 1.
    line: Option<usize>,
    /// Column in characters, from 1.
    column: Option<usize>,
    /// Characters that are meant.
    length: Option<usize>,
    /// The tensor of a file of weights.
    tensor: Option<String>,
    /// What is wrong, in one line.
    problem: String,
    /// What stands there.
    found: Option<String>,
    /// What should stand there.
    expected: Option<String>,
    /// What to do.
    hint: Option<String>,
    text: String,
}

#[pymethods]
impl Fault {
    fn __str__(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> String {
        let place = match (&self.file, self.line, self.column) {
            (Some(file), Some(line), Some(column)) => format!("{file}:{line}:{column}: "),
            (Some(file), ..) => format!("{file}: "),
            _ => String::new(),
        };
        format!("<Fault {place}{}>", self.problem)
    }
}

impl From<&toml_input::Fault> for Fault {
    fn from(fault: &toml_input::Fault) -> Self {
        let (line, column) = fault.line_column().unzip();
        Self {
            file: (fault.place != Place::Nowhere).then(|| fault.file.display().to_string()),
            line,
            column,
            length: match &fault.place {
                Place::Span { length, .. } => Some(*length),
                _ => None,
            },
            tensor: match &fault.place {
                Place::Tensor(name) => Some(name.clone()),
                _ => None,
            },
            problem: fault.problem.clone(),
            found: fault.found.clone(),
            expected: fault.expected.clone(),
            hint: fault.hint.clone(),
            text: fault.to_string(),
        }
    }
}

/// The exception of some faults.
pub fn raise(faults: impl Into<toml_input::Faults>) -> PyErr {
    let faults = faults.into();
    let error = Faults::new_err(faults.to_string().trim_end().to_owned());
    let list: Vec<Fault> = faults.iter().map(Fault::from).collect();
    // an exception without its list is better than none at all
    Python::attach(|py| error.value(py).setattr("faults", list).err().unwrap_or(error))
}

/// [`raise`] for what the command's library says.
pub fn failed(failure: cli::Failure) -> PyErr {
    raise(failure.0)
}
