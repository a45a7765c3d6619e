//! The same cause wired in other ways: an instrument apart, one sensor of three that is slow, a lost edge on either side, each ammeter
//! with an error of its own. From a generator of physics (`bench`), which shares nothing with the plant.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod bench;

use bench::{Bench, Noise, Table, model};
use diagnose::diagnosis::diagnose;
use diagnose::extend::extended_toml;
use diagnose::findings::{Findings, Named, Verdict};

const NOISE: [(&str, f64, f64); 4] = [
    ("v_out", 0.1, 0.02),
    ("i_l", 0.05, 5e-3),
    ("i_out", 0.05, 5e-3),
    ("v_in", 0.1, 0.02),
];
const ROWS: usize = 300;
/// What an instrument does to each channel.
#[derive(Debug, Clone, Copy)]
enum Instrument {
    Ideal,
    /// Shows what was true so many periods ago, below a half.
    Late(f64),
    /// A filter, its time constant in periods.
    Slow(f64),
}

/// Steps of the duty, of the load, and of both to be held out.
fn benches(bench: &Bench) -> [Bench; 3] {
    let of = |duty: &[(usize, f64)], load: &[(f64, f64, f64)]| Bench {
        rows: ROWS,
        duty: duty.to_vec(),
        load: load.to_vec(),
        ..bench.clone()
    };
    [
        of(
            &[(0, 0.5), (50, 0.56), (110, 0.45), (150, 0.53), (170, 0.48), (230, 0.55)],
            &[(0.0, 0.0, 5.0)],
        ),
        of(
            &[(0, 0.5)],
            &[(0.0, 0.0, 5.0), (60.0, 0.0, 8.0), (140.0, 0.0, 3.0), (220.0, 0.0, 6.0)],
        ),
        of(
            &[(0, 0.48), (140, 0.55)],
            &[(0.0, 0.0, 6.0), (70.0, 0.0, 3.5), (220.0, 0.0, 7.5)],
        ),
    ]
}

/// The channel as its instrument shows it.
fn seen(bench: &Bench, channel: usize, instrument: Instrument) -> Vec<f64> {
    let mut bench = bench.clone();
    match instrument {
        Instrument::Ideal => {}
        Instrument::Late(periods) => bench.sampled -= periods,
        Instrument::Slow(periods) => bench.slow[channel] = periods,
    }
    std::mem::take(bench.run().column(NOISE[channel].0))
}

/// The diagnosis of a bench with these instruments of `v_out`, `i_l` and `i_out`.
fn found(bench: &Bench, instruments: [Instrument; 3], seed: u64) -> (Findings, String) {
    let (model, mut random) = (model(), Noise(seed));
    let tables = benches(bench).map(|one| {
        let mut table: Table = one.run();
        for (channel, instrument) in instruments.into_iter().enumerate() {
            *table.column(NOISE[channel].0) = seen(&one, channel, instrument);
        }
        let set = (0..ROWS).map(|n| {
            one.load
                .iter()
                .rev()
                .find(|step| step.0 <= n as f64)
                .map_or(0.0, |step| step.2)
        });
        table.with("i_load", set.collect()).measured(&NOISE, &mut random)
    });
    let read = |name: &str, table: &Table| table.read(name, &model).unwrap();
    let train = vec![read("duty", &tables[0]), read("load", &tables[1])];
    let diagnosis = diagnose(&model, train, &[read("held", &tables[2])], &|_| {});
    let text = extended_toml(&diagnosis);
    println!("{}", diagnosis.findings.sentence);
    (diagnosis.findings, text)
}

fn only(findings: &Findings) -> &Named {
    let ids: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
    assert_eq!(ids.len(), 1, "{ids:?}: {}", findings.sentence);
    &findings.causes[0]
}

#[track_caller]
fn holds(cause: &Named, parameter: &str, truth: f64) {
    let value = &cause.parameters[parameter];
    assert!(value.low <= truth && truth <= value.high, "{truth}: {value:?}");
}

#[test]
fn a_slow_sensor_of_the_load_current_alone_is_named() {
    let (findings, text) = found(
        &Bench::default(),
        [Instrument::Ideal, Instrument::Ideal, Instrument::Slow(1.5)],
        11,
    );
    let cause = only(&findings);
    assert_eq!(cause.id, "sensor_low_pass", "{}", findings.sentence);
    assert_eq!(cause.words, "low-pass of the load current sensor");
    holds(cause, "time_constant_o", 1.5e-4);
    assert!(text.contains("[sensors.i_out]\nlow_pass = "), "{text}");
}

#[test]
fn an_instrument_apart_leaves_the_low_pass_of_the_others_named() {
    let (findings, _) = found(
        &Bench::default(),
        [Instrument::Slow(1.2), Instrument::Slow(1.2), Instrument::Ideal],
        12,
    );
    let cause = only(&findings);
    assert_eq!(cause.id, "sensor_low_pass", "{}", findings.sentence);
    holds(cause, "time_constant", 1.2e-4);
}

#[test]
fn a_voltage_sensor_that_is_late_alone_is_named() {
    let (findings, _) = found(
        &Bench::default(),
        [Instrument::Late(0.4), Instrument::Ideal, Instrument::Ideal],
        13,
    );
    let cause = only(&findings);
    let tied = cause.rivals.iter().any(|ids| ids[..] == ["sensor_delay"]);
    assert!(cause.id == "sensor_delay" || tied, "{}", findings.sentence);
}

#[test]
fn each_ammeter_may_have_an_offset_of_its_own() {
    let bench = Bench {
        offset: [0.0, 0.25, -0.15, 0.0],
        ..Bench::default()
    };
    let (findings, _) = found(&bench, [Instrument::Ideal; 3], 14);
    let cause = only(&findings);
    assert_eq!(cause.id, "i_offset", "{}", findings.sentence);
    holds(cause, "offset", 0.25);
    holds(cause, "offset_o", -0.15);
    assert_eq!(findings.verdict, Verdict::Explained, "{}", findings.sentence);
}

/// The values of every member of a tie are told, and the interval is that of all of them.
#[test]
fn a_tie_tells_the_values_of_each_member() {
    // settled points of one duty and several currents: copper, switch and diode are one number
    let bench = Bench {
        dcr: 0.6,
        duty: vec![(0, 0.5)],
        load: vec![(0.0, 0.0, 3.0), (60.0, 0.0, 5.0), (140.0, 0.0, 8.0), (220.0, 0.0, 6.0)],
        rows: ROWS,
        ..Bench::default()
    };
    let mut random = Noise(15);
    let set = (0..ROWS).map(|n| {
        bench
            .load
            .iter()
            .rev()
            .find(|step| step.0 <= n as f64)
            .map_or(0.0, |step| step.2)
    });
    let table = bench.run().with("i_load", set.collect()).measured(&NOISE, &mut random);
    let model = model();
    let train = vec![table.read("load", &model).unwrap()];
    let findings = diagnose(&model, train, &[], &|_| {}).findings;
    println!("{}", findings.sentence);
    assert_eq!(findings.verdict, Verdict::Ambiguous, "{}", findings.sentence);
    let cause = &findings.causes[0];
    assert_eq!(cause.rivals.len(), cause.rival_values.len());
    for (ids, values) in cause.rivals.iter().zip(&cause.rival_values) {
        assert!(
            ids.iter().all(|id| values.iter().any(|value| value.id == *id)),
            "{ids:?}"
        );
        assert!(
            values.iter().all(|one| one.low <= one.value && one.value <= one.high),
            "{values:?}"
        );
    }
    // half an ohm of copper is about an ohm of the switch, which conducts half of the time
    let switch = cause.rival_values.iter().flatten().find(|value| value.id == "r_ds_on");
    if let Some(switch) = switch.filter(|_| cause.id == "dcr") {
        assert!((0.7..1.4).contains(&switch.value), "{switch:?}");
        assert!(findings.sentence.contains("r_ds_on "), "{}", findings.sentence);
    }
}

#[test]
fn a_healthy_bench_is_consistent() {
    let (findings, _) = found(&Bench::default(), [Instrument::Ideal; 3], 101);
    assert_eq!(findings.verdict, Verdict::Consistent, "{}", findings.sentence);
}

/// 180 ns of 100 us: more than edges of a gate are taken for, and by itself too little to be worth a cause beside their trim.
#[test]
fn a_dead_time_just_beyond_what_edges_do_is_named_and_withholds_nothing() {
    let bench = Bench {
        lost: 0.0018,
        dcr: 0.5,
        ..Bench::default()
    };
    let (findings, _) = found(&bench, [Instrument::Ideal; 3], 102);
    let ids: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
    assert!(ids.contains(&"dcr"), "{}", findings.sentence);
    let edges = ["dead_time", "turn_on_delay", "duty_offset"];
    let named = findings.causes.iter().find(|cause| edges.contains(&cause.id));
    let Some(named) = named else {
        panic!("{}", findings.sentence)
    };
    let value = named.parameters.values().next().unwrap();
    // what is left to the trim is its standard deviation at most
    let share = if named.id == "duty_offset" {
        -value.value
    } else {
        value.value * 1e4
    };
    assert!((0.0013..=0.0023).contains(&share), "{value:?}");
}

/// Settled points of a synchronous converter of 48 V by the balance of its volt-seconds, both voltmeters of one reference that is off by `gain`.
fn synchronous(gain: f64, random: &mut Noise) -> Table {
    let names = ["duty", "v_out", "i_l", "i_out", "v_in", "r_load"];
    let mut table = Table::of(&names);
    for n in 0..24 {
        let d = 0.15 + 0.7 * f64::from(n) / 23.0;
        let i = random.between(2.0, 10.0);
        let v = d * 48.0 - i * (0.02 + 0.03);
        table.push(&[d, v * gain, i, i, 48.0 * gain, v / i]);
    }
    let digits = ["v_out", "i_l", "i_out", "v_in"].map(|name| (name, 5e-3, 1e-3));
    table.measured(&digits, random)
}

fn of_points(table: &Table) -> Findings {
    let text = "[converter]\nrectifier = \"synchronous\"\nv_in = 48.0\ninductance = 22e-6\ncapacitance = 100e-6\nf_sw = 200e3\n\
                [inductor]\ndcr = 0.02\n[switch]\nr_ds_on = 0.03\nr_ds_on_low = 0.03\n";
    let model = plant::Parameters::from_toml("plant.toml".as_ref(), text).unwrap();
    let record = table.read("points", &model).unwrap();
    let findings = diagnose(&model, vec![record], &[], &|_| {}).findings;
    println!("{}", findings.sentence);
    findings
}

#[test]
fn one_reference_of_two_voltmeters_is_one_cause() {
    let findings = of_points(&synchronous(1.03, &mut Noise(32)));
    let cause = only(&findings);
    assert_eq!(cause.id, "v_gain", "{}", findings.sentence);
    assert!(
        findings.sentence.contains("output and input voltage"),
        "{}",
        findings.sentence
    );
    holds(cause, "gain", 1.03);
}
