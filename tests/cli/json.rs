//! `--json` of the commands that write folders: one object on standard output, with the numbers of the files and of the text.

use serde_json::Value;
use tests::tools::copy_folder;

use super::Desk;

/// What a command prints with `--json`; everything else it says stands on standard error.
fn answer(desk: &Desk, line: &str) -> Value {
    parsed(&desk.succeed(&format!("{line} --json")))
}

fn parsed(text: &str) -> Value {
    let answer: Value = serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert!(answer.is_object(), "{text}");
    answer
}

/// Every key of `file` with the value that `answer` has.
#[track_caller]
fn holds(answer: &Value, file: &str) {
    let file: Value = serde_json::from_str(file).unwrap();
    for (key, value) in file.as_object().unwrap() {
        assert_eq!(&answer[key], value, "{key}");
    }
}

/// The listed files of a folder, which must be there.
fn files(desk: &Desk, answer: &Value) -> Vec<String> {
    let out = answer["out"].as_str().unwrap();
    let names: Vec<String> = answer["files"]
        .as_array()
        .unwrap()
        .iter()
        .map(|file| file["path"].as_str().or(file.as_str()).unwrap().to_owned())
        .collect();
    for name in &names {
        assert!(desk.path(out).join(name).is_file(), "{name}");
    }
    names
}

#[test]
fn compile_prints_sizes_costs_files_and_notes_as_they_stand_in_manifest_and_text() {
    let desk = Desk::new("linear");
    let line = "compile policy --emit c,fmu2 --target host --out";
    let ran = desk.type_in(&format!("{line} out --json"));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let answer = parsed(&ran.stdout);
    let manifest: Value = serde_json::from_str(&desk.read("out/manifest.json")).unwrap();
    for key in ["name", "target", "numeric_format", "sample_period", "sizes"] {
        assert_eq!(answer[key], manifest[key], "{key}");
    }
    let costs = manifest.get("costs").cloned().unwrap_or(Value::Array(Vec::new()));
    assert_eq!(answer["costs"], costs);
    let written = files(&desk, &answer);
    assert!(written.contains(&"linear_fmi2.fmu".to_owned()), "{written:?}");
    for file in answer["files"].as_array().unwrap() {
        let path = desk.path("out").join(file["path"].as_str().unwrap());
        assert_eq!(file["bytes"], std::fs::metadata(path).unwrap().len());
    }
    assert_eq!(answer["archives"][0]["path"], "linear_fmi2.fmu");
    assert_eq!(
        answer["archives"][0]["platform"].is_null(),
        answer["archives"][0]["missing"].is_string()
    );
    let text = desk.succeed(&format!("{line} plain"));
    let macs = answer["sizes"]["macs"].as_u64().unwrap();
    assert!(text.contains(&format!("linear: {macs} MACs")), "{text}");
    for note in answer["notes"].as_array().unwrap() {
        let note = format!("note: {}", note.as_str().unwrap());
        assert!(text.contains(&note) && ran.stderr.contains(&note), "{note}");
    }
    assert!(ran.stderr.contains("note: "), "this policy has some");
}

#[test]
fn compile_prints_the_budget_of_a_clock() {
    let desk = Desk::new("minimal");
    let line = "compile policy --target cortex-m4f --clock 168MHz --out";
    let answer = answer(&desk, &format!("{line} out"));
    let text = desk.succeed(&format!("{line} plain"));
    let budget = answer["budget"].as_array().unwrap();
    assert!(!budget.is_empty());
    for said in budget {
        assert!(text.contains(said.as_str().unwrap()), "{said}\n{text}");
    }
}

#[test]
fn certify_prints_the_certificate() {
    let desk = Desk::new("minimal");
    let line = "certify policy --format i16 --samples 20 --boxes 20 --out";
    let answer = answer(&desk, &format!("{line} out"));
    holds(&answer, &desk.read("out/certificate.json"));
    assert_eq!(
        files(&desk, &answer),
        ["certificate.html", "certificate.json", "map.svg"]
    );
    let text = desk.succeed(&format!("{line} plain"));
    let name = answer["name"].as_str().unwrap();
    assert!(text.contains(&format!("{name} in i16")), "{text}");
}

#[test]
fn simulate_prints_the_metrics_of_its_file() {
    let desk = super::simulate::desk();
    let line = "simulate s.toml --policy policy --out";
    let answer = answer(&desk, &format!("{line} out"));
    holds(&answer, &desk.read("out/metrics.json"));
    assert!(files(&desk, &answer).contains(&"report.html".to_owned()));
    // V, with two decimals in the table
    let policy = &answer["load_steps"][0]["controllers"]["policy"];
    let deviation = policy["worst"]["deviation"].as_f64().unwrap();
    let text = desk.succeed(&format!("{line} plain"));
    assert!(text.contains(&format!("{deviation:.2}")), "{deviation}\n{text}");
}

#[test]
fn a_check_that_fails_no_run_is_in_the_answer_of_simulate() {
    let desk = super::simulate::desk();
    let answer = answer(&desk, "simulate s.toml --policy policy --out out --check");
    assert_eq!(answer["check"]["equal"], true);
}

#[test]
fn train_prints_its_seeds_and_the_evaluation_of_the_best() {
    let desk = super::training::desk();
    let answer = answer(&desk, "train train/train.toml --out out");
    let table = desk.read("out/seeds.txt");
    let seeds = answer["seeds"].as_array().unwrap();
    assert_eq!(seeds.len(), 2);
    for (seed, row) in seeds.iter().zip(table.lines().skip(1)) {
        let kept = &seed["kept"];
        let number = |value: &Value| value.as_f64().unwrap();
        let worst = &kept["worst"];
        // the columns of the table: seed, periods, kept after, selection, evaluation, V, ms, V, cost
        let expected = [
            seed["seed"].to_string(),
            "1,200".to_owned(),
            format!("{:.2}", number(&worst["deviation"])),
            format!("{:.2}", 1e3 * number(&worst["settling"])),
            format!("{:.3}", number(&worst["tail_max"])),
            format!("{:.3}", number(&kept["selection"]["cost"])),
        ];
        let cells: Vec<&str> = row.split_whitespace().collect();
        assert_eq!([&cells[..2], &cells[5..]].concat(), expected, "{row}");
        assert_eq!(cells[2].replace(',', ""), kept["after"].to_string());
        assert_eq!(seed["control_periods"], 1200);
    }
    assert_eq!(answer["control_periods"], 2400);
    assert_eq!(answer["met"], Value::Null, "no specification");
    assert_eq!(
        (&answer["evaluation"][0]["from"], &answer["evaluation"][0]["unit"]),
        (&Value::from(200.0), &Value::from("W"))
    );
    let best = answer["best_seed"].to_string();
    assert_eq!(
        desk.read("out/report.txt"),
        desk.read(&format!("out/seeds/{best}/report.txt")),
        "the best seed's folder"
    );
}

#[test]
fn a_missed_specification_is_exit_code_1_and_said_in_the_answer() {
    let desk = super::training::desk();
    let settings = desk.read("train/train.toml");
    desk.write("train/train.toml", &format!("{settings}\n[[spec]]\ndeviation = 1e-6\n"));
    let ran = desk.type_in("train train/train.toml --seeds 3 --out out --json");
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert_eq!(parsed(&ran.stdout)["met"], false);
}

/// Errors are as they were: on standard error, and nothing else anywhere.
#[test]
fn bad_input_has_no_answer() {
    let desk = Desk::new("minimal");
    copy_folder(&tests::root().join("examples/plants"), &desk.path("plants"));
    desk.edit("policy/policy.toml", "sample_period", "sample_perriod");
    let before = desk.listing();
    for line in [
        "compile policy --out out --json",
        "certify policy --out out --json",
        "simulate s.toml --policy policy --out out --json",
        "train train.toml --out out --json",
    ] {
        for more in ["", " -q", " -v"] {
            desk.refuse(&format!("{line}{more}"), &["error: "]);
        }
    }
    assert_eq!(desk.listing(), before);
}
