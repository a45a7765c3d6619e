//! Tables that no buck of this circuit gives must end without a cause, and good ones of any length must keep their answer. Both come
//! from a seeded generator of physics and junk (`bench`), which shares nothing with the plant.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, Wiring, model};
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::findings::Verdict;
use plant::Parameters;

/// Noise of voltages and currents of a settled point, and of a row of a record.
const OF_POINTS: [(&str, f64, f64); 4] = [
    ("v_out", 0.05, 0.01),
    ("i_l", 5e-3, 1e-3),
    ("i_out", 5e-3, 1e-3),
    ("v_in", 0.05, 0.01),
];
const OF_ROWS: [(&str, f64, f64); 4] = [
    ("v_out", 0.1, 0.02),
    ("i_l", 0.05, 5e-3),
    ("i_out", 0.05, 5e-3),
    ("v_in", 0.1, 0.02),
];

/// Settled points: duty, voltage and load current, by the balance of volt-seconds in continuous conduction.
fn points(bench: &Bench, rows: usize, random: &mut Noise) -> Table {
    let mut columns: [Vec<f64>; 5] = Default::default();
    for n in 0..rows {
        let d = 0.25 + 0.5 * n as f64 / (rows - 1) as f64;
        let i = random.between(3.0, 9.0);
        let (closed, open) = (d - bench.lost, 1.0 - d + bench.lost);
        let drops = |i_l: f64| closed * bench.r_ds_on * i_l + open * (bench.v_f + bench.r_d * i_l) + bench.dcr * i_l;
        let (v, i_l) = match bench.wiring {
            Wiring::Buck => (closed * bench.v_in - drops(i), i),
            Wiring::Boost => ((bench.v_in - drops(i / open)) / open, i / open),
            Wiring::BuckBoost => ((closed * bench.v_in - drops(i / open)) / open, i / open),
        };
        let shown = [d, v, i_l, i, bench.v_in];
        columns[0].push(d);
        for k in 1..5 {
            columns[k].push(shown[k] * bench.gain[k - 1] + bench.offset[k - 1]);
        }
    }
    let load = columns[3].clone();
    let names = ["duty", "v_out", "i_l", "i_out", "v_in"];
    // the set load: the gain of the meter of the load current is not in it
    let set: Vec<f64> = load.iter().map(|i| (i - bench.offset[2]) / bench.gain[2]).collect();
    Table(names.map(str::to_owned).into_iter().zip(columns).collect()).with("i_load", set)
}

/// A record of steps of duty or load, with the load as it was set.
fn record(bench: &Bench, rows: usize, load_steps: bool) -> Table {
    let at = |share: f64| (share * rows as f64) as usize;
    let low = bench.load[0].2;
    let mut bench = Bench { rows, ..bench.clone() };
    match load_steps {
        true => {
            bench.load = vec![
                (0.0, 0.0, low),
                (at(0.3) as f64, 0.0, 1.6 * low),
                (at(0.7) as f64, 0.0, 0.6 * low),
            ];
        }
        false => bench.duty = vec![(0, 0.5), (at(0.3), 0.56), (at(0.7), 0.45)],
    }
    let load = bench.load.clone();
    let set = (0..rows).map(|n| {
        load.iter()
            .rev()
            .find(|step| step.0 <= n as f64)
            .map_or(low, |step| step.2)
    });
    bench.run().with("i_load", set.collect())
}

fn permuted(mut table: Table, name: &str, random: &mut Noise) -> Table {
    let values = table.column(name);
    for n in (1..values.len()).rev() {
        values.swap(n, random.below(n + 1));
    }
    table
}

fn replaced(mut table: Table, name: &str, of: impl Fn(f64, f64) -> f64) -> Table {
    let duty = table.column("duty").clone();
    let values = table.column(name);
    let count = values.len() as f64;
    for (n, (value, d)) in values.iter_mut().zip(duty).enumerate() {
        *value = of(d, n as f64 / count);
    }
    table
}

/// What a table without sense ends as: refused, or a diagnosis.
fn ended(what: &str, table: &Table, model: &Parameters) -> Option<Diagnosis> {
    let begun = std::time::Instant::now();
    let found = match table.read("table", model) {
        Ok(record) => diagnose(model, vec![record], &[], &|_| ()),
        Err(faults) => {
            println!("{what}: refused: {}", faults.list[0].problem);
            return None;
        }
    };
    println!(
        "{what}: {:?} in {:.1} s: {}",
        found.findings.verdict,
        begun.elapsed().as_secs_f64(),
        found.findings.sentence.chars().take(300).collect::<String>()
    );
    Some(found)
}

/// A cause at its bound is never named: that leaves a tie between causes that all are within.
fn is_wrong(found: &Diagnosis) -> bool {
    matches!(
        found.findings.verdict,
        Verdict::Explained | Verdict::MostlyExplained | Verdict::Consistent
    )
}

fn none_explains(tables: Vec<(String, Table)>) {
    let wrong = tables
        .iter()
        .filter(|(what, table)| ended(what, table, &model()).is_some_and(|found| is_wrong(&found)));
    let names: Vec<&str> = wrong.map(|(what, _)| what.as_str()).collect();
    assert!(names.is_empty(), "{} of {}: {names:#?}", names.len(), tables.len());
}

fn settled_nonsense() -> Vec<(String, Table)> {
    let mut random = Noise(11);
    let mut list = Vec::new();
    for rows in [4, 6, 9, 14, 25] {
        let clean = points(&Bench::default(), rows, &mut random);
        let v_in = 200.0;
        let boost = Bench {
            wiring: Wiring::Boost,
            v_in: 60.0,
            ..Bench::default()
        };
        let inverting = Bench {
            wiring: Wiring::BuckBoost,
            v_in: 100.0,
            ..Bench::default()
        };
        let made = [
            (
                "square of the duty",
                replaced(clean.clone(), "v_out", |d, _| v_in * d * d),
            ),
            (
                "root of the duty",
                replaced(clean.clone(), "v_out", |d, _| v_in * d.sqrt()),
            ),
            (
                "sine of the duty",
                replaced(clean.clone(), "v_out", |d, _| v_in * (0.5 + 0.3 * (9.0 * d).sin())),
            ),
            (
                "held at 80 V above",
                replaced(clean.clone(), "v_out", |d, _| (v_in * d).min(80.0)),
            ),
            ("boost", points(&boost, rows, &mut random)),
            ("buck-boost", points(&inverting, rows, &mut random)),
            ("rows permuted", permuted(clean.clone(), "v_out", &mut random)),
        ];
        for (what, table) in made {
            let table = table.without(&["i_l", "v_in"]).measured(&OF_POINTS, &mut random);
            list.push((format!("{what}, {rows} points"), table));
        }
    }
    list
}

fn nonsense_over_time() -> Vec<(String, Table)> {
    let mut random = Noise(12);
    let mut list = Vec::new();
    for rows in [24, 45, 120] {
        let load = vec![(0.0, 0.0, 5.0)];
        let clean = record(&Bench::default(), rows, false);
        let boost = Bench {
            wiring: Wiring::Boost,
            v_in: 100.0,
            load: load.clone(),
            ..Bench::default()
        };
        let mut walk = Noise(rows as u64);
        let mut level = 100.0;
        let mut wandering = clean.clone();
        for value in wandering.column("v_out") {
            level += 1.5 * walk.normal();
            *value = level;
        }
        let made = [
            ("boost", record(&boost, rows, false)),
            ("rows permuted", permuted(clean.clone(), "v_out", &mut random)),
            ("a random walk", wandering),
            (
                "a sine",
                replaced(clean.clone(), "v_out", |_, t| 100.0 + 15.0 * (40.0 * t).sin()),
            ),
            (
                "square of the duty",
                replaced(clean.clone(), "v_out", |d, _| 350.0 * d * d),
            ),
            ("another run", {
                let other = record(&Bench::default(), rows, true);
                let mut mixed = clean.clone();
                *mixed.column("v_out") = other.clone().column("v_out").clone();
                *mixed.column("i_l") = other.clone().column("i_l").clone();
                mixed
            }),
        ];
        for (what, table) in made {
            let table = table.without(&["v_in", "i_out"]).measured(&OF_ROWS, &mut random);
            list.push((format!("{what}, {rows} rows"), table));
        }
    }
    list
}

/// No filter lets rows in disorder through, so that no cause is sought: a search in thousands of rows takes its longest and finds nothing.
#[test]
fn rows_in_disorder_are_not_searched() {
    let mut random = Noise(61);
    let table = permuted(record(&Bench::default(), 900, true), "i_l", &mut random);
    let table = permuted(
        replaced(table, "v_out", |d, at| 200.0 * d + 40.0 * (at - 0.5)),
        "v_out",
        &mut random,
    );
    let found = ended("rows in disorder", &table.measured(&OF_ROWS, &mut random), &model()).unwrap();
    assert_eq!(found.findings.verdict, Verdict::Unexplained);
    assert!(
        found.findings.sentence.contains("lets through"),
        "{}",
        found.findings.sentence
    );
    let null = found.attribution.null.chi2;
    assert!(found.attribution.singles.iter().all(|single| single.state.chi2 == null));
}

/// A record of steps of the duty, at a resistor or at a current.
fn stepped(bench: &Bench) -> Bench {
    let levels = [0.4, 0.62, 0.3, 0.55, 0.47, 0.35];
    Bench {
        rows: 480,
        duty: levels.iter().enumerate().map(|(n, d)| (80 * n, *d)).collect(),
        ..bench.clone()
    }
}

/// No cause makes a voltage that the duty does not raise: nothing is sought, whatever the load does.
#[test]
fn a_voltage_that_does_not_rise_with_the_duty_is_not_searched() {
    let mut random = Noise(71);
    let loads = [
        vec![(0.0, 0.0, 5.0)],
        vec![(0.0, 0.0, 5.0), (120.0, 0.0, 9.0), (280.0, 0.0, 6.0)],
    ];
    type Law = fn(f64) -> f64;
    let falls: [(&str, Law); 3] = [
        ("falls with the duty", |d| 200.0 * (1.0 - d).powi(2)),
        ("falls with the duty", |d| 90.0 - 20.0 * d),
        ("does not rise with the duty", |_| 100.0),
    ];
    for load in loads {
        for (words, law) in falls {
            let bench = stepped(&Bench {
                load: load.clone(),
                ..Bench::default()
            });
            let set = |n: usize| {
                load.iter()
                    .rev()
                    .find(|step| step.0 <= n as f64)
                    .map_or(5.0, |step| step.2)
            };
            let table = bench.run().with("i_load", (0..bench.rows).map(set).collect());
            let table = replaced(table, "v_out", |d, _| law(d)).without(&["v_in", "i_out"]);
            let found = ended(words, &table.measured(&OF_ROWS, &mut random), &model()).unwrap();
            assert_eq!(found.findings.verdict, Verdict::Unexplained);
            assert!(
                found.findings.sentence.contains(words),
                "{words}: {}",
                found.findings.sentence
            );
            let null = found.attribution.null.chi2;
            assert!(found.attribution.singles.iter().all(|single| single.state.chi2 == null));
        }
    }
}

/// A source that gives away a quarter, a counter of few steps, a load that pulls the voltage down as the duty rises: the voltage of each rises too
/// little or falls, and each is a converter.
#[test]
fn what_a_converter_does_is_not_taken_for_a_voltage_that_does_not_rise() {
    let mut random = Noise(72);
    let weak = stepped(&Bench {
        r_ds_on: 5.0,
        load: vec![(0.0, 0.1, 0.0)],
        ..Bench::default()
    });
    let mut coarse = stepped(&Bench::default());
    for (_, duty) in &mut coarse.duty {
        *duty = (*duty * 8.0).floor() / 8.0;
    }
    // as a controller does that holds the voltage, and a little too little
    let mut held = stepped(&Bench {
        dcr: 2.0,
        ..Bench::default()
    });
    held.load = (held.duty.iter())
        .map(|(row, d)| (*row as f64, 0.0, 100.0 * (*d - 0.25) + 1.0))
        .collect();
    let commanded = stepped(&Bench::default()).duty;
    for (what, bench, load) in [
        ("weak", &weak, "r_load"),
        ("coarse", &coarse, "i_load"),
        ("held", &held, "i_load"),
    ] {
        let set = |n: usize| bench.load.iter().rev().find(|step| step.0 <= n as f64);
        let set = (0..bench.rows).map(|n| set(n).map_or(0.0, |(_, g, i)| if load == "r_load" { 1.0 / g } else { *i }));
        let mut table = bench.run().with(load, set.collect());
        for (n, duty) in table.column("duty").iter_mut().enumerate() {
            *duty = bench::at(&commanded, n as isize, |step| step.0).1;
        }
        let table = table.without(&["v_in", "i_out"]).measured(&OF_ROWS, &mut random);
        let found = ended(what, &table, &model()).unwrap();
        assert!(
            !found.findings.sentence.contains("rise"),
            "{what}: {}",
            found.findings.sentence
        );
        assert!(found.attribution.best.is_some(), "{what}");
    }
}

#[test]
fn settled_points_that_no_buck_gives_are_never_explained() {
    none_explains(settled_nonsense());
}

#[test]
fn records_that_no_buck_gives_are_never_explained() {
    none_explains(nonsense_over_time());
}

/// A good table, the cause that is in it, and the number of rows.
fn good() -> Vec<(&'static str, usize, Table)> {
    let mut random = Noise(13);
    let nominal = Bench::default;
    let benches: [(&str, Bench); 6] = [
        ("", nominal()),
        ("dcr", Bench { dcr: 0.6, ..nominal() }),
        ("diode", Bench { v_f: 3.5, ..nominal() }),
        (
            "v_gain",
            Bench {
                gain: [1.03, 1.0, 1.0, 1.0],
                ..nominal()
            },
        ),
        (
            "v_offset",
            Bench {
                offset: [1.5, 0.0, 0.0, 0.0],
                ..nominal()
            },
        ),
        (
            "dead_time",
            Bench {
                lost: 0.01,
                ..nominal()
            },
        ),
    ];
    let mut list = Vec::new();
    for (id, bench) in &benches {
        for rows in [3, 5, 8, 20] {
            let table = points(bench, rows, &mut random).without(&["v_in"]);
            list.push((*id, rows, table.measured(&OF_POINTS, &mut random)));
        }
        for rows in [24, 45, 300] {
            let table = record(bench, rows, rows != 45).without(&["v_in", "i_out"]);
            list.push((*id, rows, table.measured(&OF_ROWS, &mut random)));
        }
    }
    list
}

#[test]
fn good_tables_of_any_length_keep_their_answer() {
    let all = good();
    let is_kept = |(id, rows, table): &&(&str, usize, Table)| {
        let found = ended(&format!("[{id}] {rows}"), table, &model()).unwrap().findings;
        let names = |list: &[diagnose::findings::Named]| {
            let all = list
                .iter()
                .flat_map(|cause| cause.rivals.iter().flatten().copied().chain([cause.id]));
            all.collect::<Vec<_>>()
        };
        match *id {
            "" => found.verdict == Verdict::Consistent,
            id => found.verdict != Verdict::Unexplained && names(&found.causes).contains(&id),
        }
    };
    let lost: Vec<String> = all
        .iter()
        .filter(|one| !is_kept(one))
        .map(|(id, rows, _)| format!("[{id}] {rows}"))
        .collect();
    assert!(
        lost.len() * 100 <= 3 * all.len(),
        "{} of {}: {lost:?}",
        lost.len(),
        all.len()
    );
}
