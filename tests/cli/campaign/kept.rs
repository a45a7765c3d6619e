//! What is a user's, and what hours have gone into, is kept.

use std::io::{BufRead, BufReader, Write};
use std::process::Stdio;

use super::{desk, results};

/// The path of the first file of a folder of results that ends so.
fn file(desk: &crate::Desk, out: &str, end: &str) -> String {
    let names = results(desk, out).into_iter().map(|(name, _)| name);
    format!("{out}/{}", names.into_iter().find(|name| name.ends_with(end)).unwrap())
}

#[test]
fn files_that_policyc_did_not_write_are_given_up_with_force_alone() {
    let desk = desk();
    desk.succeed("campaign plan.toml --out out");
    let whole = results(&desk, "out");
    // beside the best policy, and within it
    desk.write("out/best/notes.txt", "mine");
    desk.write("out/best/train-train/policy.toml", "# mine");
    for line in ["campaign plan.toml --out out", "merge out --out out"] {
        desk.refuse(line, &["out/best/", "is not what policyc wrote there", "--force"]);
    }
    assert_eq!(
        desk.read("out/best/notes.txt") + &desk.read("out/best/train-train/policy.toml"),
        "mine# mine"
    );
    desk.succeed("campaign plan.toml --out out --force");
    assert!(results(&desk, "out") == whole);
    // a result, edited; it is no result any more, and before it is made again somebody is asked
    let answer = file(&desk, "out", "/answer.json");
    desk.write(&answer, "{}");
    desk.refuse(
        "campaign plan.toml --out out",
        &["/answer.json is not what policyc wrote", "--force"],
    );
    assert_eq!(desk.read(&answer), "{}");
    desk.succeed("campaign plan.toml --out out --force");
    assert!(results(&desk, "out") == whole);
}

#[test]
fn a_training_file_without_a_letter_has_a_best_policy_like_any_other() {
    let desk = desk();
    std::fs::copy(desk.path("train/train.toml"), desk.path("日.toml")).unwrap();
    desk.edit("日.toml", "../plants", "plants");
    desk.edit("日.toml", "contract/policy.toml", "train/contract/policy.toml");
    desk.edit(
        "plan.toml",
        "\"train/train.toml\"",
        "[\"train/train.toml\", \"日.toml\"]\nseeds = 3",
    );
    desk.succeed("campaign plan.toml --out out");
    for name in ["policy", "train-train"] {
        assert!(desk.path(&format!("out/best/{name}/policy.toml")).is_file(), "{name}");
    }
}

#[test]
fn a_damaged_checkpoint_costs_what_it_had_and_nothing_else() {
    let desk = desk();
    desk.succeed("campaign plan.toml --out whole");
    let plan = desk.read("whole/plan.json");
    for id in plan.split('"').filter(|word| word.starts_with("train-")) {
        let folder = desk.path(&format!("out/work/{id}/out/checkpoints"));
        std::fs::create_dir_all(&folder).unwrap();
        for seed in [3, 5] {
            std::fs::write(folder.join(format!("seed-{seed}.bin")), "torn").unwrap();
        }
    }
    std::fs::copy(desk.path("whole/plan.json"), desk.path("out/plan.json")).unwrap();
    desk.succeed("campaign plan.toml --out out");
    assert!(results(&desk, "out") == results(&desk, "whole"));
}

#[test]
fn a_worker_of_another_build_performs_nothing() {
    let desk = desk();
    let folder = desk.folder.path();
    let job = serde_json::json!({ "build": "0", "folder": folder, "arguments": ["targets"] });
    let mut worker = desk.command();
    worker
        .arg("campaign-worker")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped());
    let mut worker = worker.spawn().unwrap();
    // held until it has answered: a worker whose standard input ends has had enough
    let mut input = worker.stdin.take().unwrap();
    input.write_all(format!("{job}\n").as_bytes()).unwrap();
    let mut answer = String::new();
    BufReader::new(worker.stdout.as_mut().unwrap())
        .read_line(&mut answer)
        .unwrap();
    drop(input);
    worker.wait().unwrap();
    let answer = answer.trim_start_matches("policyc-task ");
    let answer: serde_json::Value = serde_json::from_str(answer).unwrap();
    assert_eq!(answer["exit"], 2, "{answer}");
    assert!(answer["reason"].as_str().unwrap().contains("another build"), "{answer}");
}

#[test]
fn what_cannot_be_handled_is_refused_before_anything_runs() {
    let desk = desk();
    let many = desk.type_in("campaign plan.toml --out out --jobs 1025");
    assert_eq!(many.code, Some(2));
    assert!(many.stderr.contains("1024"), "{}", many.stderr);
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt as _;
        let out = std::ffi::OsStr::from_bytes(b"o\xfft");
        let ran = desk.run([
            std::ffi::OsStr::new("campaign"),
            "plan.toml".as_ref(),
            "--out".as_ref(),
            out,
        ]);
        crate::assert_refused(&ran, &["is no UTF-8", "choose another --out"]);
    }
    assert!(!desk.listing().iter().any(|name| name.starts_with('o')));
}
