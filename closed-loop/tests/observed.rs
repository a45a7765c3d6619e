//! Classical controllers behind the observer of a policy's contract.

#![allow(clippy::unwrap_used, clippy::disallowed_methods)] // helpers of tests stand outside of #[test] functions

use std::fs;
use std::path::{Path, PathBuf};

use closed_loop::simulation::{Findings, Setting, simulate};
use closed_loop::{Converter, Named, Scenario, interpreter, rest_map};
use plant::Load;
use policy::Policy;
use tempfile::TempDir;

const SCENARIO: &str = "plant = \"plants/paper-model.toml\"
load_steps = [[200, 800]]
instants = 1
sampling_instants = 1
lead = 200
after = 200
tail = 60
limit = false
";
const BENCH: &str = "[set]\n\"pwm.duty_delay\" = 1\n";

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples")
}

/// The contract of `examples/train/measured` around a network whose weights are 0; `change` is made to its text.
fn measured(change: impl Fn(String) -> String) -> (TempDir, Policy) {
    let folder = tempfile::tempdir().unwrap();
    let contract = fs::read_to_string(examples().join("train/measured/policy.toml")).unwrap();
    // no golden answers of a network that was not trained
    let contract = contract.replace("golden = \"golden.safetensors\"\n", "");
    fs::write(folder.path().join("policy.toml"), change(contract)).unwrap();
    fs::write(folder.path().join("weights.safetensors"), weights(&[5, 4, 13])).unwrap();
    let policy = policy::load(&folder.path().join("policy.toml")).unwrap();
    (folder, policy)
}

/// Layers of these widths, all weights 0.
fn weights(widths: &[usize]) -> Vec<u8> {
    let (mut entries, mut bytes) = (Vec::new(), 0);
    for (n, pair) in widths.windows(2).enumerate() {
        for (name, shape) in [("weight", vec![pair[1], pair[0]]), ("bias", vec![pair[1]])] {
            let end = bytes + 4 * shape.iter().product::<usize>();
            entries.push(format!(
                "\"fc{}.{name}\":{{\"dtype\":\"F32\",\"shape\":{shape:?},\"data_offsets\":[{bytes},{end}]}}",
                n
            ));
            bytes = end;
        }
    }
    let header = format!("{{{}}}", entries.join(","));
    let mut file = (header.len() as u64).to_le_bytes().to_vec();
    file.extend(header.into_bytes());
    file.resize(file.len() + bytes, 0);
    file
}

fn run(scenario: &str, policy: &Policy) -> Findings {
    let file = examples().join("s.toml");
    let scenario = Scenario::from_toml(&file, scenario).unwrap();
    let setting = Setting::new(&file, scenario, policy.clone(), None).unwrap();
    let named = Named {
        name: "interpreter".to_owned(),
        controller: interpreter(policy).unwrap(),
    };
    simulate(setting, vec![named], &mut |_| Ok(())).unwrap()
}

fn names(found: &Findings) -> Vec<&str> {
    found.steps[0].courses.iter().map(|(name, _)| name.as_str()).collect()
}

/// A sensor of the inductor current that lies: who stands behind the observer does not see it.
#[test]
fn behind_an_observer_nobody_sees_the_inductor_current() {
    let (_folder, policy) = measured(|text| text);
    let duties = |observer: &str, lie: &str| -> Vec<Vec<f64>> {
        let found = run(&format!("{SCENARIO}{observer}{BENCH}{lie}"), &policy);
        let courses = found.steps[0].courses.iter().skip(2);
        courses
            .map(|(_, course)| course.shown.periods.iter().map(|p| p.record.duty).collect())
            .collect()
    };
    let (observer, lie) = ("observer = \"model\"\n", "\"sensors.i_l.offset\" = 3.0\n");
    assert_eq!(duties(observer, ""), duties(observer, lie));
    // those that measure the current are led astray: cascade, feed-forward, deadbeat
    for (straight, astray) in duties("", "").iter().zip(duties("", lie)).skip(1) {
        assert_ne!(*straight, astray);
    }
}

#[test]
fn behind_an_observer_all_four_hold_the_voltage_of_a_converter_with_losses() {
    let (_folder, policy) = measured(|text| text);
    let losses = "\"switch.r_ds_on\" = 0.1\n\"switch.v_f\" = 0.8\n";
    // sampled behind the pulse, too: the estimates are those at the start of a period then as well
    for sampled in ["", "\"pwm.sampling_phase\" = 0.6\n", "\"pwm.sampling_phase\" = 0.8\n"] {
        let found = run(
            &format!("{SCENARIO}observer = \"model\"\n{BENCH}{losses}{sampled}"),
            &policy,
        );
        assert_eq!(
            names(&found),
            ["policy", "law alone", "pid", "cascade", "feed-forward", "deadbeat"]
        );
        // the network, whose weights are 0, chooses the first offset for ever
        for (name, course) in found.steps[0].courses.iter().skip(1) {
            let worst = course.finding.worst;
            // without the bias losses of up to 1.6 V would leave feed-forward and deadbeat, whose integrals are slow, far off
            assert!(
                worst.tail_max < 0.1 && worst.deviation < 3.0,
                "{sampled} {name}: {worst:?}"
            );
        }
    }
}

#[test]
fn behind_two_observers_each_controller_stands_twice() {
    let (_folder, policy) = measured(|text| {
        let (start, end) = (text.find("[[observer]]").unwrap(), text.find("[[feature]]").unwrap());
        let second = text[start..end]
            .replace("\"model\"", "\"fast\"")
            .replace("0.0978", "0.515");
        format!("{}{second}{}", &text[..end], &text[end..])
    });
    let two = "baselines = [\"pid\", \"deadbeat\"]\nobserver = [\"model\", \"fast\"]\n";
    let found = run(&format!("{SCENARIO}{two}{BENCH}"), &policy);
    let expected = [
        "policy",
        "law alone",
        "pid model",
        "pid fast",
        "deadbeat model",
        "deadbeat fast",
    ];
    assert_eq!(names(&found), expected);
    assert!(found.files().unwrap().contains_key("200-800W-deadbeat-fast.csv"));
}

#[test]
fn an_observer_that_the_policy_does_not_have_is_refused() {
    let file = examples().join("s.toml");
    let refused = |text: &str, policy: &Policy| {
        let scenario = Scenario::from_toml(&file, &format!("{SCENARIO}{text}{BENCH}")).unwrap();
        Setting::new(&file, scenario, policy.clone(), None)
            .unwrap_err()
            .to_string()
    };
    let (_folder, policy) = measured(|text| text);
    let said = refused("observer = \"modle\"\n", &policy);
    assert!(said.contains("modle") && said.contains("model"), "{said}");
    let without = policy::load(&examples().join("buck12/policy.toml")).unwrap();
    let said = refused("observer = \"model\"\n", &without);
    assert!(said.contains("[[observer]]"), "{said}");
}

/// The law of the contract on estimates that are predicted one period ahead: with T/L = 0.05 A/V and T/C = 1/15 V/A a volt becomes
/// `1 - T^2/(2 L C)` V and `-(T/L)(1 + that)/2` A, an ampere `T/C` V and `1 - T^2/(2 L C)` A.
#[test]
fn the_map_around_rest_has_the_slopes_of_the_law_behind_the_predicted_estimates() {
    // everywhere in the dead zone: the network adds nothing
    let (_folder, policy) = measured(|text| {
        text.replace("within = 0.25", "within = 100.0")
            .replace("within = 1.0", "within = 100.0")
    });
    let set = [("pwm.duty_delay".to_owned(), 1.0)];
    let converter = Converter::load(examples().join("plants/paper-model.toml").as_path(), &set).unwrap();
    let axes = [vec![-0.1, 0.1], vec![-0.5, 0.5]];
    let map = rest_map(&policy, &converter, 100.0, Load::power(500.0), axes).unwrap();
    let (h, g) = (1e-4 / 2e-3, 1e-4 / 1.5e-3);
    let kept = 1.0 - 0.5 * h * g;
    let (by_current, by_voltage) = (0.104, 0.54);
    let along_error = by_current * h * 0.5 * (1.0 + kept) - by_voltage * kept;
    let along_current = -by_current * kept - by_voltage * g;
    let [a, b, c, d] = map.duties.as_slice() else {
        panic!("{:?}", map.duties)
    };
    for slope in [(b - a) / 0.2, (d - c) / 0.2] {
        assert!((slope - along_error).abs() < 1e-4, "{slope} {along_error}");
    }
    for slope in [c - a, d - b] {
        assert!((slope - along_current).abs() < 1e-4, "{slope} {along_current}");
    }
    // without noise and losses it rests at its reference, with what charges the capacitor at 0
    assert_eq!(map.cycle.len(), 200);
    for [error, current] in &map.cycle {
        assert!(error.abs() < 0.02 && current.abs() < 0.05, "{error} V, {current} A");
    }
}

/// The bench of `examples/simulate/measured.toml`, whose sensors are noisy, on converters that the design does not know.
#[test]
fn a_network_that_blends_two_laws_settles_as_behind_the_fast_observer_and_rests_as_behind_the_slow_one() {
    let policy = policy::load(&examples().join("simulate/blend/policy.toml")).unwrap();
    let scenario = fs::read_to_string(examples().join("simulate/measured.toml")).unwrap();
    let start = scenario.find("load_steps").unwrap();
    let set = scenario.find("[set]").unwrap();
    let task = "load_steps = [[200, 1000], [1000, 200]]\nsampling_instants = 1\ninstants = 6\nlead = 200\nafter = 300\ntail = 100\nlimit = false\n";
    let two = "baselines = [\"feed-forward\"]\nobserver = [\"model\", \"fast\"]\n";
    let bench = format!(
        "{}{task}{two}{}",
        scenario[..start].replace("../plants", "plants"),
        &scenario[set..]
    );
    let (mut settling, mut tail) = ([0.0_f64; 4], [0.0_f64; 4]);
    for (l, c, v_in) in [(0.8, 0.8, 191.0), (1.2, 1.2, 209.0), (0.8, 1.2, 209.0)] {
        let numbers = format!(
            "\"converter.inductance\" = {}\n\"converter.capacitance\" = {}\n\"converter.v_in\" = {v_in:?}\n\"switch.v_f\" = 0.5\n",
            l * 2e-3,
            c * 1.5e-3
        );
        let found = run(&format!("{bench}{numbers}"), &policy);
        assert_eq!(
            names(&found),
            ["policy", "law alone", "feed-forward model", "feed-forward fast"]
        );
        for step in &found.steps {
            for (n, (_, course)) in step.courses.iter().enumerate() {
                settling[n] = settling[n].max(course.finding.worst.settling);
                tail[n] = tail[n].max(course.finding.worst.tail_max);
            }
        }
    }
    let ([policy, law, slow, fast], said) = (settling, format!("{settling:?} {tail:?}"));
    assert!(policy < 0.85 * slow && policy < 1.1 * fast && slow < law, "{said}");
    let [policy, _, slow, fast] = tail;
    assert!(policy < 1.2 * slow && policy < 0.5 * fast, "{said}");
}
