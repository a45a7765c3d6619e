//! A bench supply on leads behind which stands an input capacitor: with and without inductance of the leads, whatever the file says of it.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Noise, Table, at, integrate};
use diagnose::diagnosis::{Diagnosis, diagnose, diagnose_knowing};
use diagnose::findings::Verdict;
use plant::Parameters;

const V_IN: f64 = 18.0;
const L: f64 = 4.7e-6;
const C: f64 = 220e-6;
const R: f64 = 0.02;
const ESR: f64 = 0.007;
const PERIOD: f64 = 1.0 / 300e3;
const ROWS: usize = 700;
/// Steps of Runge and Kutta's method while the switch is on, and while it is off.
const FINE: [usize; 2] = [12, 20];

const MODEL: &str = "[converter]\nv_in = 18.0\ninductance = 4.7e-6\ncapacitance = 220e-6\nf_sw = 300e3\nrectifier = \"synchronous\"\n\
                     [inductor]\ndcr = 0.02\n[capacitor]\nesr = 0.007\n[pwm]\nsampling_phase = 0.0\n";

/// Leads and capacitor in front of the switch.
#[derive(Clone, Copy)]
struct Leads {
    resistance: f64,
    inductance: f64,
    c_in: f64,
    esr_in: f64,
}

const SHORT: Leads = Leads {
    resistance: 0.07,
    inductance: 0.0,
    c_in: 39e-6,
    esr_in: 0.005,
};
const LONG: Leads = Leads {
    resistance: 0.06,
    inductance: 0.9e-6,
    c_in: 68e-6,
    esr_in: 0.012,
};

/// Thin leads: what swings is damped before anything stands out of the records.
const THIN: Leads = Leads {
    resistance: 0.6,
    inductance: 2.2e-6,
    c_in: 10e-6,
    esr_in: 0.05,
};

/// Inductor current, output capacitor, input capacitor, current of the leads.
type X = [f64; 4];

fn slope(x: X, leads: Leads, is_on: bool, load: f64) -> X {
    let drawn = if is_on { x[0] } else { 0.0 };
    let (input, lead) = match leads.inductance > 0.0 {
        true => (x[2] + leads.esr_in * (x[3] - drawn), x[3]),
        // (V_IN - v) / R = (v - v_c) / esr + drawn
        false => {
            let v =
                (V_IN / leads.resistance + x[2] / leads.esr_in - drawn) / (1.0 / leads.resistance + 1.0 / leads.esr_in);
            (v, (V_IN - v) / leads.resistance)
        }
    };
    let out = x[1] + ESR * (x[0] - load);
    [
        (if is_on { input } else { 0.0 } - R * x[0] - out) / L,
        (x[0] - load) / C,
        (lead - drawn) / leads.c_in,
        match leads.inductance > 0.0 {
            true => (V_IN - leads.resistance * x[3] - input) / leads.inductance,
            false => 0.0,
        },
    ]
}

fn stretch(x: &mut X, leads: Leads, is_on: bool, share: f64, load: f64) {
    let steps = FINE[usize::from(!is_on)];
    let h = share * PERIOD / steps as f64;
    integrate(x, h, steps, |x| slope(x, leads, is_on, load));
}

/// Short leads to ceramics: they swing at .65 and .82 of the rows' rate.
const CERAMIC: [Leads; 2] = [
    Leads {
        resistance: 0.08,
        inductance: 0.3e-6,
        c_in: 2.2e-6,
        esr_in: 0.02,
    },
    Leads {
        resistance: 0.12,
        inductance: 0.09e-6,
        c_in: 4.7e-6,
        esr_in: 0.005,
    },
];

/// From each row on: duty and current of an electronic load.
fn record(leads: Leads, course: &[(usize, f64, f64)], seed: u64) -> Table {
    let (mut x, mut random) = ([course[0].2, 5.0, V_IN, 1.0], Noise(seed));
    let mut table = Table::of(&["t", "duty", "v_out", "i_l", "i_out"]);
    for row in -2500..ROWS as isize {
        let (_, duty, load) = *at(course, row, |step| step.0);
        if row >= 0 {
            let values = [
                row as f64 * PERIOD,
                duty,
                x[1] + ESR * (x[0] - load) + 2e-3 * random.normal(),
                x[0] + 0.015 * random.normal(),
                load + 0.015 * random.normal(),
            ];
            table.push(&values);
        }
        stretch(&mut x, leads, true, duty, load);
        stretch(&mut x, leads, false, 1.0 - duty, load);
    }
    table
}

fn found(leads: Leads, certain: &[&str], seed: u64) -> Diagnosis {
    let model = Parameters::from_toml("plant.toml".as_ref(), MODEL).unwrap();
    let courses: [&[(usize, f64, f64)]; 2] = [
        &[(0, 0.29, 2.0), (170, 0.29, 9.0), (350, 0.29, 5.0), (520, 0.29, 12.0)],
        &[(0, 0.29, 7.0), (170, 0.31, 7.0), (350, 0.275, 7.0), (520, 0.30, 7.0)],
    ];
    let read = |n: usize| {
        let table = record(leads, courses[n], seed + n as u64);
        table.read(["load", "duty"][n], &model).unwrap()
    };
    let certain: Vec<String> = certain.iter().map(|key| (*key).to_owned()).collect();
    diagnose_knowing(&model, &certain, vec![read(0), read(1)], &[], &|_| ())
}

/// Values of the leads that lie outside of their interval, of those that the answer has.
fn missed(leads: Leads, certain: &[&str], seed: u64) -> (usize, usize) {
    let findings = found(leads, certain, seed).findings;
    let names: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
    assert_eq!(
        (findings.verdict, &names[..]),
        (Verdict::Explained, &["source_impedance"][..]),
        "{}",
        findings.sentence
    );
    let truth = [
        ("resistance", leads.resistance),
        ("inductance", leads.inductance),
        ("c_in", leads.c_in),
        ("esr_in", leads.esr_in),
    ];
    let parameters = &findings.causes[0].parameters;
    let held = truth
        .iter()
        .filter_map(|(name, value)| Some((parameters.get(*name)?, *value)));
    let missed: Vec<bool> = held
        .map(|(found, value)| value < found.low || value > found.high)
        .collect();
    println!("{}", findings.sentence);
    (missed.iter().filter(|missed| **missed).count(), missed.len())
}

#[test]
fn the_values_of_an_input_filter_lie_in_their_intervals_with_and_without_inductance() {
    let runs = [
        missed(SHORT, &[], 5),
        missed(SHORT, &[], 105),
        missed(SHORT, &["source.inductance"], 205),
        missed(LONG, &[], 305),
        missed(LONG, &[], 405),
        missed(THIN, &[], 505),
    ];
    let (out, all) = runs.iter().fold((0, 0), |sum, run| (sum.0 + run.0, sum.1 + run.1));
    // 95 % of twenty-one leave one out in two runs of three, and more than two in one of eleven
    assert!(all >= 21 && out <= 2, "{runs:?}");
}

const INVERTING: &str = "[converter]\ntopology = \"buck-boost\"\nv_in = 24.0\ninductance = 22e-6\ncapacitance = 100e-6\nf_sw = 200e3\n\
                         rectifier = \"synchronous\"\n[inductor]\ndcr = 0.03\n[capacitor]\nesr = 0.01\n\
                         [switch]\nr_ds_on = 0.03\nr_ds_on_low = 0.02\n[pwm]\nsampling_phase = 0.0\n";

/// Current of the inductor alone, of a synchronous buck-boost behind leads of 0.5 ohm and 9 uH and an input capacitor of 7 uF. From each row
/// on: duty and current of an electronic load.
fn inverting(course: &[(usize, f64, f64)], seed: u64) -> Table {
    const H: f64 = 5e-6;
    let (_, duty, load) = course[0];
    let mut x: X = [load / (1.0 - duty), 24.0 * duty / (1.0 - duty), 24.0, duty * load];
    let mut random = Noise(seed);
    let mut table = Table::of(&["t", "duty", "i_l", "i_load"]);
    for row in -3000..300isize {
        let (_, duty, load) = *at(course, row, |step| step.0);
        if row >= 0 {
            table.push(&[row as f64 * H, duty, x[0] + 5e-3 * random.normal(), load]);
        }
        for (is_on, share) in [(true, duty), (false, 1.0 - duty)] {
            integrate(&mut x, share * H / 20.0, 20, |x| {
                let (drawn, given) = if is_on { (x[0], 0.0) } else { (0.0, x[0]) };
                let input = x[2] + 5e-3 * (x[3] - drawn);
                let out = x[1] + 0.01 * (given - load);
                let across = if is_on { input - 0.06 * x[0] } else { -out - 0.05 * x[0] };
                [
                    across / 22e-6,
                    (given - load) / 100e-6,
                    (x[3] - drawn) / 7e-6,
                    (24.0 - 0.5 * x[3] - input) / 9e-6,
                ]
            });
        }
    }
    table
}

#[test]
fn the_inductor_s_current_alone_shows_the_leads_of_a_buck_boost() {
    let model = Parameters::from_toml("plant.toml".as_ref(), INVERTING).unwrap();
    let courses: [&[(usize, f64, f64)]; 2] = [
        &[(0, 0.35, 1.0), (80, 0.35, 1.8), (160, 0.35, 0.7), (230, 0.35, 1.5)],
        &[(0, 0.35, 1.2), (80, 0.39, 1.2), (160, 0.32, 1.2), (230, 0.37, 1.2)],
    ];
    let read = |n: usize| {
        let table = inverting(courses[n], 91 + n as u64);
        table.read(["load", "duty"][n], &model).unwrap()
    };
    let findings = diagnose(&model, vec![read(0), read(1)], &[], &|_| ()).findings;
    println!("{:?}: {}", findings.verdict, findings.sentence);
    assert_eq!(findings.causes.len(), 1, "{}", findings.sentence);
    let cause = &findings.causes[0];
    let mut names = cause.rivals.iter().flatten().copied().chain([cause.id]);
    assert!(names.any(|id| id == "source_impedance"), "{}", findings.sentence);
}

/// A filter that swings above half of the rows' rate looks like slower ones: five of these eight values lay outside when its fit began at those alone.
#[test]
fn a_filter_that_swings_faster_than_half_of_the_rows_rate_is_found() {
    let runs = [missed(CERAMIC[0], &[], 606), missed(CERAMIC[1], &[], 607)];
    let (out, all) = runs.iter().fold((0, 0), |sum, run| (sum.0 + run.0, sum.1 + run.1));
    assert!(all == 8 && out <= 1, "{runs:?}");
}
