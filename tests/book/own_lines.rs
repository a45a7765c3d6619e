//! How much a user writes on the way from an archive to verified code: counted, because the page says a number.

use tests::tools::{policyc, run};

/// The most that the way may cost: 55 lines were needed by hand.
const MOST: usize = 10;

/// Lines of TOML without comments, blanks and what is only layout.
fn code(text: &str) -> Vec<String> {
    let lines = text
        .lines()
        .map(|line| line.split('#').next().unwrap_or_default().trim());
    lines.filter(|line| !line.is_empty()).map(str::to_owned).collect()
}

/// The contract that `new` writes for an archive of the repository.
fn draft(model: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let archive = tests::root().join("tests/fixtures/trainers").join(model);
    let mut command = std::process::Command::new(policyc());
    command.current_dir(folder.path()).arg("new").arg(archive);
    let ran = run(&mut command);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    std::fs::read_to_string(folder.path().join("policy.toml")).unwrap()
}

#[test]
fn the_way_from_an_archive_to_code_takes_ten_lines_of_own_writing() {
    let page = std::fs::read_to_string(tests::root().join("docs/how-to/from-sb3.md")).unwrap();
    let files: Vec<&str> = page.split("```toml,file=").skip(1).collect();
    let [file] = files.as_slice() else {
        panic!("{} files on the page", files.len());
    };
    let (_, text) = file.split_once('\n').unwrap();
    let contract = code(text.split("```").next().unwrap());
    let draft = code(&draft("sb3_dqn.zip"));
    // what is not as `new` wrote it was written by hand
    let own: Vec<&String> = contract.iter().filter(|line| !draft.contains(line)).collect();
    assert_eq!(own.len(), MOST, "{own:#?}");
    assert!(page.contains("Ten lines are yours"), "the page says another number");
    // and nothing else is: no Python, no line of the draft that was left out
    assert!(!page.contains("```python"));
    let open = |line: &&String| !line.contains("\"TODO\"");
    let lost: Vec<&String> = draft
        .iter()
        .filter(open)
        .filter(|line| !contract.contains(line))
        .collect();
    assert!(lost.is_empty(), "{lost:#?}");
}

/// Each line that says TODO is one that the user writes; there is one more for each further sensor.
#[test]
fn what_an_archive_knows_is_never_asked_for() {
    for (model, features, others) in [
        ("sb3_dqn.zip", 6, &["sample_period", "{ name", "duties"][..]),
        ("sb3_sac_duty.zip", 6, &["sample_period", "{ name"]),
    ] {
        let draft = code(&draft(model));
        let open: Vec<&String> = draft.iter().filter(|line| line.contains("\"TODO\"")).collect();
        let sources = open.iter().filter(|line| line.contains("source = \"TODO\"")).count();
        assert_eq!(sources, features, "{model}: {open:#?}");
        let rest: Vec<_> = open.iter().filter(|line| !line.contains("source")).collect();
        assert_eq!(rest.len(), others.len(), "{model}: {rest:#?}");
        assert!(
            rest.iter().zip(others).all(|(line, begin)| line.starts_with(begin)),
            "{model}: {rest:#?}"
        );
    }
}

#[test]
fn the_way_from_a_plant_file_to_minus_five_volts_takes_nine_lines_of_own_writing() {
    let page = std::fs::read_to_string(tests::root().join("docs/tutorials/own-converter.md")).unwrap();
    let (_, text) = page.split_once("```toml,file=inverting.toml\n").unwrap();
    let lines = code(text.split("```").next().unwrap());
    let own: Vec<&String> = lines.iter().filter(|line| !line.starts_with('[')).collect();
    assert_eq!(own.len(), 9, "{own:#?}");
    assert!(page.contains("Nine lines are yours"), "the page says another number");
    let example = std::fs::read_to_string(tests::root().join("examples/plants/buck-boost-12-5.toml")).unwrap();
    assert_eq!(lines, code(&example), "the example is the page's converter");
}
