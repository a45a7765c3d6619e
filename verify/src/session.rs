//! A whole verification: compile, feed, compare.
//!
//! ```text
//! Stream ─► Oracle ─► Chunk (4096 steps: events and expected words) ─┬─► lane ─► driver of build 1
//!                                                                    ├─► lane ─► driver of build 2
//!                                                                    └─► ...      a thread each, LAG chunks behind
//! ```
//!
//! The interpreter runs once, whatever the number of builds. A lane ends at its first difference; the others go on.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use codegen::Output;
use interp::decisions::decisions;
use interp::golden::golden_result;
use interp::{InputError, Real};
use policy::{Policy, Scalar};
use targets::TargetSpec;
use toml_input::{Fault, Faults, Message, messages};

use crate::codes::Grid;
use crate::golden;
use crate::lane::Lane;
use crate::oracle::{Chunk, Oracle};
use crate::protocol::Layout;
use crate::report::{BuildReport, Outcome, Report};
use crate::runner::ProcessRunner;
use crate::toolchain::{self, Build, BuildError, Install, Missing, Purpose, Sources};
use crate::traces::{Recorded, Stream};

/// Generated files: relative path to text.
pub type Files = BTreeMap<String, String>;

/// What to verify and how.
pub struct Options<'a> {
    /// Control steps of the stream; recordings count.
    pub steps: u64,
    /// Seed of the stream.
    pub seed: u64,
    /// Whose compilers, flags and emulator are used.
    pub target: &'static TargetSpec,
    /// Files to verify; `None` generates them anew for the target, in C and Rust.
    pub generated: Option<&'a Files>,
    /// Names of the compilers to use; all if empty.
    pub compilers: Vec<String>,
    /// Names of the optimisation levels to build; all if empty.
    pub levels: Vec<String>,
    /// More flags for the C compilers, after all others.
    pub extra_flags: Vec<String>,
    /// More flags for rustc, after all others.
    pub extra_rust_flags: Vec<String>,
    /// Whether each build is made once more with the loops in assembly, where the generated files have some.
    pub assembly: bool,
    /// Share of golden decisions that the numeric format may change, 0..1; `None`: as the contract says.
    pub golden_decisions: Option<f64>,
    /// Recordings to play before the random part.
    pub recorded: Vec<Recorded>,
    /// These combinations of codes in the place of all else, a step of a fresh controller each.
    pub codes: Option<(&'a Grid, Range<u64>)>,
    /// A build that sends nothing for so long has failed.
    pub timeout: Duration,
    /// Told how far it is.
    pub progress: Option<&'a mut dyn FnMut(Progress)>,
}

impl Default for Options<'_> {
    fn default() -> Self {
        Self {
            steps: 100_000,
            seed: 1,
            target: targets::host(),
            generated: None,
            compilers: Vec::new(),
            levels: Vec::new(),
            extra_flags: Vec::new(),
            extra_rust_flags: Vec::new(),
            assembly: false,
            golden_decisions: None,
            recorded: Vec::new(),
            codes: None,
            // a driver's buffer of 64 kB holds some 470 steps, of 0.9 M instructions at most (floats by library on a
            // Cortex-M0+): a second or two of an emulator, and the rest is for machines under load
            timeout: Duration::from_secs(60),
            progress: None,
        }
    }
}

/// How far a verification is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// The builds are being compiled.
    Compiling {
        /// Number of builds.
        builds: usize,
    },
    /// The stream is running.
    Running {
        /// Steps the interpreter has done; the builds follow closely.
        steps: u64,
        /// Steps of the whole stream.
        of: u64,
    },
}

/// Why there is no report. Differences are no errors: they are in the report.
#[derive(Debug)]
pub enum VerifyError {
    /// A name in [`Options::compilers`] is none of the target's.
    UnknownCompiler {
        /// The name.
        found: String,
        /// The target.
        target: &'static str,
        /// Its compilers.
        expected: Vec<&'static str>,
    },
    /// The code could not be generated.
    Codegen(codegen::CodegenError),
    /// The interpreter refused an event.
    Interpreter(InputError),
    /// The policy of the construct suite does not pass the check.
    Constructs(String),
    /// A temporary folder could not be made or a folder not be read.
    Io(PathBuf, std::io::Error),
}

impl fmt::Display for VerifyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownCompiler {
                found,
                target,
                expected,
            } => write!(
                f,
                "target {target} has no compiler `{found}`, but {}",
                expected.join(", ")
            ),
            Self::Codegen(error) => write!(f, "{error}"),
            Self::Interpreter(error) => write!(f, "internal fault: interpreter: {error}"),
            Self::Constructs(faults) => write!(f, "internal fault: construct suite: {faults}"),
            Self::Io(path, error) => write!(f, "{}: {error}", path.display()),
        }
    }
}

impl std::error::Error for VerifyError {}

impl From<VerifyError> for Faults {
    fn from(error: VerifyError) -> Self {
        match error {
            VerifyError::UnknownCompiler {
                found,
                target,
                expected,
            } => messages::unknown(&format!("compiler of {target}"), &found, &expected).into(),
            VerifyError::Codegen(error) => error.into(),
            VerifyError::Interpreter(_) | VerifyError::Constructs(_) => Message::new(error.to_string()).into(),
            VerifyError::Io(path, error) => Fault::in_file(&path, Message::new(error.to_string())).into(),
        }
    }
}

/// A compiler that takes longer has failed; the largest policies take seconds.
// a hundred times that, for machines under load
pub(crate) const COMPILER_TIMEOUT: Duration = Duration::from_secs(600);
/// Steps per chunk.
// for buck12 0.6 MB of expected words, 35 a step; the figure itself is a convention
const CHUNK: u64 = 4096;
/// Chunks a slow build may lag behind.
// bounded, or a fast interpreter would fill the memory with chunks for a slow emulator
const LAG: usize = 2;

/// Compiles the policy's code with every compiler at hand and compares it with the interpreter.
///
/// # Errors
/// If nothing could be compared for reasons other than the generated code; see [`VerifyError`].
pub fn run(policy: &Policy, options: Options<'_>) -> Result<Report, VerifyError> {
    match policy.numeric_format.scalar() {
        Scalar::F32 => run_in::<f32>(policy, options),
        Scalar::F64 => run_in::<f64>(policy, options),
    }
}

/// [`run`] with the interpreter in the floats `T`.
fn run_in<T: Real>(policy: &Policy, options: Options<'_>) -> Result<Report, VerifyError> {
    let Options {
        steps,
        seed,
        target,
        generated,
        compilers,
        levels,
        extra_flags,
        extra_rust_flags,
        assembly,
        golden_decisions,
        recorded,
        codes,
        timeout,
        mut progress,
    } = options;
    let steps = codes.as_ref().map_or(steps, |(_, range)| range.end - range.start);
    let mut tell = |news: Progress| {
        if let Some(progress) = &mut progress {
            progress(news);
        }
    };
    // before anything is built: a mistyped name would look like missing tools
    check_names(target, &compilers)?;
    let fresh;
    let files = match generated {
        Some(files) => files,
        None => {
            fresh = codegen::generate(policy, target, &Output::CORES, None).map_err(VerifyError::Codegen)?;
            &fresh.files
        }
    };
    let plain = toolchain::builds(target, &compilers, &levels);
    // the build with assembly stands behind the one without, so that a report shows them together
    let both = plain.into_iter().flat_map(|build| {
        let assembly = build.with_assembly(policy, target, files).filter(|_| assembly);
        [Some(build), assembly]
    });
    let builds: Vec<Build> = both.flatten().collect();
    let temp = std::env::temp_dir();
    let folder = tempfile::tempdir().map_err(|error| VerifyError::Io(temp, error))?;
    tell(Progress::Compiling { builds: builds.len() });
    let sources = Sources {
        purpose: Purpose::Compare,
        policy,
        files,
        target,
        extra_flags: &extra_flags,
        extra_rust_flags: &extra_rust_flags,
        timeout: COMPILER_TIMEOUT,
    };
    let compiled = compile_all(&builds, sources, folder.path());

    let mut oracle = Oracle::<T>::new(policy);
    let layout = oracle.layout().clone();
    let known = oracle
        // the network alone answers these: the state stays as the stream wants to find it
        .chunk_of(golden::events(policy))
        .map_err(VerifyError::Interpreter)?;
    let golden = golden_result(policy);
    let mut stream = Stream::new(policy, seed, &recorded).after_codes(codes);
    let lanes = Lanes {
        policy,
        target,
        layout: &layout,
        known: &known,
        timeout,
    };
    let builds = lanes
        .compare(&builds, compiled, steps, &mut oracle, &mut stream, &mut tell)
        .map_err(VerifyError::Interpreter)?;
    Ok(Report {
        policy: policy.name.clone(),
        target: target.name,
        seed,
        steps: oracle.steps(),
        checksum: format!("{:08x}", oracle.checksum()),
        coverage: oracle.coverage().clone(),
        golden,
        decisions: decisions(policy, golden_decisions),
        builds,
    })
}

fn check_names(target: &TargetSpec, compilers: &[String]) -> Result<(), VerifyError> {
    let expected = toolchain::compilers(target);
    match compilers.iter().find(|name| !expected.contains(&name.as_str())) {
        Some(name) => Err(VerifyError::UnknownCompiler {
            found: name.clone(),
            target: target.name,
            expected,
        }),
        None => Ok(()),
    }
}

/// What all builds are compared with.
struct Lanes<'a> {
    policy: &'a Policy,
    target: &'a TargetSpec,
    layout: &'a Layout,
    known: &'a Chunk,
    timeout: Duration,
}

impl Lanes<'_> {
    /// Runs the interpreter over the stream once and every build beside it.
    fn compare<T: Real>(
        &self,
        builds: &[Build],
        compiled: Vec<Result<PathBuf, Outcome>>,
        steps: u64,
        oracle: &mut Oracle<T>,
        stream: &mut Stream<'_>,
        tell: &mut dyn FnMut(Progress),
    ) -> Result<Vec<BuildReport>, InputError> {
        thread::scope(|scope| {
            let mut feeds = Vec::new();
            let mut lanes = Vec::new();
            for (build, compiled) in builds.iter().zip(compiled) {
                let (feed, chunks) = sync_channel(LAG);
                feeds.push(Some(feed));
                lanes.push(scope.spawn(move || self.lane(build, compiled, &chunks)));
            }
            // with every lane ended nobody would look at the rest of the stream
            while oracle.steps() < steps && feeds.iter().any(Option::is_some) {
                let chunk = oracle.next_chunk(stream, CHUNK.min(steps - oracle.steps()))?;
                send(&mut feeds, &Arc::new(chunk));
                tell(Progress::Running {
                    steps: oracle.steps(),
                    of: steps,
                });
            }
            // the lanes wait for chunks until their channels close
            drop(feeds);
            // a lane does not panic; if one does, that is a fault of ours and must not pass as equal
            let reports = lanes.into_iter().zip(builds).map(|(lane, build)| {
                lane.join()
                    .unwrap_or_else(|_| entry(build, 0, failed("the comparison itself panicked")))
            });
            Ok(reports.collect())
        })
    }

    /// One build from its start to its end or its first difference.
    fn lane(&self, build: &Build, compiled: Result<PathBuf, Outcome>, chunks: &Receiver<Arc<Chunk>>) -> BuildReport {
        let executable = match compiled {
            Ok(executable) => executable,
            Err(outcome) => return entry(build, 0, outcome),
        };
        let Some(command) = toolchain::launch(self.target, executable, &[]) else {
            return entry(build, 0, failed("the target runs nowhere here"));
        };
        let runner = ProcessRunner::new(command, self.timeout, self.target.endianness);
        let mut lane = Lane::new(self.policy, self.layout, Box::new(runner));
        let course = lane
            .start()
            .and_then(|()| lane.known_answers(self.known))
            .and_then(|()| chunks.iter().try_for_each(|chunk| lane.follow(&chunk)));
        let outcome = course.err().unwrap_or(Outcome::Equal);
        BuildReport {
            golden: lane.golden().cloned(),
            ..entry(build, lane.steps_compared(), outcome)
        }
    }
}

/// Sends a chunk to every build that is still in the race.
fn send(feeds: &mut [Option<SyncSender<Arc<Chunk>>>], chunk: &Arc<Chunk>) {
    for feed in feeds {
        // a lane that has found a difference no longer listens
        if feed.as_ref().is_some_and(|feed| feed.send(Arc::clone(chunk)).is_err()) {
            *feed = None;
        }
    }
}

/// Compiles all builds, as many at a time as the machine has processors.
fn compile_all(builds: &[Build], sources: Sources<'_>, folder: &Path) -> Vec<Result<PathBuf, Outcome>> {
    // a counter and not shares: builds take times of very different length
    let next = AtomicUsize::new(0);
    let workers = thread::available_parallelism().map_or(1, usize::from).min(builds.len());
    let work = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(build) = builds.get(index) else { return done };
            done.push((index, compile(build, sources, &folder.join(index.to_string()))));
        }
    };
    let mut results: Vec<Result<PathBuf, Outcome>> = builds
        .iter()
        // stands until a worker has put its result there
        .map(|_| Err(failed("the compilation itself panicked")))
        .collect();
    thread::scope(|scope| {
        let threads: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        for (index, result) in threads.into_iter().filter_map(|thread| thread.join().ok()).flatten() {
            results[index] = result;
        }
    });
    results
}

fn compile(build: &Build, sources: Sources<'_>, folder: &Path) -> Result<PathBuf, Outcome> {
    if !build.missing.is_empty() {
        let missing = build.missing.clone();
        return Err(Outcome::Skipped { missing });
    }
    let skipped = |reason: String, install: Option<Install>| Outcome::Skipped {
        missing: vec![Missing { reason, install }],
    };
    // a folder each: two compilers write objects of the same names
    let made = std::fs::create_dir(folder).map_err(BuildError::Io);
    made.and_then(|()| toolchain::compile(build, sources, folder))
        .map_err(|error| match error {
            BuildError::NoFiles => skipped(format!("the files have no {} code", build.language().name()), None),
            BuildError::NoSanitiser => skipped(
                format!("{} has no sanitiser libraries", build.compiler),
                // of Debian 12, whose gcc it belongs to
                Some(Install::Package("libgcc-12-dev".to_owned())),
            ),
            BuildError::Io(error) => failed(&format!("could not compile: {error}")),
            BuildError::TooLarge(text) => failed(&format!("it does not fit the emulated board: {text}")),
            BuildError::Refused(message) => Outcome::CompileError { message },
        })
}

fn entry(build: &Build, steps_compared: u64, outcome: Outcome) -> BuildReport {
    BuildReport {
        build: build.name(),
        compiler: build.version.clone(),
        steps_compared,
        outcome,
        golden: None,
    }
}

fn failed(reason: &str) -> Outcome {
    Outcome::Failed {
        step: 0,
        event: "build".to_owned(),
        reason: reason.to_owned(),
        measurement: Vec::new(),
    }
}
