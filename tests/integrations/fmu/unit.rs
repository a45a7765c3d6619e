//! FMUs on disk, the program that imports them, FMPy, and the loop that both close.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::OnceLock;

use closed_loop::agent::Inputs;
use closed_loop::{Answer, Controller, Converter, Environment, LoadPath, Start};
use codegen::Output;
use interp::Sample;
use plant::{Load, Parameters};
use policy::{Interval, Policy};
use tests::tools::{Ran, run};
use verify::fmu::Archive;

use crate::{build, files, write};

pub const VERSIONS: [Output; 2] = [Output::Fmu2, Output::Fmu3];

/// Python with FMPy.
pub fn python() -> Command {
    tests::tools::python(env!("CARGO_TARGET_TMPDIR"))
}

/// The standard headers as FMPy brings them, but with the prefix of FMI 2 that its copy leaves out.
pub fn standard_headers() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let script = "import fmpy; print(fmpy.__path__[0], fmpy.__version__, sep='\\n')";
        let ran = run(python().args(["-c", script]));
        let [package, version] = ran.stdout.lines().collect::<Vec<_>>()[..] else {
            panic!("{}", ran.stderr);
        };
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fmi-headers-{version}"));
        if !folder.exists() {
            // whole or not at all, as tests may run twice at a time
            let made = folder.with_extension(std::process::id().to_string());
            copy_headers(&Path::new(package).join("c-code"), &made);
            if std::fs::rename(&made, &folder).is_err() {
                std::fs::remove_dir_all(made).unwrap();
            }
        }
        folder
    })
}

fn copy_headers(from: &Path, to: &Path) {
    tests::tools::copy_folder(from, to);
    let file = to.join("fmi2Functions.h");
    let text = std::fs::read_to_string(&file).unwrap();
    let stripped = "#define fmi2FullName(name) name";
    assert!(text.contains(stripped));
    let whole = "#ifdef FMI2_FUNCTION_PREFIX\n#define fmi2Paste(a, b) a##b\n#define fmi2PasteB(a, b) fmi2Paste(a, b)\n\
                 #define fmi2FullName(name) fmi2PasteB(FMI2_FUNCTION_PREFIX, name)\n#else\n#define fmi2FullName(name) name\n#endif";
    std::fs::write(file, text.replace(stripped, whole)).unwrap();
}

/// The files of an FMU with the first `from` of the file with that ending in the place of `to`.
#[track_caller]
fn edited(policy: &Policy, output: Output, ending: &str, from: &str, to: &str) -> BTreeMap<String, String> {
    let mut files = files(policy, output, 1);
    if !from.is_empty() {
        let text = files.get_mut(&format!("{}{ending}", policy.name)).unwrap();
        assert!(text.contains(from), "{from}");
        *text = text.replacen(from, to, 1);
    }
    files
}

/// FMUs without binary, as folders, for FMPy to look at their descriptions.
#[derive(Default)]
pub struct Descriptions {
    folders: Vec<tempfile::TempDir>,
}

impl Descriptions {
    /// One more; returns its description.
    #[track_caller]
    pub fn add(&mut self, policy: &Policy, output: Output, from: &str, to: &str) -> String {
        let fmi = verify::fmu::version(output).unwrap();
        let files = edited(policy, output, &format!("_{}.xml", fmi.name()), from, to);
        let folder = tempfile::tempdir().unwrap();
        let layout = codegen::backend::fmu::layout(&policy.name, fmi);
        let members = layout.iter().map(|(path, file)| (path.clone(), files[file].clone()));
        write(&members.collect(), folder.path());
        self.folders.push(folder);
        files[&layout[0].1].clone()
    }

    /// The problems of each.
    pub fn problems(&self) -> Vec<String> {
        let script = "import sys; from fmpy.validation import validate_fmu\n\
                      for path in sys.argv[1:]: print('; '.join(validate_fmu(path)).replace('\\n', ' '))";
        let ran = run(python()
            .args(["-c", script])
            .args(self.folders.iter().map(tempfile::TempDir::path)));
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let lines: Vec<String> = ran.stdout.lines().map(str::to_owned).collect();
        assert_eq!(lines.len(), self.folders.len(), "{lines:?}");
        lines
    }
}

/// An FMU with its files and its archive in a folder.
pub struct Unit {
    folder: tempfile::TempDir,
    pub policy: Policy,
    pub output: Output,
    pub archive: Archive,
    pub files: BTreeMap<String, String>,
}

impl Unit {
    pub fn new(policy: &Policy, output: Output) -> Self {
        Self::edited(policy, output, "", "", "")
    }

    /// With the first `from` of the file with that ending in the place of `to`.
    #[track_caller]
    pub fn edited(policy: &Policy, output: Output, ending: &str, from: &str, to: &str) -> Self {
        let files = edited(policy, output, ending, from, to);
        let target = targets::find("host").unwrap();
        let archive = verify::fmu::archives(policy, target, &[output], &files)
            .unwrap()
            .remove(0);
        let unit = Self {
            folder: tempfile::tempdir().unwrap(),
            policy: policy.clone(),
            output,
            archive,
            files,
        };
        write(&unit.files, unit.path());
        std::fs::write(unit.path().join(&unit.archive.file), &unit.archive.bytes).unwrap();
        tests::tools::copy_folder(&tests::root().join("tests/integrations/fmu"), unit.path());
        std::fs::write(unit.path().join("config.h"), unit.config()).unwrap();
        unit
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn version(&self) -> &'static str {
        verify::fmu::version(self.output).unwrap().name()
    }

    /// C files of the FMU.
    pub fn sources(&self) -> Vec<String> {
        codegen::backend::fmu::sources(&self.policy.name, verify::fmu::version(self.output).unwrap())
    }

    /// The binary, taken out of the archive by another reader of the format.
    pub fn library(&self) -> PathBuf {
        let (platform, _) = self.archive.binary.clone().unwrap();
        let archive = self.path().join(&self.archive.file);
        let folder = self.path().join("unpacked");
        let ran = run(Command::new("python3")
            .args(["-m", "zipfile", "-e"])
            .arg(archive)
            .arg(&folder));
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        folder.join(format!("binaries/{platform}/{}.so", self.policy.name))
    }

    /// What the importer must know of the FMU, as C.
    fn config(&self) -> String {
        let Policy { name, signals, .. } = &self.policy;
        let description = &self.files[&format!("{name}_{}.xml", self.version())];
        let start = description.find('{').unwrap();
        let token = &description[start..=start + description[start..].find('}').unwrap()];
        let kinds: String = signals
            .iter()
            .map(|signal| if signal.adc.is_some() { 'i' } else { 'r' })
            .collect();
        let list = |pick: fn(Interval) -> f64| {
            let arrives = |signal: &policy::Signal| match signal.adc {
                Some(adc) => (pick(signal.range) - adc.offset) / adc.gain,
                None => pick(signal.range),
            };
            let texts: Vec<String> = signals.iter().map(|signal| format!("{:?}", arrives(signal))).collect();
            texts.join(", ")
        };
        let paths = self.policy.paths();
        let mappings = paths.iter().filter_map(|path| path.mapping);
        let coefficients: usize = mappings
            .map(|mapping| 3 + usize::from(mapping.coefficients.r.is_some()))
            .sum();
        let scalar = self.policy.numeric_format.scalar();
        let fallbacks: Vec<String> = paths
            .iter()
            .map(|path| format!("{:?}", scalar.nearest(path.fallback)))
            .collect();
        format!(
            "#define NAME {name}_\n#define TOKEN \"{token}\"\n#define PERIOD {:?}\n#define KINDS \"{kinds}b\"\n\
             #define LOWS {{ {} }}\n#define HIGHS {{ {} }}\n#define PARAMETERS {coefficients}\n#define DUTIES {}\n#define FALLBACKS {{ {} }}\n",
            self.policy.sample_period,
            list(|range| range.low),
            list(|range| range.high),
            paths.len(),
            fallbacks.join(", ")
        )
    }

    fn importer_flags(&self) -> Vec<String> {
        let headers = standard_headers().display();
        let version = self.version().trim_start_matches("fmi");
        vec![format!("-DFMI={version}"), format!("-isystem{headers}")]
    }

    /// Builds the program that loads the FMU's binary.
    pub fn build_importer(&self) {
        let flags = self.importer_flags();
        let strict = ["gcc", "-std=c99", "-D_GNU_SOURCE", "-O1", "-Wall", "-Wextra", "-Werror"];
        let command: Vec<&str> = strict.into_iter().chain(flags.iter().map(String::as_str)).collect();
        let built = build(&command, &["importer.c", "-ldl"], self.path());
        assert_eq!((built.code, built.stderr.as_str()), (Some(0), ""));
    }

    /// The program that another unit of that policy has built.
    pub fn take_importer(&self, other: &Self) {
        std::fs::copy(other.path().join("program"), self.path().join("program")).unwrap();
    }

    /// Builds importer and sources into one object file each; `main` gets that name.
    pub fn build_objects(&self, main: &str, more: &[&str]) -> Ran {
        let flags = self.importer_flags();
        let renamed = format!("-Dmain={main}");
        let base = ["gcc", "-std=c99", "-D_GNU_SOURCE", "-DSTATIC", "-c", "-I.", &renamed];
        let (sources, folder) = (self.sources(), self.path());
        let all: Vec<&str> = base
            .into_iter()
            .chain(flags.iter().map(String::as_str))
            .chain(more.iter().copied())
            .collect();
        let mut command = Command::new(all[0]);
        command.args(&all[1..]).arg("importer.c").args(sources);
        run(command.current_dir(folder))
    }

    /// The object files of [`Unit::build_objects`].
    pub fn objects(&self) -> Vec<PathBuf> {
        let sources = self.sources();
        let all = sources.iter().map(String::as_str).chain(["importer.c"]);
        all.map(|source| self.path().join(source).with_extension("o")).collect()
    }

    /// How the FMU's instances behave; the importer is built.
    pub fn check(&self) -> Ran {
        run(Command::new(self.path().join("program"))
            .arg(self.library())
            .arg("check"))
    }

    /// The FMU as a running controller; the importer is built.
    pub fn run(&self) -> Running {
        let mut command = Command::new(self.path().join("program"));
        command.arg(self.library()).arg("run");
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let answers = BufReader::new(child.stdout.take().unwrap());
        Running { child, answers }
    }

    /// What an importer in Python, a script with its options, says of the FMU and how it simulates it with these samples.
    pub fn simulate(&self, trajectory: &[Vec<Sample>], script: &[&str]) -> (Ran, Vec<String>) {
        let mut table = "time".to_owned();
        for signal in &self.policy.signals {
            let _ = write!(table, ",{}", signal.name);
        }
        for (index, samples) in trajectory.iter().enumerate() {
            let _ = write!(table, "\n{:?}", index as f64 * self.policy.sample_period);
            for sample in samples {
                let _ = write!(table, ",{:?}", value(*sample));
            }
        }
        std::fs::write(self.path().join("signals.csv"), table).unwrap();
        let mut command = python();
        command.current_dir(self.path());
        command.args([script[0], &self.archive.file, "signals.csv", "answers.txt"]);
        let ran = run(command.args(&script[1..]));
        let answers = std::fs::read_to_string(self.path().join("answers.txt")).unwrap_or_default();
        (ran, answers.lines().map(str::to_owned).collect())
    }
}

/// A sample as a port of the FMU takes it.
fn value(sample: Sample) -> f64 {
    match sample {
        Sample::Physical(x) => f64::from(x),
        Sample::Wide(x) => x,
        Sample::Code(code) => f64::from(code),
    }
}

/// An FMU in the importing program.
pub struct Running {
    child: Child,
    answers: BufReader<ChildStdout>,
}

impl Running {
    pub fn step(&mut self, samples: &[Sample]) -> Result<Answer, String> {
        let line = self.line(samples)?;
        parse(&line).ok_or(line)
    }

    /// What the program says of a step: bits of each duty, then the actions and the status.
    pub fn line(&mut self, samples: &[Sample]) -> Result<String, String> {
        let enabled = [1.0];
        let values = samples.iter().map(|sample| value(*sample)).chain(enabled);
        let words: Vec<String> = values.map(|value| format!("{:x}", value.to_bits())).collect();
        let input = self.child.stdin.as_mut().unwrap();
        writeln!(input, "{}", words.join(" ")).map_err(|error| error.to_string())?;
        let mut line = String::new();
        self.answers.read_line(&mut line).map_err(|error| error.to_string())?;
        Ok(line.trim().to_owned())
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}

fn parse(line: &str) -> Option<Answer> {
    let [duty, action, status] = line.split(' ').collect::<Vec<_>>().try_into().ok()?;
    Some(Answer {
        duty: f64::from_bits(u64::from_str_radix(duty, 16).ok()?),
        action: action.parse().ok(),
        status: status.parse().ok()?,
    })
}

/// The line that stands for an answer: bits of the duty, action, status.
pub fn line(answer: &Answer) -> String {
    let Answer { duty, action, status } = *answer;
    format!("{:016x} {} {status}", duty.to_bits(), action.unwrap())
}

/// A loop with a converter whose load steps every 50 ms: samples and answers of each period.
pub fn closed_loop(policy: &Policy, controller: &mut dyn Controller, periods: usize) -> Vec<(Vec<Sample>, Answer)> {
    let mut parameters = Parameters::paper_model();
    parameters.inductor.dcr = 0.08;
    parameters.capacitor.esr = 0.01;
    parameters.switch.v_f = 0.8;
    parameters.sensors.v_out.noise = 0.05;
    let mut converter = Converter::new(&parameters).unwrap();
    let loads = [
        Load::power(200.0),
        Load::resistor(12.0),
        Load::power(900.0),
        Load::current(2.0),
    ];
    let start = Start {
        v_out: 90.0,
        i_l: 2.0,
        load: loads[0],
        seed: 1,
        varied: &[],
    };
    let mut sample = converter.restart(&start).unwrap();
    let mut inputs = Inputs::new(policy).unwrap();
    controller.restart().unwrap();
    let mut all = Vec::new();
    for period in 0..periods {
        let samples = inputs.samples(&sample.measured).to_vec();
        let answer = controller.step(&sample.measured).unwrap();
        let load = loads[period / 500 % loads.len()];
        sample = converter.step(answer.duty, &LoadPath::constant(load));
        all.push((samples, answer));
    }
    all
}
