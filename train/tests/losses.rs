//! Converters with the losses of their plant file: what `new --plant` writes meets its own specification.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use closed_loop::Converter;
use plant::Parameters;
use train::start::{Start, Wanted};
use train::{Contract, Ended, Outcome, SeedRun, Settings, Trainer, seeds};

/// A desk with what `new --plant` writes, read back.
struct Desk {
    text: String,
    contract: Contract,
    settings: Settings,
    converter: Converter,
}

fn desk(name: &str, plant: &str, wanted: Wanted) -> Desk {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join("plant.toml");
    std::fs::write(&file, plant).unwrap();
    let start = Start::new(&Parameters::from_file(file.as_path()).unwrap(), &file, wanted).unwrap();
    let path = folder.join("policy.toml");
    std::fs::write(&path, start.contract()).unwrap();
    let text = start
        .training("policy.toml", "plant.toml")
        .replace("hidden = [64, 64]", "hidden = [16]");
    let settings = Settings::parse(&text, &folder.join("train.toml")).unwrap_or_else(|faults| panic!("{faults}"));
    Desk {
        text: start.contract(),
        contract: Contract::load(&path, &settings.hidden).unwrap_or_else(|faults| panic!("{faults}")),
        converter: Converter::load(&file, &settings.set).unwrap(),
        settings,
    }
}

impl Desk {
    fn trainer(&self, seed: u64) -> Trainer<Converter> {
        Trainer::new(&self.settings, &self.contract, &self.converter, seed).unwrap()
    }

    /// The law alone, which is the first candidate.
    fn law(&self) -> Outcome {
        self.trainer(0).finish(Ended::Interrupted).unwrap()
    }
}

/// From 12 V to 5 V at 80 kHz; `losses` are resistances of winding and switch, ohm.
fn buck([dcr, r_ds_on]: [f64; 2]) -> String {
    format!(
        "[converter]\nv_in = 12.0\ninductance = 22e-6\ncapacitance = 330e-6\nf_sw = 80e3\nrectifier = \"synchronous\"\n\
         [inductor]\ndcr = {dcr}\n[switch]\nr_ds_on = {r_ds_on}\n[capacitor]\nesr = 0.012\n[load]\nv_fold = 1.25\n[pwm]\nduty_delay = 1\n"
    )
}

const WANTED: Wanted = Wanted {
    v_ref: 5.0,
    loads: [2.0, 20.0],
};

#[test]
fn the_observer_follows_losses_in_time_and_is_the_usual_one_without_them() {
    let lossy = desk("lossy", &buck([0.025, 0.014]), WANTED);
    let law = lossy.law();
    assert!(law.evaluated.met, "{:?}", law.verdicts().collect::<Vec<_>>());
    assert!(
        lossy.text.contains("the bias follows faster than usual"),
        "{}",
        lossy.text
    );
    let ideal = desk("ideal", &buck([0.0, 0.0]), WANTED);
    assert!(ideal.law().evaluated.met && !ideal.text.contains("faster than usual"));
}

/// Small capacitors, a diode, one period of delay.
const SMALL: [(&str, Wanted); 2] = [
    (
        "[converter]\nv_in = 200.0\ninductance = 2e-3\ncapacitance = 150e-6\nf_sw = 10e3\n[pwm]\nduty_delay = 1\n",
        Wanted {
            v_ref: 100.0,
            loads: [200.0, 1000.0],
        },
    ),
    (
        "[converter]\nv_in = 100.0\ninductance = 220e-6\ncapacitance = 1.4e-6\nf_sw = 300e3\n\
         [load]\nv_fold = 16.75\n[pwm]\nduty_delay = 1\n",
        Wanted {
            v_ref: 67.0,
            loads: [17.0, 67.0],
        },
    ),
];

#[test]
fn the_law_of_a_small_capacitor_meets_the_specification() {
    for (n, (plant, wanted)) in SMALL.into_iter().enumerate() {
        let law = desk(&format!("small-{n}"), plant, wanted).law();
        let missed: Vec<_> = law.verdicts().filter(|verdict| !verdict.holds()).collect();
        assert!(law.evaluated.met, "{plant}{missed:?}");
    }
}

/// Neither law nor observer knows the resistance of the capacitor, which the voltage of a load step of 8.3 A jumps by: up to 0.83 V, where the
/// circuit without it dips by 0.41 V.
#[test]
fn the_law_beside_a_capacitor_with_resistance_meets_the_specification() {
    for (n, esr) in [0.02, 0.05, 0.1].into_iter().enumerate() {
        let plant = format!(
            "[converter]\nv_in = 48.0\ninductance = 10e-6\ncapacitance = 220e-6\nf_sw = 200e3\nrectifier = \"synchronous\"\n\
             [pwm]\nduty_delay = 1\n[capacitor]\nesr = {esr}\n"
        );
        let wanted = Wanted {
            v_ref: 12.0,
            loads: [20.0, 120.0],
        };
        let law = desk(&format!("esr-{n}"), &plant, wanted).law();
        let missed: Vec<_> = law.verdicts().filter(|verdict| !verdict.holds()).collect();
        assert!(law.evaluated.met, "{plant}{missed:?}");
        // what nothing can beat is not beaten: the specification allows 1.1 of it
        let whole = law
            .verdicts()
            .find(|one| one.figure == "deviation" && one.load_step == [20.0, 120.0])
            .unwrap();
        let share = 1.1 * whole.found / whole.limit;
        assert!(share > 0.95 && whole.found > esr * 100.0 / 12.0, "{esr}: {whole:?}");
    }
}

/// Half way has the digits of an end, where three are written.
#[test]
fn loads_that_lie_near_each_other_have_a_middle() {
    let wanted = Wanted {
        v_ref: 100.0,
        loads: [2000.0, 2008.0],
    };
    let text =
        "[converter]\nv_in = 200.0\ninductance = 2e-3\ncapacitance = 1.5e-3\nf_sw = 10e3\n[pwm]\nduty_delay = 1\n";
    let law = desk("near", text, wanted).law();
    assert!(law.verdicts().any(|one| one.load_step == [2000.0, 2004.0]));
}

/// From 12 V to 1.8 V, where networks of a short training meet the selection and exceed a limit of the evaluation by a third of a percent.
const CORE: &str = "[converter]\nv_in = 12.0\ninductance = 2.3e-7\ncapacitance = 0.021\nf_sw = 170e3\nrectifier = \"synchronous\"\n\
                    [inductor]\ndcr = 0.00014\n[switch]\nr_ds_on = 0.00019\n[capacitor]\nesr = 2e-5\n[load]\nv_fold = 0.45\n[pwm]\nduty_delay = 1\n";

#[test]
fn a_network_that_misses_what_the_law_keeps_is_not_kept() {
    let desk = desk(
        "core",
        CORE,
        Wanted {
            v_ref: 1.8,
            loads: [19.0, 150.0],
        },
    );
    assert!(desk.law().evaluated.met);
    for seed in [0, 1] {
        let mut trainer = desk.trainer(seed);
        let ended = trainer.run(&AtomicBool::new(false), |_| {}).unwrap();
        let outcome = trainer.finish(ended).unwrap();
        assert!(outcome.evaluated.met, "seed {seed}");
    }
}

#[test]
fn of_several_seeds_one_that_meets_the_specification_goes_out() {
    let outcome = desk("seeds", &buck([0.0, 0.0]), WANTED).law();
    let run = |seed: u64, evaluated: bool, selected: bool, cost: f64| {
        let mut outcome = outcome.clone();
        (outcome.seed, outcome.evaluated.met) = (seed, evaluated);
        (outcome.selected.met, outcome.selected.cost) = (selected, cost);
        // the other way round than the selection
        outcome.evaluated.cost = 1.0 / cost;
        SeedRun {
            outcome: Some(outcome),
            ended: Ended::Budget,
            steps: 1,
            checkpoint: Vec::new(),
        }
    };
    let chosen = |runs: &[SeedRun]| seeds::best(runs).unwrap().seed;
    let missed = run(0, false, true, 0.1);
    assert_eq!(chosen(&[missed, run(1, true, true, 0.5), run(2, true, false, 0.2)]), 1);
    // where none does, the one whose evaluation misses it least, whatever the selection thought of it
    assert_eq!(chosen(&[run(3, false, true, 0.2), run(4, false, false, 0.5)]), 4);
    assert_eq!(chosen(&[run(5, true, true, 0.5), run(6, true, true, 0.4)]), 6);
}
