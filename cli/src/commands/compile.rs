//! `policyc compile`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use codegen::output::{languages, with_cores};
use codegen::{Output, manifest, notes};
use policy::Policy;
use targets::TargetSpec;
use toml_input::Message;
use verify::costs::StepCosts;
use verify::fmu::Archive;
use verify::{Decisions, Files, UNPROVEN, advice, text};

use crate::arguments::Compile;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::output;
use crate::ownership::{self, Replacing};
use report::bytes;

/// Generates, then writes everything at once.
pub fn run(options: &Compile) -> Result<Outcome, Failure> {
    let target = codegen::target(&options.target)?;
    let policy = load(options)?;
    let outputs = with_cores(&options.emit);
    let expected = verify::kit::expected(&policy, target, &outputs, options.kit_steps)?;
    let mut files = codegen::generate(&policy, target, &outputs, expected.as_ref())?.files;
    let costs = measure(options, &policy, target, &outputs, &mut files)?;
    let archives = verify::fmu::archives(&policy, target, &outputs, &files)?;
    ownership::check_policy(&options.out, &policy.name, options.replacing)?;
    let written = write(&options.out, &files, &archives, options.replacing)?;
    say(&policy, target, &written, &archives)?;
    for text in costs.texts(&policy, target, options.clock) {
        output::say(&text)?;
    }
    if let Some(clock) = options.clock {
        output::say(&advice::lines(&policy, target, &outputs, &costs, clock)?.join("\n"))?;
    }
    Ok(Outcome::Done)
}

/// The policy in the format asked for; refused if its network does not give the trainer's answers.
fn load(options: &Compile) -> Result<Policy, Failure> {
    let policy = super::load_as(&options.policy, options.outside, options.format)?;
    super::no_choices(&policy, options.golden_decisions)?;
    if let Some(golden) = verify::golden_result(&policy).filter(|golden| !golden.passed()) {
        let message = Message::new("the network does not give the trainer's golden answers; nothing was written");
        return Err(message.found(golden.to_string()).hint(golden.hint()).into());
    }
    match verify::decisions(&policy, options.golden_decisions).filter(|decisions| !decisions.kept()) {
        None => Ok(policy),
        Some(decisions) => {
            let remedy = decisions.remedy();
            let (problem, hint) = match &decisions {
                Decisions::Choice(choices) => (
                    "the numeric format changes more of the trainer's decisions than allowed; nothing was written",
                    format!(
                        "see what they cost with `policyc certify` and `policyc simulate`; to accept them, {remedy} in \
                         [network] of the contract, which `verify` reads too, or --golden-decisions {} for this run",
                        choices.accepting_share()
                    ),
                ),
                Decisions::Continuous(_) => (
                    "the numeric format changes the trainer's duties more than allowed; nothing was written",
                    format!(
                        "see what it costs with `policyc simulate`; to accept it, {remedy} in [network] of the contract"
                    ),
                ),
            };
            let found = text::decisions(&policy, &decisions).join("\n");
            Err(Message::new(problem).found(found).hint(hint).into())
        }
    }
}

/// What a step costs under the target's emulator; it goes into the manifest, too.
fn measure(
    options: &Compile,
    policy: &Policy,
    target: &TargetSpec,
    outputs: &[Output],
    files: &mut Files,
) -> Result<StepCosts, Failure> {
    if options.no_costs {
        return Ok(StepCosts::default());
    }
    let costs = StepCosts::of(policy, target, &languages(outputs), files);
    if let (false, Some(manifest)) = (costs.builds.is_empty(), files.get_mut(manifest::FILE)) {
        *manifest = manifest::with_costs(manifest, &costs.entries(policy, options.clock))?;
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
    let texts = files.iter().map(|(name, text)| (name, text.as_bytes()));
    let packed = archives.iter().map(|archive| (&archive.file, archive.bytes.as_slice()));
    let all: BTreeMap<String, Vec<u8>> = texts
        .chain(packed)
        .map(|(name, bytes)| (name.clone(), bytes.to_vec()))
        .collect();
    let length = |(name, content): (&String, &Vec<u8>)| (folder.join(name), content.len());
    let written = all.iter().map(length).collect();
    output::replace_own(folder, all, replacing)?;
    Ok(written)
}

/// Says what was made of the policy and what was written.
pub fn say(
    policy: &Policy,
    target: &TargetSpec,
    written: &[(PathBuf, usize)],
    archives: &[Archive],
) -> Result<(), Failure> {
    for note in &policy.notes {
        output::say(&format!("note: {note}"))?;
    }
    if policy.golden.is_none() {
        output::say(&format!("note: {UNPROVEN}"))?;
    }
    let sizes = manifest::sizes(policy, target);
    for note in notes(policy, target, &sizes, written.iter().map(|(path, _)| path.as_path())) {
        output::say(&format!("note: {note}"))?;
    }
    output::say(&format!("{}: {sizes}", policy.name))?;
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
