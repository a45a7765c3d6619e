//! A checked policy, and what is made of it.

use std::collections::BTreeMap;
use std::path::PathBuf;

use cli::Failure;
use cli::api::{self, CertifyRequest, CompileRequest};
use codegen::Output;
use policy::{NumericFormat, Policy};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use toml_input::{Message, messages};
use verify::drift::Drift;
use verify::traces::Recorded;
use verify::{Folder, Options, text};

use crate::faults::{failed, raise};

/// A checked policy.
#[pyclass(frozen, module = "policyc._policyc")]
pub struct NativePolicy {
    pub policy: Policy,
}

/// The numeric format of that name.
pub fn format(name: Option<&str>) -> PyResult<Option<NumericFormat>> {
    let Some(name) = name else { return Ok(None) };
    let names = NumericFormat::ALL.map(NumericFormat::name);
    let found = NumericFormat::find(name).ok_or_else(|| raise(messages::unknown("numeric format", name, &names)));
    found.map(Some)
}

fn outputs(names: &[String]) -> PyResult<Vec<Output>> {
    let known: Vec<&str> = Output::ALL.iter().map(|output| output.name()).collect();
    let find = |name: &String| {
        let found = Output::ALL.iter().find(|output| output.name() == name);
        found
            .copied()
            .ok_or_else(|| raise(messages::unknown("output", name, &known)))
    };
    names.iter().map(find).collect()
}

#[pymethods]
impl NativePolicy {
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, allow_outside: bool, format: Option<&str>) -> PyResult<Self> {
        let format = self::format(format)?;
        let policy = py.detach(|| api::load(&path, allow_outside, format)).map_err(failed)?;
        Ok(Self { policy })
    }

    fn with_format(&self, format: &str) -> PyResult<Self> {
        let policy = self.policy.clone();
        Ok(Self {
            policy: match self::format(Some(format))? {
                Some(format) => policy.with_format(format),
                None => policy,
            },
        })
    }

    fn name(&self) -> &str {
        &self.policy.name
    }

    fn numeric_format(&self) -> &'static str {
        self.policy.numeric_format.name()
    }

    fn inspect_json(&self) -> PyResult<String> {
        api::inspect_json(&self.policy).map_err(failed)
    }

    fn inspect_text(&self) -> String {
        api::inspect_text(&self.policy)
    }

    #[expect(clippy::too_many_arguments, reason = "the options of the command")]
    fn compile<'py>(
        &self,
        py: Python<'py>,
        target: String,
        emit: Vec<String>,
        kit_steps: Option<u32>,
        costs: bool,
        clock: Option<&str>,
        golden_decisions: Option<f64>,
    ) -> PyResult<BTreeMap<String, Bound<'py, PyBytes>>> {
        let clock = clock.map(verify::budget::Clock::parse).transpose();
        let request = CompileRequest {
            target,
            emit: outputs(&emit)?,
            kit_steps: kit_steps.unwrap_or(verify::kit::DEFAULT_STEPS),
            costs,
            clock: clock.map_err(|error| raise(Message::new(error)))?,
            golden_decisions,
        };
        let files = py.detach(|| api::compile(&self.policy, &request)?.into_files());
        let bytes = |(name, bytes): (String, Vec<u8>)| (name, PyBytes::new(py, &bytes));
        Ok(files.map_err(failed)?.into_iter().map(bytes).collect())
    }

    /// Whether everything is equal, the report as JSON, and the report in words.
    #[expect(clippy::too_many_arguments, reason = "the options of the command")]
    fn verify(
        &self,
        py: Python<'_>,
        target: Option<&str>,
        steps: u64,
        seed: u64,
        generated: Option<PathBuf>,
        in_its_format: bool,
        traces: Vec<PathBuf>,
        map: String,
        golden_decisions: Option<f64>,
    ) -> PyResult<(bool, String, String)> {
        let asked = Asked {
            target,
            steps,
            seed,
            generated,
            traces,
            map,
            golden_decisions,
        };
        let written = asked.generated.as_deref().filter(|_| in_its_format);
        let written = written.and_then(verify::folder::numeric_format);
        let policy = match written {
            Some(format) => &self.policy.clone().with_format(format),
            None => &self.policy,
        };
        py.detach(|| verified(policy, asked)).map_err(failed)
    }

    /// Name and text of the files of a certificate, and its summary.
    fn certify(
        &self,
        py: Python<'_>,
        axis: Vec<String>,
        at: Vec<String>,
        samples: u32,
        boxes: u32,
        seed: u64,
    ) -> PyResult<(BTreeMap<String, String>, String)> {
        let request = CertifyRequest {
            axis,
            at,
            samples,
            boxes,
            seed,
        };
        let made = py.detach(|| api::certify(&self.policy, &request)).map_err(failed)?;
        Ok((made.files, made.summary))
    }
}

/// What is asked of a verification.
struct Asked<'a> {
    target: Option<&'a str>,
    steps: u64,
    seed: u64,
    generated: Option<PathBuf>,
    traces: Vec<PathBuf>,
    /// Where a column of a trace has another name than its signal: `v_out=CH1,i_l=CH2`.
    map: String,
    golden_decisions: Option<f64>,
}

/// As the command does it: a folder that has drifted is not built.
fn verified(policy: &Policy, asked: Asked<'_>) -> Result<(bool, String, String), Failure> {
    let recorded = asked.traces.iter().map(|path| Recorded::open(policy, path, &asked.map));
    let recorded = recorded.collect::<Result<Vec<_>, _>>()?;
    let folder = asked.generated.as_deref().map(|folder| Folder::open(policy, folder));
    let folder = folder.transpose()?;
    let target = asked.target.map(codegen::target).transpose()?;
    let target = target.or(folder.as_ref().map(|folder| folder.target));
    let json = |equal: bool, drift: Option<&Drift>, report: Option<&verify::Report>| {
        serde_json::to_string(&serde_json::json!({ "equal": equal, "drift": drift, "report": report }))
    };
    if let Some(folder) = folder.as_ref().filter(|folder| !folder.drift.is_empty()) {
        let said = text::files_alone(&policy.name, &folder.drift)?;
        return Ok((false, json(false, Some(&folder.drift), None)?, said));
    }
    let report = verify::run(
        policy,
        Options {
            steps: asked.steps,
            seed: asked.seed,
            target: target.unwrap_or(targets::host()),
            generated: folder.as_ref().map(|folder| &folder.files),
            assembly: true,
            golden_decisions: asked.golden_decisions,
            recorded,
            ..Options::default()
        },
    )?;
    if !report.compared() {
        return Err(text::nothing_compared(&report).into());
    }
    let drift = folder.map(|folder| folder.drift);
    let equal = report.passed();
    let said = text::report(policy, &report, drift.as_ref())?;
    Ok((equal, json(equal, drift.as_ref(), Some(&report))?, said))
}
