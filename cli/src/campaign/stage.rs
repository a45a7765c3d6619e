//! The folder in which a task runs: its inputs, and what an interrupted run of it can be gone on with.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use campaign::{Kind, Task};

use super::folders;
use super::session::Claim;
use crate::failure::Failure;

/// What a command says that will not go on with what stands there: a checkpoint of `train`, the file of a shard of `verify --codes`.
const REFUSALS: [&str; 3] = ["checkpoint: ", "is no line of a shard", "of another run"];

/// A task that can be performed.
pub struct Staged {
    /// The command line behind `policyc`.
    pub arguments: Vec<String>,
    /// Whether it goes on with what an interrupted run left.
    pub goes_on: bool,
}

/// Puts the inputs of a task into its folder; the command line goes on with what was interrupted there.
pub fn stage(task: &Task, claim: &Claim) -> Result<Staged, Failure> {
    let folder = &claim.folder;
    let inputs = task.inputs.iter().map(|(path, content)| {
        // the folder of all inputs is the first part of their paths
        let path = path.strip_prefix("in/").unwrap_or(path).to_owned();
        (path, content.bytes.as_slice())
    });
    folders::write(&folder.join("in"), &inputs.collect::<BTreeMap<_, _>>())?;
    let out = folder.join("out");
    let mut arguments = task.arguments.clone();
    let goes_on = is_gone_on_with(task, folder);
    match (goes_on, task.kind) {
        (true, Kind::Train) => {
            // a training that was killed while it published its policy publishes it again
            leave_checkpoints(&out).map_err(|error| folders::cannot("clear", &out, &error))?;
            arguments.push("--resume".to_owned());
        }
        // the command finds its shard by itself
        (true, _) => {}
        (false, _) => folders::remove(&out).map_err(|error| folders::cannot("remove", &out, &error))?,
    }
    Ok(Staged { arguments, goes_on })
}

/// Whether an interrupted run left something in the folder of a task that the next can go on with.
pub fn is_gone_on_with(task: &Task, folder: &Path) -> bool {
    let out = folder.join("out");
    match task.kind {
        Kind::Train => holds(&out.join("checkpoints"), "seed-", ".bin"),
        Kind::Verify => holds(&out, "shard-", ".csv"),
        _ => false,
    }
}

fn holds(folder: &Path, start: &str, end: &str) -> bool {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.any(|name| name.starts_with(start) && name.ends_with(end))
}

fn leave_checkpoints(out: &Path) -> std::io::Result<()> {
    for entry in fs::read_dir(out)? {
        let entry = entry?;
        match entry.file_type()?.is_dir() {
            true if entry.file_name() == "checkpoints" => {}
            true => folders::remove(&entry.path())?,
            false => fs::remove_file(entry.path())?,
        }
    }
    Ok(())
}

/// Leaves of the folder of a task that failed what the next run can go on with.
pub fn keep_for_resuming(folder: &Path) {
    let _ = folders::remove(&folder.join("in"));
}

/// Whether a command failed because of what an earlier run had left.
pub fn is_refused(reason: &str) -> bool {
    REFUSALS.iter().any(|refusal| reason.contains(refusal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::session::Asked;
    use crate::campaign::{Session, tests::session};

    fn put(folder: &Path, name: &str) {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, "hours").unwrap();
    }

    fn claimed(session: &Session) -> Claim {
        match session.claim(&session.plan.tasks[0], false).unwrap() {
            Asked::Claimed(claim) => claim,
            _ => panic!("nobody else is there"),
        }
    }

    /// A training and its folder of work, with a checkpoint in it.
    fn training() -> (tempfile::TempDir, Session) {
        let (folder, session) = session("[[train]]\nsettings = \"a.toml\"\nseeds = 1\n");
        put(&claimed(&session).folder, "out/checkpoints/seed-1.bin");
        (folder, session)
    }

    #[test]
    fn a_training_that_was_killed_while_it_published_goes_on_from_its_checkpoint() {
        let (_folder, session) = training();
        let (task, claim) = (&session.plan.tasks[0], claimed(&session));
        put(&claim.folder, "out/policy.toml");
        put(&claim.folder, "out/seeds/1/policy.toml");
        let staged = stage(task, &claim).unwrap();
        assert_eq!(staged.arguments.last().unwrap(), "--resume");
        let names: Vec<String> = folders::read(&claim.folder.join("out")).unwrap().into_keys().collect();
        assert_eq!(names, ["checkpoints/seed-1.bin"]);
    }

    #[test]
    fn a_training_that_fails_keeps_its_checkpoints_for_the_next_run() {
        let (_folder, session) = training();
        let task = &session.plan.tasks[0];
        let claim = claimed(&session);
        stage(task, &claim).unwrap();
        session.fail(task, "error: no space left on device").unwrap();
        assert!(is_gone_on_with(task, &claim.folder) && !claim.folder.join("in").exists());
        session.finish().unwrap();
        assert!(stage(task, &claim).unwrap().goes_on);
        assert!(is_refused("error: checkpoint: it is damaged") && !is_refused("error: no space left on device"));
    }

    #[test]
    fn a_verification_of_all_codes_goes_on_with_its_shard_and_a_simulation_begins_anew() {
        let codes = "[[verify]]\npolicies = \"a.toml\"\ncodes = true\n";
        let simulate = "[[simulate]]\nscenarios = \"a.toml\"\npolicies = \"a.toml\"\n";
        for (text, goes_on) in [(codes, true), (simulate, false)] {
            let (_folder, session) = session(text);
            let claim = claimed(&session);
            put(&claim.folder, "out/shard-1-of-1.csv");
            let task = &session.plan.tasks[0];
            let staged = stage(task, &claim).unwrap();
            assert_eq!((staged.goes_on, &staged.arguments), (goes_on, &task.arguments));
            assert_eq!(claim.folder.join("out/shard-1-of-1.csv").exists(), goes_on);
        }
    }
}
