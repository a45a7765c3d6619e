//! A simulation and a transfer by the library alone, as the command line does them.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use std::path::{Path, PathBuf};

use closed_loop::simulation::{PAGE, Setting, Spread, simulate};
use closed_loop::transfer::{self, Means};
use closed_loop::{Answer, Controller, Converter, Error, Named, Next, Scenario, interpreter};
use plant::Signals;
use policy::Policy;
use toml_input::Message;

const SCENARIO: &str = "plant = \"plants/sb3-buck12.toml\"
load_steps = [[200, 500]]
instants = 2
sampling_instants = 1
lead = 20
after = 60
tail = 20
baselines = [\"pid\"]
";

fn examples() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples")
}

fn policy() -> Policy {
    policy::load(&examples().join("buck12/policy.toml")).unwrap()
}

/// The scenario stands beside the examples, so that its plant is found.
fn scenario() -> (PathBuf, Scenario) {
    let file = examples().join("s.toml");
    let scenario = Scenario::from_toml(&file, SCENARIO).unwrap();
    (file, scenario)
}

fn setting() -> Setting {
    let (file, scenario) = scenario();
    Setting::new(&file, scenario, policy(), None).unwrap()
}

fn named(name: &str, controller: Box<dyn Controller>) -> Named {
    Named {
        name: name.to_owned(),
        controller,
    }
}

/// Answers as another does, but for one bit of one duty.
struct OneBitOff {
    inner: Box<dyn Controller>,
    period: usize,
}

impl Controller for OneBitOff {
    fn restart(&mut self) -> Result<(), Error> {
        self.period = 0;
        self.inner.restart()
    }

    fn step(&mut self, measured: &Signals) -> Result<Answer, Error> {
        let mut answer = self.inner.step(measured)?;
        if self.period == 7 {
            answer.duty = f64::from_bits(answer.duty.to_bits() + 1);
        }
        self.period += 1;
        Ok(answer)
    }
}

fn go_on(_: &Next<'_>) -> Result<(), Error> {
    Ok(())
}

#[test]
fn a_short_circuit_as_a_load_is_refused_before_it_is_simulated() {
    let file = examples().join("s.toml");
    let text = SCENARIO.replace("load_steps = [[200, 500]]", "resistance_steps = [[50, 1e-6]]");
    // at 1 uF a millionth of an ohm would take 400 million steps a period
    let text = text + "set = { \"converter.capacitance\" = 1e-6 }\n";
    let scenario = Scenario::from_toml(&file, &text).unwrap();
    let refused = Setting::new(&file, scenario, policy(), None).map(drop);
    let said = refused.map_err(|error| error.to_string()).unwrap_err();
    assert!(
        said.contains("too small to be simulated") && said.contains("s.toml"),
        "{said}"
    );
}

#[test]
fn a_controller_that_differs_in_one_bit_is_named_with_its_period() {
    let both = vec![
        named("interpreter", interpreter(&policy()).unwrap()),
        named(
            "other",
            Box::new(OneBitOff {
                inner: interpreter(&policy()).unwrap(),
                period: 0,
            }),
        ),
    ];
    let found = simulate(setting(), both, &mut go_on).unwrap();
    let check = found.check.as_ref().unwrap();
    assert_eq!(check.names, ["interpreter", "other"]);
    // two instants of lead, a period more at the second, and 60 periods after the step
    assert_eq!(check.periods, 80 + 81);
    let [difference] = check.differences.as_slice() else {
        panic!("{:?}", check.differences)
    };
    assert!(
        difference.starts_with("other: 200 -> 500 W differs from period 7 on"),
        "{difference}"
    );
    assert!(found.summary().contains("DIFFERENT from interpreter"));
}

#[test]
fn one_controller_is_compared_with_none_and_leaves_all_files() {
    let one = vec![named("interpreter", interpreter(&policy()).unwrap())];
    let found = simulate(setting(), one, &mut go_on).unwrap();
    assert!(found.check.is_none());
    let files = found.files().unwrap();
    let names: Vec<&str> = files.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "200-500W-pid.csv",
            "200-500W-policy.csv",
            "200-500W.svg",
            "metrics.csv",
            "metrics.json",
            PAGE,
            "summary.txt"
        ]
    );
}

/// Every piece of the work is counted once, before any of it is done: the law of the time that is left asks for it.
#[test]
fn what_is_done_adds_up_to_what_was_announced() {
    let spread = vec![Spread::parse("converter.inductance=57.8e-6,78.2e-6").unwrap()];
    for (spread, converters) in [(vec![], 0), (spread, 5)] {
        let of = setting().spread(spread, None).unwrap();
        let mut told = Vec::new();
        let one = vec![named("interpreter", interpreter(&policy()).unwrap())];
        let found = simulate(of, one, &mut |next| {
            told.push((next.what.to_string(), next.done, next.all));
            Ok(())
        });
        let cells = found.unwrap().spread.map_or(0, |spread| spread.cells.len());
        assert_eq!(cells, converters);
        assert!(
            told.windows(2)
                .all(|pair| pair[0].1 <= pair[1].1 && pair[0].2 == pair[1].2),
            "{told:?}"
        );
        // the last word is about a limit, behind all runs, or about the last converter of the spread, before its own
        let (what, done, all) = told.last().unwrap();
        match converters {
            0 => assert!(what.ends_with("limit") && done == all, "{told:?}"),
            _ => assert!(what.starts_with("converter 5 of 5") && done < all, "{told:?}"),
        }
    }
}

#[test]
fn who_is_told_what_comes_next_can_end_it() {
    let mut told = Vec::new();
    let mut tell = |next: &Next<'_>| {
        told.push(next.what.to_string());
        match told.len() {
            3 => Err(Message::new("enough").into()),
            _ => Ok(()),
        }
    };
    let one = vec![named("interpreter", interpreter(&policy()).unwrap())];
    let error = simulate(setting(), one, &mut tell).unwrap_err();
    assert!(error.to_string().contains("enough"), "{error}");
    assert_eq!(
        told,
        [
            "200 -> 500 W (1 of 1): interpreter",
            "200 -> 500 W (1 of 1): interpreter",
            "200 -> 500 W (1 of 1): pid"
        ]
    );
}

#[test]
fn a_transfer_that_is_ended_ran_nothing_more() {
    let (file, scenario) = scenario();
    let setting = transfer::Setting::new(&file, scenario, policy()).unwrap();
    let real = [examples().join("drm/plants/lossy.toml")];
    let start = |policy: &Policy| Ok(named("interpreter", interpreter(policy)?));
    let mut told = 0;
    let mut tell = |next: &Next<'_>| {
        // ten points beside two runs in simulation, two without a mapping, two with it
        assert_eq!((next.done, next.all), (told, 16));
        told += 1;
        match next.what.to_string().ends_with("point 2 of 10") {
            true => Err(Message::new("enough").into()),
            false => Ok(()),
        }
    };
    let means = Means {
        simulator: "the plant",
        simulate: &|_, parameters| Converter::new(parameters),
        start: &start,
        ideal: false,
        tell: &mut tell,
    };
    let error = transfer::transfer(setting, &real, means).unwrap_err();
    assert!(error.to_string().contains("enough"), "{error}");
    // two instants in simulation, two at the real converter, and two points of two loads at five voltages
    assert_eq!(told, 6);
}

/// The example's load steps move the voltage by more than 0.1 V and the current by more than an ampere.
#[test]
fn a_run_that_leaves_the_range_of_an_empirical_correction_is_told_so() {
    let file = examples().join("s.toml");
    let notes = |set: &str| -> Vec<String> {
        let scenario = Scenario::from_toml(&file, &format!("{SCENARIO}[set]\n{set}")).unwrap();
        let setting = Setting::new(&file, scenario, policy(), None).unwrap();
        let agent = closed_loop::Agent::<f32>::new(&policy()).unwrap();
        let found = simulate(setting, vec![named("interpreter", Box::new(agent))], &mut |_| Ok(())).unwrap();
        let is_ours = |note: &&String| note.contains("[empirical]");
        found.setting.notes.iter().filter(is_ours).cloned().collect()
    };
    let around = |v_span: f64, v: f64| {
        format!(
            "\"empirical.i\" = 1e-4\n\"empirical.i_centre\" = 0\n\"empirical.i_span\" = 1000\n\"empirical.v\" = {v}\n\
             \"empirical.v_centre\" = 100\n\"empirical.v_span\" = {v_span}\n"
        )
    };
    let said = notes(&around(0.05, 1e-4));
    assert!(
        !said.is_empty()
            && said
                .iter()
                .all(|note| note.contains("`v_out` in ") && note.contains("99.95")),
        "{said:?}"
    );
    assert!(
        said.iter()
            .all(|note| !note.contains("`i_l`") && !note.contains("`duty`")),
        "{said:?}"
    );
    assert_eq!(notes(&around(50.0, 1e-4)), [""; 0], "within");
    assert_eq!(notes(&around(0.05, 0.0)), [""; 0], "the voltage does not count");
}
