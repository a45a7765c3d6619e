//! `policyc replay`: an index says nothing of the duty that it commands, so logged duties are held against the contract's.

use super::Desk;

/// The case `activations`: its second feature is the previous duty, its duties are .4, .5 and .6.
const DUTIES: [f64; 3] = [0.4, 0.5, 0.6];
const ROWS: usize = 30;

fn action(row: usize) -> usize {
    (row * row + row / 5) % 3
}

/// A log of two episodes with these duties for the actions; `duty` writes the cells behind the action of a row.
fn log(head: &str, cells: impl Fn(usize) -> String) -> String {
    let mut text = format!("episode,v_out,action{head}\n");
    for row in 0..ROWS {
        let v_out = 12.0 + (row as f64 * 0.7).sin();
        text += &format!("{},{v_out:.5},{}{}\n", row / 15, action(row), cells(row));
    }
    text
}

fn said(text: &str, line: &str) -> (Option<i32>, String) {
    let desk = Desk::new("activations");
    desk.write("log.csv", text);
    let ran = desk.type_in(line);
    (ran.code, ran.stdout)
}

const REPLAY: &str = "replay policy log.csv --exploring";

#[test]
fn duties_of_the_contract_are_equal_and_others_are_told_with_those_that_fit() {
    let with = |duties: [f64; 3]| log(",duty", move |row| format!(",{}", duties[action(row)]));
    let (code, text) = said(&with(DUTIES), REPLAY);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("to the last digit"), "{text}");
    // in all rows of an action alike, a thousandth is another duty and no rounding
    let (code, text) = said(&with([0.4004, 0.4996, 0.6]), REPLAY);
    assert_eq!(code, Some(1), "{text}");
    assert!(
        text.contains("duties = [0.4004, 0.4996, 0.6] in [actions] fits the log"),
        "{text}"
    );
    let (code, text) = said(&with([0.6, 0.5, 0.4]), REPLAY);
    assert_eq!(code, Some(1), "{text}");
    for part in [
        "action 0 commands 0.4 in the contract and 0.6 in the log",
        "duties = [0.6, 0.5, 0.4] in [actions] fits the log",
        "the actions of the log have other duties",
    ] {
        assert!(text.contains(part), "{part}\n{text}");
    }
    let (code, text) = said(&with([0.44, 0.55, 0.66]), REPLAY);
    assert_eq!(code, Some(1), "another span\n{text}");
    // a log without one of the actions cannot say all of them
    let some = log(",duty", |row| format!(",{}", [0.6, 0.5, 0.4][action(row)]));
    let some: String = some
        .lines()
        .filter(|line| !line.contains(",1,"))
        .map(|line| format!("{line}\n"))
        .collect();
    let (code, text) = said(&some, REPLAY);
    assert!(code == Some(1) && text.contains("look at their order"), "{text}");
}

#[test]
fn a_duty_before_a_row_is_that_of_the_row_before() {
    let before = |row: usize, duties: [f64; 3]| match row % 15 {
        0 => 0.5,
        _ => duties[action(row - 1)],
    };
    let with = |duties: [f64; 3]| log(",previous_duty", move |row| format!(",{}", before(row, duties)));
    let (code, text) = said(&with(DUTIES), REPLAY);
    assert_eq!(code, Some(0), "{text}");
    let (code, text) = said(&with([0.6, 0.5, 0.4]), REPLAY);
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("by previous_duty, are others"), "{text}");
    // the feature that is the previous duty says it, too; its scale and offset may be what is wrong
    let with = |duties: [f64; 3]| log(",obs_d", move |row| format!(",{}", before(row, duties)));
    let (code, text) = said(&with([0.6, 0.5, 0.4]), &format!("{REPLAY} --skip 1"));
    assert_eq!(code, Some(1), "{text}");
    assert!(
        text.contains("duties = [0.6, 0.5, 0.4] in [actions] fits the log, if scale and offset of d are right"),
        "{text}"
    );
}

/// Duties that are worked out from a column which came late are others for that reason alone.
#[test]
fn a_duty_before_that_was_logged_late_does_not_accuse_the_duties() {
    let before = |row: usize| match row % 15 {
        0 => 0.5,
        _ => DUTIES[action(row - 1)],
    };
    let late = |row: usize| before(if row.is_multiple_of(15) { row } else { row - 1 });
    for name in ["obs_d", "previous_duty"] {
        // beside the column that shows it, the feature in its own right
        let head = format!(",{name}{}", if name == "obs_d" { "" } else { ",obs_d" });
        let text = log(&head, |row| match name {
            "obs_d" => format!(",{}", late(row)),
            _ => format!(",{},{}", late(row), before(row)),
        });
        let (code, text) = said(&text, &format!("{REPLAY} --skip 1"));
        assert_eq!(code, Some(1), "{text}");
        let column = if name == "obs_d" { "d" } else { name };
        assert!(text.contains(&format!("{column}: logged one row late")), "{text}");
        assert!(!text.contains("are others"), "{text}");
    }
}

#[test]
fn first_rows_of_episodes_can_be_left_out() {
    // the environment begins with another duty than the contract, which begins with the fallback's 0
    let before = |row: usize| match row % 15 {
        0 => 0.5,
        _ => DUTIES[action(row - 1)],
    };
    let text = log(",obs_d", |row| format!(",{}", before(row)));
    let (code, told) = said(&text, REPLAY);
    assert!(
        code == Some(1) && told.contains("only in the first row of an episode"),
        "{told}"
    );
    let (code, told) = said(&text, &format!("{REPLAY} --skip 1"));
    assert_eq!(code, Some(0), "{told}");
    assert!(told.contains("2 rows of them left out"), "{told}");
    // a column of the duty before hides nothing of it
    let text = log(",previous_duty,obs_d", |row| format!(",{0},{0}", before(row)));
    let (code, told) = said(&text, REPLAY);
    assert!(code == Some(1) && told.contains("look at initial_duty"), "{told}");
    let (code, told) = said(&text, &format!("{REPLAY} --skip 1"));
    assert_eq!(code, Some(0), "{told}");
}

#[test]
fn actions_that_differ_without_observations_are_no_equal_observations() {
    let (code, text) = said(&log("", |_| String::new()), "replay policy log.csv");
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("has no observations, which would say why"), "{text}");
    assert!(!text.contains("the observations are equal"), "{text}");
}

/// Increments of the duty: the law is the duty before.
#[test]
fn what_an_action_adds_is_held_against_the_log() {
    /// Cells of a row from the duty before and behind it.
    type Cells = fn((f64, f64)) -> String;
    let desk = Desk::new("activations");
    let law = "base = \"previous_duty\"\noffsets = [-0.02, 0.0, 0.02]";
    desk.edit("policy/policy.toml", "duties = [0.4, 0.5, 0.6]", law);
    desk.edit("policy/policy.toml", "duty = 0.0\nhold", "duty = 0.5\nhold");
    // duty before and behind each row
    let duties = |adds: [f64; 3]| {
        let mut duty = 0.5;
        let of = |row: usize| {
            let before = if row.is_multiple_of(15) { 0.5 } else { duty };
            duty = before + adds[action(row)];
            (before, duty)
        };
        (0..ROWS).map(of).collect::<Vec<_>>()
    };
    let said = |text: &str| {
        desk.write("log.csv", text);
        let ran = desk.type_in(REPLAY);
        (ran.code, ran.stdout)
    };
    let forms: [(&str, Cells); 4] = [
        (",duty", |pair| format!(",{:.6}", pair.1)),
        (",previous_duty", |pair| format!(",{:.6}", pair.0)),
        (",obs_d", |pair| format!(",{:.6}", pair.0)),
        (",obs_d,duty", |pair| format!(",{:.6},{:.6}", pair.0, pair.1)),
    ];
    for (head, cells) in forms {
        let with = |adds: [f64; 3]| {
            let list = duties(adds);
            log(head, |row| cells(list[row]))
        };
        let (code, text) = said(&with([-0.02, 0.0, 0.02]));
        assert_eq!(code, Some(0), "{head}\n{text}");
        for (adds, told) in [
            (
                [0.02, 0.0, -0.02],
                "action 0 adds -0.02 in the contract and 0.02 in the log",
            ),
            (
                [-0.03, 0.0, 0.03],
                "offsets = [-0.03, 0, 0.03] in [actions] fits the log",
            ),
        ] {
            let (code, text) = said(&with(adds));
            assert_eq!(code, Some(1), "{head}\n{text}");
            assert!(text.contains(told), "{head}\n{text}");
            // a scale of the feature would turn the controller round, and everything else would be equal
            assert!(!text.contains("scale = "), "{head}\n{text}");
        }
    }
    let (code, text) = said(&log(",duty", |_| ",0.3".to_owned()));
    assert_eq!(code, Some(1), "{text}");
    // three digits are enough for these offsets, and two of them tell nothing of offsets of a hundredth
    let rounded = |digits: usize, adds: [f64; 3]| {
        let list = duties(adds);
        said(&log(",duty", |row| format!(",{:.digits$}", list[row].1)))
    };
    let (code, text) = rounded(3, [-0.0203, 0.0, 0.0203]);
    assert_eq!(code, Some(0), "{text}");
    // six show what three hide: a little more in every row of the action
    let (code, text) = rounded(6, [-0.02, 0.0, 0.0203]);
    assert!(
        code == Some(1) && text.contains("action 2 adds 0.02 in the contract and 0.0203"),
        "{text}"
    );
    // one row of another duty is one row, whatever the others of its action have
    let list = duties([-0.02, 0.0, 0.02]);
    let (code, text) = said(&log(",duty", |row| {
        let slip = if row == 14 { 0.007 } else { 0.0 };
        format!(",{:.6}", list[row].1 + slip)
    }));
    assert!(
        code == Some(1) && text.contains("others in 1 of 30 rows, first in line 16"),
        "{text}"
    );
    desk.edit("policy/policy.toml", "[-0.02, 0.0, 0.02]", "[-0.008, 0.0, 0.008]");
    let (code, text) = rounded(2, [-0.008, 0.0, 0.008]);
    assert!(code == Some(0) && !text.contains("are others"), "{text}");
    let (code, text) = rounded(6, [0.008, 0.0, -0.008]);
    assert_eq!(code, Some(1), "{text}");
}

/// A log of duties alone says as much as one of indices: the same choices are equal and others, and a duty that the contract does not have
/// is told with the action that comes nearest.
#[test]
fn a_duty_without_an_action_says_what_was_chosen() {
    let duties: Vec<f64> = policy::load(&tests::example())
        .unwrap()
        .actions()
        .iter()
        .map(|action| action.duty)
        .collect();
    let chosen = |line: usize| (line * line + line / 7) % duties.len();
    let desk = super::replay::desk(&super::replay::environment());
    let plain = super::replay::table(&super::replay::environment());
    let with = |name: &str, cell: &dyn Fn(usize) -> String| -> String {
        let lines = plain.lines().enumerate().map(|(line, text)| match line {
            0 => format!("{text},{name}\n"),
            line => format!("{text},{}\n", cell(line)),
        });
        lines.collect()
    };
    let counted = |text: &str| {
        desk.write("log.csv", text);
        let ran = desk.type_in("replay buck12 log.csv");
        let mut lines = ran.stdout.lines();
        let counts = lines
            .find(|line| line.trim_start().starts_with("action"))
            .map(str::to_owned);
        (ran.code, counts, ran.stdout + &ran.stderr)
    };
    let (code, by_index, text) = counted(&with("action", &|line| chosen(line).to_string()));
    assert!(code == Some(1) && by_index.is_some(), "{text}");
    let (code, by_duty, text) = counted(&with("duty", &|line| format!("{:.4}", duties[chosen(line)])));
    assert_eq!((code, by_duty), (Some(1), by_index), "{text}");
    assert!(text.contains("comes nearest to `duty`"), "{text}");
    let (_, _, text) = counted(&with("duty", &|line| {
        format!(
            "{:.4}",
            duties[chosen(line)] + if chosen(line) == 3 { 0.012 } else { 0.0 }
        )
    }));
    assert!(text.contains("action 3 commands"), "{text}");
    // behind a mapping there are as many duties as rows
    let (code, _, text) = counted(&with("duty", &|line| format!("{:.4}", 0.35 + 1e-3 * line as f64)));
    assert!(
        code == Some(0) && text.contains("does not say which action was chosen"),
        "{text}"
    );
    let refused = desk.type_in("replay buck12 log.csv --golden golden.safetensors");
    assert!(
        refused.code == Some(2) && refused.stderr.contains("the index of the choice"),
        "{}",
        refused.stderr
    );
}
