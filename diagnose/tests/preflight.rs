//! Faults of a bench that no cause of the list is: each is named before or behind the fit, with what mends it, and no good record is
//! suspected. The records come from a circuit that shares nothing with the plant (`bench`).

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, Wiring, model, of};
use diagnose::drive::Model;
use diagnose::fit::State;
use diagnose::noise;
use diagnose::problem::Problem;
use diagnose::record::Record;
use diagnose::{preflight, supply};

const ROWS: usize = 150;

/// A record of steps of duty and load of this size, with the load as it was set.
fn clean(random: &mut Noise) -> Table {
    made(&Bench::default(), random)
}

fn made(bench: &Bench, random: &mut Noise) -> Table {
    let low = random.between(4.0, 6.0);
    let (first, second) = (random.between(35.0, 55.0).floor(), random.between(90.0, 110.0).floor());
    let d = random.between(0.4, 0.55);
    let load = vec![(0.0, 0.0, low), (first, 0.0, 1.5 * low), (second, 0.0, 0.8 * low)];
    let bench = Bench {
        rows: ROWS,
        duty: vec![(0, d), (70, d + 0.07), (125, d - 0.06)],
        load: load.clone(),
        ..bench.clone()
    };
    let set = (0..ROWS).map(|n| {
        load.iter()
            .rev()
            .find(|step| step.0 <= n as f64)
            .map_or(low, |step| step.2)
    });
    let table = bench.run().with("i_load", set.collect());
    let noises = [
        ("v_out", 0.1, 0.02),
        ("i_l", 0.05, 5e-3),
        ("i_out", 0.05, 5e-3),
        ("v_in", 0.1, 0.02),
    ];
    table.measured(&noises, random)
}

/// What is said of a training record before any cause is sought: its fault, or its notes and those of the preflight.
fn said(table: &Table) -> String {
    let record = match table.read("run", &model()) {
        Ok(record) => record,
        Err(faults) => return format!("{faults}"),
    };
    let base = Model::new(&model());
    let repairs = record.repairs.join("\n");
    let mut problem = Problem::new(vec![record], base.clone());
    let null = State::settle(&problem, &base, &problem.first_starts(&base), None);
    problem.sigma = noise::sigma(&problem, &null.residual);
    let null = State::settle(&problem, &base, &null.starts, None);
    let mut all = vec![repairs];
    all.extend(preflight::readings(&problem, &null).into_iter().map(|one| one.words));
    all.join("\n")
}

fn shifted(mut table: Table, by: isize) -> Table {
    for name in ["v_out", "i_l", "i_out", "v_in"] {
        let old = table.column(name).clone();
        let at = |row: usize| old[row.saturating_add_signed(-by).min(old.len() - 1)];
        *table.column(name) = (0..old.len()).map(at).collect();
    }
    table
}

fn scaled(mut table: Table, name: &str, by: f64) -> Table {
    table.column(name).iter_mut().for_each(|value| *value *= by);
    table
}

fn exchanged(mut table: Table, a: &str, b: &str) -> Table {
    let old = table.column(a).clone();
    *table.column(a) = std::mem::replace(table.column(b), old);
    table
}

fn clipped(mut table: Table, name: &str, share: f64) -> Table {
    let values = table.column(name);
    let (low, high) = values
        .iter()
        .fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(*v), h.max(*v)));
    let end = low + share * (high - low);
    values.iter_mut().for_each(|value| *value = value.min(end));
    table
}

/// What is wrong, the table, and the words that name it.
fn faulty() -> Vec<(String, Table, &'static str)> {
    let mut random = Noise(21);
    let mut list = Vec::new();
    for turn in 0..3 {
        let mut add =
            |what: String, table: Table, words: &'static str| list.push((format!("{what} [{turn}]"), table, words));
        for by in [-4, -3, -2, -1, 1, 2, 3, 4] {
            add(
                format!("shifted by {by}"),
                shifted(clean(&mut random), by),
                "looks shifted by",
            );
        }
        for (name, by) in [("v_out", 1e3), ("i_l", 1e3), ("v_out", 1e-3), ("i_out", 1e-3)] {
            add(
                format!("{name} x {by}"),
                scaled(clean(&mut random), name, by),
                "is not in",
            );
        }
        add(
            "v and i".into(),
            exchanged(clean(&mut random), "v_out", "i_l"),
            "exchanged",
        );
        add(
            "i and i".into(),
            exchanged(clean(&mut random), "i_out", "i_l"),
            "exchanged",
        );
        add(
            "v and v".into(),
            exchanged(clean(&mut random), "v_out", "v_in"),
            "exchanged",
        );
        add("clipped v".into(), clipped(clean(&mut random), "v_out", 0.7), "cut off");
        add("clipped i".into(), clipped(clean(&mut random), "i_l", 0.7), "cut off");
        add(
            "other load".into(),
            scaled(clean(&mut random), "i_load", 2.0),
            "not the load that was drawn",
        );
        add(
            "half the load".into(),
            scaled(clean(&mut random), "i_load", 0.5),
            "not the load that was drawn",
        );
        for (wiring, v_in) in [(Wiring::Boost, 200.0), (Wiring::BuckBoost, 200.0)] {
            let bench = Bench {
                wiring,
                v_in,
                ..Bench::default()
            };
            add(
                format!("{wiring:?}"),
                made(&bench, &mut random),
                "and the model is a buck",
            );
        }
    }
    list
}

#[test]
fn nine_of_ten_faults_of_a_bench_are_named() {
    let all = faulty();
    let is_missed = |(_, table, words): &&(String, Table, &str)| !said(table).contains(words);
    let missed: Vec<&str> = all.iter().filter(is_missed).map(|(what, ..)| what.as_str()).collect();
    println!("{} of {} missed: {missed:?}", missed.len(), all.len());
    assert!(
        10 * missed.len() <= all.len(),
        "{} of {}: {missed:?}",
        missed.len(),
        all.len()
    );
}

#[test]
fn no_good_record_is_suspected() {
    let mut random = Noise(22);
    let benches = [
        Bench::default(),
        Bench {
            dcr: 0.5,
            ..Bench::default()
        },
        Bench {
            capacitance: 120e-6,
            ..Bench::default()
        },
        Bench {
            gain: [1.0, 0.95, 1.0, 1.0],
            ..Bench::default()
        },
    ];
    for turn in 0..100 {
        let said = said(&made(&benches[turn % 4], &mut random));
        assert_eq!(said.trim(), "", "{turn}");
    }
}

/// A small inductance: at the instant of sampling the current is half of its mean, and the duty that is the middle of all is not the
/// one that belongs to the middle load.
#[test]
fn ripple_at_the_instant_of_sampling_is_no_probe() {
    let mut random = Noise(29);
    for (sampled, conductance) in [(0.39, 0.3), (0.39, 0.22), (0.61, 0.22), (0.0, 0.4)] {
        let bench = Bench {
            v_in: 24.0,
            inductance: 22e-6,
            capacitance: 220e-6,
            f_sw: 200e3,
            dcr: 0.08,
            v_f: 0.45,
            rows: ROWS,
            sampled,
            duty: vec![(0, 0.2), (40, 0.23), (75, 0.27)],
            load: vec![(0.0, conductance, 0.0), (112.0, 0.6 * conductance, 0.0)],
            ..Bench::default()
        };
        let digits = [
            ("v_out", 0.004, 1e-3),
            ("i_l", 0.01, 1e-3),
            ("i_out", 0.008, 1e-3),
            ("v_in", 0.01, 1e-3),
        ];
        let table = bench.run().measured(&digits, &mut random);
        let read = table
            .read("run", &of(&bench))
            .map(|_| ())
            .map_err(|faults| faults.to_string());
        assert_eq!(read, Ok(()), "{sampled} {conductance}");
        // half of it still is one, where the current surely never rests
        if conductance > 0.25 {
            let halved = scaled(table, "i_l", 0.5);
            let faults = halved.read("run", &of(&bench)).map(|_| ()).unwrap_err().to_string();
            let wanted = "i_l is 0.5 times what the model has";
            assert!(faults.contains(wanted), "{sampled} {conductance}: {faults}");
        }
    }
}

/// A filter that hardly damps: behind each step the current swings by more than its mean through the rest of the record, and the median
/// of its rows is far from what rest would show.
#[test]
fn a_current_that_swings_is_no_probe() {
    let mut random = Noise(31);
    for sampled in [0.2, 0.3] {
        let bench = Bench {
            v_in: 6.4,
            inductance: 0.32e-6,
            capacitance: 140e-6,
            f_sw: 690e3,
            dcr: 4e-3,
            esr: 8e-4,
            r_ds_on: 3e-3,
            v_f: 0.02,
            r_d: 1e-3,
            rows: ROWS,
            sampled,
            duty: vec![
                (0, 0.66),
                (12, 0.61),
                (38, 0.465),
                (68, 0.387),
                (96, 0.53),
                (120, 0.374),
            ],
            load: vec![(0.0, 0.9, 6.0), (68.0, 0.9, 7.8), (120.0, 0.9, 5.4)],
            ..Bench::default()
        };
        let digits = [
            ("v_out", 0.002, 1e-3),
            ("i_l", 0.02, 1e-3),
            ("i_out", 0.02, 1e-3),
            ("v_in", 0.003, 1e-3),
        ];
        let table = bench.run().measured(&digits, &mut random);
        // the plant file says another instant
        let mut believed = of(&bench);
        believed.pwm.sampling_phase = 0.0;
        let read = table
            .read("run", &believed)
            .map(|_| ())
            .map_err(|faults| faults.to_string());
        assert_eq!(read, Ok(()), "{sampled}");
    }
}

fn read(name: &str, table: &Table) -> Record {
    table.read(name, &model()).unwrap()
}

#[test]
fn columns_a_row_ahead_are_no_sampling_instant_and_columns_a_row_behind_may_be_one() {
    let mut random = Noise(31);
    let mut found = |by: isize| {
        let records = ["a", "b"].map(|name| read(name, &shifted(clean(&mut random), by)));
        diagnose::diagnosis::diagnose(&model(), records.to_vec(), &[], &|_| ()).findings
    };
    let ahead = found(-1);
    assert_eq!(
        ahead.verdict,
        diagnose::findings::Verdict::Unexplained,
        "{}",
        ahead.sentence
    );
    assert!(
        ahead.causes.is_empty() && ahead.sentence.contains("looks shifted by 1 row"),
        "{}",
        ahead.sentence
    );
    // what is a period old an instrument may have held back
    let behind = found(1);
    let ids: Vec<&str> = behind.causes.iter().map(|cause| cause.id).collect();
    assert!(!ids.is_empty(), "{}", behind.sentence);
    assert!(
        ["sampling_delay", "sensor_delay", "duty_delay"].contains(&ids[0]),
        "{}",
        behind.sentence
    );
}

#[test]
fn a_held_out_record_at_another_source_is_named_with_its_map() {
    let mut random = Noise(23);
    let train = [read("first", &clean(&mut random))];
    let low = Bench {
        v_in: 170.0,
        ..Bench::default()
    };
    let mut table = made(&low, &mut random).without(&["v_in"]);
    let held = [read("second", &table)];
    let said = supply::sources(&train, &held, &Model::new(&model()));
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("[records.second] constants = { v_in = 1"), "{said:?}");
    table = clean(&mut random);
    let held = [read("second", &table)];
    assert!(supply::sources(&train, &held, &Model::new(&model())).is_empty());
}

#[test]
fn a_held_out_record_that_is_a_training_record_is_found() {
    let mut random = Noise(24);
    let (one, other) = (clean(&mut random), clean(&mut random));
    let train = [read("first", &one)];
    let held = [read("second", &one), read("third", &other)];
    assert_eq!(preflight::repeated(&train, &held), [("second", "first")]);
}

/// The table is another bench's by nothing but the carrier of the plant file.
#[test]
fn a_wrong_carrier_is_named() {
    let mut random = Noise(25);
    let mut wrong = model();
    (wrong.pwm.carrier, wrong.pwm.sampling_phase) = (plant::Carrier::Trailing, 0.5);
    let [train, held] = [clean(&mut random), clean(&mut random)].map(|table| table.without(&["i_out", "v_in"]));
    let [train, held] = [("first", train), ("second", held)].map(|(name, table)| table.read(name, &wrong).unwrap());
    let found = diagnose::diagnosis::diagnose(&wrong, vec![train], &[held], &|_| ());
    let findings = &found.findings;
    let notes = findings.noise.repairs.join("\n");
    println!("{}\n{notes}", findings.sentence);
    assert_eq!(findings.verdict, diagnose::findings::Verdict::Explained);
    assert!(notes.contains("`carrier = \"centre\"` is taken"), "{notes}");
}

/// At a duty of 0.4 a buck-boost gives nearly what a buck gives at 1 - d: one number tells neither, and a duty that moves tells the
/// direction.
#[test]
fn a_buck_boost_at_a_low_duty_is_no_turned_duty() {
    let mut random = Noise(26);
    for duty in [vec![(0, 0.4)], vec![(0, 0.38), (70, 0.42)]] {
        let bench = Bench {
            wiring: Wiring::BuckBoost,
            rows: ROWS,
            duty,
            load: vec![(0.0, 0.0, 5.0)],
            ..Bench::default()
        };
        let table = bench.run().with("i_load", vec![5.0; ROWS]);
        let table = table.measured(
            &[("v_out", 0.1, 0.02), ("i_l", 0.05, 5e-3), ("i_out", 0.05, 5e-3)],
            &mut random,
        );
        let said = said(&table);
        assert!(!said.contains("1 - d"), "{said}");
    }
}

#[test]
fn another_load_and_another_source_are_noted_before_the_search() {
    let mut random = Noise(27);
    let said_of =
        |bench: &Bench, name: &str, times: f64, random: &mut Noise| said(&scaled(made(bench, random), name, times));
    let set = said_of(&Bench::default(), "i_load", 1.0 / 1.3, &mut random);
    assert!(set.contains("looks as if the load drew 1.3"), "{set}");
    let low = Bench {
        v_in: 170.0,
        ..Bench::default()
    };
    let source = said_of(&low, "v_out", 1.0, &mut random);
    assert!(source.contains("looks like a source of about 1"), "{source}");
}

/// Two thirds of the set load: with ripple and losses the current of the inductor looks like half of it, and no probe is wrong.
#[test]
fn a_load_that_both_meters_show_is_no_probe() {
    let mut random = Noise(30);
    let bench = Bench {
        dcr: 1.0,
        ..Bench::default()
    };
    let said = said(&scaled(made(&bench, &mut random), "i_load", 1.0 / 0.66));
    assert!(!said.contains("i_l is 0.5 times"), "{said}");
}

#[test]
fn spikes_are_left_out_on_a_swing_and_in_a_held_out_record() {
    let mut random = Noise(28);
    let train = read("train", &clean(&mut random));
    let mut table = clean(&mut random);
    for row in [40, 75, 131] {
        table.column("i_l")[row] += 4.0;
    }
    let held = read("held", &table);
    let found = diagnose::diagnosis::diagnose(&model(), vec![train], &[held], &|_| ());
    let notes = found.findings.noise.repairs.join("\n");
    assert!(
        notes.contains("spikes of single rows are left out: i_l of held"),
        "{notes}"
    );
    assert!(
        found.findings.gain.shifts.is_empty(),
        "{:?}",
        found.findings.gain.shifts
    );
}
