//! Commands on a converter that is an FMU: the one of `examples/fmu`, built here, and one that fails.

use std::process::Command;

use tests::tools::{copy_folder, run};

use super::Desk;

const PLANT: &str = "\
[converter]
model = \"averaged\"
v_in = 200.0
inductance = 2e-3
capacitance = 1.5e-3
f_sw = 10e3

[load]
v_fold = 20.0
";

const FMU: &str = "
[fmu]
file = \"buck.fmu\"
[fmu.inputs]
duty = \"duty\"
load_power = \"load.p\"
load_current = \"load.i\"
v_in = \"source.v\"
[fmu.outputs]
v_out = \"out.v\"
i_l = \"inductor.i\"
[fmu.initial]
v_out = \"v_start\"
i_l = \"i_start\"
[fmu.parameters]
\"converter.inductance\" = \"L\"
\"converter.capacitance\" = \"C\"
\"switch.r_ds_on\" = \"switch.r_on\"
\"switch.v_f\" = \"diode.v_f\"
[fmu.start]
\"winding.r\" = 0.1
";

/// A load step at few instants, without limits.
const SCENARIO: &str = "\
plant = \"plant.toml\"
v_ref = 100.0
load_steps = [[200, 500]]
instants = 3
sampling_instants = 2
lead = 100
after = 100
tail = 40
baselines = [\"pid\"]
";

fn build(desk: &Desk, source: &str, flags: &[&str], description: &str) {
    let folder = desk.path("unpacked");
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(folder.join("binaries/linux64")).unwrap();
    std::fs::write(folder.join("modelDescription.xml"), description).unwrap();
    let mut gcc = Command::new("gcc");
    gcc.args(["-std=c99", "-O2", "-shared", "-fPIC", "-o"])
        .arg(folder.join("binaries/linux64/buck.so"))
        .arg(tests::root().join(source))
        .args(flags)
        .arg("-lm");
    let ran = run(&mut gcc);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let mut pack = Command::new("python3");
    pack.current_dir(&folder)
        .args(["-m", "zipfile", "-c", "../buck.fmu", "modelDescription.xml", "binaries"]);
    assert_eq!(run(&mut pack).code, Some(0));
    std::fs::remove_dir_all(&folder).unwrap();
}

fn example() -> String {
    std::fs::read_to_string(tests::root().join("examples/fmu/modelDescription.xml")).unwrap()
}

fn desk() -> Desk {
    let desk = Desk::new("minimal");
    for folder in ["buck12", "plants", "drm", "train"] {
        copy_folder(&tests::root().join("examples").join(folder), &desk.path(folder));
    }
    build(&desk, "examples/fmu/buck.c", &[], &example());
    desk.write(
        "plant.toml",
        &format!("{PLANT}[switch]\nr_ds_on = 0.5\nv_f = 2.0\n{FMU}"),
    );
    desk.write("scenario.toml", SCENARIO);
    desk
}

#[test]
fn an_fmu_does_not_run_before_it_is_allowed() {
    let desk = desk();
    let before = desk.listing();
    let words = ["foreign native code", "--run-fmu", "plant.toml"];
    desk.refuse("simulate scenario.toml --policy buck12 --out loop", &words);
    desk.refuse(
        "drm acquire --plant plant.toml --duties 0.5 --currents 2 --out points.csv",
        &words,
    );
    // nobody computes another circuit in its place
    let words = ["is an FMU", "plant.toml:"];
    desk.refuse(
        "drm judge --mapping drm/drm.toml --plant plant.toml --nominal plants/sb3-buck12.toml --v-ref 100 --currents 2",
        &words,
    );
    desk.refuse(
        "simulate scenario.toml --policy buck12 --out loop --plant plants/none.toml --run-fmu",
        &["none.toml"],
    );
    let words = ["is an FMU", "plant.toml:"];
    desk.refuse(
        "drm acquire --plant plant.toml --run-fmu --simulator ngspice --duties 0.5 --currents 2 --out points.csv",
        &words,
    );
    assert_eq!(desk.listing(), before);
}

/// Without losses the FMU is the averaged plant: the loop takes the same way.
#[test]
fn a_simulation_on_an_fmu_is_that_of_the_equal_plant() {
    let desk = desk();
    let lossless = FMU.replace("\"winding.r\" = 0.1", "\"winding.r\" = 0.0");
    desk.write("plant.toml", &format!("{PLANT}{lossless}"));
    desk.write(
        "same.toml",
        &PLANT
            .to_string()
            .replace("f_sw = 10e3\n", "f_sw = 10e3\nrectifier = \"synchronous\"\n"),
    );
    let said = desk.succeed("simulate scenario.toml --policy buck12 --run-fmu --out loop");
    for words in ["foreign code", "buck.fmu", "nominal numbers"] {
        assert!(said.contains(words), "{words}\n{said}");
    }
    desk.succeed("simulate scenario.toml --policy buck12 --plant same.toml --out same");
    for file in ["200-500W-policy.csv", "200-500W-pid.csv"] {
        let [a, b] = ["loop", "same"].map(|folder| voltages(&desk.read(&format!("{folder}/{file}"))));
        let moved = b.iter().map(|v| (v - 100.0).abs()).fold(0.0, f64::max);
        let distance = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // the midpoint rule in steps of 1 us: (w h)^2/24 = 1e-8 of some volts a step, 20,000 of them at worst add up
        assert!(
            a.len() == b.len() && moved > 0.1 && distance < 2e-3,
            "{file}: {distance} of {moved}"
        );
    }
    // once more: the same bytes
    desk.succeed("simulate scenario.toml --policy buck12 --run-fmu --out again");
    assert_eq!(desk.read("loop/metrics.csv"), desk.read("again/metrics.csv"));
    let said = desk.succeed(
        "simulate scenario.toml --policy buck12 --run-fmu --spread converter.inductance=1.8e-3,2.2e-3,2 --out spread",
    );
    assert!(said.contains("2 converters"), "{said}");
    desk.refuse(
        "simulate scenario.toml --policy buck12 --run-fmu --spread inductor.dcr=0,0.2,2 --out none --quiet",
        &["not told of `inductor.dcr`"],
    );
}

fn voltages(csv: &str) -> Vec<f64> {
    let mut lines = csv.lines();
    let at = lines
        .next()
        .unwrap()
        .split(',')
        .position(|name| name == "v_out_V")
        .unwrap();
    lines
        .map(|line| line.split(',').nth(at).unwrap().parse().unwrap())
        .collect()
}

/// Settled points are those of the model's own equation at rest.
#[test]
fn points_acquired_at_an_fmu_satisfy_its_equation() {
    let desk = desk();
    desk.succeed("drm acquire --plant plant.toml --run-fmu --duties 0.46,0.5,0.54 --currents 3,8 --out points.csv");
    let text = desk.read("points.csv");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let head: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut rows = 0;
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |name: &str| -> f64 { cells[head.iter().position(|n| *n == name).unwrap()].parse().unwrap() };
        let (d, i) = (number("d_real"), number("i_out"));
        let v = d * (200.0 - 0.5 * i) - (1.0 - d) * 2.0 - 0.1 * i;
        assert!((number("v_out") - v).abs() < 2e-2, "{line}: {v}");
        rows += 1;
    }
    assert_eq!(rows, 6, "{text}");
    desk.succeed("drm fit points.csv --trained-on plants/sb3-buck12.toml --out drm.toml");
}

#[test]
fn a_transfer_to_an_fmu_says_what_cannot_be_known() {
    let desk = desk();
    desk.write(
        "cases.toml",
        &SCENARIO
            .replace("plant.toml", "plants/sb3-buck12.toml")
            .replace("[\"pid\"]", "[]"),
    );
    let line =
        "drm transfer cases.toml --policy drm/policy.toml --allow-outside --real plant.toml --controller interpreter";
    desk.refuse(&format!("{line} --out none"), &["foreign native code", "--run-fmu"]);
    desk.refuse(
        &format!("{line} --run-fmu --ideal --out none"),
        &["exact mapping", "--ideal", "plant.toml"],
    );
    let said = desk.succeed(&format!("{line} --run-fmu --out transfer"));
    for words in ["FMUs", "mapped", "not known of an FMU"] {
        assert!(said.contains(words), "{words}\n{said}");
    }
}

#[test]
fn a_training_runs_on_an_fmu() {
    let desk = desk();
    desk.edit("train/paper12.toml", "../plants/paper-model.toml", "../plant.toml");
    desk.edit("train/paper12.toml", "steps = 100000 ", "steps = 600 ");
    desk.edit("train/paper12.toml", "seeds = [0, 1, 2, 3, 4]", "seeds = [3, 4]");
    desk.edit("train/paper12.toml", "every = 100\n", "every = 300\n");
    desk.refuse(
        "train train/paper12.toml --out trained",
        &["foreign native code", "--run-fmu"],
    );
    let ran = desk.type_in("train train/paper12.toml --run-fmu --out trained");
    // so few steps meet no specification
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stderr.contains("foreign code"), "{}", ran.stderr);
    let once = desk.type_in("train train/paper12.toml --run-fmu --threads 1 --out alone");
    assert_eq!(once.code, Some(1), "{}", once.stderr);
    for seed in ["3", "4"] {
        let [a, b] = ["trained", "alone"]
            .map(|out| std::fs::read(desk.path(&format!("{out}/seeds/{seed}/weights.safetensors"))));
        assert_eq!(a.unwrap(), b.unwrap(), "seed {seed}");
    }
    // what is randomised, and the FMU is not told of, is named
    let text = desk.read("train/paper12.toml");
    desk.write(
        "train/paper12.toml",
        &format!("{text}\n[[randomise]]\nkey = \"inductor.dcr\"\nvalue = [0.1, 0.2]\n"),
    );
    desk.refuse(
        "train train/paper12.toml --run-fmu --out none --quiet",
        &["not told of `inductor.dcr`"],
    );
}

/// The model of the crate's own tests, with a fault on its way.
#[test]
fn an_fmu_that_fails_ends_the_command_and_nothing_is_written() {
    let desk = desk();
    let names = [
        "duty",
        "load.i",
        "load.g",
        "load.p",
        "source.v",
        "L",
        "C",
        "R_L",
        "v_start",
        "i_start",
        "out.v",
        "inductor.i",
    ];
    let variable = |(n, name): (usize, &&str)| {
        let causality = match n {
            0..=4 => "input",
            5..=9 => "parameter",
            _ => "output",
        };
        let start = if n < 10 { " start=\"0\"" } else { "" };
        format!(
            "<ScalarVariable name=\"{name}\" valueReference=\"{n}\" causality=\"{causality}\"><Real{start}/></ScalarVariable>"
        )
    };
    let variables: String = names.iter().enumerate().map(variable).collect();
    let description = format!(
        "<fmiModelDescription fmiVersion=\"2.0\" modelName=\"buck\" guid=\"{{policyc-test-buck}}\">\
         <CoSimulation modelIdentifier=\"buck\" canHandleVariableCommunicationStepSize=\"true\"/>\
         <ModelVariables>{variables}</ModelVariables><ModelStructure/></fmiModelDescription>"
    );
    let wires = FMU.replace(
        "\"switch.r_ds_on\" = \"switch.r_on\"\n\"switch.v_f\" = \"diode.v_f\"\n",
        "",
    );
    let wires = wires.replace("[fmu.start]\n\"winding.r\" = 0.1\n", "");
    desk.write("plant.toml", &format!("{PLANT}{wires}"));
    let model = "fmu/tests/model/buck.c";
    build(&desk, model, &["-DFMI=2", "-DFAULT_ERROR_AT=0.00502"], &description);
    let before = desk.listing();
    let words = ["failed (error)", "from 5.1", "the inductor has melted", "buck.fmu"];
    desk.refuse(
        "simulate scenario.toml --policy buck12 --run-fmu --out loop --quiet",
        &words,
    );
    let told = desk.type_in("simulate scenario.toml --policy buck12 --run-fmu --verbose --out loop");
    assert!(
        told.stderr.contains("buck.fmu: error: the inductor has melted"),
        "{}",
        told.stderr
    );
    desk.refuse(
        "drm acquire --plant plant.toml --run-fmu --duties 0.5 --currents 2 --out points.csv --quiet",
        &words,
    );
    build(&desk, model, &["-DFMI=2", "-DFAULT_NAN_AT=0.00502"], &description);
    let words = ["no number for `out.v`", "NaN at 5.1"];
    desk.refuse(
        "simulate scenario.toml --policy buck12 --run-fmu --out loop --quiet",
        &words,
    );
    assert_eq!(desk.listing(), before);
}

/// Designs and limits are made from the nominal numbers, and the limit says so.
#[test]
fn nominal_numbers_beside_an_fmu_are_designed_on() {
    let desk = desk();
    desk.succeed("design plant.toml --v-ref 100 --load 10 --noise 0.01");
    let ran = desk.type_in("limit plant.toml --v-ref 100 --load-step 200,500");
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    assert!(ran.stderr.contains("nominal numbers beside the FMU"), "{}", ran.stderr);
}
