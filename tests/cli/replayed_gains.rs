//! `policyc replay` of an actor whose action is added to the duty before: golden answers of its log, and what a format changes.

use interp::{Controller, Sample};
use safetensors::tensor::{Dtype, TensorView, serialize};

use super::Desk;

const ROWS: usize = 120;
const HIDDEN: usize = 12;
const REST: &str = r#"name = "adder"
sample_period = 1e-5
signal = [
  { name = "v_out", unit = "V", range = [60.0, 140.0] },
  { name = "i_l", unit = "A", range = [-30.0, 30.0] },
]
feature = [
  { name = "e", source = "100 - v_out", scale = 0.1, clip = [-2.0, 2.0] },
  { name = "e_1", source = "100 - v_out", filters = [{ delay = 1 }], scale = 0.1, clip = [-2.0, 2.0] },
  { name = "i", source = "i_l", scale = 0.2, clip = [-4.0, 4.0] },
  { name = "d", source = "previous_duty", scale = 5.0, offset = -2.5 },
]

[network]
weights = "weights.safetensors"
hidden_activation = "relu"

[actions]
base = "previous_duty"
gains = [{ squash = "tanh", scale = 0.03 }]

[limits]
duty = [0.1, 0.8]
initial_duty = 0.5

[fallback]
duty = 0.1
hold = 3
"#;
/// As the law is where a signal is in it.
const MEASURED: (&str, &str) = ("base = \"previous_duty\"", "base = \"0.004 * v_out\"");
const REPLAY: &str = "replay adder log.csv";

/// Weights of 4 -> HIDDEN -> 1 from a generator of its own.
fn weights() -> Vec<u8> {
    let mut state = 12_345_u32;
    let mut bytes = |count: usize, size: f32| -> Vec<u8> {
        let next = |_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (size * ((state >> 8) as f32 / 8_388_608.0 - 1.0)).to_le_bytes()
        };
        (0..count).flat_map(next).collect()
    };
    let layers = [
        ("layer_0.weight", vec![HIDDEN, 4], bytes(4 * HIDDEN, 0.8)),
        ("layer_0.bias", vec![HIDDEN], bytes(HIDDEN, 0.3)),
        ("layer_1.weight", vec![1, HIDDEN], bytes(HIDDEN, 0.7)),
        ("layer_1.bias", vec![1], bytes(1, 0.05)),
    ];
    let view = |(name, shape, data): &'static (&str, Vec<usize>, Vec<u8>)| {
        (*name, TensorView::new(Dtype::F32, shape.clone(), data).unwrap())
    };
    let layers: &'static _ = Box::leak(Box::new(layers));
    serialize(layers.iter().map(view), None).unwrap()
}

fn desk() -> Desk {
    let desk = Desk::new("minimal");
    std::fs::create_dir(desk.path("adder")).unwrap();
    desk.write("adder/policy.toml", REST);
    std::fs::write(desk.path("adder/weights.safetensors"), weights()).unwrap();
    desk
}

/// Two episodes of the contract in f32, whose `digits` are written.
fn log(desk: &Desk, digits: usize) -> String {
    let policy = policy::load(&desk.path("adder/policy.toml")).unwrap();
    let mut controller = Controller::<f32>::new(&policy);
    let mut log = "episode,v_out,i_l,obs_0,obs_1,obs_2,obs_3,duty\n".to_owned();
    for row in 0..ROWS {
        let (episode, t) = (row / 60, row as f64);
        if row == 60 {
            controller.reset();
        }
        let samples = [100.0 + 6.0 * (0.31 * t).sin(), 12.0 * (0.17 * t).cos()].map(|x| (1e5 * x).round() / 1e5);
        let trace = controller.eval(&samples.map(Sample::Wide)).unwrap();
        log += &format!("{episode},{},{}", samples[0], samples[1]);
        for feature in &trace.features {
            log += &format!(",{:.digits$}", feature.observation);
        }
        log += &format!(",{:.digits$}\n", trace.decision(0).duty_sim);
        controller.commit_trace(&trace);
    }
    log
}

#[test]
fn a_log_of_a_law_that_the_observations_tell_becomes_golden_duties() {
    let desk = desk();
    let advised = "of its log (`policyc replay --golden`)";
    assert!(desk.succeed("inspect adder").contains(advised));
    desk.write("log.csv", &log(&desk, 8));
    desk.succeed(&format!("{REPLAY} --golden adder/of_log.safetensors"));
    desk.edit(
        "adder/policy.toml",
        "[network]\n",
        "[network]\ngolden = \"of_log.safetensors\"\n",
    );
    let said = desk.succeed("inspect adder");
    assert!(said.contains("120 golden vectors: largest error of the duty"), "{said}");
    // a golden answer that says nothing of the law would be equal to anything
    desk.edit("adder/policy.toml", "scale = 0.03", "scale = 0.04");
    let other = desk.type_in("inspect adder");
    assert_eq!(other.code, Some(1), "{}{}", other.stdout, other.stderr);
}

/// The law reads a voltage, and the features have its difference from another only: a duty says nothing of the network then.
#[test]
fn a_law_that_the_observations_hide_is_refused_with_what_would_do_and_is_not_advised() {
    let desk = desk();
    desk.edit("adder/policy.toml", MEASURED.0, MEASURED.1);
    desk.write("log.csv", &log(&desk, 8));
    let words = [
        "`0.004 * v_out`",
        "`output` [n, gains]",
        "atanh(action)",
        "an observation does not tell",
    ];
    desk.refuse(&format!("{REPLAY} --golden new.safetensors"), &words);
    assert!(!desk.path("new.safetensors").exists());
    let said = desk.succeed("inspect adder");
    assert!(
        said.contains("no golden vectors") && !said.contains("replay --golden"),
        "{said}"
    );
}

#[test]
fn rows_that_the_controller_never_answers_are_no_golden_answers_and_do_not_judge_a_format() {
    let desk = desk();
    desk.write("log.csv", &log(&desk, 8));
    // 10 A end at an observation of 2, so of the rows beyond it some are no observation of this controller
    desk.edit("adder/policy.toml", "range = [-30.0, 30.0]", "range = [-10.0, 10.0]");
    let ran = desk.type_in(&format!("{REPLAY} --golden adder/of_log.safetensors"));
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let left: usize = (ran.stderr.lines())
        .find_map(|line| {
            line.split("of_log.safetensors: ")
                .nth(1)?
                .split(' ')
                .next()?
                .parse()
                .ok()
        })
        .unwrap();
    assert!(left > 40 && left < 100, "{}", ran.stderr);
    let away = format!("{} of 120 rows are left out", ROWS - left);
    assert!(ran.stderr.contains(&away), "{}", ran.stderr);
    desk.edit(
        "adder/policy.toml",
        "[network]\n",
        "[network]\ngolden = \"of_log.safetensors\"\n",
    );
    let inspected = desk.type_in("inspect adder --format i16").stdout;
    let replayed = desk.type_in(&format!("{REPLAY} --format i16")).stdout;
    let line = |text: &str| {
        text.lines()
            .find(|line| line.contains("gains in i16"))
            .map(|line| line.trim().to_owned())
    };
    assert!(line(&replayed).is_some(), "{replayed}");
    assert_eq!(line(&replayed), line(&inspected));
    let apart = format!("{} of 120 rows do not count", ROWS - left);
    assert!(replayed.contains(&apart), "{replayed}");
}

/// 0.8 in binary32 lies above the limit of 0.8 that the controller rounds inwards: a trainer that clips there logs it all the same.
#[test]
fn a_duty_at_its_limit_is_that_of_the_controller() {
    let desk = desk();
    let policy = policy::load(&desk.path("adder/policy.toml")).unwrap();
    for (limit, logged) in [(1, "0.800000012"), (1, "0.8"), (0, "0.1"), (0, "0.0999999940")] {
        let mut controller = Controller::<f32>::new(&policy);
        let mut log = "v_out,i_l,previous_duty,obs_3,duty\n".to_owned();
        for row in 0..40 {
            let mut state = controller.state().clone();
            let mut own = state.output(0);
            let ends = controller.duty_before(0).unwrap();
            own.previous_duty = [ends.0, ends.1][limit];
            state.set_output(0, own);
            controller.restore(&state);
            let samples = [100.0 + 3.0 * f64::from(row % 7), 8.0 - f64::from(row % 5)];
            let trace = controller.eval(&samples.map(Sample::Wide)).unwrap();
            let observation = 5.0 * logged.parse::<f64>().unwrap() - 2.5;
            let duty = trace.decision(0).duty_sim;
            log += &format!("{},{},{logged},{observation:.6},{duty:.8}\n", samples[0], samples[1]);
            controller.commit_trace(&trace);
        }
        desk.write("log.csv", &log);
        let ran = desk.type_in(&format!("{REPLAY} --skip 1"));
        let all = format!("{logged}: {}{}", ran.stdout, ran.stderr);
        assert_eq!(ran.code, Some(0), "{all}");
        assert!(all.contains("duty equal in 40 of 40"), "{all}");
    }
    // farther off it is another contract's
    desk.write(
        "log.csv",
        "v_out,i_l,previous_duty,obs_3\n100,8,0.8001,1.5\n100,8,0.8001,1.5\n",
    );
    desk.refuse(
        REPLAY,
        &["none that the controller commands", "0.8001", "0.1", "0.79999"],
    );
}

/// Where every sample lies outside its range nothing is decided: equal features say nothing of a format.
#[test]
fn a_log_without_a_row_that_counts_says_so_of_the_format() {
    let desk = desk();
    desk.write("log.csv", &log(&desk, 8));
    desk.edit("adder/policy.toml", "range = [-30.0, 30.0]", "range = [50.0, 60.0]");
    let said = desk.type_in(&format!("{REPLAY} --format i16")).stdout;
    for words in ["120 of 120 rows do not count", "; this log says nothing of it"] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(!said.contains("gains in i16"), "{said}");
}

#[test]
fn a_law_in_integers_is_held_against_f32_first_and_judged_by_golden_duty() {
    let desk = desk();
    desk.write("log.csv", &log(&desk, 8));
    let plain = desk.succeed(REPLAY);
    // the limits of the duty and the ends of a gain are two ranges
    assert!(plain.contains("duty equal in 120 of 120"), "{plain}");
    assert!(plain.contains("of the range of the limits, 0.7, in line"), "{plain}");
    let ran = desk.type_in(&format!("{REPLAY} --format i8"));
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    for words in [
        "duty equal in 120 of 120 in f32",
        "gains in i8: DIFFERENT: off by at most",
        "of their ranges, 0.0600 of gain 0",
        "most in row (from 0) ",
        "equal in f32, but i8 changes more than is allowed; to accept it, golden_duty = ",
    ] {
        assert!(ran.stdout.contains(words), "{words}: {}", ran.stdout);
    }
    assert!(!ran.stdout.contains("look at squash"), "{}", ran.stdout);
    let contract = desk.read("adder/policy.toml");
    let limit = |share: &str| format!("[network]\ngolden = \"of_log.safetensors\"\ngolden_duty = {share}\n");
    desk.succeed(&format!("{REPLAY} --golden adder/of_log.safetensors"));
    desk.write("adder/policy.toml", &contract.replace("[network]\n", &limit("0.5")));
    let accepted = desk.succeed(&format!("{REPLAY} --format i8"));
    assert!(
        accepted.contains("equal in f32, and i8 changes no more than is allowed"),
        "{accepted}"
    );
    // one that is none of the contract's is not blamed on the format
    desk.edit("adder/policy.toml", "scale = 0.03", "scale = 0.05");
    let other = desk.type_in(&format!("{REPLAY} --format i8"));
    assert_eq!(other.code, Some(1), "{}", other.stdout);
    assert!(other.stdout.contains("in f32, first other in line"), "{}", other.stdout);
    assert!(!other.stdout.contains("gains in i8"), "{}", other.stdout);
}

/// Four digits are equal to a replay that allows for them, and farther off than golden_tolerance does.
#[test]
fn golden_answers_of_few_digits_come_with_the_tolerance_that_takes_them() {
    let desk = desk();
    desk.write("log.csv", &log(&desk, 4));
    let ran = desk.type_in(&format!("{REPLAY} --tolerance 3e-4 --golden adder/of_log.safetensors"));
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let entry = ran
        .stderr
        .split("golden_tolerance = ")
        .nth(1)
        .unwrap_or_else(|| panic!("{}", ran.stderr));
    let entry = entry.split_whitespace().next().unwrap().trim_end_matches(',');
    let golden = format!("[network]\ngolden = \"of_log.safetensors\"\ngolden_tolerance = {entry}\n");
    desk.edit("adder/policy.toml", "[network]\n", &golden);
    desk.succeed("inspect adder");
}
