//! One page, typed in from its first command to its last by a reader who began in an empty folder.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use tests::tools::{is_without, policyc};

use super::blocks::{self, Block, Kind};

/// No page may keep a reader longer; most take seconds.
const PATIENCE: Duration = Duration::from_secs(10 * 60);
const LAST_LINES: usize = 40;

/// What a page came to.
#[derive(Default)]
pub struct Outcome {
    pub seconds: f64,
    pub commands: usize,
    /// Blocks that were not run: `line: reason`.
    pub left_out: Vec<String>,
    /// What failed: `line: what`, and the output.
    pub faults: Vec<String>,
}

/// A reader's desk: `work/`, empty, beside the checkout `policyc/`.
struct Desk {
    folder: tempfile::TempDir,
}

impl Desk {
    fn new() -> Self {
        let desk = Self {
            folder: tempfile::tempdir().unwrap(),
        };
        let root = tests::root().canonicalize().unwrap();
        std::fs::create_dir(desk.path("work")).unwrap();
        std::fs::create_dir(desk.path("bin")).unwrap();
        std::fs::create_dir(desk.path("page")).unwrap();
        std::os::unix::fs::symlink(root, desk.path("policyc")).unwrap();
        std::os::unix::fs::symlink(policyc(), desk.path("bin/policyc")).unwrap();
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Bash with the programs that a reader has after `docs/install.md`.
    fn shell(&self) -> Command {
        let target = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let python = target.with_file_name("python").join("bin");
        let path = std::env::var("PATH").unwrap_or_default();
        let mut command = Command::new("bash");
        command
            .current_dir(self.path("work"))
            .env(
                "PATH",
                format!("{}:{}:{path}", self.path("bin").display(), python.display()),
            )
            // what the crates of the pages depend on is built once for all of them and for the firmware
            .env("CARGO_TARGET_DIR", target.join("../firmware/no-std"))
            .env("CARGO_TERM_COLOR", "never")
            .env("LC_ALL", "C")
            .env_remove("POLICYC_BLESS")
            .stdin(Stdio::null());
        command
    }

    fn has(&self, need: &str) -> bool {
        let without = std::env::var("POLICYC_WITHOUT_RUST_TARGETS").unwrap_or_default();
        // `arm-none-eabi-gcc` is a program and `thumbv7em-none-eabihf` a target: rustc knows which
        let script = format!(
            "if rustc --print target-list | grep -qxF '{need}'; then ls \"$(rustc --print target-libdir --target '{need}')\"/libcore-*; else command -v '{need}'; fi"
        );
        let known = !without.split(',').any(|target| target == need) && !is_without(need);
        let mut shell = self.shell();
        shell.args(["-c", &script]).stdout(Stdio::null()).stderr(Stdio::null());
        known && shell.status().is_ok_and(|status| status.success())
    }
}

/// Runs a page behind the one where its reader comes from (`blocks::continues`), whose own lines are judged where they stand.
pub fn run(text: &str, before: Option<&str>) -> Outcome {
    let started = Instant::now();
    let mut outcome = Outcome::default();
    let both = before.map_or(Ok(Vec::new()), blocks::read).and_then(|mut all| {
        all.retain(|block| block.kind != Kind::Shown);
        all.extend(blocks::read(text)?);
        Ok(all)
    });
    match both {
        Ok(blocks) => run_blocks(&blocks, &mut outcome),
        Err(faults) => outcome.faults = faults,
    }
    outcome.seconds = started.elapsed().as_secs_f64();
    outcome
}

fn run_blocks(blocks: &[Block], outcome: &mut Outcome) {
    let desk = Desk::new();
    let mut script = String::from("set -euo pipefail\n");
    let mut ran = Vec::new();
    for (index, block) in blocks.iter().enumerate() {
        if let Some(need) = block.needs.as_ref().filter(|need| !desk.has(need)) {
            outcome.left_out.push(format!("{}: {need} is not here", block.line));
            continue;
        }
        match &block.kind {
            Kind::NotTested { reason } => outcome.left_out.push(format!("{}: {reason}", block.line)),
            Kind::File(name) => {
                let source = desk.path(&format!("page/{index}.file"));
                std::fs::write(&source, &block.text).unwrap();
                writeln!(script, "install -Dm644 '{}' '{name}'", source.display()).unwrap();
            }
            Kind::Commands { exit } => {
                let place = desk.path(&format!("page/{index}.out"));
                writeln!(script, "exec >'{}' 2>&1", place.display()).unwrap();
                script.push_str(&typed(&block.text, *exit));
                ran.push(index);
            }
            Kind::Shown => {}
        }
    }
    if ran.is_empty() {
        return;
    }
    outcome.commands = ran.len();
    let ended = type_in(&desk, &script);
    judge(blocks, &ran, &desk, ended, outcome);
}

/// A block in the shell of its page; one that must fail runs in a shell of its own, so that the page goes on.
fn typed(text: &str, exit: i32) -> String {
    match exit {
        0 => text.to_owned(),
        code => format!(
            "set +e\n(\nset -e\n{text})\ncode=$?\nset -e\n\
             [ $code = {code} ] || {{ echo \"exit code $code in the place of {code}\"; exit 1; }}\n"
        ),
    }
}

/// `None`: it took too long.
fn type_in(desk: &Desk, script: &str) -> Option<bool> {
    let path = desk.path("page/script");
    std::fs::write(&path, script).unwrap();
    let mut child = desk.shell().arg(&path).spawn().unwrap();
    let started = Instant::now();
    while started.elapsed() < PATIENCE {
        if let Some(status) = child.try_wait().unwrap() {
            return Some(status.success());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    None
}

fn judge(blocks: &[Block], ran: &[usize], desk: &Desk, ended: Option<bool>, outcome: &mut Outcome) {
    let output = |index: usize| std::fs::read(desk.path(&format!("page/{index}.out")));
    let text = |index: usize| String::from_utf8_lossy(&output(index).unwrap_or_default()).into_owned();
    let reached: Vec<usize> = ran.iter().copied().filter(|index| output(*index).is_ok()).collect();
    if ended != Some(true) {
        // the last block that was begun is the one that failed
        let index = reached.last().copied().unwrap_or(0);
        let all = text(index);
        let lines: Vec<&str> = all.lines().collect();
        let tail = lines[lines.len().saturating_sub(LAST_LINES)..].join("\n    ");
        let what = if ended.is_none() { "takes too long" } else { "fails" };
        outcome
            .faults
            .push(format!("{}: {what}\n    {tail}", blocks[index].line));
    }
    for index in reached {
        let Some(shown) = blocks.get(index + 1).filter(|next| next.kind == Kind::Shown) else {
            continue;
        };
        if let Err(fault) = blocks::is_in_output(&shown.text, &text(index)) {
            let printed = text(index).replace('\n', "\n    ");
            outcome.faults.push(format!("{}: {fault}\n    {printed}", shown.line));
        }
    }
}
