//! A policy with several outputs where one duty is meant: the commands that close a loop are told which.
// the test makes its own inputs
#![allow(clippy::disallowed_methods)]

use safetensors::SafeTensors;
use safetensors::tensor::{TensorView, serialize};
use serde_json::Value;

use super::Desk;
use super::simulate::desk as one_output;

/// The example policy in `policy/` and, in `two/`, the same as the output `left` beside an output `right` that always commands 0.45.
pub fn desk() -> Desk {
    let desk = one_output();
    tests::tools::copy_folder(&desk.path("policy"), &desk.path("two"));
    let text = desk.read("two/policy.toml");
    let [head, tail] = ["golden = ", "[actions]"].map(|word| text.find(word).unwrap());
    let duties = text[tail..].lines().nth(1).unwrap();
    let contract = format!(
        "{}\n[[output]]\nname = \"left\"\nactions = {{ {duties} }}\nmapping = {{ file = \"drm.toml\", load_current = \"i_out\" }}\n\
         limits = {{ duty = [0.40, 0.60], initial_duty = 0.5 }}\nfallback = {{ duty = 0.0 }}\n\n\
         [[output]]\nname = \"right\"\nactions = {{ continuous = {{ clip = [-1.0, 1.0], scale = 0.5, offset = 0.5 }} }}\n\
         limits = {{ duty = [0.45, 0.9], initial_duty = 0.5 }}\nfallback = {{ duty = 0.125 }}\n\n[fallback]\nhold = 3\n",
        &text[..head]
    );
    desk.write("two/policy.toml", &contract);
    let path = desk.path("two/weights.safetensors");
    std::fs::write(&path, with_row(&std::fs::read(&path).unwrap(), -0.5)).unwrap();
    desk
}

/// The weights with one more row in the last layer, which is nothing but a bias.
fn with_row(file: &[u8], bias: f32) -> Vec<u8> {
    let tensors = SafeTensors::deserialize(file).unwrap();
    let last = tensors.names().into_iter().max().unwrap().to_string();
    let stem = last.strip_suffix(".weight").unwrap();
    let widened = tensors.tensors().into_iter().map(|(name, tensor)| {
        let (mut shape, mut data) = (tensor.shape().to_vec(), tensor.data().to_vec());
        if name == format!("{stem}.weight") {
            data.extend(vec![0; 4 * shape[1]]);
            shape[0] += 1;
        } else if name == format!("{stem}.bias") {
            data.extend(bias.to_le_bytes());
            shape[0] += 1;
        }
        (name, tensor.dtype(), shape, data)
    });
    let widened: Vec<_> = widened.collect();
    let views = widened
        .iter()
        .map(|(name, dtype, shape, data)| (name, TensorView::new(*dtype, shape.clone(), data).unwrap()));
    serialize(views, None).unwrap()
}

/// Lines of a CSV as cells.
fn cells(csv: &str) -> Vec<Vec<String>> {
    csv.lines()
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect()
}

#[test]
fn the_output_that_drives_the_plant_does_what_it_does_alone_and_the_other_is_told_beside_it() {
    let desk = desk();
    desk.succeed("simulate s.toml --policy policy --out alone");
    let said = desk.succeed("simulate s.toml --policy two --output left --check --out both");
    assert!(
        said.contains("output  left drives the plant, right is computed beside it"),
        "{said}"
    );
    assert!(said.contains("equal to the bit over"), "{said}");
    let (alone, both) = (
        cells(&desk.read("alone/200-500W-policy.csv")),
        cells(&desk.read("both/200-500W-policy.csv")),
    );
    assert_eq!(both[0][11..], ["duty_right", "action_right"]);
    assert_eq!(alone.len(), both.len());
    for (alone, both) in alone.iter().zip(&both).skip(1) {
        // the status is that of both: right is always at its limit
        assert_eq!(alone[..10], both[..10]);
        let right: f64 = both[11].parse().unwrap();
        assert!((right - 0.45).abs() < 1e-6 && both[12] == "0", "{both:?}");
    }
    let row = |name: &str| {
        let line = said.lines().find(|line| line.starts_with(name));
        line.unwrap_or_else(|| panic!("{name}\n{said}")).to_owned()
    };
    for word in ["0.4500", "0.45 .. 0.9", "80 of 80", "0 of 80"] {
        assert!(row("right").contains(word), "{word}\n{said}");
    }
    assert!(row("left (plant)").contains("0.4 .. 0.6"), "{said}");
    assert!(row("status of all").contains("LIMITED in 80"), "{said}");
    let json: Value = serde_json::from_str(&desk.read("both/metrics.json")).unwrap();
    assert_eq!(json["output"], "left");
    let outputs = json["load_steps"][0]["outputs"].as_array().unwrap();
    assert_eq!(outputs.len(), 2);
    assert_eq!(
        (&outputs[0]["drives"], &outputs[1]["drives"]),
        (&true.into(), &false.into())
    );
    assert_eq!(outputs[1]["at_limit"], 80);
    let figures = |file: &str| -> Value {
        let json: Value = serde_json::from_str(&desk.read(file)).unwrap();
        json["load_steps"][0]["controllers"].clone()
    };
    assert_eq!(figures("alone/metrics.json"), figures("both/metrics.json"));
    let page = desk.read("both/report.html");
    assert!(
        page.contains("left (plant)") && page.contains("Status of all outputs"),
        "{page}"
    );
    assert!(!desk.read("alone/report.html").contains("Status of all outputs"));
}

#[test]
fn the_scenario_says_which_output_drives_the_plant_and_the_command_line_another() {
    let desk = desk();
    desk.edit("s.toml", "instants = 3", "output = \"right\"\ninstants = 3");
    desk.succeed("simulate s.toml --policy two --out right --spread converter.inductance=30e-6,40e-6,2");
    let rows = cells(&desk.read("right/200-500W-policy.csv"));
    assert_eq!(rows[0][11], "duty_left");
    assert!(rows[1..].iter().all(|row| row[8].starts_with("0.45")), "{:?}", rows[1]);
    assert!(desk.read("right/spread.csv").lines().count() > 2);
    desk.succeed("simulate s.toml --policy two --output left --out left");
    assert_eq!(cells(&desk.read("left/200-500W-policy.csv"))[0][11], "duty_right");
}

#[test]
fn without_a_name_the_outputs_are_listed_and_a_wrong_one_is_refused() {
    let desk = desk();
    let words = [
        "s.toml",
        "several outputs",
        "outputs left, right",
        "output = \"left\"",
        "--output left",
    ];
    desk.refuse("simulate s.toml --policy two --out out", &words);
    let words = [
        "no output of this name",
        "rihgt",
        "one of left, right",
        "did you mean `right`?",
    ];
    desk.refuse("simulate s.toml --policy two --output rihgt --out out", &words);
    let words = ["a contract with one", "left", "leave `output` and --output out"];
    desk.refuse("simulate s.toml --policy policy --output left --out out", &words);
    assert!(!desk.path("out").exists());
}

#[test]
fn a_transfer_fits_the_mapping_of_the_output_that_it_is_told() {
    let desk = desk();
    desk.edit(
        "s.toml",
        "load_steps = [[200, 500], [500, 200]]",
        "load_steps = [[200, 500]]\nlimit = false",
    );
    let line = "drm transfer s.toml --real plants/paper-table.toml --controller interpreter";
    desk.succeed(&format!("{line} --policy policy --out alone"));
    let said = desk.succeed(&format!("{line} --policy two --output left --out both"));
    assert!(said.contains("its output left"), "{said}");
    assert_eq!(desk.read("alone/metrics.csv"), desk.read("both/metrics.csv"));
    desk.refuse(
        &format!("{line} --policy two --out out"),
        &["outputs left, right", "--output left"],
    );
    desk.refuse(
        &format!("{line} --policy two --output right --out out"),
        &["no mapping", "right"],
    );
}

/// A log of the loop under `left`: samples, its choices, and what `right` always wants, 0.5 * (-0.5) + 0.5.
fn log(desk: &Desk, head: &str, more: impl Fn(usize, &[usize]) -> String) -> String {
    if !desk.path("loop").exists() {
        desk.succeed("simulate s.toml --policy two --output left --out loop");
    }
    let rows = cells(&desk.read("loop/200-500W-policy.csv"));
    let actions: Vec<usize> = rows[1..].iter().map(|row| row[9].parse().unwrap()).collect();
    let mut text = format!("v_out,i_l,i_out,{head}\n");
    for (row, cells) in rows[1..].iter().enumerate() {
        text += &format!("{},{},{},{}\n", cells[2], cells[3], cells[4], more(row, &actions));
    }
    text
}

#[test]
fn a_log_is_held_against_each_output_by_its_own_columns() {
    let desk = desk();
    let both = "action_left,duty_right";
    desk.write("log.csv", &log(&desk, both, |row, left| format!("{},0.25", left[row])));
    let said = desk.succeed("replay two log.csv");
    for part in [
        "left: action equal in 80 of 80",
        "right: duty equal in 80 of 80",
        "the actions of left and the duties of right",
    ] {
        assert!(said.contains(part), "{part}\n{said}");
    }
    // names of others through the map
    desk.edit("log.csv", both, "choice,command");
    desk.succeed("replay two log.csv --map action_left=choice,duty_right=command");
    // only the output that differs is named
    let wrong = |text: &str, parts: &[&str], left_out: &str| {
        desk.write("log.csv", text);
        let ran = desk.type_in("replay two log.csv");
        assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
        for part in parts {
            assert!(ran.stdout.contains(part), "{part}\n{}", ran.stdout);
        }
        assert!(!ran.stdout.contains(left_out), "{left_out}\n{}", ran.stdout);
    };
    wrong(
        &log(&desk, both, |row, left| format!("{},0.3", left[row])),
        &[
            "DIFFERENT: the duties of right.",
            "right: duty equal in 0 of 80",
            "left: action equal in 80 of 80",
        ],
        "the actions of left",
    );
    wrong(
        &log(&desk, both, |row, left| {
            format!("{},0.25", if row == 40 { 11 - left[row] } else { left[row] })
        }),
        &[
            "DIFFERENT: the actions of left.",
            "left: action equal in 79 of 80, first other in line 42",
        ],
        "the duties of right",
    );
    // a table of duties that is another one
    wrong(
        &log(&desk, "action_left,duty_left", |row, left| {
            format!("{},{:.2}", left[row], 0.55 - 0.01 * left[row] as f64)
        }),
        &[
            "left: the duties of the actions, by duty_left, are others",
            "the actions of left of the log have other duties",
        ],
        "right:",
    );
    desk.write("log.csv", "v_out,i_l,i_out\n100,2,2\n");
    desk.refuse(
        "replay two log.csv",
        &["nothing to compare with", "`action_left`, `action_right`"],
    );
    let refused = log(&desk, "action_right", |row, left| left[row].to_string());
    desk.write("log.csv", &refused);
    desk.refuse("replay two log.csv", &["commands a number", "`duty`"]);
}

#[test]
fn the_duty_before_of_an_output_is_that_of_its_own_column() {
    let desk = desk();
    desk.edit(
        "two/policy.toml",
        "source = \"(i_l - i_out) / c_out\"\nscale = 3e-4",
        "source = \"left_previous_duty - right_previous_duty\"\nscale = 10",
    );
    let with = |right: f64| {
        log(&desk, "action_left,duty_right,obs_dv_dt", |row, left| {
            let duty = |row: usize| 0.44 + 0.01 * left[row] as f64 - if row.is_multiple_of(2) { 0.25 } else { right };
            // both begin with 0.5
            let before = if row == 0 { 0.0 } else { duty(row - 1) };
            format!(
                "{},{},{:.6}",
                left[row],
                if row % 2 == 0 { 0.25 } else { right },
                10.0 * before
            )
        })
    };
    desk.write("log.csv", &with(0.3));
    let ran = desk.type_in("replay two log.csv --exploring");
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("equal: the 1 of 6 features"), "{}", ran.stdout);
    // the feature follows right's column: with another value there it is another
    let log = with(0.3).replace(",0.3,", ",0.31,");
    desk.write("log.csv", &log);
    assert_eq!(desk.type_in("replay two log.csv --exploring").code, Some(1));
}

#[test]
fn what_knows_one_duty_says_what_to_do() {
    let desk = desk();
    let example = tests::root().join("examples/train/paper12.toml");
    let lines = std::fs::read_to_string(example).unwrap();
    let here = |line: &str| match line.split(' ').next() {
        Some("plant") => "plant = \"plants/paper-model.toml\"".to_owned(),
        Some("contract") => "contract = \"two/policy.toml\"".to_owned(),
        _ => line.to_owned(),
    };
    let lines: Vec<String> = lines.lines().map(here).collect();
    desk.write("t.toml", &lines.join("\n"));
    let words = [
        "two/policy.toml",
        "outputs left, right",
        "a contract without [[output]]",
        "policyc new model.zip",
    ];
    desk.refuse("train t.toml --out trained", &words);
    assert!(!desk.path("trained").exists());
}
