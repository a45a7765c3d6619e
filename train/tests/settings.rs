//! Training files: defaults, and every kind of fault with its place.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use train::Settings;
use train::learner::{Loss, TargetUpdate};

const LEAST: &str = "plant = \"p.toml\"\ncontract = \"c/policy.toml\"\nsteps = 1000\n";

/// What every file needs beside [`LEAST`], a table each; behind a text that has not got it.
const REST: [(&str, &str); 4] = [
    ("[reward]", "v_ref = 100.0"),
    ("[episode]", "loads = { values = [200, 500] }"),
    ("[selection]", "load_steps = [[200, 500]]"),
    ("[evaluation]", "load_steps = [[500, 200]]"),
];

/// The text with the tables of [`REST`] that it has not got.
fn parse(text: &str) -> Result<Settings, String> {
    let rest = REST.iter().filter(|(table, _)| !text.contains(table));
    let rest: String = rest.map(|(table, key)| format!("{table}\n{key}\n")).collect();
    parse_alone(&format!("{text}{rest}"))
}

fn parse_alone(text: &str) -> Result<Settings, String> {
    Settings::parse(text, Path::new("folder/train.toml")).map_err(|faults| faults.to_string())
}

#[test]
fn what_no_default_can_know_is_asked_for() {
    let message = parse_alone(LEAST).unwrap_err();
    for part in [
        "`v_ref` is missing in [reward]",
        "`loads` is missing in [episode]",
        "`load_steps` is missing in [selection]",
        "`load_steps` is missing in [evaluation]",
    ] {
        assert!(message.contains(part), "{part}\n{message}");
    }
}

/// Of another converter, every voltage is another one.
#[test]
fn voltages_left_out_are_shares_of_the_reference() {
    let settings = parse(&format!("{LEAST}[reward]\nv_ref = 5.0\n")).unwrap();
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
    let [low, high] = settings.episode.initial_voltage;
    assert!(near(low, 4.85) && near(high, 5.15) && near(settings.episode.max_error, 2.0));
    // 5 mV, 50 mV, and as much off for an error of half of it as at 100 V
    assert!(near(settings.reward.of(5.004, 0.0), 10.0 - 0.8));
    assert!(near(settings.reward.of(5.04, 0.0), 1.0 - 8.0));
    assert!(near(settings.reward.of(7.5, 0.0), -500.0));
}

#[test]
fn three_keys_are_enough_and_the_rest_is_the_papers() {
    let settings = parse(LEAST).unwrap();
    assert_eq!(settings.plant, Path::new("folder/p.toml"));
    assert_eq!(settings.hidden, [64, 64]);
    let learning = &settings.learning;
    assert_eq!(
        (learning.learning_rate, learning.replay, learning.epsilon_end),
        (1e-3, 200_000, 0.1)
    );
    let learner = learning.learner;
    assert_eq!(
        (learner.batch, learner.discount, learner.gradient_clip),
        (256, 0.9, Some(1.0))
    );
    assert_eq!((learner.loss, learner.double), (Loss::Huber, false));
    assert_eq!(learner.target_update, TargetUpdate::Soft { rate: 1e-3 });
    assert_eq!(settings.evaluation.instants, 24);
}

#[test]
fn a_contract_that_commands_a_number_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("policy.toml");
    for (actions, entry) in [
        (
            "continuous = { squash = \"tanh\", scale = 0.4, offset = 0.5 }",
            "continuous in [actions]",
        ),
        ("gains = [{ squash = \"tanh\" }]", "gains in [actions]"),
    ] {
        std::fs::write(&path, format!("[actions]\n{actions}\n")).unwrap();
        let refused = train::Contract::load(&path, &[4]).unwrap_err().to_string();
        for part in ["commands a number", "policy.toml", entry] {
            assert!(refused.contains(part), "{part}: {refused}");
        }
    }
}

#[test]
fn reward_is_the_papers_by_default() {
    let reward = parse(LEAST).unwrap().reward;
    for (v, expected) in [
        (100.0, 10.0),
        (100.05, 9.5),
        (99.5, -4.0),
        (102.0, -20.0),
        (98.0, -20.0),
    ] {
        assert!(
            (reward.of(v, 0.3) - expected).abs() < 1e-9,
            "{v} V: {}",
            reward.of(v, 0.3)
        );
    }
}

#[test]
fn curriculum_stages_follow_one_another() {
    let text = format!(
        "{LEAST}[[curriculum]]\nuntil = 10\nrandomise = 0.25\nloads = {{ values = [300] }}\n[[curriculum]]\nuntil = 20\n"
    );
    let settings = parse(&text).unwrap();
    assert_eq!(
        (settings.stage(9).0.values.as_slice(), settings.stage(9).1),
        ([300.0].as_slice(), 0.25)
    );
    assert_eq!(settings.stage(10).0, &settings.episode.loads);
    assert_eq!(settings.stage(20).1, 1.0);
}

#[test]
fn another_converter_has_limits_of_its_own_for_each_load_step() {
    let spread = "[[spread]]\nfactor = { \"converter.v_in\" = 0.9 }\ntail = 0.5\n";
    let of_steps = "[[spread.spec]]\nload_step = [200, 500]\ndeviation = 1\n[[spread.spec]]\nload_step = [500, 200]\nsettling = 2\n";
    let settings = parse(&format!("{LEAST}{spread}{of_steps}")).unwrap();
    let limits: Vec<_> = settings.spread[0]
        .limits
        .iter()
        .map(|own| {
            (
                own.load_step,
                own.limits.deviation,
                own.limits.settling,
                own.limits.tail,
            )
        })
        .collect();
    assert_eq!(
        limits,
        [
            (Some([200.0, 500.0]), Some(1.0), None, None),
            (Some([500.0, 200.0]), None, Some(2.0), None),
            (None, None, None, Some(0.5)),
        ]
    );
    assert!(
        settings.specification.is_empty(),
        "those of the spread are not the file's"
    );
}

/// Text behind the least file, its line there, and what the message must say.
const FAULTS: &[(&str, usize, &[&str])] = &[
    ("stepps = 3", 4, &["unknown key `stepps`", "did you mean `steps`?"]),
    (
        "[learning]\nrate = 1e-3",
        5,
        &["unknown key `rate` in [learning]", "learning_rate"],
    ),
    (
        "[learning]\nlearning_rate = 0.0",
        5,
        &["`learning_rate` must be greater than 0", "found: 0"],
    ),
    (
        "[learning]\nlearning_rate = \"0,001\"",
        5,
        &[
            "of the wrong kind",
            "the text \"0,001\"",
            "a number",
            "with a point and without quotes",
        ],
    ),
    ("[learning]\nbatch = 2.5", 5, &["the number 2.5", "a whole number"]),
    ("[learning]\nbatch = 0", 5, &["found: 0", "1 to 65536"]),
    (
        "[learning]\ndiscount = 1.0",
        5,
        &["`discount` is out of range", "0 to 0.999999"],
    ),
    (
        "[learning]\ndiscount = nan",
        5,
        &["`discount` is not a finite number", "found: nan"],
    ),
    (
        "[learning]\nalgorithm = \"doubledqn\"",
        5,
        &["no such value", "dqn, double-dqn", "did you mean \"double-dqn\"?"],
    ),
    (
        "[learning]\ntarget_update = { soft = 1e-3, hard = 5 }",
        5,
        &["exactly one of `soft`, `hard`"],
    ),
    (
        "[learning]\ntarget_update = { soft = 2 }",
        5,
        &["more than 0, at most 1"],
    ),
    (
        "[learning]\nepsilon = { end = 1.5 }",
        5,
        &["`end` is out of range", "0 to 1"],
    ),
    (
        "[network]\nhidden = []",
        5,
        &["too few hidden layers", "found: 0", "1 to 8"],
    ),
    (
        "[network]\nhidden = [64, 5000]",
        5,
        &["`hidden` is out of range", "1 to 1024"],
    ),
    ("seeds = []", 4, &["no seed", "at least one"]),
    ("seeds = [-1]", 4, &["found: -1"]),
    ("early_stop = 1", 4, &["the whole number 1", "true or false"]),
    ("learning = 3", 4, &["the whole number 3", "a table"]),
    (
        "[reward]\nbands = [[1.0, 1.0], [0.1, 10.0]]",
        5,
        &["from the narrowest to the widest"],
    ),
    (
        "[episode]\nloads = { }",
        5,
        &["`loads` is empty", "`values`, `range` or both"],
    ),
    (
        "[episode]\nloads = { range = [500, 200] }",
        5,
        &["crossed", "write [200, 500]"],
    ),
    (
        "[episode]\ninitial_voltage = [1, 2, 3]",
        5,
        &["wrong number of values", "found: 3"],
    ),
    (
        "[[randomise]]\nkey = \"switch.vf\"\nvalue = [0, 1]",
        5,
        &["the plant has no number `switch.vf`", "`switch.v_f`"],
    ),
    (
        "[[randomise]]\nkey = \"switch.v_f\"",
        4,
        &["exactly one of `value`, `factor`"],
    ),
    (
        "[set]\n\"pwm.dutydelay\" = 1",
        5,
        &["the plant has no number", "did you mean `pwm.duty_delay`?"],
    ),
    (
        "[[curriculum]]\nrandomise = 0.5",
        4,
        &["`until` is missing in [[curriculum]]"],
    ),
    (
        "[[spec]]\nload_step = [200, 500]",
        4,
        &["without a limit", "duty_activity"],
    ),
    ("[[spec]]\nduty_activity = -1", 5, &["greater than 0"]),
    (
        "[[spread]]\ntail = 1",
        4,
        &["a [[spread]] that is the plant itself", "`factor`, `set` or both"],
    ),
    (
        "[[spread]]\nfactor = { \"converter.inductanc\" = 0.9 }",
        5,
        &["the plant has no number", "did you mean `converter.inductance`?"],
    ),
    (
        "[[spread]]\nfactor = { \"converter.v_in\" = 0 }",
        5,
        &["greater than 0"],
    ),
    (
        "[[spread]]\nset = { \"converter.v_in\" = 90 }\n[[spread.spec]]\nload_step = [200, 500]",
        6,
        &["a [[spec]] without a limit"],
    ),
    (
        "[[spec]]\ninstants = \"all\"\ntail = 1",
        5,
        &["no such value", "worst, sample"],
    ),
    (
        "[selection]\nload_steps = [200, 500]",
        5,
        &["of the wrong kind", "two numbers"],
    ),
    ("[selection]\nevery = 0", 5, &["1 to 1000000000"]),
    ("steps = 5", 4, &["not valid TOML", "duplicate key"]),
];

#[test]
fn every_fault_says_where_it_is_and_what_was_expected() {
    for (text, line, parts) in FAULTS {
        let whole = format!("{LEAST}{text}\n");
        let Err(message) = parse(&whole) else {
            panic!("accepted: {text}")
        };
        let place = format!("folder/train.toml:{line}:");
        for part in parts.iter().copied().chain([place.as_str()]) {
            assert!(message.contains(part), "{text}\nlacks {part:?}:\n{message}");
        }
    }
}

/// The end of the file is where a bracket is missed, so nothing may stand behind it.
#[test]
fn a_bracket_that_is_not_closed_is_shown_where_it_opens() {
    let message = parse_alone(&format!("{LEAST}x = [1,\n")).unwrap_err();
    for part in ["folder/train.toml:4:", "not valid TOML"] {
        assert!(message.contains(part), "lacks {part:?}:\n{message}");
    }
}

#[test]
fn a_faulty_part_of_a_table_is_not_reported_as_missing() {
    for text in ["{ values = [-1] }", "{ range = [5, 2] }"] {
        let message = parse(&format!("{LEAST}[episode]\nloads = {text}\n")).unwrap_err();
        assert_eq!(message.matches("error:").count(), 1, "{message}");
    }
}

#[test]
fn all_faults_come_at_once_in_the_order_of_the_file() {
    let text = "contract = 5\n[learning]\nbatch = -3\nfoo = 1\n[episode]\nsteps = true\n";
    let message = parse(text).unwrap_err();
    assert_eq!(message.matches("error:").count(), 7, "{message}");
    let order = [
        "`plant` is missing",
        "`contract`",
        "`batch`",
        "unknown key `foo`",
        "`steps` is of the wrong kind",
    ];
    let places: Vec<usize> = order
        .iter()
        .map(|part| message.find(part).unwrap_or_else(|| panic!("{part}\n{message}")))
        .collect();
    assert!(places.is_sorted(), "{message}");
}
