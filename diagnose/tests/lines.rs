//! Lines in records: a dither that the duty column does not show is seen, and healthy records of a circuit that shares nothing with the plant
//! (`bench`) show none.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, model};
use diagnose::diagnosis::diagnose;
use diagnose::drive::Model;
use diagnose::fast;
use diagnose::findings::Verdict;
use diagnose::fit::State;
use diagnose::noise;
use diagnose::problem::Problem;

/// Steps of duty and load over so many rows; the real duty goes to either side by `dither`, in a pattern of rows.
fn table(rows: usize, dither: (f64, &[f64]), changed: &Bench, random: &mut Noise) -> Table {
    let at = |share: f64| (share * rows as f64) as usize;
    let (d, low) = (random.between(0.4, 0.55), random.between(4.0, 6.0));
    let duty = |n: usize| match n {
        n if n < at(0.45) => d,
        n if n < at(0.8) => d + 0.06,
        _ => d - 0.05,
    };
    let set = |n: usize| if n < at(0.25) { low } else { 1.4 * low };
    let bench = Bench {
        rows,
        duty: (0..rows)
            .map(|n| (n, duty(n) + dither.0 * dither.1[n % dither.1.len()]))
            .collect(),
        load: vec![(0.0, 0.0, low), (at(0.25) as f64, 0.0, 1.4 * low)],
        ..changed.clone()
    };
    let mut table = bench
        .run()
        .without(&["i_out", "v_in"])
        .with("i_load", (0..rows).map(set).collect());
    *table.column("duty") = (0..rows).map(duty).collect();
    table.measured(&[("v_out", 0.1, 0.02), ("i_l", 0.05, 5e-3)], random)
}

/// How many lines are seen in what the model as given leaves.
fn seen(table: &Table) -> usize {
    let base = Model::new(&model());
    let mut problem = Problem::new(vec![table.read("run", &model()).unwrap()], base.clone());
    let null = State::settle(&problem, &base, &problem.first_starts(&base), None);
    problem.sigma = noise::sigma(&problem, &null.residual);
    let null = State::settle(&problem, &base, &null.starts, None);
    let found = fast::structures(&problem, &null, &null);
    for one in &found {
        println!("{}: {}", one.channel, one.shape);
    }
    found.len()
}

#[test]
fn healthy_records_show_no_line() {
    let random = &mut Noise(31);
    let mut alarms = 0;
    for n in 0..200 {
        let rows = [120, 150, 200, 300, 500][n % 5];
        alarms += usize::from(seen(&table(rows, (0.0, &[0.0]), &Bench::default(), random)) > 0);
    }
    // one in a hundred
    assert!(alarms <= 2, "{alarms} of 200");
}

/// Another capacitor rings at each step, and a ring is no line.
#[test]
fn what_a_wrong_circuit_leaves_is_no_line() {
    let random = &mut Noise(32);
    let mut alarms = 0;
    for n in 0..40 {
        let good = Bench::default();
        let changed = match n % 4 {
            0 => Bench {
                capacitance: 0.8 * good.capacitance,
                ..good
            },
            1 => Bench {
                inductance: 0.85 * good.inductance,
                ..good
            },
            2 => Bench { esr: 0.2, ..good },
            _ => Bench { dcr: 0.5, ..good },
        };
        alarms += usize::from(seen(&table(250, (0.0, &[0.0]), &changed, random)) > 0);
    }
    assert!(alarms <= 1, "{alarms} of 40");
}

/// Patterns, each with the amplitude of its line in the current that a duty of 1 makes, A. A duty of 1 adds 10 A a period at 200 V, 2 mH and 10
/// kHz. From middle to middle of two periods half of each is added: 5 cot(w / 2) times the amplitude of the pattern's own line, which is
/// 1.414 and 1.231. From start to start a zigzag goes 5 A to either side.
const QUARTER: (&[f64], f64) = (&[1.0, 1.0, -1.0, -1.0], 7.07);
const HALF: (&[f64], f64) = (&[1.0, -1.0], 5.0);
const FIFTH: (&[f64], f64) = (&[1.0, 1.0, 0.0, -1.0, -1.0], 8.47);
/// Amplitude of the noise's own line in n rows, times their root: 0.05 A on two sides of the spectrum, or on the one at half the rate.
const NOISE_LINE: f64 = 0.1;

#[test]
fn a_dither_of_the_duty_is_seen() {
    let random = &mut Noise(33);
    for (pattern, gain) in [QUARTER, HALF, FIFTH] {
        let mut hits = 0;
        for n in 0..20 {
            let rows: usize = [120, 200, 300, 500][n % 4];
            let one_sided = if pattern.len() == 2 { 0.5 } else { 1.0 };
            let dither = 10.0 * one_sided * NOISE_LINE / (rows as f64).sqrt() / gain;
            // in the middle of a period a zigzag passes through 0: half of what one period adds, half of what the next takes
            let sampled = if pattern.len() == 2 { 0.0 } else { 0.5 };
            let bench = Bench {
                sampled,
                ..Bench::default()
            };
            hits += usize::from(seen(&table(rows, (dither, pattern), &bench, random)) > 0);
        }
        println!("{hits} of 20 with {pattern:?}");
        assert!(hits >= 19, "{hits} of 20 with {pattern:?}");
    }
}

#[test]
fn a_line_alone_is_unexplained_and_beside_a_cause_it_is_said() {
    let random = &mut Noise(34);
    let good = Bench::default();
    let healthy = table(250, (0.006, QUARTER.0), &good, random)
        .read("run", &model())
        .unwrap();
    let found = diagnose(&model(), vec![healthy], &[], &|_| ()).findings;
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
    assert!(
        found.sentence.starts_with("The model explains the records but for")
            && found.sentence.contains("the same in every fourth row"),
        "{}",
        found.sentence
    );
    let changed = Bench {
        capacitance: 120e-6,
        ..good
    };
    let both = table(250, (0.006, QUARTER.0), &changed, random)
        .read("run", &model())
        .unwrap();
    let found = diagnose(&model(), vec![both], &[], &|_| ()).findings;
    println!("{}", found.sentence);
    assert_eq!(found.verdict, Verdict::MostlyExplained, "{}", found.sentence);
    assert_eq!(
        found.causes.iter().map(|cause| cause.id).collect::<Vec<_>>(),
        ["c_wrong"]
    );
    assert!(
        found.sentence.contains("No cause of the list makes that"),
        "{}",
        found.sentence
    );
    assert!(found.structure.iter().any(|one| one.shape.contains("line at 2500 Hz")));
}
