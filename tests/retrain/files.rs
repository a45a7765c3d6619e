//! What `--retrain` writes, and what it leaves alone.

use closed_loop::Agent;
use diagnose::retrain::Correction;
use diagnose::retrain::contract::corrected;
use plant::Signals;
use tests::tools::copy_folder;

use super::{Bench, Noise, all, desk, nominal, policyc_in, records};

/// The gain goes into the contract, as a file of its own, and the network learns on true volts.
#[test]
fn a_sensors_gain_stands_in_the_new_contract_and_the_users_is_untouched() {
    let (desk, cases) = all();
    let (_, ended) = &cases[3];
    let contract = std::fs::read_to_string(ended.folder.join("out/retrain/policy/policy.toml")).unwrap();
    assert!(
        contract.contains("((v_out - v_out_offset) / v_out_gain) - v_ref"),
        "{contract}"
    );
    let line = contract.lines().find(|line| line.starts_with("v_out_gain")).unwrap();
    let gain: f64 = line.split(['=', '#']).nth(1).unwrap().trim().parse().unwrap();
    assert!((gain - 1.02).abs() < 1e-3, "{line}");
    let own = std::fs::read(tests::root().join("examples/train/blind/policy.toml")).unwrap();
    assert_eq!(std::fs::read(desk.join("contract/policy.toml")).unwrap(), own);
    let settings = std::fs::read_to_string(ended.folder.join("out/retrain/train.toml")).unwrap();
    assert!(
        settings.contains("plant = \"../plant.extended.toml\"")
            && settings.contains("contract = \"contract/policy.toml\"")
    );
}

#[test]
fn the_loop_before_and_after_stands_in_page_and_json() {
    let (_, cases) = all();
    let (_, ended) = &cases[2];
    let page = std::fs::read_to_string(ended.folder.join("out/report.html")).unwrap();
    for part in ["Trained anew", "policy before", "trained anew", "pid", "duty changes"] {
        assert!(page.contains(part), "{part}");
    }
    let retrained = &ended.json["gain"]["retrained"];
    let controllers = retrained["places"][0]["controllers"].as_array().unwrap();
    let names: Vec<&str> = controllers
        .iter()
        .map(|line| line["controller"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["policy before", "trained anew", "pid"]);
    assert_eq!(controllers[0]["steps"].as_array().unwrap().len(), 4);
}

#[test]
fn a_second_run_overwrites_nothing_and_says_so_at_once() {
    let (_, cases) = all();
    let (_, ended) = &cases[2];
    let policy = ended.folder.join("out/retrain/policy/policy.toml");
    let before = std::fs::read(&policy).unwrap();
    let line = "diagnose --model ../plant.toml --train r0.csv r1.csv --policy ../old --retrain ../train.toml --out out";
    let begun = std::time::Instant::now();
    let again = policyc_in(&ended.folder, line);
    assert_eq!(again.code, Some(2), "{}", again.stderr);
    assert!(again.stderr.contains("holds a policy already"), "{}", again.stderr);
    // before the diagnosis, which takes seconds
    assert!(begun.elapsed().as_secs_f64() < 2.0);
    assert_eq!(std::fs::read(&policy).unwrap(), before);
}

/// A training file that cannot be is told before the diagnosis, and nothing is written.
#[test]
fn a_bad_training_file_is_told_first() {
    let desk = desk("0", 300);
    let table = &records(&nominal(), &mut Noise(1))[0];
    std::fs::write(desk.path().join("r.csv"), table.text()).unwrap();
    let text = super::settings("0", 300).replace("v_ref = 100.0", "v_ref = \"high\"");
    std::fs::write(desk.path().join("bad.toml"), text).unwrap();
    let ran = policyc_in(
        desk.path(),
        "diagnose --model plant.toml --train r.csv --retrain bad.toml --out out",
    );
    assert_eq!(ran.code, Some(2));
    assert!(
        ran.stderr.contains("bad.toml") && ran.stderr.contains("v_ref"),
        "{}",
        ran.stderr
    );
    assert!(!desk.path().join("out").exists());
}

/// A tie between a sensor and the converter wants two different contracts: nothing is trained, and the experiment is a file.
#[test]
fn a_tie_of_sensor_and_converter_is_not_trained_on() {
    let desk = desk("0", 300);
    let hidden = Bench {
        gain: [1.03, 1.0, 1.0, 1.0],
        rows: 280,
        ..nominal()
    };
    // the voltage alone does not tell its gain from the source's
    let table = records(&hidden, &mut Noise(3))[0].clone().without(&["i_l", "i_out"]);
    std::fs::write(desk.path().join("r.csv"), table.text()).unwrap();
    let ran = policyc_in(
        desk.path(),
        "diagnose --model plant.toml --train r.csv --retrain train.toml --out out",
    );
    assert_eq!(ran.code, Some(1), "{}\n{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("Not trained anew"), "{}", ran.stdout);
    assert!(!desk.path().join("out/retrain").exists());
}

/// What a contract with a correction shows the network of a wrong sensor is what the user's shows of a right one.
#[test]
fn a_corrected_contract_sees_the_true_signal() {
    let folder = tempfile::tempdir().unwrap();
    copy_folder(&tests::root().join("examples/blind/policy"), folder.path());
    let path = folder.path().join("policy.toml");
    let own = std::fs::read_to_string(&path).unwrap();
    let wrong = [("v_out", 1.03, -0.7, "V"), ("i_out", 0.9, 0.2, "A")];
    let corrections = wrong.map(|(signal, gain, offset, unit)| Correction {
        signal,
        gain,
        offset,
        unit,
    });
    let right = Signals {
        v_out: 97.5,
        i_l: 4.0,
        i_out: 5.5,
        v_in: 200.0,
    };
    let shown = Signals {
        v_out: 1.03 * right.v_out - 0.7,
        i_out: 0.9 * right.i_out + 0.2,
        ..right
    };
    let observed = |text: &str, measured: &Signals| {
        std::fs::write(&path, text).unwrap();
        let mut agent = Agent::<f32>::new(&policy::load(&path).unwrap()).unwrap();
        agent.sense(measured).unwrap();
        agent.observation().to_vec()
    };
    let before = observed(&own, &right);
    let corrected = corrected(&own, &corrections);
    assert!(corrected.left.is_empty() && corrected.before.is_empty() && corrected.taken.len() == 2);
    let after = observed(&corrected.text, &shown);
    let is_close = |(a, b): (&f32, &f32)| (a - b).abs() < 1e-4;
    assert!(before.iter().zip(&after).all(is_close), "{before:?} {after:?}");
    // without the correction it is another one
    assert!(!before.iter().zip(&observed(&own, &shown)).all(is_close));
}

/// Codes are corrected where they become numbers; other forms of `[parameters]` keep theirs; and what cannot be corrected is said.
#[test]
fn converters_inline_parameters_and_observers_are_told_apart() {
    let one = |text: &str| {
        corrected(
            text,
            &[Correction {
                signal: "v_out",
                gain: 1.25,
                offset: 0.5,
                unit: "V",
            }],
        )
    };
    let adc = "[[signal]]\nname = \"v_out\"\nadc = { gain = 0.0625, offset = -1.0, bits = 12 }\n[[feature]]\nsource = \"v_out\"\n";
    let made = one(adc);
    assert_eq!(
        made.text,
        adc.replace("0.0625", "0.05").replace("offset = -1.0", "offset = -1.2")
    );
    assert_eq!(made.before, ["v_out"]);
    let inline =
        "parameters = { v_ref = 5.0 }\n[[signal]]\nname = \"v_out\"\n[[feature]]\nsource = \"v_ref - v_out\"  # e\n";
    let made = one(inline);
    assert!(
        made.text
            .starts_with("parameters = { v_out_gain = 1.25, v_out_offset = 0.5,  v_ref = 5.0 }"),
        "{}",
        made.text
    );
    assert!(
        made.text
            .contains("source = \"v_ref - ((v_out - v_out_offset) / v_out_gain)\"  # e"),
        "{}",
        made.text
    );
    let observer = "[[signal]]\nname = \"v_out\"\n[[observer]]\noutput_voltage = \"v_out\"\n";
    let made = one(observer);
    assert_eq!(made.text, observer);
    assert!(made.left[0].contains("observer") && made.taken.is_empty());
    // a contract that does not measure it has nothing to correct
    assert_eq!(one("[[signal]]\nname = \"i_l\"\n").taken.len(), 0);
}

/// Ctrl-C keeps checkpoints; the same command with `--resume` ends with the very weights of a run that nobody disturbed.
#[cfg(unix)]
#[test]
fn an_interrupted_training_goes_on_bit_for_bit() {
    let (desk, cases) = all();
    let (_, whole) = &cases[2];
    let folder = desk.join("interrupted");
    std::fs::create_dir_all(&folder).unwrap();
    for name in ["r0.csv", "r1.csv"] {
        std::fs::copy(whole.folder.join(name), folder.join(name)).unwrap();
    }
    let line = "diagnose --model ../plant.toml --train r0.csv r1.csv --policy ../old --retrain ../train.toml --out out";
    let mut child = std::process::Command::new(tests::tools::policyc())
        .args(line.split(' '))
        .current_dir(&folder)
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let checkpoints = folder.join("out/retrain/policy/checkpoints");
    while !checkpoints.exists() {
        assert!(child.try_wait().unwrap().is_none(), "ended before its first checkpoint");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let pid = child.id().to_string();
    std::process::Command::new("kill")
        .args(["-INT", &pid])
        .status()
        .unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    // the diagnosis is whole, and nothing says that a policy was trained
    assert!(folder.join("out/diagnosis.json").exists() && !folder.join("out/retrain/policy/policy.toml").exists());
    let again = policyc_in(&folder, line);
    assert_eq!(again.code, Some(2), "{}", again.stderr);
    assert!(again.stderr.contains("--resume"), "{}", again.stderr);
    let resumed = policyc_in(&folder, &format!("{line} --resume"));
    assert!(matches!(resumed.code, Some(0 | 1)), "{}", resumed.stderr);
    for name in ["retrain/policy/weights.safetensors", "diagnosis.json"] {
        let read = |folder: &std::path::Path| std::fs::read(folder.join("out").join(name)).unwrap();
        assert!(read(&folder) == read(&whole.folder), "{name}");
    }
}
