//! A numeric format is judged by the decisions that it changes, wherever it is named.

use serde_json::Value;

use super::{Desk, assert_refused};

/// The example, with its 515 golden vectors, in `policy/`.
fn example() -> Desk {
    let desk = Desk::new("linear");
    std::fs::remove_dir_all(desk.path("policy")).unwrap();
    tests::tools::copy_folder(&tests::example().with_file_name(""), &desk.path("policy"));
    desk
}

/// Changed decisions and ties as `inspect --json` counts them.
fn counted(desk: &Desk, format: &str) -> (u64, u64) {
    let ran = desk.type_in(&format!("inspect policy --format {format} --json"));
    let json: Value = serde_json::from_str(&ran.stdout).unwrap();
    let allowed = json["decisions"]["allowed"].as_f64().unwrap();
    let is_kept = json["decisions"]["changed"].as_f64().unwrap() <= 515.0 * allowed;
    assert_eq!(ran.code, Some(i32::from(!is_kept)), "{}", ran.stderr);
    let number = |key: &str| json["decisions"][key].as_u64().unwrap();
    assert_eq!(number("observations"), 515);
    (number("changed"), number("ties"))
}

/// The expected numbers were counted with the compiled C and a program of its own, before this existed.
#[test]
fn integers_change_as_many_decisions_as_their_compiled_code_does() {
    let desk = example();
    for (format, expected) in [("f32", 0), ("f64", 0), ("i16", 194), ("i8", 364)] {
        let (changed, ties) = counted(&desk, format);
        assert_eq!(changed + ties, expected, "{format}: {changed} and {ties} ties");
    }
}

#[test]
fn verify_of_a_format_that_changes_decisions_ends_with_1_though_all_builds_are_equal() {
    let desk = example();
    let ran = desk.type_in("verify policy --format i8 --steps 200");
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    for words in [
        "decisions in i8: DIFFERENT",
        "of 515 changed",
        "operating range",
        "equal: buck12 against the interpreter",
    ] {
        assert!(ran.stdout.contains(words), "{words}\n{}", ran.stdout);
    }
    let text = desk.succeed("verify policy --format f32 --steps 200");
    assert!(text.contains("decisions in f32: 0 of 515 changed"), "{text}");
    desk.succeed("verify policy --format i8 --golden-decisions 0.8 --steps 200");
}

#[test]
fn compile_refuses_a_format_that_changes_decisions_unless_their_share_is_accepted() {
    let desk = example();
    let before = desk.listing();
    let ran = desk.type_in("compile policy --format i16 --no-costs --out out");
    assert_refused(
        &ran,
        &["of 515 changed", "most at golden vector", "--golden-decisions 0.37"],
    );
    assert_eq!(desk.listing(), before, "nothing is written");
    desk.succeed("compile policy --format i16 --golden-decisions 0.37 --no-costs --out out");
    let ran = desk.type_in("compile policy --golden-decisions 37 --no-costs --out out");
    assert_refused(&ran, &["--golden-decisions", "0.02 for 2 %"]);
}

#[test]
fn the_contract_may_accept_a_share() {
    let desk = example();
    desk.edit("policy/policy.toml", "[network]", "[network]\ngolden_decisions = 0.4");
    desk.succeed("compile policy --format i16 --no-costs --out out");
    desk.succeed("verify policy --format i16 --steps 200");
}

/// A wrong activation is no matter of decisions or builds: it is said once, with what to look at.
#[test]
fn a_network_that_was_read_wrongly_is_told_apart_from_builds_that_differ() {
    let desk = example();
    desk.edit("policy/policy.toml", "\"relu\"", "\"tanh\"");
    let ran = desk.type_in("verify policy --steps 200");
    assert_eq!(ran.code, Some(1));
    for words in [
        "equal: buck12 against the interpreter",
        "does not give the trainer's golden answers",
        "hint: with hidden_activation = \"relu\" the same weights give all 515 golden answers",
    ] {
        assert!(ran.stdout.contains(words), "{words}\n{}", ran.stdout);
    }
    assert!(!ran.stdout.contains("decides otherwise"), "{}", ran.stdout);
    let ran = desk.type_in("inspect policy");
    assert_eq!(ran.code, Some(1), "{}", ran.stderr);
    let hint = "with hidden_activation = \"relu\" the same weights give all 515 golden answers";
    assert!(ran.stderr.contains(hint), "{}", ran.stderr);
    assert_refused(&desk.type_in("compile policy --no-costs --out out"), &[hint]);
}

/// Where no activation mends it, none is proposed.
#[test]
fn an_activation_that_does_not_fit_either_is_not_proposed() {
    let desk = example();
    desk.edit("policy/policy.toml", "\"relu\"", "\"tanh\"");
    desk.edit("policy/policy.toml", "[network]", "[network]\ngolden_tolerance = 1e-12");
    let ran = desk.type_in("inspect policy");
    assert!(ran.stderr.contains("hint: look at hidden_activation"), "{}", ran.stderr);
}

#[test]
fn compile_says_how_many_accepted_decisions_a_format_changes() {
    let desk = example();
    let said = desk.succeed("compile policy --format i16 --golden-decisions 0.37 --no-costs --out out");
    assert!(
        said.contains("decisions in i16: 187 of 515 changed (36.3 %, allowed 37.0 %)"),
        "{said}"
    );
    assert!(said.contains("they give up at most"), "{said}");
    let said = desk.succeed("compile policy --no-costs --out exact");
    assert!(!said.contains("decisions in"), "{said}");
}

#[test]
fn code_without_golden_vectors_is_said_to_be_unproven() {
    let desk = Desk::new("linear");
    for line in ["compile policy --no-costs --out out", "verify policy --steps 50"] {
        let text = desk.succeed(line);
        assert!(
            text.contains("nothing shows that the weights were read"),
            "{line}\n{text}"
        );
    }
}

/// Generated files do not say what is accepted, so that they accept nothing for whoever verifies them; the message says what to type.
#[test]
fn verify_of_a_folder_that_was_accepted_on_the_command_line_says_what_to_type() {
    let desk = example();
    let said = desk.succeed("compile policy --format i16 --golden-decisions 0.4 --no-costs --out out");
    assert!(said.contains("give `verify` --golden-decisions 0.4 as well"), "{said}");
    let ran = desk.type_in("verify policy --generated out --steps 100");
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    assert!(
        ran.stdout.contains("for this run --golden-decisions 0.37"),
        "{}",
        ran.stdout
    );
    assert!(
        ran.stdout.contains("golden_decisions = 0.37 in [network]"),
        "{}",
        ran.stdout
    );
    desk.succeed("verify policy --generated out --steps 100 --golden-decisions 0.37");
    desk.edit("policy/policy.toml", "[network]", "[network]\ngolden_decisions = 0.4");
    let said = desk.succeed("compile policy --format i16 --golden-decisions 0.4 --no-costs --out again");
    assert!(!said.contains("give `verify`"), "the contract accepts it: {said}");
}

/// One number, in one unit, wherever it is said: the loss of the worst change as a share of the operating range of Q.
#[test]
fn compile_and_certify_say_a_loss_in_the_same_unit() {
    let desk = example();
    let after = |said: &str, words: &str| {
        let rest = said.split_once(words).unwrap_or_else(|| panic!("{words}\n{said}")).1;
        rest.split(' ').next().unwrap().to_owned()
    };
    let compiled = desk.succeed("compile policy --format i16 --golden-decisions 0.4 --no-costs --out out");
    let certified = desk.succeed("certify policy --format i16 --samples 20 --boxes 4 --out certificate");
    let range = "of the operating range of Q, which is ";
    assert_eq!(after(&compiled, range), after(&certified, range));
    let golden = certified.split_once("golden observations").unwrap().1;
    assert_eq!(
        after(&compiled, "give up at most "),
        after(golden, "of Q: "),
        "{certified}"
    );
}
