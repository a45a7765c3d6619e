//! Several outputs from one network: generated code against the interpreter, every duty of every step.

use policy::{Head, NumericFormat, Policy};

use super::{COMPILERS, assert_equal, run};

fn load(seed: u64) -> (tests::random::Folder, Policy) {
    let folder = tests::random::several::policy(seed).unwrap();
    let policy = policy::load_with(&folder.path(), &tests::random::several::options());
    let policy = policy.unwrap_or_else(|faults| panic!("{}\n{faults}", folder.contract));
    (folder, policy)
}

#[test]
fn random_policies_with_several_outputs_are_equal_in_every_format() {
    let count = if tests::full() { 60 } else { 6 };
    for seed in 0..count {
        let (folder, policy) = load(seed);
        for (at, format) in NumericFormat::ALL.into_iter().enumerate() {
            let compiler = COMPILERS[(seed as usize + at) % 3];
            let report = run(&policy.clone().with_format(format), 1000, seed, &[compiler]);
            assert_equal(&report, &format!("{} {compiler}\n{}", format.name(), folder.contract));
        }
    }
}

#[test]
fn random_policies_with_several_outputs_reach_heads_limiters_observers_and_two_to_four_outputs() {
    let policies: Vec<Policy> = (0..60).map(|seed| load(seed).1).collect();
    let outputs = |policy: &Policy| match &policy.head {
        Head::Several(outputs) => outputs.clone(),
        other => panic!("{other:?}"),
    };
    for count in 2..=4 {
        assert!(policies.iter().any(|policy| outputs(policy).len() == count), "{count}");
    }
    let all: Vec<_> = policies.iter().flat_map(outputs).collect();
    assert!(all.iter().any(|output| output.head.continuous().is_some()));
    assert!(all.iter().any(|output| output.head.is_choice()));
    assert!(all.iter().any(|output| output.limits.slew.is_some()));
    assert!(all.iter().any(|output| output.limits.soft_start.is_some()));
    assert!(all.iter().any(|output| output.mapping.is_some()) && all.iter().any(|output| output.mapping.is_none()));
    let mixed = |policy: &&Policy| {
        let own = outputs(policy);
        own.iter().any(|output| output.head.is_choice()) && own.iter().any(|output| !output.head.is_choice())
    };
    assert!(policies.iter().filter(mixed).count() > 10);
    let observers: Vec<_> = policies.iter().flat_map(|policy| policy.observers.clone()).collect();
    for (output, delay) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)] {
        let is_drawn = |own: &policy::Observer| (own.output, own.compute_delay) == (output, delay);
        assert!(observers.iter().any(is_drawn), "output {output}, delay {delay}");
    }
}

/// Whether gcc makes of these files what the policy says.
fn is_equal(policy: &Policy, files: &verify::Files) -> bool {
    let options = verify::Options {
        steps: 2000,
        generated: Some(files),
        compilers: vec!["gcc".to_owned()],
        ..verify::Options::default()
    };
    verify::run(policy, options).unwrap().equal()
}

/// Each of these would be silently wrong in a duty that is not the first.
#[test]
fn planted_defects_in_the_second_output_are_caught() {
    let (_folder, policy) = (0..60)
        .map(load)
        .find(|(_, policy)| {
            let paths = policy.paths();
            paths[1].head.is_choice() && paths[1].limits.slew.is_some()
        })
        .expect("a policy whose second output is a choice with a slew limit");
    let host = targets::find("host").unwrap();
    let clean = codegen::sources(&policy, host, &[codegen::Output::C], None)
        .unwrap()
        .files;
    let source = format!("{}.c", policy.name);
    let column = policy.paths()[1].column;
    let edits = [
        // another column of the last layer
        (
            format!("_greedy(&outputs[{column}],"),
            format!("_greedy(&outputs[{}],", column - 1),
        ),
        // remembered in the place of another output
        ("command->duty[1];".to_owned(), "command->duty[0];".to_owned()),
        // the slew limit around another output's command
        (
            "= command->duty_sim[1];".to_owned(),
            "= command->duty_sim[0];".to_owned(),
        ),
    ];
    for (from, to) in edits {
        let text = &clean[&source];
        assert!(text.contains(&from), "{from}\n{text}");
        let mut files = clean.clone();
        files.insert(source.clone(), text.replacen(&from, &to, 1));
        assert!(!is_equal(&policy, &files), "{from} -> {to} was not seen");
    }
}

/// The estimates of a leg that another leg drives would look right as long as both command the same.
#[test]
fn an_observer_that_another_output_drives_is_caught() {
    let (_folder, policy) = (0..60)
        .map(load)
        .find(|(_, policy)| policy.observers.first().is_some_and(|observer| observer.output == 1))
        .expect("a policy whose first observer is driven by the second output");
    let host = targets::find("host").unwrap();
    let mut files = codegen::sources(&policy, host, &[codegen::Output::C], None)
        .unwrap()
        .files;
    let names = policy.output_names();
    let [own, other] = [names[1], names[0]].map(|name| format!("state->previous_command_{name}"));
    let text = files.get_mut(&format!("{}.c", policy.name)).unwrap();
    // observers stand before the features: the first value that is made of the command is theirs
    let line = text
        .lines()
        .find(|line| line.starts_with("    const") && line.contains(&own));
    let line = line.unwrap_or_else(|| panic!("{own}\n{text}")).to_owned();
    *text = text.replacen(&line, &line.replace(&own, &other), 1);
    assert!(!is_equal(&policy, &files), "{line}");
}
