//! Commands whose files are handed over in the place of being written.

use std::collections::BTreeMap;

use pyo3::prelude::*;

use crate::faults::failed;

/// What `policyc simulate`, `policyc diagnose` or `policyc drm fit` would write, by name.
#[pyfunction]
pub fn files(py: Python<'_>, arguments: Vec<String>) -> PyResult<BTreeMap<String, String>> {
    py.detach(|| cli::api::files(arguments.iter().map(String::as_str)))
        .map_err(failed)
}
