//! `policyc compile`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use codegen::output::languages;
use codegen::{Output, manifest};
use policy::{NumericFormat, Policy};
use serde::Serialize;
use targets::TargetSpec;
use verify::budget::{Clock, Slot};
use verify::code::{self, Code};
use verify::costs::{Entry, StepCosts};
use verify::fmu::Archive;
use verify::{Files, advice};

use super::compile_page;
use super::progress_line::Working;
use crate::arguments::Compile;
use crate::failure::Failure;
use crate::made;
use crate::outcome::Outcome;
use crate::output;
use crate::ownership::{self, Replacing};
use crate::talk;
use report::bytes;

/// What is asked of a compilation, beside the policy.
#[derive(Debug, Clone)]
pub struct Request {
    /// Deployment target by name.
    pub target: String,
    /// What to make; `c` and `rust` come along where another output calls them.
    pub emit: Vec<Output>,
    /// Control steps in the kit.
    pub kit_steps: u32,
    /// Whether the code is built and run under the target's emulator to report its costs.
    pub costs: bool,
    /// Clock of the processor, against which the costs are held.
    pub clock: Option<Clock>,
    /// Share of the golden decisions that the numeric format may change, 0..1; `None`: as the contract says.
    pub golden_decisions: Option<f64>,
}

/// What a compilation makes.
pub struct Made {
    target: &'static TargetSpec,
    outputs: Vec<Output>,
    files: Files,
    archives: Vec<Archive>,
    costs: StepCosts,
    /// What the format does to the trainer's decisions, in words; empty where it changes none.
    decisions: Vec<String>,
}

impl Made {
    /// Every file that the command writes, by name, the record of those without a mark included.
    ///
    /// # Errors
    /// If the record cannot be written as JSON.
    pub fn into_files(self) -> Result<BTreeMap<String, Vec<u8>>, Failure> {
        ownership::recorded(together(&self.files, &self.archives))
    }
}

/// Generates, then writes everything at once.
pub fn run(options: &Compile) -> Result<Outcome, Failure> {
    // a name that is no target's is said before a policy is read
    codegen::target(&options.target)?;
    let policy = super::load_several_as(&options.policy, options.outside, options.format)?;
    let clock = clock(options, &policy)?;
    let working = Working::new(match options.no_costs {
        true => "generating",
        false => "generating, and building to measure a step",
    });
    let made = make(
        &policy,
        &Request {
            target: options.target.clone(),
            emit: options.emit.clone(),
            kit_steps: options.kit_steps,
            costs: !options.no_costs,
            clock,
            golden_decisions: options.golden_decisions,
        },
    )?;
    drop(working);
    ownership::check_policy(&options.out, &policy.name, options.replacing)?;
    if targets::find(&options.target).is_none() {
        talk::note(&format!("{} has the core `{}`", options.target, made.target.name));
    }
    let written = write(&options.out, &made.files, &made.archives, options.replacing)?;
    let costs = made.costs.texts(&policy, made.target, clock);
    let budget = match clock {
        Some(clock) => advice::lines(&policy, made.target, &made.outputs, &made.costs, clock)?,
        None => Vec::new(),
    };
    if let Some(path) = &options.report {
        output::replace_own_one(
            path,
            &page(options, clock, &policy, &made, &costs, &budget)?,
            options.replacing,
        )?;
    }
    if options.json {
        say_json(options, clock, &policy, &made, &costs, budget)?;
        return Ok(Outcome::Done);
    }
    say(&policy, made.target, &written, &made.archives, &made.decisions)?;
    for text in &costs {
        output::say(text)?;
    }
    if !budget.is_empty() {
        output::say(&budget.join("\n"))?;
    }
    Ok(Outcome::Done)
}

/// The clock, with the time that a policy has which is trained on `--plant`.
fn clock(options: &Compile, policy: &Policy) -> Result<Option<Clock>, Failure> {
    let plant = options.plant.as_ref().map(plant::Parameters::from_file).transpose()?;
    let slot = plant.map_or(Slot::Unknown, |plant| {
        let phase = plant.pwm.sampling_phase;
        match plant.pwm.duty_delay {
            0 if phase > 0.0 => Slot::Behind(((1.0 - phase) * plant.t_sw() / policy.sample_period).min(1.0)),
            0 => Slot::AtOnce,
            _ => Slot::Later,
        }
    });
    Ok(options.clock.map(|clock| clock.with(slot)))
}

/// The page that `--report` asks for.
fn page(
    options: &Compile,
    clock: Option<Clock>,
    policy: &Policy,
    made: &Made,
    costs: &[String],
    budget: &[String],
) -> Result<String, Failure> {
    let sizes = manifest::sizes(policy, made.target);
    let files = together(&made.files, &made.archives);
    let mut notes = code::notes(policy, made.target, &sizes, files.keys().map(Path::new));
    notes.extend(code::decision_notes(&made.decisions));
    let path = super::contract_path(&options.policy);
    let text = std::fs::read_to_string(&path)?;
    let page = compile_page::page(&compile_page::Shown {
        policy,
        target: made.target,
        sizes: &sizes,
        contract: (&path.display().to_string(), &text),
        files: &made.files,
        written: files
            .iter()
            .map(|(name, content)| (name.clone(), content.len()))
            .collect(),
        costs: &made.costs,
        cost_texts: costs,
        clock,
        budget,
        notes: &notes,
    })?;
    let read = [("policy", options.policy.display().to_string())];
    made::signed_page(&page, &[("--out", "generated"), ("--report", "report.html")], &read)
}

/// What `--json` prints. Keys that the manifest has, too, mean the same in both.
#[derive(Serialize)]
struct Answer<'a> {
    name: &'a str,
    target: &'static str,
    numeric_format: NumericFormat,
    /// s
    sample_period: f64,
    sizes: manifest::Sizes,
    costs: Vec<Entry<'a>>,
    /// With a clock: whether a step fits into its period, in words.
    budget: Vec<String>,
    out: &'a Path,
    files: Vec<Written>,
    archives: Vec<Packed<'a>>,
    notes: &'a [String],
}

#[derive(Serialize)]
struct Written {
    /// Below `out`.
    path: String,
    bytes: usize,
}

#[derive(Serialize)]
struct Packed<'a> {
    path: &'a str,
    /// What the binary in it is for, and the compiler that made it.
    platform: Option<&'a str>,
    compiler: Option<&'a str>,
    /// Why there is no binary.
    missing: Option<&'a str>,
}

impl<'a> Packed<'a> {
    fn of(archive: &'a Archive) -> Self {
        let binary = archive.binary.as_ref();
        Self {
            path: &archive.file,
            platform: binary.ok().map(|(platform, _)| *platform),
            compiler: binary.ok().map(|(_, compiler)| *compiler),
            missing: binary.err().map(String::as_str),
        }
    }
}

fn say_json(
    options: &Compile,
    clock: Option<Clock>,
    policy: &Policy,
    made: &Made,
    costs: &[String],
    budget: Vec<String>,
) -> Result<(), Failure> {
    let sizes = manifest::sizes(policy, made.target);
    let files = together(&made.files, &made.archives);
    let mut notes = code::notes(policy, made.target, &sizes, files.keys().map(Path::new));
    notes.extend(code::decision_notes(&made.decisions));
    notes.extend(costs.iter().flat_map(|text| talk::notes_of(text)));
    notes.iter().for_each(|note| talk::note(note));
    let written = |(path, content): (&String, &Vec<u8>)| Written {
        path: path.clone(),
        bytes: content.len(),
    };
    output::say_json(&Answer {
        name: &policy.name,
        target: made.target.name,
        numeric_format: policy.numeric_format,
        sample_period: policy.sample_period,
        sizes,
        costs: made.costs.entries(policy, clock),
        budget,
        out: &options.out,
        files: files.iter().map(written).collect(),
        archives: made.archives.iter().map(Packed::of).collect(),
        notes: &notes,
    })
}

/// The files of a policy; nothing is written.
///
/// # Errors
/// If the network does not give the trainer's answers, or there is no such target, or an output cannot be made.
pub fn make(policy: &Policy, request: &Request) -> Result<Made, Failure> {
    let target = codegen::target(&request.target)?;
    super::no_choices(policy, request.golden_decisions)?;
    let Code {
        outputs,
        mut files,
        decisions,
    } = code::make(
        policy,
        target,
        &request.emit,
        request.kit_steps,
        request.golden_decisions,
    )?;
    let costs = measure(request, policy, target, &outputs, &mut files)?;
    let archives = verify::fmu::archives(policy, target, &outputs, &files)?;
    Ok(Made {
        target,
        outputs,
        files,
        archives,
        costs,
        decisions,
    })
}

/// What a step costs under the target's emulator; it goes into the manifest, too.
fn measure(
    request: &Request,
    policy: &Policy,
    target: &TargetSpec,
    outputs: &[Output],
    files: &mut Files,
) -> Result<StepCosts, Failure> {
    if !request.costs {
        return Ok(StepCosts::default());
    }
    let costs = StepCosts::of(policy, target, &languages(outputs), files);
    if let (false, Some(manifest)) = (costs.builds.is_empty(), files.get_mut(manifest::FILE)) {
        *manifest = manifest::with_costs(manifest, &costs.entries(policy, request.clock))?;
    }
    Ok(costs)
}

/// Writes files and archives, all or none; each with its length.
pub fn write(
    folder: &Path,
    files: &Files,
    archives: &[Archive],
    replacing: Replacing,
) -> Result<Vec<(PathBuf, usize)>, Failure> {
    let all = together(files, archives);
    let length = |(name, content): (&String, &Vec<u8>)| (folder.join(name), content.len());
    let written = all.iter().map(length).collect();
    output::replace_own(folder, all, replacing)?;
    Ok(written)
}

fn together(files: &Files, archives: &[Archive]) -> BTreeMap<String, Vec<u8>> {
    let texts = files.iter().map(|(name, text)| (name, text.as_bytes()));
    let packed = archives.iter().map(|archive| (&archive.file, archive.bytes.as_slice()));
    let all = texts.chain(packed);
    all.map(|(name, bytes)| (name.clone(), bytes.to_vec())).collect()
}

/// Says what was made of the policy and what was written.
pub fn say(
    policy: &Policy,
    target: &TargetSpec,
    written: &[(PathBuf, usize)],
    archives: &[Archive],
    decisions: &[String],
) -> Result<(), Failure> {
    let sizes = manifest::sizes(policy, target);
    for note in code::notes(policy, target, &sizes, written.iter().map(|(path, _)| path.as_path())) {
        output::say(&format!("note: {note}"))?;
    }
    output::say(&format!("{}: {sizes}", policy.name))?;
    for line in decisions {
        output::say(line)?;
    }
    for (path, length) in written {
        output::say(&format!("  {} ({})", path.display(), bytes(*length)))?;
    }
    for Archive { file, binary, .. } in archives {
        output::say(&match binary {
            Ok((platform, compiler)) => format!("{file}: sources and a binary for {platform}, built with {compiler}"),
            Err(reason) => format!("note: {file}: sources only, no binary: {reason}"),
        })?;
    }
    Ok(())
}
