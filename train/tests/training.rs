//! Whole trainings, small ones: they learn, repeat themselves to the byte, and go on where they were interrupted.

#![allow(clippy::unwrap_used, clippy::panic)]

mod common;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use closed_loop::scenario::{load_step, survey_all};
use common::{Alarm, StandIn, tiny};
use train::learner::TargetUpdate;
use train::score::{Score, Scoring};
use train::trainer::{controller, quick_controller};
use train::{Course, Ended, Trainer, Unwatched, seeds, train_all};

static NEVER: AtomicBool = AtomicBool::new(false);

fn trainer(seed: u64) -> Trainer<StandIn> {
    let (settings, contract) = tiny();
    Trainer::new(&settings, &contract, &StandIn::new(1.5e-3, 1), seed).unwrap()
}

#[test]
fn a_small_training_learns_to_hold_the_voltage() {
    let mut trainer = trainer(3);
    assert_eq!(trainer.run(&NEVER, |_| {}).unwrap(), Ended::Budget);
    let (first, best) = (trainer.curve()[0], trainer.best().unwrap());
    assert!(
        best.score.cost < 0.25 * first.cost,
        "first {}, best {}",
        first.cost,
        best.score.cost
    );
    let outcome = trainer.finish(Ended::Budget).unwrap();
    for finding in &outcome.findings {
        assert!(
            finding.worst.deviation < 3.0 && finding.worst.tail_max < 1.0,
            "{finding:?}"
        );
    }
}

#[test]
fn the_trainer_sees_the_q_values_of_the_interpreter_to_the_bit() {
    let trainer = trainer(3);
    let (_, contract) = tiny();
    let controller = interp::Controller::<f32>::new(&contract.with(trainer.network()));
    let mut scratch = [Vec::new(), Vec::new()];
    for n in 0..50 {
        let observation: Vec<f32> = (0..4).map(|i| ((n * 7 + i * 13) % 31) as f32 * 0.13 - 2.0).collect();
        trainer.network().q_values(&observation, &mut scratch);
        let expected = controller.q_values(&ndarray::aview1(&observation)).unwrap();
        let bits = |x: &f32| x.to_bits();
        assert!(scratch[0].iter().map(bits).eq(expected.iter().map(bits)));
    }
}

#[test]
fn the_controller_of_the_looks_commands_what_the_interpreter_commands() {
    let mut trainer = trainer(3);
    trainer.run_until(1500, &NEVER, |_| {}).unwrap();
    let (settings, contract) = tiny();
    let network = trainer.network();
    let task = &settings.evaluation;
    for instant in task.all_instants() {
        let run = |quick| {
            let environment = StandIn::new(1.5e-3, 1);
            let step = [200.0, 800.0];
            if quick {
                let controller = quick_controller(&contract, network).unwrap();
                return load_step(environment, controller, 100.0, task, step, instant)
                    .unwrap()
                    .1;
            }
            load_step(
                environment,
                controller(&contract, network).unwrap(),
                100.0,
                task,
                step,
                instant,
            )
            .unwrap()
            .1
        };
        assert_eq!(run(true), run(false));
    }
}

/// Candidates that are ruled out early, or wait, must not be better than the one that is kept, whose cost is that of everything.
#[test]
fn the_policy_that_is_kept_is_the_first_of_those_that_cost_least_at_every_load_step_and_instant() {
    let (mut settings, contract) = tiny();
    settings.steps = 1500;
    // one network a look, which is the one that can be asked for
    settings.learning.learner.target_update = TargetUpdate::Hard { every: 100 };
    let environment = StandIn::new(1.5e-3, 1);
    let mut trainer = Trainer::new(&settings, &contract, &environment, 3).unwrap();
    let (selection, v_ref) = (&settings.selection, settings.reward.v_ref);
    let scoring = Scoring::new(&selection.task.load_steps, &settings.specification, selection.margin);
    let mut least: Option<(u64, Score)> = None;
    while trainer.step_count() < settings.steps {
        let look = (trainer.step_count() + selection.every).min(settings.steps);
        trainer.run_until(look, &NEVER, |_| {}).unwrap();
        let controller = quick_controller(&contract, trainer.network()).unwrap();
        let task = &selection.task;
        let findings = survey_all(&environment, &controller, v_ref, task, &task.all_instants()).unwrap();
        let score = scoring.score(&findings);
        if least.is_none_or(|(_, best)| score.cost < best.cost) {
            least = Some((look, score));
        }
        if look > 1000 && look < settings.steps {
            let interrupted = trainer.finish(Ended::Interrupted).unwrap();
            assert_eq!(Some((interrupted.best_step, interrupted.selected)), least);
        }
    }
    let best = trainer.best().unwrap();
    assert_eq!(Some((best.step, best.score)), least);
    assert!(trainer.curve().iter().all(|look| look.cost >= best.score.cost));
}

#[test]
fn the_same_seed_gives_the_same_bytes_alone_and_side_by_side() {
    let (mut settings, contract) = tiny();
    settings.steps = 500;
    settings.seeds = vec![3, 4, 5];
    let environment = StandIn::new(1.5e-3, 1);
    let run = |threads, checkpoint_every| {
        let course = Course {
            threads,
            checkpoint_every,
            ..Course::default()
        };
        train_all(&settings, &contract, &environment, &course, &NEVER, &Unwatched).unwrap()
    };
    let (alone, together) = (run(1, None), run(3, Some(Duration::ZERO)));
    for (a, b) in alone.iter().zip(&together) {
        assert!(a.checkpoint == b.checkpoint);
        assert_eq!(a.outcome.as_ref().unwrap().files, b.outcome.as_ref().unwrap().files);
    }
    assert!(alone[0].checkpoint != alone[1].checkpoint);
    let best = seeds::best(&alone).unwrap();
    let costs = alone.iter().map(|run| run.outcome.as_ref().unwrap().selected.cost);
    assert_eq!(best.selected.cost, costs.fold(f64::INFINITY, f64::min));
}

#[test]
fn an_interrupted_training_goes_on_to_the_same_bytes() {
    let (mut settings, contract) = tiny();
    settings.steps = 760;
    let mut whole = Trainer::new(&settings, &contract, &StandIn::new(1.5e-3, 1), 3).unwrap();
    whole.run(&NEVER, |_| {}).unwrap();

    let alarm = Arc::new(Alarm::default());
    let mut environment = StandIn::new(1.5e-3, 1);
    environment.alarm = Some(alarm.clone());
    let mut trainer = Trainer::new(&settings, &contract, &environment, 3).unwrap();
    let mut interruptions = 0;
    // before the first update, inside episodes, behind looks
    for steps in [13, 71, 180, 777, 5, 400, 1 << 40] {
        alarm.steps.store(steps, Ordering::Relaxed);
        alarm.flag.store(false, Ordering::Relaxed);
        let ended = trainer.run(&alarm.flag, |_| {}).unwrap();
        interruptions += u32::from(ended == Ended::Interrupted);
        let bytes = trainer.checkpoint().unwrap();
        // a fresh training, of another seed even, becomes the interrupted one
        trainer = Trainer::new(&settings, &contract, &environment, 9).unwrap();
        trainer.resume(&bytes).unwrap();
        assert!(trainer.checkpoint().unwrap() == bytes);
    }
    assert!(interruptions >= 4, "{interruptions}");
    assert_eq!(trainer.step_count(), 760);
    assert!(trainer.checkpoint().unwrap() == whole.checkpoint().unwrap());
    let (a, b) = (
        trainer.finish(Ended::Budget).unwrap(),
        whole.finish(Ended::Budget).unwrap(),
    );
    assert_eq!(a.files, b.files);
}

#[test]
fn a_checkpoint_of_another_training_is_refused() {
    let (mut settings, contract) = tiny();
    let bytes = trainer(3).checkpoint().unwrap();
    let environment = StandIn::new(150e-6, 1);
    let mut other_plant = Trainer::new(&settings, &contract, &environment, 3).unwrap();
    assert!(
        other_plant
            .resume(&bytes)
            .unwrap_err()
            .to_string()
            .contains("another training")
    );
    settings.digest.push('0');
    let mut other_file = Trainer::new(&settings, &contract, &StandIn::new(1.5e-3, 1), 3).unwrap();
    assert!(other_file.resume(&bytes).is_err());
    assert!(
        trainer(3)
            .resume(&bytes[1..])
            .unwrap_err()
            .to_string()
            .contains("this is not one of policyc")
    );
}

#[test]
fn training_stops_once_the_specification_is_met() {
    let (mut settings, contract) = tiny();
    let easy = "\n[[spec]]\ndeviation = 50.0\n";
    let path = settings.file.clone();
    let text = std::fs::read_to_string(&path).unwrap() + easy;
    settings = train::Settings::parse(&text, &path).unwrap();
    let mut trainer = Trainer::new(&settings, &contract, &StandIn::new(1.5e-3, 1), 3).unwrap();
    assert_eq!(trainer.run(&NEVER, |_| {}).unwrap(), Ended::Met);
    assert!(trainer.step_count() < 2500, "{}", trainer.step_count());
    let report = trainer.finish(Ended::Met).unwrap().files.remove("report.txt").unwrap();
    assert!(String::from_utf8(report).unwrap().contains("Specification: met"));
}

/// `fixtures/tiny.toml` with more lines.
fn extended(lines: &str) -> Trainer<StandIn> {
    let (settings, contract) = tiny();
    let text = std::fs::read_to_string(&settings.file).unwrap() + lines;
    let settings = train::Settings::parse(&text, &settings.file).unwrap_or_else(|faults| panic!("{faults}"));
    Trainer::new(&settings, &contract, &StandIn::new(1.5e-3, 1), 3).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_policy_has_to_hold_on_every_converter_of_the_spread() {
    let easy = "\n[[spec]]\ndeviation = 50.0\n";
    // 196 V do what 200 V do; of 80 V no duty makes 100 V
    let near = format!("{easy}[[spread]]\nfactor = {{ \"converter.v_in\" = 0.98 }}\n");
    let far = format!("{easy}[[spread]]\nset = {{ \"converter.v_in\" = 80 }}\ntail = 15.0\n");
    let mut trainer = extended(&near);
    assert_eq!(trainer.run(&NEVER, |_| {}).unwrap(), Ended::Met);
    let outcome = trainer.finish(Ended::Met).unwrap();
    assert!(outcome.evaluated.met && outcome.judged.len() == 2);
    assert_ne!(
        outcome.judged[0].findings, outcome.judged[1].findings,
        "another converter"
    );
    let steps = outcome.findings.len();
    let csv = String::from_utf8(outcome.files["spread.csv"].clone()).unwrap();
    assert_eq!(csv.lines().count(), 1 + 2 * steps);
    assert!(
        csv.starts_with("converter,from_W") && csv.contains("\n\"v_in x 0.98\","),
        "{csv}"
    );

    let mut trainer = extended(&far);
    assert_eq!(trainer.run(&NEVER, |_| {}).unwrap(), Ended::Budget);
    let outcome = trainer.finish(Ended::Budget).unwrap();
    assert!(!outcome.evaluated.met && outcome.judged[0].score.met && !outcome.judged[1].score.met);
    let report = String::from_utf8(outcome.files["report.txt"].clone()).unwrap();
    assert!(
        report.contains("On v_in = 80:") && report.contains("Specification: NOT met"),
        "{report}"
    );
    // its own limit, and none of the file's
    let own: Vec<&str> = (report.lines())
        .filter(|line| line.ends_with("(on v_in = 80)"))
        .collect();
    assert!(
        own.iter().all(|line| line.contains("limit 15.000 V")) && !own.is_empty(),
        "{report}"
    );
}

#[test]
fn the_policy_folder_passes_the_check_and_its_golden_vectors_are_the_trainers() {
    let mut trainer = trainer(4);
    let calls = AtomicU64::new(0);
    let ended = trainer.run(&NEVER, |progress| {
        calls.fetch_add(1, Ordering::Relaxed);
        assert_eq!((progress.seed, progress.steps), (4, 2500));
    });
    assert_eq!(calls.load(Ordering::Relaxed), 10);
    let outcome = trainer.finish(ended.unwrap()).unwrap();
    let names: Vec<&str> = outcome.files.keys().map(String::as_str).collect();
    let expected = [
        "evaluation.csv",
        "golden.safetensors",
        "learning-curve.csv",
        "net.safetensors",
        "policy.toml",
        "report.txt",
    ];
    assert_eq!(names, expected);

    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in &outcome.files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    let policy = policy::load(&folder.path().join("policy.toml")).unwrap_or_else(|faults| panic!("{faults}"));
    let golden = policy.golden.unwrap();
    assert!(golden.count > 50, "{}", golden.count);
    assert_eq!(
        policy.layers.iter().map(|layer| layer.outputs).collect::<Vec<_>>(),
        [24, 16, 5]
    );
    let best = &trainer.best().unwrap().network;
    let mut scratch = [Vec::new(), Vec::new()];
    best.q_values(&golden.observations[..4], &mut scratch);
    for (a, b) in scratch[0].iter().zip(&golden.q_values) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
}
