//! What a queue runs: its jobs, in a folder that they find as the queue leaves it.

use std::process::{Command, Stdio};

use super::{desk, results};
use crate::Desk;

/// A shell that finds `policyc`.
fn bash(desk: &Desk) -> Command {
    let folder = tests::tools::policyc().parent().unwrap().to_owned();
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("bash");
    command.current_dir(desk.folder.path()).env("PATH", path);
    command
}

#[test]
fn the_jobs_of_an_array_may_all_begin_at_once() {
    let desk = desk();
    desk.succeed("campaign plan.toml --out whole");
    desk.succeed("campaign plan.toml --out out --write slurm=array.slurm");
    assert!(desk.path("out/plan.json").is_file(), "the jobs find a campaign");
    let before = std::fs::metadata(desk.path("out/plan.json"))
        .unwrap()
        .modified()
        .unwrap();
    // and even if they do not
    for is_fresh in [false, true] {
        if is_fresh {
            std::fs::remove_dir_all(desk.path("out")).unwrap();
        }
        let start = |number: usize| {
            let mut job = bash(&desk);
            job.arg("array.slurm").env("SLURM_ARRAY_TASK_ID", number.to_string());
            job.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
        };
        let jobs: Vec<_> = (1..=4).map(start).collect();
        for job in jobs {
            let ended = job.wait_with_output().unwrap();
            assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stderr));
        }
        if !is_fresh {
            let after = std::fs::metadata(desk.path("out/plan.json"))
                .unwrap()
                .modified()
                .unwrap();
            assert_eq!(before, after, "the same bytes are not written again");
        }
        desk.succeed("merge out --out out");
        assert!(results(&desk, "out") == results(&desk, "whole"));
    }
}

/// Snakemake makes the folders of what a job is to write before the job, and removes what it wrote if it does not end with 0.
#[test]
fn the_rules_of_snakemake_run_where_it_has_made_the_folders() {
    let desk = desk();
    desk.succeed("campaign plan.toml --out whole");
    desk.succeed("campaign plan.toml --out out --write snakemake=Snakefile");
    std::fs::remove_dir_all(desk.path("out")).unwrap();
    let rules = desk.read("Snakefile");
    let shell = |rule: &str| {
        let rule = rules.split(&format!("rule {rule}:\n")).nth(1).unwrap();
        let line = rule
            .lines()
            .find_map(|line| line.trim().strip_prefix("shell: "))
            .unwrap();
        line.replace("\" + \"", "").trim_matches('"').to_owned()
    };
    let run = |line: &str| tests::tools::run(bash(&desk).args(["-euo", "pipefail", "-c", line]));
    let listed = desk.succeed("campaign plan.toml --out whole --list");
    let ids: Vec<&str> = listed
        .lines()
        .map(|line| line.split_whitespace().nth(1).unwrap())
        .collect();
    for (number, id) in ids.iter().enumerate() {
        std::fs::create_dir_all(desk.path("out/tasks").join(id)).unwrap();
        let ran = run(&shell("task").replace("{wildcards.task}", id));
        assert_eq!(ran.code, Some(0), "{}", ran.stderr);
        let merged = run(&shell("merge"));
        assert_eq!(merged.code, Some(0), "a no is a result: {}", merged.stderr);
        let counted = format!("\"done\": {}", number + 1);
        assert!(desk.read("out/results.json").contains(&counted));
    }
    assert!(results(&desk, "out") == results(&desk, "whole"));
    std::fs::remove_file(desk.path("out/plan.json")).unwrap();
    assert_ne!(run(&shell("merge")).code, Some(0), "a fault is none");
}
