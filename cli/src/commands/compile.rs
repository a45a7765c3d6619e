//! `policyc compile`

use std::collections::BTreeMap;
use std::path::Path;

use codegen::{Language, manifest};
use policy::Policy;
use targets::TargetSpec;
use verify::fmu::Archive;
use verify::{Files, Selection};

use super::budget;
use super::costs::Measured;
use super::verify::golden_text;
use super::{bytes, grouped};
use crate::arguments::Compile;
use crate::{Failure, Outcome, output};

/// Generates, then writes everything at once.
pub fn run(options: &Compile) -> Result<Outcome, Failure> {
    let target = super::target(&options.target)?;
    let policy = super::load_as(&options.policy, options.format.map(Into::into))?;
    if let Some(golden) = verify::golden_result(&policy)?.filter(|golden| !golden.passed()) {
        return Err(Failure(format!(
            "the network does not give the trainer's golden answers; nothing was written\n   = found: {}\n   \
             = hint: look at hidden_activation, the order of layers and features, transpose; `policyc verify` compares them too",
            golden_text(&golden)
        )));
    }
    let mut languages: Vec<Language> = options.lang.iter().map(|lang| (*lang).into()).collect();
    let mut doors = options.door.clone();
    if !doors.is_empty() {
        languages.push(Language::C);
    }
    languages.sort();
    languages.dedup();
    doors.sort();
    doors.dedup();
    let selection = Selection {
        languages,
        doors,
        kit_steps: options.kit_steps,
    };
    let mut files = verify::doors::generate(&policy, target, &selection)?;
    let measured = if options.no_costs {
        Measured::default()
    } else {
        Measured::of(&policy, target, &selection.languages, &files)
    };
    if let (false, Some(manifest)) = (measured.costs.is_empty(), files.get_mut(manifest::FILE)) {
        *manifest = manifest::with_costs(manifest, &measured.entries(&policy, options.clock))?;
    }
    let archives = verify::fmu::archives(&policy, target, &selection.doors, &files)?;
    write(&policy, target, &options.out, &files, &archives)?;
    measured.say(&policy, target, options.clock)?;
    if let Some(clock) = options.clock {
        output::say(&budget::lines(&policy, target, &selection, &measured, clock)?.join("\n"))?;
    }
    Ok(Outcome::Done)
}

/// Writes the files and says what they are.
pub fn write(
    policy: &Policy,
    target: &TargetSpec,
    folder: &Path,
    files: &Files,
    archives: &[Archive],
) -> Result<(), Failure> {
    let texts = files.iter().map(|(name, text)| (name, text.as_bytes()));
    let packed = archives.iter().map(|archive| (&archive.file, archive.bytes.as_slice()));
    let all: BTreeMap<String, Vec<u8>> = texts
        .chain(packed)
        .map(|(name, bytes)| (name.clone(), bytes.to_vec()))
        .collect();
    output::write_all(folder, &all)?;
    for note in &policy.notes {
        output::say(&format!("note: {note}"))?;
    }
    let sizes = manifest::sizes(policy, target);
    if let Some(bound) = sizes.accumulator_bound {
        output::say(&format!(
            "note: integer network: no 32-bit sum can overflow, the largest is {} of {} over the whole box of observations",
            grouped(bound.unsigned_abs()),
            grouped(u64::from(i32::MAX.unsigned_abs()))
        ))?;
    }
    let removed: usize = sizes.removed_neurons.iter().sum();
    if removed > 0 {
        let whole: usize = policy.layers.iter().map(|layer| layer.inputs * layer.outputs).sum();
        output::say(&format!(
            "note: {removed} neurons are 0 for every observation and left out: {} of {} MACs, the same bits",
            grouped(sizes.macs as u64),
            grouped(whole as u64)
        ))?;
    }
    if let Some(bound) = sizes.q_error_bound {
        output::say(&format!(
            "note: no Q value is further than {} from real arithmetic, for every observation; `policyc certify` says more",
            report::quantity(bound, "", 3)
        ))?;
    }
    let (macs, tables, state) = (
        grouped(sizes.macs as u64),
        bytes(sizes.table_bytes),
        bytes(sizes.state_bytes),
    );
    output::say(&format!(
        "{}: {macs} MACs per step, {tables} of tables, {state} of state",
        policy.name
    ))?;
    for (name, content) in &all {
        output::say(&format!("  {} ({})", folder.join(name).display(), bytes(content.len())))?;
    }
    for Archive { file, binary, .. } in archives {
        output::say(&match binary {
            Ok((platform, compiler)) => format!("{file}: sources and a binary for {platform}, built with {compiler}"),
            Err(reason) => format!("note: {file}: sources only, no binary: {reason}"),
        })?;
    }
    Ok(())
}
