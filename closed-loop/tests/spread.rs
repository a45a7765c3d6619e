//! Controllers on converters other than those they were made for.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use std::path::{Path, PathBuf};

use closed_loop::simulation::{Draws, Findings, Setting, Spread, simulate};
use closed_loop::{Named, Scenario, interpreter};

const SCENARIO: &str = "plant = \"plants/paper-model.toml\"
load_steps = [[200, 500]]
instants = 1
sampling_instants = 1
lead = 60
after = 120
tail = 20
baselines = [\"feed-forward\"]
limit = false
";

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples")
}

fn setting(more: &str) -> Setting {
    let file = examples().join("s.toml");
    let scenario = Scenario::from_toml(&file, &format!("{SCENARIO}{more}")).unwrap();
    let policy = policy::load(&examples().join("buck12/policy.toml")).unwrap();
    Setting::new(&file, scenario, policy, None).unwrap()
}

fn run(setting: Setting) -> Findings {
    let policy = Named {
        name: "interpreter".to_owned(),
        controller: interpreter(&setting.policy).unwrap(),
    };
    simulate(setting, vec![policy], &mut |_| Ok(())).unwrap()
}

fn spread(keys: &[&str]) -> Vec<Spread> {
    keys.iter().map(|text| Spread::parse(text).unwrap()).collect()
}

#[test]
fn the_nominal_converter_of_a_spread_does_what_it_does_alone_and_the_others_do_not() {
    let found = run(setting("")
        .spread(spread(&["converter.inductance=1.6e-3,2.4e-3,3"]), None)
        .unwrap());
    let cells = &found.spread.as_ref().unwrap().cells;
    let deviations = |name: &str| -> Vec<f64> {
        let of = |cell: &closed_loop::simulation::Cell| {
            let (_, metrics) = cell.worst.iter().find(|(other, _)| other == name).unwrap();
            metrics.tail_max
        };
        cells.iter().map(of).collect()
    };
    // a spread looks at six phases, so its figures are compared where the phase has no part: in the tail
    for (n, name) in ["policy", "feed-forward"].into_iter().enumerate() {
        let alone = found.steps[0].courses[n].1.finding.worst.tail_max;
        let all = deviations(name);
        assert!(all[1] >= alone && all[0] != all[2], "{name}: {all:?}, {alone}");
    }
    let csv = &found.files().unwrap()["spread.csv"];
    assert_eq!(csv.lines().count(), 1 + 3 * 2);
    assert!(csv.starts_with("converter.inductance,controller,deviation_V,"), "{csv}");
}

/// Half the inductance: the design for it is another one, which a plant whose own design is used would hide.
#[test]
fn classical_controllers_keep_the_design_of_the_nominal_converter() {
    let plant = examples().join("plants/paper-model.toml");
    let halved = "set = { \"converter.inductance\" = 1e-3 }\n";
    let tail = |setting: Setting| run(setting).steps[0].courses[1].1.finding.worst;
    let own = tail(setting(halved));
    let nominal = tail(setting(halved).designed_on(&plant).unwrap());
    assert_ne!(own, nominal);
    let of_spread = run(setting("")
        .spread(spread(&["converter.inductance=1e-3,2e-3,2"]), None)
        .unwrap());
    let cells = of_spread.spread.unwrap().cells;
    let found = cells[0]
        .worst
        .iter()
        .find(|(name, _)| name == "feed-forward")
        .unwrap()
        .1;
    // the sampling instant is one of the six of a spread, whose worst is no better
    assert!(found.deviation >= nominal.deviation, "{found:?} {nominal:?}");
    assert_eq!(found.chatter.subharmonic_periods, nominal.chatter.subharmonic_periods);
}

#[test]
fn two_numbers_make_a_map_for_each_controller() {
    let two = [
        "converter.inductance=1.7e-3,2.3e-3,2",
        "converter.capacitance=1.3e-3,1.7e-3,3",
    ];
    let found = run(setting("").spread(spread(&two), None).unwrap());
    assert_eq!(found.spread.as_ref().unwrap().cells.len(), 6);
    let files = found.files().unwrap();
    assert!(files.contains_key("spread-policy.svg") && files.contains_key("spread-feed-forward.svg"));
    assert!(files["report.html"].contains("policy: largest deviation"));
    assert!(files["summary.txt"].contains("6 converters"));
}

#[test]
fn what_is_no_spread_is_refused() {
    for (text, words) in [
        ("converter.inductance", "no range"),
        ("converter.inductance=1e-3", "no range"),
        ("converter.inductance=2e-3,1e-3", "no range"),
        ("converter.inductance=1e-3,inf", "no range"),
        ("converter.inductance=1e-3,2e-3,1", "no range"),
        ("converter.inductanc=1e-3,2e-3", "converter.inductance"),
    ] {
        let said = Spread::parse(text).unwrap_err().to_string();
        assert!(said.contains(words), "{text}: {said}");
    }
    let thrice = spread(&["load.bleed=1,2", "load.v_fold=1,2", "converter.v_in=190,200"]);
    assert!(setting("").spread(thrice, None).is_err());
    let twice = spread(&["load.v_fold=1,2", "load.v_fold=1,2"]);
    assert!(setting("").spread(twice, None).is_err());
    let other = examples().join("plants/boost-24-48.toml");
    let said = setting("").designed_on(&other).unwrap_err().to_string();
    assert!(said.contains("a boost at 100000 Hz"), "{said}");
}

fn drawn(count: usize, seed: u64) -> Findings {
    let of = spread(&[
        "converter.inductance=1.6e-3,2.4e-3",
        "converter.capacitance=1.2e-3,1.8e-3",
        "converter.v_in=190,210",
    ]);
    run(setting("").spread(of, Some(Draws { count, seed })).unwrap())
}

#[test]
fn drawn_converters_lie_between_the_ends_and_more_of_them_begin_with_the_fewer() {
    let numbers = |count, seed| -> Vec<Vec<f64>> {
        let found = drawn(count, seed);
        let cells = found.spread.unwrap().cells;
        cells.into_iter().map(|cell| cell.numbers).collect()
    };
    let (few, many, others) = (numbers(2, 7), numbers(5, 7), numbers(2, 8));
    assert_eq!(few, many[..2]);
    assert_ne!(few, others);
    for own in &many {
        let ends = [[1.6e-3, 2.4e-3], [1.2e-3, 1.8e-3], [190.0, 210.0]];
        assert!(
            own.iter().zip(ends).all(|(x, [low, high])| low <= *x && *x < high),
            "{own:?}"
        );
    }
}

/// Median and worst from the file of every converter, by sorting it.
#[test]
fn median_and_worst_are_those_of_the_converters_in_spread_csv() {
    let found = drawn(5, 7);
    let files = found.files().unwrap();
    let json: serde_json::Value = serde_json::from_str(&files["metrics.json"]).unwrap();
    let spread = &json["spread"];
    assert_eq!(
        (spread["converters"].as_u64(), spread["seed"].as_u64()),
        (Some(5), Some(7))
    );
    for controller in ["policy", "feed-forward"] {
        for (key, column) in [("deviation", 4), ("settling", 5), ("tail_max", 7)] {
            let rows = files["spread.csv"]
                .lines()
                .skip(1)
                .map(|line| line.split(',').collect::<Vec<_>>());
            let mut values: Vec<f64> = rows
                .filter(|row| row[3] == controller)
                .map(|row| row[column].parse().unwrap())
                .collect();
            values.sort_by(f64::total_cmp);
            let of = &spread["controllers"][controller][key];
            assert_eq!(
                [of["median"].as_f64(), of["worst"].as_f64()],
                [Some(values[2]), Some(values[4])]
            );
        }
    }
    assert!(files["summary.txt"].contains("drawn with seed 7") && files["summary.txt"].contains("better in"));
    assert!(files.contains_key("spread-draws.svg"));
}

#[test]
fn draws_that_go_with_no_spread_are_refused() {
    let refused = |keys: &[&str], count: usize| {
        let draws = Some(Draws { count, seed: 1 });
        setting("").spread(spread(keys), draws).unwrap_err().to_string()
    };
    assert!(refused(&[], 3).contains("without a number"));
    assert!(refused(&["converter.v_in=190,210"], 0).contains("1 to 10000"));
    assert!(refused(&["converter.v_in=190,210,3"], 3).contains("count of values"));
    assert!(refused(&["converter.v_in=190,210", "load.bleed=1,2", "converter.v_in=1,2"], 3).contains("twice"));
}
