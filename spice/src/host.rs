//! The program between ngspice's shared library and us: built once per process, one child per converter.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::OnceLock;
use toml_input::Message;

use closed_loop::Error;
use tempfile::TempDir;

/// What to type where ngspice's library is missing.
pub const INSTALL: &str = "ngspice's shared library is needed; type\n    sudo apt-get update && sudo apt-get install -y \
    --no-install-recommends libngspice0-dev gcc libc6-dev\nor `cargo xtask test`, which does so";

const SOURCE: &str = include_str!("../host/host.c");

/// The sources that a run sets, in the order of the host program: the netlist's `external` ones.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// `gu`: 1 is on.
    UpperGate = 0,
    /// `gl`: 1 is on.
    LowerGate = 1,
    /// `pw`, W.
    Power = 2,
    /// `cc`, A.
    Current = 3,
    /// `gg`, S.
    Conductance = 4,
}

/// A source goes to another level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Which source.
    pub source: Source,
    /// s from the start of the control period; may lie before or behind it.
    pub time: f64,
    /// s
    pub rise: f64,
    /// What it goes to.
    pub level: f64,
}

/// What ngspice says at a sampling instant.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Row {
    /// V, `v(out)`
    pub v_out: f64,
    /// A, `i(vil)`
    pub i_l: f64,
    /// A, `i(vout)`
    pub i_out: f64,
    /// V, `v(nin)`
    pub v_in: f64,
    /// Lowest and highest output voltage, then inductor current, since the row before.
    pub extremes: [f64; 4],
    /// The other vectors that were asked for.
    pub others: Vec<f64>,
}

/// A netlist in the middle of its transient.
#[derive(Debug)]
pub struct Host {
    child: Child,
    input: Option<ChildStdin>,
    output: BufReader<ChildStdout>,
    _folder: TempDir,
}

impl Host {
    /// Starts `netlist` and returns the start; `before` are the edges behind it, `others` vectors to be read beside those of
    /// every [`Row`].
    ///
    /// # Errors
    /// If the library is missing or does not take the netlist.
    pub fn start(netlist: &str, t_sample: f64, before: &[Edge], others: &[&str]) -> Result<(Self, Row), Error> {
        let folder = tempfile::tempdir().map_err(|error| failed("make a folder", &error))?;
        let file = folder.path().join("circuit.cir");
        std::fs::write(&file, netlist).map_err(|error| failed("write a netlist", &error))?;
        let mut command = Command::new(program()?);
        command.arg(&file).arg(format!("{t_sample:e}")).args(others);
        command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit());
        let mut child = command.spawn().map_err(|error| failed("start ngspice", &error))?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(Message::new("ngspice has no pipes").into());
        };
        let mut host = Self {
            child,
            input: Some(input),
            output: BufReader::new(output),
            _folder: folder,
        };
        let row = host.period(before)?;
        Ok((host, row))
    }

    /// The edges of a control period; returns its end.
    ///
    /// # Errors
    /// If ngspice gave up.
    pub fn period(&mut self, edges: &[Edge]) -> Result<Row, Error> {
        let mut line = edges.len().to_string();
        for edge in edges {
            // writing to a String cannot fail
            let _ = write!(
                line,
                // `{:e}` has as many digits as the round trip needs: the edges are where they were computed
                " {} {:e} {:e} {:e}",
                edge.source as u8, edge.time, edge.rise, edge.level
            );
        }
        line.push('\n');
        if let Some(input) = &mut self.input {
            let sent = input.write_all(line.as_bytes()).and_then(|()| input.flush());
            sent.map_err(|error| failed("talk to ngspice", &error))?;
        }
        self.row()
    }

    fn row(&mut self) -> Result<Row, Error> {
        let mut line = String::new();
        let read = self.output.read_line(&mut line);
        read.map_err(|error| failed("hear ngspice", &error))?;
        // where ngspice has ended the line is empty, and has too few numbers
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        match &numbers[..] {
            &[_, v_out, i_l, i_out, v_in, a, b, c, d, ref others @ ..] => Ok(Row {
                v_out,
                i_l,
                i_out,
                v_in,
                extremes: [a, b, c, d],
                others: others.to_vec(),
            }),
            _ => Err(Message::new("ngspice ended early; its words are above").into()),
        }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // the end of its input ends it
        self.input = None;
        let _ = self.child.wait();
    }
}

fn failed(what: &str, error: &std::io::Error) -> Error {
    Message::new(format!("cannot {what}")).found(error.to_string()).into()
}

/// The built host program.
fn program() -> Result<&'static Path, Error> {
    static PROGRAM: OnceLock<Result<(TempDir, PathBuf), Error>> = OnceLock::new();
    match PROGRAM.get_or_init(build) {
        Ok((_, path)) => Ok(path),
        Err(error) => Err(error.clone()),
    }
}

fn build() -> Result<(TempDir, PathBuf), Error> {
    let folder = tempfile::tempdir().map_err(|error| failed("make a temporary folder", &error))?;
    let (source, program) = (folder.path().join("host.c"), folder.path().join("host"));
    std::fs::write(&source, SOURCE).map_err(|error| failed("write the host program", &error))?;
    let mut command = Command::new("gcc");
    command
        .args(["-std=c99", "-O2", "-o"])
        .arg(&program)
        .arg(&source)
        .arg("-lngspice");
    let missing = |found: String| {
        Message::new("the host of ngspice cannot be built")
            .found(found)
            .hint(INSTALL)
    };
    let output = command.output().map_err(|error| missing(format!("gcc: {error}")))?;
    if !output.status.success() {
        return Err(missing(String::from_utf8_lossy(&output.stderr).into_owned()).into());
    }
    Ok((folder, program))
}
