//! `policyc replay`: which column of a log is what.

use super::replay::{desk, environment, table};

/// As arrays are written: an index in brackets is no unit, `ep` is the episode, and a column that may be the choice is asked for.
#[test]
fn replay_reads_the_names_that_an_array_gives() {
    let own = table(&environment()).replacen("episode", "ep", 1);
    let own = (0..6).fold(own, |text, n| {
        text.replacen(&format!("obs_{n}"), &format!("obs[{n}]"), 1)
    });
    let lines = own.lines().enumerate();
    let with: Vec<String> = lines
        .map(|(n, line)| format!("{line},{}", if n == 0 { "a" } else { "0" }))
        .collect();
    let desk = desk(&environment());
    desk.write("log.csv", &(with.join("\n") + "\n"));
    let ran = desk.type_in("replay buck12 log.csv");
    assert!(
        ran.code == Some(0) && ran.stdout.contains("equal: all 6 features") && ran.stdout.contains("2 episodes"),
        "{}",
        ran.stdout
    );
    assert!(ran.stderr.contains("--map action=a"), "{}", ran.stderr);
}

#[test]
fn a_column_that_looks_like_a_duty_is_proposed_and_compared() {
    let desk = desk(&environment());
    let log = desk.read("log.csv");
    let mut lines = log.lines();
    let header = format!("{},action,duty_before", lines.next().unwrap());
    let rows = lines.map(|line| format!("{line},0,0.5"));
    let text: Vec<String> = [header].into_iter().chain(rows).collect();
    desk.write("log.csv", &(text.join("\n") + "\n"));
    let ran = desk.type_in("replay buck12 log.csv --exploring");
    assert!(ran.stderr.contains("--map previous_duty=duty_before"), "{}", ran.stderr);
    // action 0 commands .44
    let ran = desk.type_in("replay buck12 log.csv --exploring --map previous_duty=duty_before");
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    assert!(ran.stdout.contains("duties"), "{}", ran.stdout);
}

/// A signal's column in the place of an observation is right only for a feature that does nothing, and may be a slip of the map.
#[test]
fn a_map_that_reads_a_column_twice_is_told() {
    let desk = desk(&environment());
    let ran = desk.type_in("replay buck12 log.csv --map obs_0=v_out,v_out=v_out");
    assert_eq!(ran.code, Some(1), "{}", ran.stdout);
    let note = "signal `v_out` are both read from `v_out`: so the network is taken to have seen the signal as it is";
    assert!(ran.stderr.contains(note), "{}", ran.stderr);
    let ran = desk.type_in("replay buck12 log.csv");
    assert!(!ran.stderr.contains("both read"), "{}", ran.stderr);
}
