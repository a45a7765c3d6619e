//! Episodes on simulated converters, into arrays of numpy.

use std::path::{Path, PathBuf};

use closed_loop::{Converter, LoadKind};
use numpy::{PyReadonlyArray1, PyReadwriteArray1, PyReadwriteArray2};
use plant::Signals;
use policy::Policy;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml_input::{Fault, FileName, Message, messages};
use train::episodes::{Actions, Begin, Episodes as Inner, Given};
use train::{Contract, Settings};

use crate::faults::raise;

/// Converters in the middle of their episodes.
#[pyclass(module = "policyc._policyc")]
pub struct Episodes {
    inner: Inner,
    policy: Policy,
}

fn kind(name: &str) -> PyResult<LoadKind> {
    let kinds = [
        ("power", LoadKind::Power),
        ("current", LoadKind::Current),
        ("resistance", LoadKind::Resistance),
    ];
    let found = kinds.iter().find(|(known, _)| *known == name);
    let known = kinds.map(|(name, _)| name);
    let found = found.ok_or_else(|| raise(messages::unknown("kind of load", name, &known)));
    Ok(found?.1)
}

/// A contract whose weights need not exist yet.
fn contract(path: &Path) -> Result<Contract, train::Error> {
    let path = if path.is_dir() {
        path.join("policy.toml")
    } else {
        path.to_owned()
    };
    Contract::load_any(&path, &[])
}

/// An action of an environment is a duty or its index; the gains of a law are neither.
fn schedules(path: &Path) -> train::Error {
    let message =
        Message::new("the environment takes duties, and in this contract the network gives the gains of a law")
            .found("gains in [actions]")
            .expected("duties, pairs, offsets or continuous")
            .hint("train the gains in an environment of your own, and give its network to this contract");
    Fault::in_file(path, message).into()
}

fn signals(signals: &Signals) -> [(&'static str, f64); 4] {
    [
        ("v_out", signals.v_out),
        ("i_l", signals.i_l),
        ("i_out", signals.i_out),
        ("v_in", signals.v_in),
    ]
}

/// The voltage to hold that a contract names, V, and the control period, s.
#[pyfunction]
pub fn contract_facts(py: Python<'_>, path: PathBuf) -> PyResult<(Option<f64>, f64)> {
    let contract = py.detach(|| contract(&path)).map_err(raise)?;
    Ok((closed_loop::held_by(&contract.policy), contract.policy.sample_period))
}

#[pymethods]
impl Episodes {
    /// `text` is that of a training file, which `file` names in faults; a `plant` or `contract` in it is from its folder.
    #[new]
    fn new(
        py: Python<'_>,
        file: PathBuf,
        text: Option<&str>,
        count: usize,
        load_kind: &str,
        profile: Vec<(u64, f64)>,
    ) -> PyResult<Self> {
        let kind = kind(load_kind)?;
        let made = py.detach(|| {
            let settings = match text {
                Some(text) => Settings::parse(text, &file)?,
                None => Settings::load(&file)?,
            };
            let contract = contract(&settings.contract)?;
            if contract.policy.head.schedule().is_some() {
                return Err(schedules(&settings.contract));
            }
            let plant = FileName::named_by_a_file(&settings.plant);
            let nominal = Converter::load(plant, &settings.set)?;
            let inner = Inner::new(&settings, &contract, &nominal, count, (kind, profile))?;
            Ok::<_, train::Error>((inner, contract.policy))
        });
        let (inner, policy) = made.map_err(raise)?;
        Ok(Self { inner, policy })
    }

    /// Least and largest value of each feature, as binary32: its clip, or none.
    fn observation_ends(&self) -> (Vec<f32>, Vec<f32>) {
        let end = |feature: &policy::Feature| {
            let clip = feature.clip;
            clip.map_or((f32::NEG_INFINITY, f32::INFINITY), |clip| {
                (clip.low as f32, clip.high as f32)
            })
        };
        self.policy.features.iter().map(end).unzip()
    }

    /// Duties of the actions, or what each adds to a law; those at both ends of a policy that commands a number.
    fn duties(&self) -> Vec<f64> {
        match self.policy.head.residual() {
            // its duties are those of the law with them, of which only the ends are known
            Some(_) => self.policy.actions().iter().map(|action| action.duty).collect(),
            None => self.policy.head.duties(),
        }
    }

    fn is_continuous(&self) -> bool {
        self.policy.head.continuous().is_some()
    }

    fn is_batch(&self) -> bool {
        self.inner.is_batch()
    }

    /// The contract's file.
    fn contract(&self) -> Option<PathBuf> {
        self.policy.files.first().cloned()
    }

    fn sample_period(&self) -> f64 {
        self.policy.sample_period
    }

    fn seed(&mut self, index: usize, seed: u64) -> PyResult<()> {
        self.check(index)?;
        self.inner.seed(index, seed);
        Ok(())
    }

    fn begin(
        &mut self,
        index: usize,
        v_out: Option<f64>,
        i_l: Option<f64>,
        load: Option<f64>,
        noise: u64,
    ) -> PyResult<()> {
        self.check(index)?;
        let begin = v_out.map(|v_out| Begin {
            v_out,
            i_l,
            load,
            noise,
        });
        self.inner.begin(index, begin.as_ref()).map_err(raise)
    }

    fn observe(&self, mut into: PyReadwriteArray2<'_, f32>) -> PyResult<()> {
        let features = self.inner.features();
        let room = into.as_slice_mut()?;
        for (index, row) in room.chunks_exact_mut(features.max(1)).enumerate() {
            if index < self.inner.count() {
                row.copy_from_slice(self.inner.observation(index));
            }
        }
        Ok(())
    }

    fn step_index(
        &mut self,
        py: Python<'_>,
        actions: PyReadonlyArray1<'_, i64>,
        over: PyReadonlyArray1<'_, bool>,
        given: (
            PyReadwriteArray2<'_, f32>,
            PyReadwriteArray1<'_, f64>,
            PyReadwriteArray1<'_, bool>,
        ),
    ) -> PyResult<()> {
        self.step(py, Actions::Index(actions.as_slice()?), over.as_slice()?, given)
    }

    fn step_duty(
        &mut self,
        py: Python<'_>,
        actions: PyReadonlyArray1<'_, f32>,
        over: PyReadonlyArray1<'_, bool>,
        given: (
            PyReadwriteArray2<'_, f32>,
            PyReadwriteArray1<'_, f64>,
            PyReadwriteArray1<'_, bool>,
        ),
    ) -> PyResult<()> {
        self.step(py, Actions::Duty(actions.as_slice()?), over.as_slice()?, given)
    }

    /// The true state of one converter, and what its sensors show.
    fn info<'py>(&self, py: Python<'py>, index: usize) -> PyResult<Bound<'py, PyDict>> {
        self.check(index)?;
        let (sample, info) = (self.inner.sample(index), PyDict::new(py));
        for (name, value) in signals(&sample.signals()) {
            info.set_item(name, value)?;
        }
        let measured = PyDict::new(py);
        for (name, value) in signals(&sample.measured) {
            measured.set_item(name, value)?;
        }
        info.set_item("measured", measured)?;
        let (duty, status) = self.inner.command(index);
        info.set_item("duty", duty)?;
        info.set_item("status", status)?;
        info.set_item("load", self.inner.load(index))?;
        info.set_item("period", self.inner.periods(index))?;
        Ok(info)
    }

    /// The true state of all into the rows of an array: v_out, i_l, i_out, v_in, duty, load.
    fn states(&self, mut into: PyReadwriteArray2<'_, f64>) -> PyResult<()> {
        let room = into.as_slice_mut()?;
        let count = self.inner.count();
        if room.len() != 6 * count {
            return Err(raise(Message::new("the array is not one of six rows")));
        }
        for index in 0..count {
            let sample = self.inner.sample(index);
            let (duty, _) = self.inner.command(index);
            let values = [
                sample.v_out,
                sample.i_l,
                sample.i_out,
                sample.v_in,
                duty,
                self.inner.load(index),
            ];
            for (row, value) in values.into_iter().enumerate() {
                room[row * count + index] = value;
            }
        }
        Ok(())
    }
}

impl Episodes {
    fn check(&self, index: usize) -> PyResult<()> {
        if index < self.inner.count() {
            return Ok(());
        }
        let message = Message::new("there is no such converter").found(index.to_string());
        Err(raise(message.expected(format!("below {}", self.inner.count()))))
    }

    fn step(
        &mut self,
        py: Python<'_>,
        actions: Actions<'_>,
        over: &[bool],
        (mut observations, mut rewards, mut truncated): (
            PyReadwriteArray2<'_, f32>,
            PyReadwriteArray1<'_, f64>,
            PyReadwriteArray1<'_, bool>,
        ),
    ) -> PyResult<()> {
        let given = Given {
            observations: observations.as_slice_mut()?,
            rewards: rewards.as_slice_mut()?,
            truncated: truncated.as_slice_mut()?,
        };
        let stepped = if self.inner.count() > 1 {
            py.detach(|| self.inner.step(actions, over, given))
        } else {
            // taking Python's lock again costs more than a period of one converter
            self.inner.step(actions, over, given)
        };
        stepped.map_err(raise)
    }
}
