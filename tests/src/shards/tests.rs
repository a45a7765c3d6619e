use std::cell::Cell;
use std::collections::BTreeSet;

use super::*;

fn plan(shard: u64, count: u64) -> Plan {
    Plan {
        first: 1000,
        policies: 30,
        steps: 5,
        shard: Shard::new(shard, count).unwrap(),
        family: Family::One,
    }
}

/// A result without compilers.
fn quick(seed: u64, steps: u64) -> Row {
    Row {
        seed,
        format: FORMATS[(seed % 5) as usize].name().into(),
        compiler: COMPILERS[(seed % 3) as usize].into(),
        builds: 3,
        checksum: format!("{:08x}", seed * steps),
        outcome: "equal".into(),
    }
}

fn merged(folder: &Path) -> String {
    merge(folder).unwrap();
    std::fs::read_to_string(folder.join(MERGED)).unwrap()
}

#[test]
fn fifteen_seeds_in_a_row_meet_every_format_with_every_compiler() {
    let pairs: BTreeSet<(u64, u64)> = (1000..1015).map(|seed| (seed % 5, seed % 3)).collect();
    assert_eq!(pairs.len(), FORMATS.len() * COMPILERS.len());
}

#[test]
fn shards_in_any_order_merge_to_the_bytes_of_one_run() {
    let (one, three) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    run(plan(1, 1), one.path(), quick, |_| {}).unwrap();
    for shard in [3, 1, 2] {
        run(plan(shard, 3), three.path(), quick, |_| {}).unwrap();
    }
    assert_eq!(merged(one.path()), merged(three.path()));
    assert_eq!(merge(three.path()).unwrap().len(), 30);
}

#[test]
fn a_killed_run_goes_on_behind_its_last_whole_line() {
    let (whole, killed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    run(plan(1, 1), whole.path(), quick, |_| {}).unwrap();
    let text = std::fs::read_to_string(Shard::WHOLE.file(whole.path())).unwrap();
    for length in (0..text.len()).step_by(7) {
        std::fs::write(Shard::WHOLE.file(killed.path()), &text[..length]).unwrap();
        let compared = Cell::new(0);
        let count = |seed, steps| {
            compared.set(compared.get() + 1);
            quick(seed, steps)
        };
        run(plan(1, 1), killed.path(), count, |_| {}).unwrap();
        let whole_lines = text[..length].matches('\n').count().saturating_sub(2);
        assert_eq!(compared.get(), 30 - whole_lines, "killed after {length} bytes");
        assert_eq!(merged(killed.path()), merged(whole.path()));
    }
}

#[test]
fn more_policies_go_on_in_the_same_file_and_other_steps_do_not() {
    let folder = tempfile::tempdir().unwrap();
    run(plan(1, 2), folder.path(), quick, |_| {}).unwrap();
    let more = Plan {
        policies: 40,
        ..plan(1, 2)
    };
    assert_eq!(run(more, folder.path(), quick, |_| {}).unwrap().len(), 20);
    let other = Plan { steps: 6, ..plan(1, 2) };
    let message = run(other, folder.path(), quick, |_| {}).unwrap_err().to_string();
    assert!(message.contains("of another run"), "{message}");
}

#[test]
fn results_that_disagree_are_not_merged() {
    let folder = tempfile::tempdir().unwrap();
    run(plan(1, 1), folder.path(), quick, |_| {}).unwrap();
    let other = |seed, _| quick(seed, 99);
    run(plan(1, 2), folder.path(), other, |_| {}).unwrap();
    let message = merge(folder.path()).unwrap_err().to_string();
    assert!(message.contains("two results of 1000"), "{message}");
}

#[test]
fn a_policy_that_is_not_equal_is_counted() {
    let rows: Vec<Row> = (1000..1030)
        .map(|seed| match seed {
            1007 => Row {
                outcome: "gcc -O2 differs at step 3 in duty".into(),
                ..quick(seed, 1)
            },
            _ => quick(seed, 1),
        })
        .collect();
    assert!(table(&rows).ends_with("| all | | 30 | 90 | 1 |\n"), "{}", table(&rows));
    assert!(!rows[7].is_equal());
}

#[test]
fn a_policy_is_compared_with_its_turns_compiler() {
    let row = compare(Family::One, 1002, 20);
    assert_eq!((row.compiler.as_str(), row.format.as_str()), ("gcc", "f32-fma"));
    assert!(row.is_equal() && row.builds >= 3, "{row}");
}
