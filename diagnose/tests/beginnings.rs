//! Where a simulation begins, at the start of a record and behind lost rows: a current that is not what its slow or late sensor shows, a load
//! that has not come to rest, and an output that collapsed for a while.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;
mod folder;

use bench::{Bench, Noise, Table, at, integrate, named, of};
use diagnose::diagnosis::diagnose;
use diagnose::findings::{Findings, Verdict};
use folder::{findings, ids};
use plant::{Carrier, Parameters};

/// The table without these rows, as a logger leaves it that was too slow for a while.
fn losing(mut table: Table, rows: &[std::ops::Range<usize>]) -> Table {
    for (_, values) in &mut table.0 {
        let mut row = 0;
        values.retain(|_| {
            row += 1;
            !rows.iter().any(|range| range.contains(&(row - 1)))
        });
    }
    table
}

fn consistent(findings: &Findings) {
    assert_eq!(
        findings.verdict,
        Verdict::Consistent,
        "{} {:?}",
        findings.sentence,
        findings.noise.repairs
    );
}

#[test]
fn behind_a_steep_ripple_a_slow_sensor_shows_another_current_than_flows() {
    // 9 A of ripple beside a mean of 5 A, and a filter of an eighth of the period: where the simulation began with what is shown, the diode
    // stopped the current, and no fit found its way back
    let mut random = Noise(41);
    for (carrier, share) in [(Carrier::Trailing, 0.0), (Carrier::Leading, 1.0)] {
        let bench = |duty: &[(usize, f64)], load: &[(f64, f64, f64)]| Bench {
            v_in: 14.0,
            inductance: 16e-6,
            capacitance: 470e-6,
            f_sw: 20e3,
            dcr: 0.025,
            esr: 0.008,
            r_ds_on: 0.03,
            v_f: 0.5,
            r_d: 0.006,
            slow: [0.0, 0.13, 0.0, 0.0],
            carrier: share,
            duty: duty.to_vec(),
            load: load.to_vec(),
            ..Bench::default()
        };
        let runs = [
            bench(&[(0, 0.74)], &[(0.0, 0.0, 5.2), (62.0, 0.0, 6.5), (130.0, 0.0, 5.6)]),
            bench(&[(0, 0.72), (70, 0.75), (140, 0.73)], &[(0.0, 0.0, 5.5)]),
        ];
        let mut model = of(&runs[0]);
        model.pwm.carrier = carrier;
        model.sensors.i_l.low_pass = 0.13 / 20e3;
        let table = |run: &Bench, random: &mut Noise| {
            let level = |n: usize| {
                let of = run.load.iter().rev().find(|step| step.0 <= n as f64);
                of.map_or(0.0, |step| step.2)
            };
            let set = (0..run.rows).map(level).collect();
            let whole = run.run().with("i_load", set);
            let noisy = whole.measured(
                &[("v_out", 2e-3, 1e-4), ("i_l", 0.02, 1e-3), ("i_out", 0.02, 1e-3)],
                random,
            );
            losing(noisy, &[20..23, 88..90, 101..109])
        };
        let records = ["load", "duty"].iter().zip(&runs);
        let records = records.map(|(name, run)| table(run, &mut random).read(name, &model).unwrap());
        consistent(&diagnose(&model, records.collect(), &[], &|_| ()).findings);
    }
}

const PERIOD: f64 = 10e-6;
const PHASE: f64 = 0.8;
const ROWS: usize = 320;
/// Of the load's power, periods.
const LAG: f64 = 9.0;

const MODEL: &str = "[converter]\nv_in = 48.0\ninductance = 33e-6\ncapacitance = 220e-6\nf_sw = 100e3\nrectifier = \"synchronous\"\n\
                     [inductor]\ndcr = 0.04\n[capacitor]\nesr = 0.01\n[pwm]\nsampling_phase = 0.8\n[load]\ncpl_time_constant = 90e-6\n";

/// Output voltage for inductor current, capacitor and what the regulated load draws.
fn output([i, v, drawn]: [f64; 3]) -> f64 {
    (v + 0.01 * (i - drawn)) / (1.0 + 0.01 / 4.0)
}

fn stretch(x: &mut [f64; 3], (source, power): (f64, f64), share: f64) {
    integrate(x, share * PERIOD / 8.0, 8, |x| {
        let out = output(x);
        [
            (source - 0.04 * x[0] - out) / 33e-6,
            (x[0] - x[2] - out / 4.0) / 220e-6,
            (power / out - x[2]) / (LAG * PERIOD),
        ]
    });
}

/// From each row on: the power that a regulated load of 12 V draws, which follows its setting slowly, beside a resistor of 4 ohm.
fn record(course: &[(usize, f64)], seed: u64) -> Table {
    let mut random = Noise(seed);
    let mut x = [6.0, 12.0, course[0].1 / 12.0];
    let mut table = Table::of(&["t", "duty", "v_out", "i_l", "r_load", "p_load"]);
    for row in -3000..ROWS as isize {
        let power = at(course, row, |step| step.0).1;
        stretch(&mut x, (48.0, power), 0.25);
        stretch(&mut x, (0.0, power), PHASE - 0.25);
        if row >= 0 {
            let out = output(x);
            let time = (row as f64 + PHASE) * PERIOD;
            let values = [
                time,
                0.25,
                out + 2e-3 * random.normal(),
                x[0] + 0.01 * random.normal(),
                4.0,
                power,
            ];
            table.push(&values);
        }
        stretch(&mut x, (0.0, power), 1.0 - PHASE);
    }
    table
}

#[test]
fn behind_lost_rows_a_load_of_constant_power_is_still_on_its_way() {
    let model = Parameters::from_toml("plant.toml".as_ref(), MODEL).unwrap();
    // the load steps among the rows that were lost
    let courses: [&[(usize, f64)]; 2] = [
        &[(0, 20.0), (61, 44.0), (151, 12.0), (243, 30.0)],
        &[(0, 35.0), (82, 15.0), (170, 40.0), (250, 25.0)],
    ];
    let lost = [[60..64, 150..153, 242..247], [81..84, 168..173, 249..252]];
    let records = (0..2).map(|n| {
        let table = losing(record(courses[n], 5 + n as u64), &lost[n]);
        table.read(["first", "second"][n], &model).unwrap()
    });
    consistent(&diagnose(&model, records.collect(), &[], &|_| ()).findings);
}

fn found(model: &Parameters, tables: &[Table]) -> Findings {
    let records = tables.iter().zip(["first", "second", "third"]);
    let records = records.map(|(table, name)| table.read(name, model).unwrap());
    let findings = diagnose(model, records.collect(), &[], &|_| ()).findings;
    println!(
        "{:?}: {}\n{}",
        findings.verdict,
        findings.sentence,
        findings.noise.repairs.join("\n")
    );
    findings
}

/// What an electronic load was set to in each row.
fn set(bench: &Bench) -> Vec<f64> {
    let level = |n: usize| at(&bench.load, n as isize, |step| step.0 as usize).2;
    (0..bench.rows).map(level).collect()
}

/// A buck that is on where its period starts, and is sampled late in it.
fn trailing(duty: &[(usize, f64)], load: &[(f64, f64, f64)]) -> Bench {
    Bench {
        v_in: 24.0,
        inductance: 22e-6,
        capacitance: 100e-6,
        f_sw: 100e3,
        dcr: 0.03,
        esr: 0.05,
        r_ds_on: 0.02,
        v_f: 0.5,
        r_d: 0.01,
        carrier: 0.0,
        sampled: 0.7,
        duty: duty.to_vec(),
        load: load.to_vec(),
        ..Bench::default()
    }
}

fn trailing_model(bench: &Bench) -> Parameters {
    let mut model = of(bench);
    (model.pwm.carrier, model.pwm.sampling_phase) = (Carrier::Trailing, bench.sampled);
    model
}

/// What was true `late` periods before each sample.
fn earlier(bench: &Bench, late: f64, name: &str) -> Vec<f64> {
    let instant = bench.sampled - late;
    let periods = (-instant.floor()).max(0.0) as usize;
    let older = Bench {
        sampled: instant + periods as f64,
        ..bench.clone()
    };
    // ahead of the first row everything rests: each of those periods is as the first
    let values = older.run().column(name).clone();
    let ahead = vec![values[0]; periods];
    [&ahead, &values[..values.len() - periods]].concat()
}

/// Of 2.5 A of ripple an ESR of 50 mohm makes 130 mV, which tell one instant of the period from another.
#[test]
fn a_voltage_alone_that_is_shown_late_is_no_other_cause() {
    let runs = [
        trailing(&[(0, 0.45)], &[(0.0, 0.0, 4.0), (60.0, 0.0, 6.5), (130.0, 0.0, 3.0)]),
        trailing(&[(0, 0.42), (50, 0.5), (110, 0.38), (160, 0.47)], &[(0.0, 0.0, 5.0)]),
    ];
    let mut random = Noise(51);
    let tables = runs.clone().map(|run| {
        let mut table = run.run().without(&["i_l", "i_out", "v_in"]).with("i_load", set(&run));
        *table.column("v_out") = earlier(&run, 1.3, "v_out");
        table.measured(&[("v_out", 5e-3, 1e-3)], &mut random)
    });
    let findings = found(&trailing_model(&runs[0]), &tables);
    assert!(named(&findings).contains(&"sensor_delay"), "{}", findings.sentence);
}

/// The sensor shows at the sampling instant what flowed half a period before: there the switch was on, and now the current rests.
#[test]
fn a_late_current_is_found_where_a_record_begins_with_a_current_that_rests() {
    let runs = [
        trailing(
            &[(0, 0.4)],
            &[(0.0, 0.0, 0.4), (45.0, 0.0, 0.7), (90.0, 0.0, 3.0), (145.0, 0.0, 1.8)],
        ),
        trailing(
            &[(0, 0.36), (40, 0.42), (80, 0.34), (140, 0.46)],
            &[(0.0, 1.0 / 40.0, 0.0), (100.0, 1.0 / 6.0, 0.0)],
        ),
    ];
    let mut random = Noise(53);
    let tables = runs.clone().map(|run| {
        let run = Bench { sampled: 0.9, ..run };
        let first = run.run().column("i_l")[..20].to_vec();
        assert!(first.iter().all(|i| *i < 1e-9), "{first:?}");
        let mut table = run.run().without(&["i_out", "v_in"]).with("i_load", set(&run));
        let conductance = |n: usize| at(&run.load, n as isize, |step| step.0 as usize).1;
        let ohm = |n: usize| match conductance(n) {
            0.0 => 0.0,
            g => 1.0 / g,
        };
        table = table.with("r_load", (0..run.rows).map(ohm).collect());
        *table.column("i_l") = earlier(&run, 0.5, "i_l");
        table.measured(&[("v_out", 5e-3, 1e-3), ("i_l", 0.02, 1e-3)], &mut random)
    });
    let mut model = trailing_model(&runs[0]);
    model.pwm.sampling_phase = 0.9;
    let findings = found(&model, &tables);
    let ids: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
    assert_eq!(
        (findings.verdict, &ids[..]),
        (Verdict::Explained, &["sensor_delay"][..]),
        "{}",
        findings.sentence
    );
    let delay = findings.causes[0].parameters["delay_i"].value;
    assert!((delay / 5e-6 - 1.0).abs() < 0.05, "{delay:e}");
}

/// At the peak of its current such a sensor shows about the mean, and the diode ends the current in some periods and in others not.
#[test]
fn a_slow_current_at_its_peak_on_the_verge_of_rest_is_consistent() {
    for (middle, seed) in [(1.2, 55), (1.35, 57)] {
        let mut random = Noise(seed);
        let bench = |duty: &[(usize, f64)], load: &[(f64, f64, f64)]| Bench {
            carrier: 1.0,
            sampled: 0.0,
            slow: [0.0, 1.0 / 3.0, 0.0, 0.0],
            ..trailing(duty, load)
        };
        // half of the ripple is 1.35 A at a duty of 0.45
        let runs = [
            bench(
                &[(0, 0.45)],
                &[
                    (0.0, 0.0, middle),
                    (60.0, 0.0, middle + 0.4),
                    (130.0, 0.0, middle - 0.2),
                ],
            ),
            bench(&[(0, 0.43), (50, 0.48), (110, 0.4), (160, 0.46)], &[(0.0, 0.0, middle)]),
        ];
        let tables = runs.clone().map(|run| {
            let table = run.run().without(&["i_out", "v_in"]).with("i_load", set(&run));
            table.measured(&[("v_out", 5e-3, 1e-3), ("i_l", 0.02, 1e-3)], &mut random)
        });
        let mut model = trailing_model(&runs[0]);
        model.pwm.carrier = Carrier::Leading;
        model.sensors.i_l.low_pass = 1.0 / 3.0 / runs[0].f_sw;
        consistent(&found(&model, &tables));
    }
}

const COLLAPSING: &str = "[converter]\nv_in = 12.0\ninductance = 10e-6\ncapacitance = 47e-6\nf_sw = 200e3\n\
                          [inductor]\ndcr = 0.03\n[capacitor]\nesr = 0.01\n[switch]\nr_ds_on = 0.04\nv_f = 0.4\nr_d = 0.01\n\
                          [pwm]\nsampling_phase = 0.0\n";

/// A switch of 90 mohm behind whose diode the output of 5 V falls while the duty is 0. Below a fifth of it the electronic load lets go.
fn collapsing(course: &[(usize, f64, f64)], seed: u64) -> Table {
    const H: f64 = 5e-6;
    let drawn = |v: f64, load: f64| load * (v / 0.5 - 1.0).clamp(0.0, 1.0);
    let slope = |x: [f64; 2], is_on: bool, load: f64| {
        let out = x[1] + 0.01 * (x[0] - drawn(x[1], load));
        let leg = if is_on { 12.0 - 0.09 * x[0] } else { -0.4 - 0.01 * x[0] };
        let rise = (leg - 0.03 * x[0] - out) / 10e-6;
        let rests = x[0] <= 0.0 && rise < 0.0;
        [if rests { 0.0 } else { rise }, (x[0] - drawn(x[1], load)) / 47e-6]
    };
    let (mut x, mut random) = ([course[0].2, 5.0], Noise(seed));
    let mut table = Table::of(&["t", "duty", "v_out", "i_l", "i_load"]);
    for row in -1500..260isize {
        let (_, duty, load) = *at(course, row, |step| step.0);
        if row >= 0 {
            let before = at(course, row - 1, |step| step.0).2;
            let out = x[1] + 0.01 * (x[0] - drawn(x[1], before));
            let values = [
                row as f64 * H,
                duty,
                out + 3e-3 * random.normal(),
                x[0] + 0.01 * random.normal(),
                load,
            ];
            table.push(&values);
        }
        for (is_on, share) in [(true, duty), (false, 1.0 - duty)] {
            for _ in 0..100 {
                integrate(&mut x, share * H / 100.0, 1, |x| slope(x, is_on, load));
                x[0] = x[0].max(0.0);
            }
        }
    }
    table
}

#[test]
fn a_switch_is_found_beside_an_output_that_collapses_for_a_while() {
    let model = Parameters::from_toml("plant.toml".as_ref(), COLLAPSING).unwrap();
    let courses: [&[(usize, f64, f64)]; 2] = [
        // 3 A take 4 V off the capacitor in a dozen periods
        &[(0, 0.45, 3.0), (70, 0.0, 3.0), (88, 0.45, 3.0), (170, 0.45, 4.5)],
        &[(0, 0.45, 2.5), (60, 0.52, 2.5), (120, 0.4, 2.5), (190, 0.47, 4.0)],
    ];
    let mut tables = [collapsing(courses[0], 61), collapsing(courses[1], 62)];
    let low = tables[0].column("v_out").iter().filter(|v| **v < 1.0).count();
    assert!((5..=8).contains(&low), "{low} rows");
    let findings = found(&model, &tables);
    assert!(named(&findings).contains(&"r_ds_on"), "{}", findings.sentence);
    // rows at the instant of a load step are left out as well, with a note of their own
    let notes = findings.noise.repairs.join("\n");
    assert!(notes.contains("of 260 rows v_out is below 20 %"), "{notes}");
}

/// A healthy buck with a diode. Its second record begins with a current that stops within the first period, where no line along the initial state leads,
/// and as long as both records took their step together the first one stayed .1 A off as well: a core loss made it up.
#[test]
fn a_record_that_begins_at_rest_holds_no_other_where_it_begins() {
    consistent(&findings("rest_beside_a_start", &["judge.csv"]));
}

/// A boost from 7.584 V in the place of 7.3 V, a record of which begins where no line leads: the source was not found for the other one.
#[test]
fn a_cause_is_found_though_one_record_begins_where_no_line_leads() {
    let findings = findings("start_beside_a_rest", &["judge.csv"]);
    assert_eq!(findings.verdict, Verdict::Explained, "{}", findings.sentence);
    assert_eq!(ids(&findings), ["v_in_wrong"], "{}", findings.sentence);
    let v_in = &findings.causes[0].parameters["v_in"];
    assert!(v_in.low < 7.58359 && v_in.high > 7.58359, "{v_in:?}");
}

/// A healthy buck; two spikes of 17.7 V among the first eight rows bent the initial state to them, and the model rang where they lay.
#[test]
fn spikes_at_the_start_are_left_out() {
    let findings = findings("spikes_at_the_start", &["judge.csv"]);
    consistent(&findings);
    let rows = ["second:5:v_o", "second:7:v_o"];
    let left_out = |row: &&str| findings.noise.outliers.iter().any(|one| one == row);
    assert!(rows.iter().all(left_out), "{:?}", findings.noise.outliers);
}
