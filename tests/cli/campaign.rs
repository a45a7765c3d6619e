//! `policyc campaign` and `policyc merge`: what is done is kept, and results do not depend on who made them, or when.

mod kept;
mod queues;
mod shared;

use std::process::Stdio;
use std::time::{Duration, Instant};

use super::{Desk, contents};

const PLAN: &str = r#"
name = "Two kinds"

[[train]]
settings = "train/train.toml"

[[simulate]]
scenarios = "scenario.toml"
policies = "policy"
plants = ["plants/paper-model.toml", "plants/paper-table.toml"]
"#;

const SCENARIO: &str = r#"
load_steps = [[200, 500]]
instants = 1
sampling_instants = 1
lead = 20
after = 40
tail = 10
limit = false
baselines = ["feed-forward"]
"#;

fn desk() -> Desk {
    let desk = super::training::desk();
    std::fs::remove_dir_all(desk.path("policy")).unwrap();
    tests::tools::copy_folder(&tests::root().join("examples/buck12"), &desk.path("policy"));
    desk.write("scenario.toml", SCENARIO);
    desk.write("plan.toml", PLAN);
    desk
}

/// Everything of a folder of results.
fn results(desk: &Desk, out: &str) -> Vec<(String, Vec<u8>)> {
    contents(&desk.path(out))
}

#[test]
fn a_campaign_has_what_its_commands_write_and_a_second_run_does_nothing() {
    let desk = desk();
    let first = desk.succeed("campaign plan.toml --out out");
    assert!(first.contains("4 of 4 tasks are done. 4 ran now."), "{first}");
    let page = desk.read("out/report.html");
    assert!(page.contains("How this page was made") && page.contains("policyc campaign PLAN.toml"));
    let before = results(&desk, "out");
    // the policy that `train` chooses among the same seeds, and the figures of `simulate`
    desk.succeed("train train/train.toml --out alone");
    let own = std::fs::read(desk.path("alone/weights.safetensors")).unwrap();
    assert_eq!(
        std::fs::read(desk.path("out/best/train-train/weights.safetensors")).unwrap(),
        own
    );
    desk.succeed("simulate scenario.toml --policy policy --plant plants/paper-model.toml --out loop");
    let metrics = std::fs::read(desk.path("loop/metrics.json")).unwrap();
    assert!(
        before
            .iter()
            .any(|(name, bytes)| name.ends_with("/metrics.json") && *bytes == metrics)
    );
    let begun = Instant::now();
    let second = desk.succeed("campaign plan.toml --out out");
    assert!(
        second.contains("0 ran now") && begun.elapsed() < Duration::from_secs(5),
        "{second}"
    );
    assert_eq!(results(&desk, "out"), before);
    assert!(!desk.path("out/work").exists() && !desk.path("out/failed").exists());
}

#[test]
fn only_what_reads_an_edited_file_runs_again() {
    let desk = desk();
    desk.edit(
        "plan.toml",
        "settings = \"train/train.toml\"",
        "settings = \"train/train.toml\"\nseeds = [3]",
    );
    desk.succeed("campaign plan.toml --out out");
    desk.edit(
        "plants/paper-table.toml",
        "[converter]",
        "[converter] # a comment is an edit",
    );
    let again = desk.succeed("campaign plan.toml --out out");
    assert!(again.contains("1 ran now"), "{again}");
    // a result that was edited, and one that lost a file; in a folder without results of what was read before
    desk.succeed("campaign plan.toml --out other");
    let file = |end: &str| {
        results(&desk, "other")
            .into_iter()
            .find(|(name, _)| name.ends_with(end))
            .unwrap()
            .0
    };
    let answer = file("answer.json");
    desk.write(&format!("other/{answer}"), "{}");
    std::fs::remove_file(desk.path(&format!("other/{}", file("metrics.json")))).unwrap();
    let again = desk.succeed("campaign plan.toml --out other --json --force");
    assert_eq!(serde_json::from_str::<serde_json::Value>(&again).unwrap()["ran"], 2);
    assert_ne!(desk.read(&format!("other/{answer}")), "{}");
}

#[test]
fn parts_of_several_machines_merge_to_the_bytes_of_one_run_in_any_order() {
    let desk = desk();
    desk.succeed("campaign plan.toml --out one --jobs 1");
    let one = results(&desk, "one");
    for (task, out) in [("4", "a"), ("1", "a"), ("3", "b"), ("2", "c"), ("1", "c")] {
        desk.succeed(&format!("campaign plan.toml --out {out} --task {task}"));
    }
    desk.succeed("merge a b c --out abc");
    assert!(results(&desk, "abc") == one);
    desk.succeed("merge c b a --out cba");
    assert!(results(&desk, "cba") == one);
    // into one of them; and what is missing is said
    let ran = desk.type_in("merge b --out b");
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert!(
        ran.stdout.contains("1 of 4 tasks are done, 3 have not been run."),
        "{}",
        ran.stdout
    );
    desk.succeed("merge a b c --out a --json");
    desk.refuse(
        "merge a policy --out d",
        &["policy is no folder of a campaign", "--out of policyc campaign"],
    );
    assert!(!desk.path("d").exists());
}

/// Of two machines that do not compute the same.
#[test]
fn two_results_of_one_task_are_refused_by_file() {
    let desk = desk();
    for out in ["a", "b"] {
        desk.succeed(&format!("campaign plan.toml --out {out} --task 3"));
    }
    let file = |end: &str| {
        results(&desk, "b")
            .into_iter()
            .find(|(name, _)| name.ends_with(end))
            .unwrap()
            .0
    };
    let (record, metrics) = (file("task.json"), file("metrics.csv"));
    let old = policy::sha256(&std::fs::read(desk.path(&format!("b/{metrics}"))).unwrap());
    desk.write(&format!("b/{metrics}"), "other");
    desk.refuse("merge a b --out c", &["metrics.csv was edited since it was made"]);
    desk.edit(&format!("b/{record}"), &old, &policy::sha256(b"other"));
    desk.refuse("merge a b --out d", &["different results", "metrics.csv in a and in b"]);
}

#[cfg(unix)]
#[test]
fn an_interrupted_campaign_goes_on_to_the_same_bytes() {
    let desk = desk();
    desk.edit("train/train.toml", "steps = 1200", "steps = 60000");
    desk.edit("train/train.toml", "every = 200", "every = 20000");
    desk.edit(
        "plan.toml",
        "settings = \"train/train.toml\"",
        "settings = \"train/train.toml\"\nseeds = [5, 6]",
    );
    let mut command = desk.command();
    command.args(["campaign", "plan.toml", "--out", "out", "--jobs", "1"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let begun = Instant::now();
    let checkpoint = || {
        let tasks = std::fs::read_dir(desk.path("out/work")).into_iter().flatten().flatten();
        let mut checkpoints = tasks.map(|task| task.path().join("out/checkpoints/seed-5.bin"));
        checkpoints.any(|path| path.exists())
    };
    while !checkpoint() {
        assert!(begun.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    let ended = super::interrupt(child);
    assert_eq!(ended.status.code(), Some(130));
    assert!(String::from_utf8_lossy(&ended.stderr).contains("4 tasks are left"));
    assert!(!desk.path("out/results.json").exists() && checkpoint());
    desk.succeed("campaign plan.toml --out out");
    desk.succeed("campaign plan.toml --out whole");
    assert!(results(&desk, "out") == results(&desk, "whole"));
}

#[test]
fn a_task_that_fails_costs_no_other_and_is_tried_again() {
    let desk = desk();
    // what only the run finds out: loads that would be resistors
    let plant = desk.read("plants/paper-model.toml");
    desk.write("plants/fold.toml", &format!("{plant}\n[load]\nv_fold = 90.0\n"));
    desk.edit("train/train.toml", "paper-model.toml", "fold.toml");
    desk.edit("plan.toml", "train/train.toml\"", "train/train.toml\"\nseeds = 3");
    let ran = desk.type_in("campaign plan.toml --out out");
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    assert!(
        ran.stdout.contains("2 of 3 tasks are done, 1 failed."),
        "{}",
        ran.stdout
    );
    assert!(
        ran.stdout.contains("failed train: settings train/train.toml, seed 3: "),
        "{}",
        ran.stdout
    );
    let reasons = desk.read("out/results.json");
    assert!(
        reasons.contains("in/plants/fold.toml"),
        "the reason has its place, without the machine's folders: {reasons}"
    );
    assert!(
        !desk
            .read("out/results.json")
            .contains(&desk.folder.path().display().to_string())
    );
    let ran = desk.type_in("campaign plan.toml --out out --json");
    let json: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    assert_eq!(
        (ran.code, json["ran"].clone(), json["counts"]["failed"].clone()),
        (Some(1), 1.into(), 1.into())
    );
    let ran = desk.type_in("campaign plan.toml --out out --task 1");
    assert_eq!(ran.code, Some(2));
    assert!(ran.stderr.contains("seed 3 has no result"), "{}", ran.stderr);
}

#[test]
fn slips_are_found_before_anything_runs() {
    let desk = desk();
    desk.edit(
        "plan.toml",
        "policies = \"policy\"",
        "policies = \"policy\"\nformats = [\"f32\", \"i61\"]",
    );
    let error = desk.refuse("campaign plan.toml --out out", &["i61", "plan.toml:7:1"]);
    assert!(!error.contains("Usage"), "{error}");
    desk.write("plan.toml", PLAN);
    desk.edit("train/train.toml", "steps = 1200", "step = 1200");
    desk.refuse(
        "campaign plan.toml --out out",
        &["train/train.toml", "did you mean `steps`?"],
    );
    desk.edit("train/train.toml", "step = 1200", "steps = 1200");
    // every file of a section, and every number
    desk.write("empty.csv", "t,duty,v_out\n");
    let plan = format!(
        "{PLAN}[[diagnose]]\nmodels = \"plants/paper-model.toml\"\ntrain = \"empty.csv\"\n\
         [[verify]]\npolicies = \"policy\"\ntraces = \"empty.csv\"\n[[certify]]\npolicies = \"policy\"\nboxes = [20, 2000000]\n"
    );
    desk.write("plan.toml", &plan);
    desk.edit("plants/paper-table.toml", "[converter]", "[convertor]");
    let words = ["did you mean `converter`?", "empty.csv", "1000000", "plan.toml"];
    let error = desk.refuse("campaign plan.toml --out out", &words);
    assert!(
        error.contains("4 errors") || error.matches("error: ").count() >= 4,
        "{error}"
    );
    desk.edit("plants/paper-table.toml", "[convertor]", "[converter]");
    desk.write("plan.toml", PLAN);
    std::fs::create_dir(desk.path("mine")).unwrap();
    desk.write("mine/notes", "mine");
    desk.refuse("campaign plan.toml --out mine", &["is not empty"]);
    desk.refuse("campaign plan.toml --out out --task 5", &["no such task", "1 to 4"]);
    desk.refuse(
        "campaign plan.toml --out out --engine ray",
        &["pip install 'policyc[ray]'"],
    );
    desk.refuse("campaign plan.toml --out out --address auto", &["--engine ray"]);
    assert!(!desk.path("out").exists());
}

/// As Slurm and Snakemake would: the array's number, and a name for each file.
#[test]
fn scripts_of_queues_call_every_task() {
    let desk = desk();
    desk.succeed("campaign plan.toml --out whole");
    let said = desk.succeed("campaign plan.toml --out out --write slurm=array.slurm");
    assert!(
        said.contains("4 tasks") && said.contains("sbatch array.slurm"),
        "{said}"
    );
    let script = desk.read("array.slurm");
    assert!(script.contains("#SBATCH --array=1-4\n"), "{script}");
    let path = tests::tools::policyc().parent().unwrap().to_owned();
    let path = format!("{}:{}", path.display(), std::env::var("PATH").unwrap());
    for number in 1..=4 {
        let mut job = std::process::Command::new("bash");
        job.arg("array.slurm")
            .current_dir(desk.folder.path())
            .env("PATH", &path);
        let ran = tests::tools::run(job.env("SLURM_ARRAY_TASK_ID", number.to_string()));
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    }
    let merge = script
        .lines()
        .find_map(|line| line.strip_prefix("#   policyc "))
        .unwrap();
    desk.succeed(merge);
    assert!(results(&desk, "out") == results(&desk, "whole"));
    desk.succeed("campaign plan.toml --out out --write snakemake=Snakefile");
    let rules = desk.read("Snakefile");
    let listed = desk.succeed("campaign plan.toml --out out --list");
    for line in listed.lines() {
        let id = line.split_whitespace().nth(1).unwrap();
        assert!(
            rules.contains(&format!("    \"{id}\",\n")) && line.contains("  done "),
            "{line}"
        );
    }
}
