//! Several processes in one folder, and several folders as one.

use std::process::{Child, Stdio};

use super::{desk, results};
use crate::Desk;

fn start(desk: &Desk, line: &str) -> Child {
    let mut command = desk.command();
    command.args(line.split(' '));
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

#[test]
fn two_campaigns_in_one_folder_both_end_with_all_results() {
    let desk = desk();
    desk.edit("train/train.toml", "steps = 1200", "steps = 12000");
    desk.edit("train/train.toml", "every = 200", "every = 4000");
    let both = [(), ()].map(|()| start(&desk, "campaign plan.toml --out out --jobs 1"));
    for child in both {
        let ended = child.wait_with_output().unwrap();
        let (said, error) = (
            String::from_utf8_lossy(&ended.stdout),
            String::from_utf8_lossy(&ended.stderr),
        );
        assert_eq!(ended.status.code(), Some(0), "{said}{error}");
        assert!(said.contains("4 of 4 tasks are done."), "{said}");
    }
    desk.succeed("campaign plan.toml --out whole");
    assert!(results(&desk, "out") == results(&desk, "whole"));
}

/// Two plans, of which each has what the other has not.
fn halves() -> Desk {
    let desk = desk();
    let plan = desk.read("plan.toml");
    let (train, simulate) = plan.split_once("[[simulate]]").unwrap();
    desk.write("train.toml", train);
    desk.write(
        "simulate.toml",
        &format!("name = \"Two kinds\"\n[[simulate]]{simulate}"),
    );
    desk.succeed("campaign train.toml --out a");
    desk.succeed("campaign simulate.toml --out b");
    desk
}

#[test]
fn what_a_folder_has_stays_in_it_when_another_is_merged_into_it() {
    let desk = halves();
    desk.succeed("campaign plan.toml --out whole");
    let said = desk.succeed("merge b --out a");
    assert!(said.contains("4 of 4 tasks are done."), "{said}");
    assert!(results(&desk, "a") == results(&desk, "whole"));
}

#[test]
fn a_merge_that_is_refused_writes_nothing_and_can_be_tried_again() {
    let desk = halves();
    // the last of the tasks is torn: those before it must not have been put into `a` by then
    let records = results(&desk, "b").into_iter().map(|(name, _)| name);
    let last = records.filter(|name| name.ends_with("/metrics.json")).max().unwrap();
    let text = desk.read(&format!("b/{last}"));
    desk.write(&format!("b/{last}"), "{}");
    let before = results(&desk, "a");
    desk.refuse("merge b --out a", &["metrics.json was edited since it was made"]);
    assert!(results(&desk, "a") == before);
    desk.write(&format!("b/{last}"), &text);
    assert!(desk.succeed("merge b --out a").contains("4 of 4 tasks are done."));
}

/// A plan may come from anybody, and its names become folders.
#[test]
fn a_name_that_leads_out_of_the_folder_is_refused() {
    let desk = desk();
    desk.succeed("campaign plan.toml --out a --task 4");
    desk.succeed("campaign plan.toml --out mine --task 3");
    let plan = desk.read("a/plan.json");
    let id = plan
        .split('"')
        .find(|word| word.starts_with("train-"))
        .unwrap()
        .to_owned();
    desk.edit("a/plan.json", &id, "../../mine");
    let before = results(&desk, "mine");
    desk.refuse(
        "merge a --out b",
        &["a/plan.json", "../../mine", "16 hexadecimal digits"],
    );
    assert!(results(&desk, "mine") == before && !desk.path("b").exists());
}

#[test]
fn reasons_of_failures_merge_to_the_same_in_any_order_and_stay() {
    let desk = desk();
    for out in ["a", "b"] {
        desk.succeed(&format!("campaign plan.toml --out {out} --task 3"));
    }
    let plan = desk.read("a/plan.json");
    let id = plan.split('"').find(|word| word.starts_with("train-")).unwrap();
    for (out, reason) in [("a", "no room"), ("b", "no light")] {
        std::fs::create_dir_all(desk.path(&format!("{out}/failed"))).unwrap();
        desk.write(&format!("{out}/failed/{id}.txt"), reason);
    }
    for line in ["merge a b --out ab", "merge b a --out ba", "merge ab --out again"] {
        assert_eq!(desk.type_in(line).code, Some(1), "{line}");
    }
    assert!(desk.read("ab/results.json").contains("no light"));
    assert!(results(&desk, "ab") == results(&desk, "ba") && results(&desk, "ab") == results(&desk, "again"));
}
