//! What no cause explains is described by an empirical term, fenced off from causes. The converter is that of `bench`, which shares
//! nothing with the plant; in front of its switch stands a modulator with play that bends, which is on no list and has no form of
//! the term's.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use std::path::Path;

use bench::{Bench, Noise, Table};
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::drive::{Begin, Model, simulate};
use diagnose::extend::{extended_toml, partial_toml};
use diagnose::findings::Verdict;
use diagnose::gain::Regime;
use diagnose::record::{Record, Segment};
use plant::Parameters;

const ROWS: usize = 300;
const LOAD: f64 = 12.0;
const NOISE: [(&str, f64, f64); 2] = [("v_out", 0.1, 0.02), ("i_l", 0.05, 5e-3)];

/// Without series resistance of the capacitor: the plant is simulated ten times as fast.
fn bench() -> Bench {
    Bench {
        esr: 0.0,
        // far from where the current rests at 0: the steps of `bench` meet that instant only roughly
        load: vec![(0.0, 0.0, LOAD)],
        ..Bench::default()
    }
}

fn model() -> Parameters {
    bench::of(&bench())
}

/// What stands between the commanded duty and the switch.
#[derive(Clone, Copy)]
struct Modulator {
    /// Half the width of the play.
    play: f64,
    /// Size of the bend.
    bend: f64,
}

const STRAIGHT: Modulator = Modulator { play: 0.0, bend: 0.0 };
const BENT: Modulator = Modulator { play: 4e-3, bend: 0.03 };

/// A run with duties that change at random, and the table of it with the commanded duty.
fn run(bench: &Bench, modulator: Modulator, random: &mut Noise) -> Table {
    let mut commanded = Vec::new();
    while commanded.len() < ROWS {
        let duty = (1e3 * random.between(0.38, 0.62)).round() / 1e3;
        commanded.extend(vec![duty; 12 + random.below(40)]);
    }
    commanded.truncate(ROWS);
    let mut follows = commanded[0];
    let real = commanded.iter().enumerate().map(|(row, duty)| {
        follows = f64::clamp(follows, duty - modulator.play, duty + modulator.play);
        (row, follows + modulator.bend * (1.0 - (9.0 * (follows - 0.47)).cosh()))
    });
    let bench = Bench {
        rows: ROWS,
        duty: real.collect(),
        ..bench.clone()
    };
    let mut table = bench.run().with("i_load", vec![LOAD; ROWS]);
    *table.column("duty") = commanded;
    table.without(&["i_out", "v_in"]).measured(&NOISE, random)
}

fn diagnosed(bench: &Bench, train: Modulator, held: Modulator, seed: u64) -> Diagnosis {
    let (model, mut random) = (model(), Noise(seed));
    let mut read = |name: &str, modulator| run(bench, modulator, &mut random).read(name, &model).unwrap();
    let train = ["a", "b", "c"].map(|name| read(name, train)).to_vec();
    diagnose(&model, train, &[read("held", held)], &|_| {})
}

/// Held-out errors of the output voltage, V: of the model as given and of the file that is written.
fn held_out(found: &Diagnosis) -> [f64; 2] {
    let mut held = found.findings.gain.heldout.iter();
    let whole = held
        .find(|held| held.channel == "v_o" && held.regime == Regime::All)
        .unwrap();
    [whole.rmse_before, whole.rmse_after]
}

fn written(found: &Diagnosis) -> Parameters {
    Parameters::from_toml(Path::new("plant.extended.toml"), &extended_toml(found)).unwrap()
}

#[test]
fn what_no_cause_explains_is_described_and_called_no_cause() {
    let found = diagnosed(&bench(), BENT, BENT, 5);
    let findings = &found.findings;
    println!("{}", findings.sentence);
    assert_eq!(findings.verdict, Verdict::Unexplained);
    assert!(findings.causes.is_empty() && findings.partial.iter().all(|one| one.id != "empirical"));
    let term = findings.empirical.as_ref().unwrap();
    println!("{term:#?}");
    assert!(
        term.written && term.sentence.contains("explains nothing"),
        "{}",
        term.sentence
    );
    assert!((1..=6).contains(&term.coefficients.len()));
    assert_eq!(term.left_out, "records");
    let [before, after] = held_out(&found);
    // half: the bend has no form of the term's, and play remembers longer than its rate
    assert!(after < 0.5 * before, "{before} V to {after} V");
    if let Some(text) = partial_toml(&found) {
        assert!(
            text.contains("[empirical]") && !text.contains("as it was given"),
            "{text}"
        );
    }
    // nothing else has moved: without the table the file is the model as given
    let plant = written(&found);
    assert!(plant.empirical != model().empirical);
    let mut rest = plant.clone();
    rest.empirical = model().empirical;
    assert_eq!(rest, model());
}

#[test]
fn a_term_that_does_not_hold_in_a_held_out_record_is_said_and_not_written() {
    let other = Modulator {
        play: BENT.play,
        bend: -BENT.bend,
    };
    let found = diagnosed(&bench(), BENT, other, 6);
    let term = found.findings.empirical.as_ref().unwrap();
    println!("{term:#?}");
    assert!(
        !term.written && term.sentence.contains("not written"),
        "{}",
        term.sentence
    );
    assert_eq!(written(&found), model());
    let [before, after] = held_out(&found);
    assert!((after - before).abs() < 1e-6 * before, "{before} V to {after} V");
}

#[test]
fn records_that_the_model_or_a_cause_explains_get_no_term() {
    let wound = Bench { dcr: 0.6, ..bench() };
    for (bench, verdict) in [(bench(), Verdict::Consistent), (wound, Verdict::Explained)] {
        let found = diagnosed(&bench, STRAIGHT, STRAIGHT, 7);
        assert!(
            found.findings.verdict == verdict || found.findings.verdict == Verdict::Ambiguous,
            "{}",
            found.findings.sentence
        );
        assert!(found.findings.empirical.is_none());
        assert_eq!(written(&found).empirical, model().empirical);
    }
}

/// Beside a correction that stands already, causes would be fitted to what it leaves.
#[test]
fn a_model_that_has_a_term_is_diagnosed_without_it() {
    let mut given = model();
    (given.empirical.constant, given.empirical.rate) = (0.03, 0.1);
    let found = [model(), given].map(|model| {
        let mut random = Noise(7);
        let train = ["a", "b", "c"].map(|name| run(&bench(), STRAIGHT, &mut random).read(name, &model).unwrap());
        diagnose(&model, train.to_vec(), &[], &|_| {})
    });
    let [plain, with] = &found;
    assert_eq!(plain.findings.sentence, with.findings.sentence);
    assert_eq!(extended_toml(plain), extended_toml(with));
    let is_said = |found: &Diagnosis| {
        found
            .findings
            .noise
            .repairs
            .iter()
            .any(|note| note.contains("[empirical]"))
    };
    assert!(!is_said(plain) && is_said(with));
}

/// A record that is cut where a step of the duty still shows is simulated as the whole one.
#[test]
fn a_segment_begins_with_the_rate_that_the_duties_before_it_left() {
    let mut p = model();
    (p.empirical.rate, p.empirical.rate_span, p.empirical.rate_time) = (0.05, 0.1, 17.0 * p.t_sw());
    let mut record = run(&bench(), STRAIGHT, &mut Noise(8)).read("a", &p).unwrap();
    let begun = [record.measured[0][0], record.measured[1][0], 0.0];
    let simulated = |record: &Record, states: &[[f64; 3]]| {
        let begin = Begin {
            states,
            levels: &[],
            late: &[],
            trim: 0.0,
        };
        simulate(&Model::new(&p), record, &begin)
    };
    assert!(record.segments.len() == 1 && record.segments[0].start == 0);
    let whole = simulated(&record, &[begun]);
    let step = (60..ROWS)
        .find(|row| record.duty[*row] != record.duty[row - 1])
        .unwrap();
    let (cut, end) = (step + 10, record.segments[0].end);
    record.segments = vec![Segment { start: 0, end: cut }, Segment { start: cut, end }];
    let parts = simulated(&record, &[begun, [whole[cut][0], whole[cut][1], 0.0]]);
    let apart = (cut..end).map(|row| (whole[row][0] - parts[row][0]).abs());
    let most = apart.fold(0.0, f64::max);
    // a segment begins with the current and the voltage of the instant, and not with where its gates were to the last nanosecond; the
    // rate that is forgotten makes more than a volt
    assert!(most < 0.02, "{most} V");
}
