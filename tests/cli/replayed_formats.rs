//! Logs against a contract in integers, and logs that are kept as golden answers.

use super::Desk;
use super::replay::{desk, environment, table};

/// The environment's log with the actions of the contract in f32, by the interpreter.
fn log_with_actions(desk: &Desk) -> String {
    use interp::{Controller, Sample};
    let policy = policy::load(&desk.path("buck12/policy.toml")).unwrap();
    let mut controller = Controller::<f32>::new(&policy);
    let rows = environment();
    let text = table(&rows);
    let mut lines = text.lines();
    let mut log = format!("{},action\n", lines.next().unwrap());
    let mut episode = rows[0].episode;
    for (row, line) in rows.iter().zip(lines) {
        if row.episode != episode {
            controller.reset();
            episode = row.episode;
        }
        // the digits of the log, not those behind them
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        let samples: Vec<Sample> = cells[1..4].iter().map(|x| Sample::Wide(*x)).collect();
        let trace = controller.eval(&samples).unwrap();
        log += &format!("{line},{}\n", trace.decision(0).action_index);
        controller.commit_trace(&trace);
    }
    log
}

#[test]
fn replay_in_integers_counts_what_the_format_changes_apart_from_a_wrong_contract() {
    let desk = desk(&environment());
    desk.write("log.csv", &log_with_actions(&desk));
    let said = desk.succeed("replay buck12 log.csv");
    assert!(said.contains("action equal in 120 of 120"), "{said}");
    // what a format changes is said where it is little, too
    let wide = desk.type_in("replay buck12 log.csv --format i16").stdout;
    assert!(wide.contains("decisions in i16: "), "{wide}");
    let refused = desk.type_in("replay buck12 log.csv --format i8");
    assert_eq!(refused.code, Some(1), "{}", refused.stdout);
    for words in [
        "decisions in i8: DIFFERENT: ",
        " of 120 changed (",
        "most in row (from 0) ",
        "equal in f32, but i8 changes more than is allowed; to accept it, golden_decisions = ",
    ] {
        assert!(refused.stdout.contains(words), "{words}: {}", refused.stdout);
    }
    assert!(!refused.stdout.contains("the order of [actions]"), "{}", refused.stdout);
    desk.edit(
        "buck12/policy.toml",
        "golden = \"golden.safetensors\"",
        "golden = \"golden.safetensors\"\ngolden_decisions = 0.99",
    );
    let accepted = desk.succeed("replay buck12 log.csv --format i8");
    assert!(
        accepted.contains("equal in f32, and i8 changes no more than is allowed"),
        "{accepted}"
    );
}

#[test]
fn observations_under_another_name_are_proposed_and_fewer_columns_are_not() {
    let desk = desk(&environment());
    let log = log_with_actions(&desk);
    desk.write("log.csv", &log.replace("obs_", "x"));
    let said = desk.type_in("replay buck12 log.csv");
    let map = "obs_0=x0,obs_1=x1,obs_2=x2,obs_3=x3,obs_4=x4,obs_5=x5";
    assert!(
        said.stderr
            .contains(&format!("if they are its observations: --map {map}")),
        "{}",
        said.stderr
    );
    let mapped = desk.succeed(&format!("replay buck12 log.csv --map {map}"));
    assert!(mapped.contains("equal: all 6 features"), "{mapped}");
    desk.write("log.csv", &log.replace("obs_", "x").replace("x5", "other"));
    let said = desk.type_in("replay buck12 log.csv");
    assert!(!said.stderr.contains("its observations"), "{}", said.stderr);
}

#[test]
fn a_log_becomes_golden_answers_that_judge_a_format() {
    let desk = desk(&environment());
    desk.write("log.csv", &log_with_actions(&desk));
    desk.succeed("replay buck12 log.csv --golden buck12/of_log.safetensors");
    desk.edit("buck12/policy.toml", "golden.safetensors", "of_log.safetensors");
    let said = desk.succeed("inspect buck12");
    assert!(said.contains("decisions in f32: 0 of 120 changed"), "{said}");
    let replayed = desk.type_in("replay buck12 log.csv --format i8").stdout;
    let inspected = desk.type_in("inspect buck12 --format i8").stdout;
    let line = |text: &str| {
        let line = text
            .lines()
            .find(|line| line.contains("decisions in i8"))
            .unwrap()
            .trim();
        line.trim_start_matches("decisions ").to_owned()
    };
    assert!(
        inspected.contains(line(&replayed).trim_start_matches("in i8: ")),
        "{inspected} {replayed}"
    );
    // answers without Q values tell the activation, too, where they are many
    desk.edit("buck12/policy.toml", "\"relu\"", "\"tanh\"");
    let misread = desk.type_in("inspect buck12");
    let hint = "with hidden_activation = \"relu\" the same weights give all 120 golden answers";
    assert!(misread.stderr.contains(hint), "{}", misread.stderr);
    desk.edit("buck12/policy.toml", "\"tanh\"", "\"relu\"");
    let again = desk.type_in("replay buck12 log.csv --golden buck12/of_log.safetensors");
    assert!(
        again.code == Some(2) && again.stderr.contains("another name with --golden"),
        "{}",
        again.stderr
    );
    // explored actions are none of the network's, and skipped rows were compared with nothing
    for unjudged in ["--exploring", "--skip 1"] {
        let refused = desk.type_in(&format!("replay buck12 log.csv --golden new.safetensors {unjudged}"));
        assert_eq!(refused.code, Some(2), "{}", refused.stderr);
        assert!(!desk.path("new.safetensors").exists());
    }
}
