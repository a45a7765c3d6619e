//! What `import policyc` loads: the compiler, the interpreter and the simulated converters, for Python.
//!
//! Nothing is decided here: a function turns what Python gives into the types of the crates, calls them without Python's lock,
//! and turns the answer back. Dataclasses, gymnasium and everything that wants a library of Python stand in `lib/policyc`.

mod campaign;
mod controller;
mod environment;
mod faults;
mod files;
mod models;
mod policy;

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the command line of `policyc`, the program's name first, and returns its exit code. Prints as the program does. `program` is
/// how it starts itself again, for the workers of a campaign.
#[pyfunction]
fn command(py: Python<'_>, arguments: Vec<OsString>, program: Vec<OsString>) -> u8 {
    cli::api::set_program(program);
    py.detach(|| cli::main(arguments))
}

/// The native half of the package.
#[pymodule]
fn _policyc(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("BUILD", ::campaign::BUILD)?;
    module.add("Faults", module.py().get_type::<faults::Faults>())?;
    module.add_class::<faults::Fault>()?;
    module.add_class::<policy::NativePolicy>()?;
    module.add_class::<controller::Command>()?;
    module.add_class::<controller::Controller>()?;
    module.add_class::<environment::Episodes>()?;
    module.add_function(wrap_pyfunction!(environment::contract_facts, module)?)?;
    module.add_function(wrap_pyfunction!(models::import_model, module)?)?;
    module.add_function(wrap_pyfunction!(models::contract_json, module)?)?;
    module.add_class::<campaign::NativeCampaign>()?;
    module.add_function(wrap_pyfunction!(campaign::perform, module)?)?;
    module.add_function(wrap_pyfunction!(campaign::on_ray, module)?)?;
    module.add_function(wrap_pyfunction!(command, module)?)?;
    module.add_function(wrap_pyfunction!(files::files, module)?)
}
