//! One entry for desk and CI: `cargo xtask <command>`.

mod book;
mod markdown;
mod process;
mod programs;
mod release;
mod rules;
mod steps;
mod studio;
mod tools;
mod wheel;
mod workspace;

use std::process::ExitCode;

use steps::Options;
use workspace::Workspace;

const USAGE: &str = "\
usage: cargo xtask <command>

  test [--quick|--full] [--skip-install]   everything CI asks for; the last line counts the steps
         --quick          without the crates `tests` and `blind`, the wheel, rustdoc, firmware and the demo
         --full           what a release asks for: 20,000 steps on every emulated target, float libraries included; the libraries
                          of trainers and Ray; packages and the oldest compiler
         --skip-install   look for the tools, install none
  setup                             only the tools: compilers, emulators, ngspice, mdBook (also called install)
  bless                             rewrite the golden files from what the code produces now
  wheel [--full]                    only the Python package: build, install, test
  studio                            only the page of `policyc studio`, into target/studio
  release --dry-run                 packs every published crate, and builds the packages with the oldest compiler
  layers                            only the layer rules
  book                              only the book: links, contents, mdBook
  words                             words of each page, and figures per hundred of them
  comments                          share of the lines of each crate that say why
  bench [--json|--counts|--peers|--host]
                                    instruction counts and times of the generated network (docs/results/kernels.md)
  random --out DIR [--policies N] [--shard I/N] ...
                                    policies drawn at random, every build against the interpreter (docs/evidence.md; --help)
  fuzz [--seconds N|--executions N] [--target NAME] ...
                                    damaged bytes for every reader (docs/results/fuzzing.md; --help)
  mutants --seed S [--sample N] ...
                                    changes to interp, policy and codegen that a test should catch (docs/evidence.md; --help)
  blind --out DIR ...               blind cases for the diagnosis and their score (docs/reference/blind-cases.md; --help)
";

#[derive(Debug, PartialEq)]
enum Command {
    Test(Options),
    Install,
    Bless,
    Wheel(Options),
    Studio,
    Release,
    Layers,
    Book,
    Words,
    Comments,
    Random(Vec<String>),
    Blind(Vec<String>),
    Fuzz(Vec<String>),
    Mutants(Vec<String>),
    Bench(Vec<String>),
    Help,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let command = match parse(&arguments) {
        Ok(command) => command,
        Err(message) => {
            eprint!("error: {message}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    match run(command) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn parse(arguments: &[String]) -> Result<Command, String> {
    let Some((name, rest)) = arguments.split_first() else {
        return Err("no command given".into());
    };
    let command = match name.as_str() {
        "test" => return parse_test(rest),
        "random" => return Ok(Command::Random(rest.to_vec())),
        "blind" => return Ok(Command::Blind(rest.to_vec())),
        "bench" => return Ok(Command::Bench(rest.to_vec())),
        "fuzz" => return Ok(Command::Fuzz(rest.to_vec())),
        "mutants" => return Ok(Command::Mutants(rest.to_vec())),
        "wheel" => {
            return parse_test(rest).map(|command| match command {
                Command::Test(options) => Command::Wheel(options),
                other => other,
            });
        }
        "release" if rest == ["--dry-run"] => return Ok(Command::Release),
        // publishing cannot be taken back: it is typed by hand
        "release" => return Err("`release` takes `--dry-run`; nothing is published from here".into()),
        "studio" => Command::Studio,
        "setup" | "install" => Command::Install,
        "bless" => Command::Bless,
        "layers" => Command::Layers,
        "book" => Command::Book,
        "words" => Command::Words,
        "comments" => Command::Comments,
        "help" | "--help" | "-h" => Command::Help,
        _ => return Err(format!("unknown command `{name}`")),
    };
    match rest.first() {
        Some(extra) => Err(format!("`{name}` takes no argument, found `{extra}`")),
        None => Ok(command),
    }
}

fn parse_test(flags: &[String]) -> Result<Command, String> {
    let mut options = Options::default();
    for flag in flags {
        match flag.as_str() {
            "--quick" => options.quick = true,
            "--full" => options.full = true,
            "--skip-install" => options.skip_install = true,
            _ => return Err(format!("unknown option `{flag}` of `test`")),
        }
    }
    match options.quick && options.full {
        true => Err("`--quick` and `--full` exclude each other".into()),
        false => Ok(Command::Test(options)),
    }
}

/// `Ok(false)`: the command ran and found faults, which it has printed.
fn run(command: Command) -> Result<bool, String> {
    match command {
        Command::Help => {
            print!("{USAGE}");
            Ok(true)
        }
        Command::Install => {
            let target_dir = Workspace::load()?.target_dir;
            book::provide(&target_dir, &process::Output::Terminal);
            tools::provide(&target_dir, &process::Output::Terminal)?;
            println!("all tools are there");
            Ok(true)
        }
        Command::Test(options) => Ok(steps::run_all(&Workspace::load()?, steps::ALL, options)),
        Command::Wheel(options) => Ok(steps::run_all(&Workspace::load()?, steps::OF_THE_WHEEL, options)),
        Command::Studio => Ok(steps::run_all(
            &Workspace::load()?,
            steps::OF_THE_STUDIO,
            Options::default(),
        )),
        Command::Release => Ok(steps::run_all(
            &Workspace::load()?,
            steps::OF_A_RELEASE,
            Options {
                full: true,
                ..Options::default()
            },
        )),
        Command::Bless => bless(&Workspace::load()?),
        Command::Layers => layers(&Workspace::load()?),
        Command::Book => Ok(steps::run_all(
            &Workspace::load()?,
            steps::OF_THE_BOOK,
            Options::default(),
        )),
        Command::Words => listed(&rules::words(&Workspace::load()?)?),
        Command::Comments => listed(&rules::comments(&Workspace::load()?)?),
        Command::Random(arguments) => random(&Workspace::load()?, &arguments),
        Command::Blind(arguments) => blind(&Workspace::load()?, &arguments),
        Command::Fuzz(arguments) => fuzz(&Workspace::load()?, &arguments),
        Command::Mutants(arguments) => mutants(&Workspace::load()?, &arguments),
        Command::Bench(arguments) => other_crate(&Workspace::load()?, "bench", &arguments),
    }
}

fn listed(lines: &[String]) -> Result<bool, String> {
    lines.iter().for_each(|line| println!("{line}"));
    Ok(true)
}

fn bless(workspace: &Workspace) -> Result<bool, String> {
    let mut command = workspace.cargo(&["test", "-p", "tests", "golden"]);
    command.env(steps::BLESS, "1");
    process::run(&mut command, &process::Output::Terminal)?;
    println!("golden files are rewritten: read the difference before you commit it");
    Ok(true)
}

fn blind(workspace: &Workspace, arguments: &[String]) -> Result<bool, String> {
    if arguments.iter().any(|argument| argument == "--score") {
        let mut build = workspace.cargo(&["build", "--release", "--quiet", "--bin", "policyc"]);
        process::run(&mut build, &process::Output::Terminal)?;
    }
    other_crate(workspace, "blind", arguments)
}

fn random(workspace: &Workspace, arguments: &[String]) -> Result<bool, String> {
    // no `-p` and no release: the tests have built all of it, with overflow checks in the interpreter
    let mut command = workspace.cargo(&["run", "--quiet", "--bin", "random-policies", "--"]);
    let status = command.args(arguments).status();
    Ok(status.map_err(|error| format!("cargo: {error}"))?.success())
}

fn fuzz(workspace: &Workspace, arguments: &[String]) -> Result<bool, String> {
    // a profile of its own: as quick as a release, with overflow checks
    let mut command = workspace.cargo(&["run", "--profile", "fuzz", "--quiet", "-p", "fuzz", "--"]);
    let status = command.args(arguments).status();
    Ok(status.map_err(|error| format!("cargo: {error}"))?.success())
}

fn mutants(workspace: &Workspace, arguments: &[String]) -> Result<bool, String> {
    // a crate outside of the workspace, as the firmware is
    let mut command = workspace.cargo(&["run", "--quiet", "--manifest-path", "tools/mutants/Cargo.toml"]);
    command
        .arg("--target-dir")
        .arg(workspace.target_dir.join("mutants/tool"));
    let status = command.arg("--").args(arguments).status();
    Ok(status.map_err(|error| format!("cargo: {error}"))?.success())
}

fn other_crate(workspace: &Workspace, name: &str, arguments: &[String]) -> Result<bool, String> {
    let mut command = workspace.cargo(&["run", "--release", "--quiet", "-p", name, "--"]);
    // no limit of time: a large set takes an hour
    let status = command.args(arguments).status();
    Ok(status.map_err(|error| format!("cargo: {error}"))?.success())
}

fn layers(workspace: &Workspace) -> Result<bool, String> {
    let findings = rules::layers(workspace)?;
    for fault in &findings.faults {
        println!("{fault}");
    }
    println!(
        "{} crates, {} violations",
        workspace.crates.len(),
        findings.faults.len()
    );
    Ok(findings.faults.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<Command, String> {
        parse(&line.split(' ').map(String::from).collect::<Vec<_>>())
    }

    #[test]
    fn flags_of_test_are_read() {
        let options = Options {
            quick: true,
            skip_install: true,
            full: false,
        };
        assert_eq!(parsed("test --skip-install --quick"), Ok(Command::Test(options)));
        let options = Options {
            full: true,
            ..Options::default()
        };
        assert_eq!(parsed("test --full"), Ok(Command::Test(options)));
        assert!(parsed("test --full --quick").unwrap_err().contains("exclude"));
    }

    #[test]
    fn a_release_is_rehearsed_and_nothing_else() {
        assert_eq!(parsed("release --dry-run"), Ok(Command::Release));
        assert!(parsed("release").unwrap_err().contains("--dry-run"));
        assert!(parsed("release --now").unwrap_err().contains("--dry-run"));
    }

    #[test]
    fn unknown_words_are_named() {
        assert!(parsed("tset").unwrap_err().contains("`tset`"));
        assert!(parsed("test --fast").unwrap_err().contains("`--fast`"));
        assert!(parsed("bless now").unwrap_err().contains("`now`"));
    }
}
