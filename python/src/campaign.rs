//! Campaigns: the folder and its tasks for Python, which has the engines of Python.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, mpsc};
use std::time::Duration;

use campaign::{Done, Kind, Plan, Task};
use cli::api::{self, Local, Progress, Replacing, Session};
use pyo3::exceptions::PyIndexError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;
use toml_input::Message;

use crate::faults::{failed, raise};

/// How often Python is asked whether a signal has come.
const LOOK: Duration = Duration::from_millis(50);

type Files<'py> = BTreeMap<String, Bound<'py, PyBytes>>;

/// A plan and the folder of its results.
#[pyclass(frozen, module = "policyc._policyc")]
pub struct NativeCampaign {
    session: Session,
    out: PathBuf,
}

impl NativeCampaign {
    fn task(&self, index: usize) -> PyResult<&Task> {
        let task = self.session.plan.tasks.get(index);
        task.ok_or_else(|| PyIndexError::new_err("no such task"))
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn copied(files: BTreeMap<String, PyBackedBytes>) -> BTreeMap<String, Vec<u8>> {
    files
        .into_iter()
        .map(|(name, content)| (name, content.to_vec()))
        .collect()
}

fn bytes(py: Python<'_>, files: BTreeMap<String, Vec<u8>>) -> Files<'_> {
    let each = |(name, content): (String, Vec<u8>)| (name, PyBytes::new(py, &content));
    files.into_iter().map(each).collect()
}

#[pymethods]
impl NativeCampaign {
    /// Reads a plan, or a text in the place of the one at `plan`, and what `out` holds. Writes nothing.
    #[new]
    fn new(py: Python<'_>, plan: PathBuf, text: Option<&str>, out: PathBuf, force: bool) -> PyResult<Self> {
        let open = || {
            let plan = match text {
                Some(text) => Plan::from_text(&plan, text),
                None => Plan::open(&plan),
            };
            let session = Session::open(plan?, &out, Replacing { force })?;
            let pending = session.pending();
            api::check_campaign(&session.plan, &pending)?;
            Ok(session)
        };
        let session = py.detach(open).map_err(failed)?;
        Ok(Self { session, out })
    }

    /// Makes the folder.
    fn begin(&self) -> PyResult<()> {
        self.session.begin().map_err(failed)
    }

    /// How many tasks there are.
    fn count(&self) -> usize {
        self.session.plan.tasks.len()
    }

    /// Indices of the tasks without a result.
    fn pending(&self) -> Vec<usize> {
        self.session.pending()
    }

    /// What a task is, in words.
    fn title(&self, index: usize) -> PyResult<String> {
        Ok(self.task(index)?.title())
    }

    /// Kind, command line, and path and digest of each input.
    fn shipped(&self, index: usize) -> PyResult<(&'static str, Vec<String>, BTreeMap<String, String>)> {
        let task = self.task(index)?;
        let digests = task
            .inputs
            .iter()
            .map(|(path, content)| (path.clone(), content.digest.clone()));
        Ok((task.kind.name(), task.arguments.clone(), digests.collect()))
    }

    /// An input of a task.
    fn content<'py>(&self, py: Python<'py>, index: usize, path: &str) -> PyResult<Bound<'py, PyBytes>> {
        let content = self.task(index)?.inputs.get(path);
        let content = content.ok_or_else(|| PyIndexError::new_err("no such input"))?;
        Ok(PyBytes::new(py, &content.bytes))
    }

    /// Keeps the result of a task.
    fn store(&self, index: usize, exit: u8, files: BTreeMap<String, PyBackedBytes>) -> PyResult<()> {
        let done = Done::new(self.task(index)?, exit, copied(files));
        self.session.store(&done).map_err(failed)
    }

    /// Keeps why a task has no result.
    fn fail(&self, index: usize, reason: &str) -> PyResult<()> {
        self.session.fail(self.task(index)?, reason).map_err(failed)
    }

    /// Runs all pending tasks with workers of this machine, which are started by the words of `program`. `tell` hears the title of each task
    /// that has ended, and why it failed. A signal to Python ends it.
    fn run(&self, py: Python<'_>, jobs: usize, program: Vec<OsString>, tell: Py<PyAny>) -> PyResult<()> {
        api::set_program(program);
        let stop = AtomicBool::new(false);
        let (send, receive) = mpsc::channel::<(String, Option<String>)>();
        let (send, receive) = (Mutex::new(send), Mutex::new(receive));
        let session = &self.session;
        std::thread::scope(|scope| {
            let stop = &stop;
            let engine = scope.spawn(move || {
                let tell = |progress: Progress<'_>| {
                    let news = (progress.task.title(), progress.reason.map(str::to_owned));
                    // nobody may be listening any more
                    let _ = locked(&send).send(news);
                };
                let local = Local {
                    jobs,
                    stop,
                    tell: &tell,
                };
                local.run(session, session.pending())
            });
            let mut told = Ok(());
            loop {
                let news = py.detach(|| locked(&receive).recv_timeout(LOOK));
                if let (Ok((title, reason)), true) = (&news, told.is_ok()) {
                    told = tell.call1(py, (title, reason)).map(|_| ());
                }
                if told.is_ok() {
                    told = py.check_signals();
                }
                if told.is_err() {
                    stop.store(true, Ordering::Relaxed);
                }
                if news == Err(mpsc::RecvTimeoutError::Disconnected) {
                    break;
                }
            }
            let ran = py.detach(|| engine.join());
            told?;
            match ran {
                Ok(ran) => ran.map_err(failed),
                Err(_) => Err(raise(Message::new("the engine of the campaign broke"))),
            }
        })
    }

    /// Merges. Whether everything holds, `results.json`, the page, and the summary.
    fn finish(&self, py: Python<'_>) -> PyResult<(bool, String, String, String)> {
        let finish = || {
            let finished = self.session.finish()?;
            let results = &finished.results;
            let summary = api::campaign_summary(&self.out.display().to_string(), &finished, None);
            Ok((results.hold(), results.json(), results.page()?, summary))
        };
        py.detach(finish).map_err(failed)
    }
}

/// Performs a task that came with its inputs, in a temporary folder: exit code, files, and why it failed.
#[pyfunction]
pub fn perform<'py>(
    py: Python<'py>,
    kind: &str,
    arguments: Vec<String>,
    inputs: BTreeMap<String, PyBackedBytes>,
) -> PyResult<(u8, Files<'py>, Option<String>)> {
    let names = Kind::ALL.map(Kind::name);
    let found = Kind::ALL.into_iter().find(|own| own.name() == kind);
    let kind = found.ok_or_else(|| raise(toml_input::messages::unknown("kind of task", kind, &names)))?;
    let inputs = copied(inputs);
    let (performed, files) = py.detach(|| api::perform(kind, &arguments, &inputs)).map_err(failed)?;
    Ok((performed.exit, bytes(py, files), performed.reason))
}

/// Plan, folder, address, and whether `--force`, `--json` and `--quiet` are given, of a command line that asks for a campaign on Ray.
#[pyfunction]
pub fn on_ray(arguments: Vec<OsString>) -> Option<(PathBuf, PathBuf, Option<String>, [bool; 3])> {
    let asked = api::on_ray(arguments)?;
    Some((
        asked.plan,
        asked.out,
        asked.address,
        [asked.force, asked.json, asked.quiet],
    ))
}
