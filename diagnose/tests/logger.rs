//! Records of a data logger, whose rows are many switching periods apart.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::findings::Verdict;
use diagnose::record::Record;
use measured::{ColumnMap, Sheet};
use plant::{Faults, Load, Parameters, Plant};

/// A converter of 48 V and 20 kHz; a row each millisecond is one of 20 periods.
fn model() -> Parameters {
    let mut p = Parameters::paper_table();
    (p.converter.v_in, p.converter.f_sw) = (48.0, 20e3);
    (p.converter.inductance, p.converter.capacitance) = (220e-6, 220e-6);
    (p.inductor.dcr, p.switch.r_ds_on, p.switch.v_f) = (0.05, 0.02, 0.6);
    p
}

/// Duty and load current beside 10 ohm, each for 40 rows.
const STEPS: [(f64, f64); 9] = [
    (0.5, 0.0),
    (0.5, 2.0),
    (0.5, 4.0),
    (0.45, 4.0),
    (0.55, 1.0),
    (0.4, 3.0),
    (0.4, 0.0),
    (0.5, 1.0),
    (0.6, 2.0),
];
const HELD: usize = 40;

/// What a logger notes in a row.
#[derive(Clone, Copy, PartialEq)]
enum Row {
    Sample,
    /// The mean since the row before, as far as a filter of that time makes one.
    Mean,
}

/// A record of `hidden` with a row each `periods`. Steps come somewhere between two rows.
fn logged(hidden: &Parameters, periods: usize, row: Row) -> String {
    let mut p = hidden.clone();
    for sensor in [&mut p.sensors.v_out, &mut p.sensors.i_l, &mut p.sensors.i_out] {
        sensor.noise = 0.02;
        if row == Row::Mean {
            sensor.low_pass = periods as f64 * p.converter.f_sw.recip();
        }
    }
    let mut plant = Plant::new(&p).unwrap();
    let set = |n: usize| STEPS[(n / (HELD * periods)).min(STEPS.len() - 1)];
    let load = |n: usize| Load {
        current: set(n).1,
        ..Load::resistor(10.0)
    };
    plant.reset_at(23.5, 2.0, &load(0));
    let mut text = "t,duty,v_out,i_l,i_out,r_load,i_load\n".to_owned();
    let shift = periods / 3;
    for n in 0..STEPS.len() * HELD * periods {
        let (duty, current) = set(n + shift);
        if n % periods == 0 {
            let (s, t) = (plant.measured(), n as f64 * p.t_sw());
            let _ = writeln!(
                text,
                "{t:.6},{duty},{:.4},{:.4},{:.4},10,{current}",
                s.v_out, s.i_l, s.i_out
            );
        }
        plant.step(duty, &load(n + shift));
    }
    text
}

fn read(text: &str) -> Result<Record, Faults> {
    let sheet = Sheet::parse(Path::new("logged.csv"), text.into(), &Record::file_options())?;
    Record::read(&sheet, &ColumnMap::default(), &model())
}

fn diagnosed(text: &str) -> Diagnosis {
    let start = Instant::now();
    let found = diagnose(&model(), vec![read(text).unwrap()], &[], &|_| ());
    println!(
        "{:?} {}\n{:?}",
        start.elapsed(),
        found.findings.sentence,
        found.findings.noise
    );
    // the desk waits for seconds; other tests share the machine with this one
    assert!(start.elapsed() < Duration::from_secs(60), "{:?}", start.elapsed());
    found
}

#[test]
fn a_healthy_logger_record_is_consistent_whether_it_holds_samples_or_means() {
    for row in [Row::Sample, Row::Mean] {
        let found = diagnosed(&logged(&model(), 20, row));
        assert_eq!(
            found.findings.verdict,
            Verdict::Consistent,
            "{}",
            found.findings.sentence
        );
        let said = found.findings.noise.repairs.join("\n");
        assert!(said.contains("20 switching periods apart"), "{said}");
        assert_eq!(said.contains("samples at"), row == Row::Sample, "{said}");
    }
}

#[test]
fn a_resistance_shows_in_a_logger_record() {
    let mut hidden = model();
    hidden.inductor.dcr = 0.25;
    let found = diagnosed(&logged(&hidden, 20, Row::Mean));
    let first = &found.findings.causes[0];
    let tied: Vec<&str> = first.rivals.iter().flatten().copied().chain([first.id]).collect();
    assert!(tied.contains(&"dcr"), "{}", found.findings.sentence);
}

#[test]
fn rows_a_few_periods_apart_are_simulated_anew_behind_each_step() {
    let record = read(&logged(&model(), 3, Row::Sample)).unwrap();
    assert!(!record.settled);
    assert_eq!(record.segments.len(), STEPS.len());
    let found = diagnosed(&logged(&model(), 3, Row::Sample));
    assert_eq!(
        found.findings.verdict,
        Verdict::Consistent,
        "{}",
        found.findings.sentence
    );
}

#[test]
fn a_logger_record_without_rest_is_refused_with_the_time_that_the_filter_needs() {
    let text = logged(&model(), 20, Row::Mean);
    let mut lines = text.lines();
    let mut moving = format!("{}\n", lines.next().unwrap());
    for (n, line) in lines.enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let duty = 0.4 + 0.02 * (n / 3 % 8) as f64;
        let _ = writeln!(moving, "{},{duty},{}", cells[0], cells[2..].join(","));
    }
    let fault = read(&moving).unwrap_err().list.remove(0);
    assert!(fault.problem.contains("do not stand still"), "{fault}");
    assert!(fault.hint.unwrap().contains("a row each switching period"));
}

#[test]
fn rows_that_a_user_calls_a_record_over_time_are_simulated() {
    let sheet = Sheet::parse(
        Path::new("logged.csv"),
        logged(&model(), 20, Row::Sample).into(),
        &Record::file_options(),
    )
    .unwrap();
    let mut map = ColumnMap::default();
    map.settled = Some(false);
    assert!(!Record::read(&sheet, &map, &model()).unwrap().settled);
}
