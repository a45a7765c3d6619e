//! `policyc verify --codes`: every combination of ADC codes, in shards that stay.

use serde_json::Value;

use super::Desk;

/// A policy whose two converters have 6 bits, so that one part of a second holds the grid.
fn coarse() -> Desk {
    let desk = Desk::new("adc_mapping");
    desk.edit("policy/policy.toml", "gain = 0.0048828125", "gain = 0.3125");
    desk.edit("policy/policy.toml", "gain = 0.005", "gain = 0.32");
    desk
}

#[test]
fn all_codes_are_compared_once_and_kept() {
    let desk = coarse();
    // 64 steps of 0.3125 V are 20 V: codes 0 to 64; 62 of 0.32 A are 19.84 A: codes 0 to 62; one more at either end
    let text = desk.succeed("verify policy --codes --out all");
    for word in [
        "v_out: codes -1 to 65",
        "i_out: codes -1 to 63",
        "all 4,355 combinations",
        "equal",
    ] {
        assert!(text.contains(word), "{word}\n{text}");
    }
    let kept = desk.read("all/codes.csv");
    assert_eq!(kept, desk.read("all/shard-1-of-1.csv"));
    // a shard that another machine has done counts, and one without a part does nothing
    std::fs::remove_file(desk.path("all/codes.csv")).unwrap();
    let answer: Value =
        serde_json::from_str(&desk.succeed("verify policy --codes --out all --shard 2/2 --json")).unwrap();
    assert_eq!((&answer["complete"], &answer["compared"]), (&true.into(), &4355.into()));
    assert_eq!(kept, desk.read("all/codes.csv"));
    let text = desk.succeed("verify policy --codes --out half --shard 2/2");
    assert!(
        text.contains("0 of 4,355 combinations") && !text.contains("against the interpreter"),
        "{text}"
    );
}

#[test]
fn another_policy_does_not_go_on_in_the_same_folder() {
    let desk = coarse();
    desk.succeed("verify policy --codes --out all --shard 2/2");
    desk.edit("policy/policy.toml", "scale = 0.5", "scale = 0.25");
    desk.refuse(
        "verify policy --codes --out all --shard 2/2",
        &["all/shard-2-of-2.csv", "of another run"],
    );
    // and a file of somebody else stays what it is
    std::fs::create_dir(desk.path("mine")).unwrap();
    desk.write("mine/shard-1-of-1.csv", "t,v\n1,2\n3,4\n");
    desk.refuse(
        "verify policy --codes --out mine",
        &["mine/shard-1-of-1.csv", "of another run"],
    );
    assert_eq!(desk.read("mine/shard-1-of-1.csv"), "t,v\n1,2\n3,4\n");
}

#[test]
fn a_signal_without_codes_is_refused() {
    let desk = Desk::new("linear");
    desk.refuse(
        "verify policy --codes --out all",
        &["policy.toml", "arrives as a number"],
    );
    assert!(!desk.path("all").exists());
    desk.refuse("verify policy --codes", &["--out"]);
    desk.refuse("verify policy --codes --out all --shard 3/2", &["1 <= I <= N"]);
}
