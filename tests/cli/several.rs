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
