//! Every way in which an FMU can be wrong, before it runs and while it does.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

mod common;

use closed_loop::{Converter, Environment, LoadPath, Start};
use common::{Bench, Draft, WIRES, zip};
use plant::Load;

#[track_caller]
fn contains(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is not in\n{text}");
    }
}

/// Runs until it fails; returns the words and how many periods were good.
#[track_caller]
fn failure(converter: &mut Converter) -> (String, usize) {
    let load = Load::current(2.0);
    let start = Start {
        v_out: 100.0,
        i_l: 2.0,
        load,
        seed: 0,
        varied: &[],
    };
    if let Err(error) = converter.restart(&start) {
        return (error.to_string(), 0);
    }
    for period in 0..50 {
        let sample = converter.step(0.5, &LoadPath::constant(load));
        if let Some(error) = converter.failure() {
            assert!(sample.v_out.is_nan());
            // and stays so
            assert!(converter.step(0.5, &LoadPath::constant(load)).v_out.is_nan());
            return (error.to_string(), period);
        }
    }
    panic!("it ran");
}

#[test]
fn what_fails_on_the_way_is_told_with_time_and_words() {
    // periods of 0.1 ms: what fails at 1.5 ms has done 15 of them, but for a rounding error
    for fmi in [2, 3] {
        for (flag, words) in [
            (
                "FAULT_ERROR_AT=0.00149",
                ["failed (error)", "step from 1.5", "the inductor has melted"],
            ),
            (
                "FAULT_FATAL_AT=0.00149",
                ["broke down (fatal)", "step from 1.5", "--verbose"],
            ),
            (
                "FAULT_DISCARD_AT=0.00149",
                ["discarded", "step from 1.5", "reached 1.5"],
            ),
            (
                "FAULT_NAN_AT=0.00159",
                ["no number for `out.v`", "NaN at 1.6", "diverged"],
            ),
        ] {
            let mut fmu = Draft::new(fmi).flag(flag).build().whole();
            let (text, periods) = failure(&mut fmu);
            contains(&text, &words);
            contains(&text, &["buck.fmu"]);
            assert_eq!(periods, 15, "{text}");
            // and once more, as an episode after the one that failed
            assert_eq!(failure(&mut fmu), (text, periods), "FMI {fmi} {flag}");
        }
    }
    let (text, periods) = failure(&mut Draft::new(3).flag("FAULT_END_AT=0.00149").build().whole());
    contains(&text, &["asked to end the simulation", "1.5"]);
    assert_eq!(periods, 15);
}

#[test]
fn an_fmu_that_makes_no_instance_says_so() {
    let (text, _) = failure(&mut Draft::new(2).flag("FAULT_NO_INSTANCE").build().whole());
    contains(&text, &["makes no instance", "--verbose", "buck.fmu"]);
    // another build's token
    let (text, _) = failure(&mut Draft::new(3).edit(common::TOKEN, "{other}").build().whole());
    contains(&text, &["makes no instance", "token"]);
}

#[test]
fn a_description_that_is_not_for_us_is_refused() {
    let two = || Draft::new(2);
    let refused = |draft: Draft| draft.build().refusal(WIRES);
    contains(
        &refused(two().edit("\"2.0\"", "\"1.0\"")),
        &["another version", "fmiVersion = \"1.0\"", "2.0 or 3.0", "buck.fmu"],
    );
    contains(
        &refused(two().edit("<CoSimulation", "<ModelExchange")),
        &["not for co-simulation", "model exchange", "brings its own solver"],
    );
    contains(
        &refused(two().edit("</ModelVariables>", "</ModelVariable>")),
        &["modelDescription.xml is not sound", "byte"],
    );
    contains(&refused(two().edit("\"inductor.i\"", "\"out.v\"")), &["`out.v` twice"]);
    contains(
        &refused(two().edit("valueReference=\"3\"", "valueReference=\"-3\"")),
        &["valueReference = \"-3\""],
    );
    contains(
        &refused(two().edit("Identifier=\"buck\"", "Identifier=\"../buck\"")),
        &["modelIdentifier"],
    );
    contains(
        &refused(two().edit("modelName=\"buck\"", "modelName=\"&own;\"")),
        &["not sound"],
    );
    contains(
        &refused(two().edit("<fmiModelDescription", "<other><fmiModelDescription")),
        &["outermost element is <other>"],
    );
    let deep = format!("{}{}", "<a>".repeat(200), "</a>".repeat(200));
    contains(
        &refused(two().edit("<UnitDefinitions>", &format!("{deep}<UnitDefinitions>"))),
        &["100 deep"],
    );
}

#[test]
fn a_binary_that_is_not_for_us_is_refused() {
    let mut draft = Draft::new(2);
    draft.platform = "win64".to_owned();
    contains(
        &draft.build().refusal(WIRES),
        &[
            "no binary for this machine",
            "win64",
            "binaries/linux64/buck.so",
            "buck.fmu",
        ],
    );
    let mut draft = Draft::new(3);
    draft.platform = "linux64".to_owned();
    contains(
        &draft.build().refusal(WIRES),
        &["no binary", "binaries for: linux64", "binaries/x86_64-linux/buck.so"],
    );
    let version = Draft::new(2).flag("VERSION=\"1.0\"").build().refusal(WIRES);
    contains(&version, &["binary of the FMU is of another version", "\"1.0\"", "2.0"]);
    contains(
        &Draft::new(2).flag("FAULT_NO_SET_REAL").build().refusal(WIRES),
        &["lacks a function", "fmi2SetReal"],
    );
    let draft = Draft::new(2);
    let members = vec![
        ("modelDescription.xml".to_owned(), draft.description().into_bytes()),
        ("binaries/linux64/buck.so".to_owned(), b"no program".to_vec()),
    ];
    contains(&Bench::of(&zip(&members)).refusal(WIRES), &["cannot be loaded", "ldd"]);
}

#[test]
fn names_of_the_plant_file_are_looked_up() {
    let bench = Draft::new(2).build();
    let edited = |from: &str, to: &str| {
        assert!(WIRES.contains(from));
        bench.refusal(&WIRES.replacen(from, to, 1))
    };
    contains(
        &edited("\"out.v\"", "\"out_v\""),
        &[
            "no variable `out_v`",
            "did you mean `out.v`",
            "plant.toml:",
            "v_out = \"out_v\"",
        ],
    );
    contains(
        &edited("\"duty\"\n", "\"L\"\n"),
        &[
            "`L` of the FMU is no input",
            "causality = \"parameter\"",
            "causality = \"input\"",
        ],
    );
    contains(
        &edited("\"inductor.i\"", "\"duty\""),
        &["`duty` of the FMU is no output"],
    );
    contains(&edited("\"v_start\"", "\"out.v\""), &["cannot be set before a run"]);
    contains(
        &edited("i_l = \"inductor.i\"", "i_l = \"in.v\""),
        &["another unit", "\"V\"", "A"],
    );
    contains(&edited("i_l = \"inductor.i\"\n", ""), &["`i_l`", "inductor current"]);
    contains(&edited("duty = ", "duties = "), &["duties", "duty"]);
    contains(
        &edited("converter.inductance", "converter.inductanc"),
        &["no number `converter.inductanc`", "converter.inductance"],
    );
    contains(
        &edited("\"converter.inductance\" = \"L\"", "\"pwm.duty_lsb\" = \"L\""),
        &["`pwm.duty_lsb` is not the FMU's"],
    );
    contains(
        &bench.refusal(&format!("step = 3e-5\n{WIRES}")),
        &["does not divide the control period", "step = 0.00003"],
    );
    let tables = bench.refusal("");
    contains(
        &tables,
        &[
            "[fmu.inputs] has no `duty`",
            "[fmu.outputs] has no `v_out`",
            "[fmu.outputs] has no `i_l`",
        ],
    );
    let inner = Draft::new(3).attributes("fixedInternalStepSize=\"3e-5\"").build();
    contains(
        &inner.refusal(WIRES),
        &["own step does not divide", "fixedInternalStepSize = 0.00003"],
    );
    contains(
        &bench.refusal(&format!("{WIRES}[fmu.start]\n\"L\" = \"two\"\n")),
        &["L", "number"],
    );
    contains(
        &bench.refusal(&format!("{WIRES}[fmu.start]\n\"l\" = 2.0\n")),
        &["no variable `l`"],
    );
}

#[test]
fn units_and_types_of_the_description_are_compared() {
    let refused = |draft: Draft| draft.build().refusal(WIRES);
    let milli = Draft::new(2).edit("s=\"-3\" A=\"-1\"", "s=\"-3\" A=\"-1\" factor=\"0.001\"");
    contains(&refused(milli), &["another unit", "factor 0.001", "V"]);
    let integer = Draft::new(2).edit(
        "initial=\"calculated\"><Real unit=\"V\"/>",
        "initial=\"calculated\"><Integer/>",
    );
    contains(
        &refused(integer),
        &["`out.v` of the FMU is of another type", "Integer", "Real or Float64"],
    );
    let single = Draft::new(3).edit("<Float64 name=\"duty\"", "<Float32 name=\"duty\"");
    contains(&refused(single), &["`duty` of the FMU is of another type", "Float32"]);
    let array = Draft::new(3).edit(
        "<Float64 name=\"duty\" valueReference=\"0\" causality=\"input\" variability=\"continuous\" start=\"0\"/>",
        "<Float64 name=\"duty\" valueReference=\"0\" causality=\"input\" start=\"0 0\"><Dimension start=\"2\"/></Float64>",
    );
    contains(&refused(array), &["an array of Float64", "a scalar"]);
}

#[test]
fn an_effect_that_nobody_would_compute_is_refused() {
    let bench = Draft::new(2).build();
    let refused = |extra: &str| bench.open(extra, WIRES).map(|_| ()).unwrap_err().to_string();
    contains(
        &refused("[inductor]\ndcr = 0.1\n"),
        &["not told of `inductor.dcr`", "[fmu.parameters]"],
    );
    contains(
        &refused("[sensors.v_out]\nlow_pass = 1e-4\n"),
        &["not told of `sensors.v_out.low_pass`"],
    );
    let told = format!("{WIRES}\"inductor.dcr\" = \"R_L\"\n");
    assert!(bench.open("[inductor]\ndcr = 0.1\n", &told).is_ok());
}

#[test]
fn a_load_without_an_input_is_refused_by_name() {
    let bench = Draft::new(2).build();
    let only = WIRES.replace("load_current = \"load.i\"\nload_conductance = \"load.g\"\n", "");
    let mut fmu = bench.open("", &only).unwrap();
    let start = |load| Start {
        v_out: 100.0,
        i_l: 2.0,
        load,
        seed: 0,
        varied: &[],
    };
    assert!(fmu.restart(&start(Load::power(200.0))).is_ok());
    for (load, word) in [
        (Load::current(2.0), "constant current"),
        (Load::resistor(50.0), "a resistance"),
    ] {
        contains(
            &fmu.restart(&start(load)).unwrap_err().to_string(),
            &["not told of loads of", word, "load_current"],
        );
    }
    let only = WIRES.replace("v_in = \"source.v\"\n", "");
    let mut fmu = bench.open("", &only).unwrap();
    fmu.restart(&start(Load::current(2.0))).unwrap();
    contains(
        &fmu.set_source(190.0).unwrap_err().to_string(),
        &["source while it runs", "v_in = "],
    );
}

/// Archives that no tool writes: nothing of them is unpacked.
#[test]
fn hostile_archives_are_refused() {
    let good = Draft::new(2).members();
    let with = |name: &str| {
        let mut members = good.clone();
        members.push((name.to_owned(), b"x".to_vec()));
        Bench::of(&zip(&members)).refusal(WIRES)
    };
    for name in [
        "../../outside.so",
        "/tmp/outside.so",
        "binaries/../../x",
        "a\\b",
        "c:x",
        "resources//x",
    ] {
        contains(&with(name), &["not a sound FMU", "stay inside the archive", "buck.fmu"]);
    }
    contains(&with("modelDescription.xml"), &["twice"]);
    let bytes = zip(&good);
    for cut in [0, 10, bytes.len() / 2, bytes.len() - 1] {
        contains(&Bench::of(&bytes[..cut]).refusal(WIRES), &["not a sound FMU"]);
    }
    contains(&Bench::of(b"no archive at all").refusal(WIRES), &["not a sound FMU"]);
    contains(
        &Bench::of(&zip(&good[1..])).refusal(WIRES),
        &["no modelDescription.xml"],
    );
    // a byte of the packed description
    let mut damaged = bytes.clone();
    damaged[100] ^= 0x40;
    contains(&Bench::of(&damaged).refusal(WIRES), &["not a sound FMU"]);
    // sizes that are lies: of the row in the directory, whose first stands behind all members
    let row = bytes.windows(4).rposition(|four| four == b"PK\x01\x02").unwrap();
    let mut huge = bytes.clone();
    huge[row + 24..row + 28].copy_from_slice(&0xFFFF_FFF0_u32.to_le_bytes());
    contains(&Bench::of(&huge).refusal(WIRES), &["more than 2048 MiB"]);
    let mut short = bytes.clone();
    short[row + 24..row + 28].copy_from_slice(&10_u32.to_le_bytes());
    contains(&Bench::of(&short).refusal(WIRES), &["not a sound FMU"]);
    // both rows lead to the first member
    let mut twice = bytes.clone();
    twice[row + 42..row + 46].copy_from_slice(&0_u32.to_le_bytes());
    contains(&Bench::of(&twice).refusal(WIRES), &["not a sound FMU"]);
}

/// A member of zeros that unpacks to more than it says, and one that says too much for a description.
#[test]
fn a_bomb_is_not_unpacked() {
    let mut members = Draft::new(2).members();
    members[0].1 = vec![b' '; 200 << 20];
    let text = Bench::of(&zip(&members)).refusal(WIRES);
    contains(&text, &["`modelDescription.xml` of 209715200 bytes", "at most"]);
}

#[test]
fn the_circuit_of_this_program_is_not_taken_in_its_place() {
    let bench = Draft::new(2).build();
    let path = bench.plant("", WIRES);
    let refused = plant::Parameters::from_file(path.as_path()).unwrap_err().to_string();
    contains(&refused, &["is an FMU", "--run-fmu", "plant.toml:"]);
    assert!(Converter::load(path.as_path(), &[]).is_err());
    let (parameters, is_fmu) = plant::Parameters::nominal_from_file(path.as_path()).unwrap();
    assert!(is_fmu && parameters.converter.inductance == 2e-3);
}
