//! Generates blind cases and scores a diagnosis of them.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use blind::case::{Truth, measure};
use blind::experiment::Extent;
use blind::independent::{Family, Set};
use blind::plan::{Plan, plan, plan_of};
use blind::score::{Closed, Diagnosis, closed_table, judge, table};
use clap::{Parser, ValueEnum};

/// Hides effects in data of an independent simulator. See docs/reference/blind-cases.md.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask blind")]
struct Arguments {
    /// Everything follows from it. Left out, it is that of the folder, or drawn anew.
    #[arg(long)]
    seed: Option<u64>,
    /// Who makes the cases: ngspice with the effects that the diagnosis lists, or the world that knows nothing of it.
    #[arg(long, value_enum, default_value_t = World::Ngspice)]
    world: World,
    /// How many.
    #[arg(long, default_value_t = 48)]
    cases: usize,
    /// Folder of the set; cases that are there already are kept.
    #[arg(long)]
    out: PathBuf,
    /// Short records, as in the test command.
    #[arg(long)]
    short: bool,
    /// Do not look for rivals of the truth: twenty times as fast.
    #[arg(long)]
    no_rivals: bool,
    /// Hide these effects in every case instead of drawing them: ids with commas, or "none". With `--world independent`: a
    /// family of cases.
    #[arg(long)]
    only: Option<String>,
    /// Diagnose each case and write DIR/score.md.
    #[arg(long)]
    score: bool,
    /// With `--world independent`: no boost and no buck-boost.
    #[arg(long)]
    buck_only: bool,
    /// With --score: the mapping of this policy is refitted in each diagnosis, and the hidden converter judges it.
    #[arg(long, requires = "score")]
    closed_loop: Option<PathBuf>,
    /// The program that diagnoses; by default the one built beside this.
    #[arg(long)]
    policyc: Option<PathBuf>,
    /// Cases at a time.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
}

/// Who makes the cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum World {
    Ngspice,
    Independent,
}

impl Arguments {
    fn seed(&self) -> u64 {
        self.seed.unwrap_or_default()
    }
}

fn main() -> ExitCode {
    let mut arguments = Arguments::parse();
    let outcome = settle_seed(&mut arguments).and_then(|()| match (arguments.world, arguments.score) {
        (World::Independent, _) => independent(&arguments),
        (World::Ngspice, true) => generate(&arguments).and_then(|()| score(&arguments)),
        (World::Ngspice, false) => generate(&arguments),
    });
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
    }
}

/// The seed that was given, that of the folder, or one drawn from the clock; the folder keeps it.
fn settle_seed(arguments: &mut Arguments) -> Result<(), String> {
    let path = arguments.out.join("seed.txt");
    let kept = std::fs::read_to_string(&path)
        .ok()
        .and_then(|text| text.trim().parse().ok());
    let drawn = || {
        let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
        now.map_or(1, |now| (now.as_nanos() % 1_000_000_007) as u64)
    };
    let seed = arguments.seed.or(kept).unwrap_or_else(drawn);
    arguments.seed = Some(seed);
    create(&arguments.out)?;
    std::fs::write(&path, format!("{seed}\n")).map_err(|error| format!("{}: {error}", path.display()))
}

fn policyc(arguments: &Arguments) -> PathBuf {
    let beside = || Some(std::env::current_exe().ok()?.with_file_name("policyc"));
    let given = arguments.policyc.clone();
    given.or_else(beside).unwrap_or_else(|| "policyc".into())
}

fn independent(arguments: &Arguments) -> Result<(), String> {
    let family = |word: &String| {
        let known = Family::ALL.into_iter().find(|family| family.word() == word);
        let words = Family::ALL.map(Family::word).join(", ");
        known.ok_or_else(|| format!("--only {word}: no such family; there are {words}"))
    };
    let set = Set {
        seed: arguments.seed(),
        cases: arguments.cases,
        out: arguments.out.clone(),
        only: arguments.only.as_ref().map(family).transpose()?,
        short: arguments.short,
        rivals: !arguments.no_rivals,
        buck_only: arguments.buck_only,
        jobs: arguments.jobs,
    };
    println!("seed {}, {} cases in {}", set.seed, set.cases, set.out.display());
    let text = set.run(arguments.score.then(|| policyc(arguments)).as_deref())?;
    if arguments.score {
        println!("\n{text}");
    }
    Ok(())
}

fn planned(arguments: &Arguments, index: usize) -> Result<Plan, String> {
    let extent = if arguments.short { Extent::Short } else { Extent::Full };
    match &arguments.only {
        None => Ok(plan(arguments.seed(), index, extent)),
        Some(text) => {
            let ids: Vec<&str> = text.split(',').filter(|id| *id != "none").collect();
            plan_of(arguments.seed(), index, &ids, extent).ok_or_else(|| format!("--only {text}: no such effect"))
        }
    }
}

fn generate(arguments: &Arguments) -> Result<(), String> {
    let cases = arguments.out.join("cases");
    create(&cases)?;
    println!(
        "seed {}, {} cases in {}",
        arguments.seed(),
        arguments.cases,
        cases.display()
    );
    let (next, done, failed) = (AtomicUsize::new(0), AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            if index >= arguments.cases {
                return;
            }
            let started = Instant::now();
            let outcome = case(arguments, &cases, index);
            let count = done.fetch_add(1, Ordering::Relaxed) + 1;
            let seconds = started.elapsed().as_secs_f64();
            match outcome {
                Ok(line) => println!("[{count}/{}] case_{index:03} {line} ({seconds:.1} s)", arguments.cases),
                Err(message) => {
                    eprintln!("[{count}/{}] case_{index:03} failed: {message}", arguments.cases);
                    if let Ok(mut failed) = failed.lock() {
                        failed.push(index);
                    }
                }
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..arguments.jobs.max(1) {
            scope.spawn(work);
        }
    });
    let failed = failed.into_inner().unwrap_or_default();
    match failed.is_empty() {
        true => Ok(()),
        false => Err(format!("{} cases failed: {failed:?}", failed.len())),
    }
}

/// Measures a case unless it is there; what is hidden is not printed.
fn case(arguments: &Arguments, cases: &Path, index: usize) -> Result<String, String> {
    let folder = cases.join(format!("case_{index:03}"));
    let plan = planned(arguments, index)?;
    if let Ok(text) = std::fs::read_to_string(folder.join("truth.json")) {
        let truth: Truth = serde_json::from_str(&text).map_err(|error| format!("{}: {error}", folder.display()))?;
        let hidden: Vec<&str> = truth.effects.iter().map(|hidden| hidden.id.as_str()).collect();
        let wanted: Vec<&str> = plan.effects.iter().map(|effect| effect.id).collect();
        return match truth.seed == arguments.seed() && hidden == wanted {
            true => Ok("is there".to_owned()),
            false => Err(format!("{} is a case of another set", folder.display())),
        };
    }
    let measured = measure(&plan, !arguments.no_rivals)?;
    // an interrupted run leaves no half case behind
    let draft = cases.join(format!(".case_{index:03}"));
    let _ = std::fs::remove_dir_all(&draft);
    for (path, text) in &measured.files {
        let path = draft.join(path);
        create(path.parent().unwrap_or(&draft))?;
        std::fs::write(&path, text).map_err(|error| format!("{}: {error}", path.display()))?;
    }
    std::fs::rename(&draft, &folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    Ok("measured".to_owned())
}

/// Diagnoses every case, one after the other, and writes the score.
fn score(arguments: &Arguments) -> Result<(), String> {
    let policyc = policyc(arguments);
    let (mut judged, mut loops) = (Vec::new(), Vec::new());
    for index in 0..arguments.cases {
        let name = format!("case_{index:03}");
        let started = Instant::now();
        let case = arguments.out.join("cases").join(&name);
        let answers = arguments.out.join("diagnoses").join(&name);
        // a score without the closed loop leaves no mapping
        let files = ["diagnosis.json", "drm.toml"];
        let wanted = if arguments.closed_loop.is_some() { 2 } else { 1 };
        if files[..wanted].iter().any(|file| !answers.join(file).exists()) {
            diagnose(&policyc, &case, &answers, arguments.closed_loop.as_deref())?;
        }
        let truth: Truth = json(&case.join("truth.json"))?;
        let diagnosis: Diagnosis = json(&answers.join("diagnosis.json"))?;
        println!(
            "[{}/{}] {name} diagnosed ({:.1} s)",
            index + 1,
            arguments.cases,
            started.elapsed().as_secs_f64()
        );
        if let Some(policy) = &arguments.closed_loop {
            loops.push((name.clone(), closed(arguments, index, policy, &answers)?));
        }
        judged.push((name, judge(&truth, &diagnosis)));
    }
    let mut text = table(arguments.seed(), &judged);
    if !loops.is_empty() {
        text.push_str(&closed_table(&loops));
    }
    let path = arguments.out.join("score.md");
    std::fs::write(&path, &text).map_err(|error| format!("{}: {error}", path.display()))?;
    println!("\n{text}");
    Ok(())
}

/// The policy at the hidden bench of a case, with its own mapping and with that of the diagnosis.
fn closed(arguments: &Arguments, index: usize, policy: &Path, answers: &Path) -> Result<Closed, String> {
    let plan = planned(arguments, index)?;
    let contract = if policy.is_dir() {
        policy.join("policy.toml")
    } else {
        policy.to_owned()
    };
    let before = policy::load(&contract).map_err(|faults| faults.to_string())?;
    let mapping = policy::load_mapping(&answers.join("drm.toml")).map_err(|faults| faults.to_string())?;
    let mut after = before.clone();
    after.mapping = before.mapping.as_ref().map(|own| policy::Mapping {
        load_current: own.load_current,
        ..mapping
    });
    let close = |policy| blind::control::close(&plan.bench, policy).map_err(|error| error.to_string());
    Ok(Closed {
        kind: plan.kind,
        hidden: plan.effects.iter().map(|effect| effect.id.to_owned()).collect(),
        duty: blind::control::repairable(&plan.bench),
        before: close(&before)?,
        after: close(&after)?,
    })
}

fn diagnose(policyc: &Path, case: &Path, answers: &Path, policy: Option<&Path>) -> Result<(), String> {
    create(answers)?;
    let mut command = Command::new(policyc);
    command.arg("diagnose").arg("--model").arg(case.join("plant.toml"));
    for (option, folder) in [("--train", "train"), ("--heldout", "heldout")] {
        command.arg(option).args(records(&case.join(folder))?);
    }
    if let Some(policy) = policy {
        command.arg("--policy").arg(policy);
    }
    command.arg("--out").arg(answers);
    let output = command
        .output()
        .map_err(|error| format!("{}: {error}", policyc.display()))?;
    match answers.join("diagnosis.json").exists() {
        true => Ok(()),
        false => Err(format!(
            "{} of {} wrote no diagnosis.json:\n{}",
            policyc.display(),
            case.display(),
            String::from_utf8_lossy(&output.stderr)
        )),
    }
}

fn records(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let entries = std::fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.sort();
    Ok(files)
}

fn json<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
    serde_json::from_str(&text).map_err(|error| format!("{}: {error}", path.display()))
}

fn create(folder: &Path) -> Result<(), String> {
    std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", folder.display()))
}
