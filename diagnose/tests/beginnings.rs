//! Where a simulation begins, at the start of a record and behind lost rows: a current that is not what its slow sensor shows, and a load
//! that has not come to rest.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, at, integrate, of};
use diagnose::diagnosis::diagnose;
use diagnose::findings::{Findings, Verdict};
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
