//! Captures of an oscilloscope: a board of device models in ngspice, sampled.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod board;
mod damaged;

use diagnose::capture::estimates::Estimate;
use diagnose::diagnosis::{Diagnosis, diagnose};
use diagnose::findings::{Named, Verdict};
use diagnose::record::Record;
use plant::Parameters;

use board::{CLEAN, COARSE, PERIOD, Scope, half, read, run, truth};

fn diagnosed(model: &Parameters, records: Vec<Record>) -> Diagnosis {
    let found = diagnose(model, records, &[], &|_| ());
    println!("{}\n{:?}", found.findings.sentence, found.findings.noise.repairs);
    for one in found.findings.captures.iter().flat_map(|capture| &capture.values) {
        println!(
            "{} {:.5e} [{:.5e}, {:.5e}] {}",
            one.name, one.value, one.low, one.high, one.unit
        );
    }
    found
}

fn estimate<'a>(found: &'a Diagnosis, name: &str) -> &'a Estimate {
    let all = found.findings.captures.iter().flat_map(|capture| &capture.values);
    all.into_iter()
        .find(|one| one.name == name)
        .unwrap_or_else(|| panic!("no {name}"))
}

fn is_near(value: f64, truth: f64, share: f64) -> bool {
    (value / truth - 1.0).abs() < share
}

fn value(causes: &[Named], id: &str, parameter: &str) -> f64 {
    let cause = causes
        .iter()
        .find(|cause| cause.id == id)
        .unwrap_or_else(|| panic!("{id} is not named"));
    cause.parameters[parameter].value
}

/// What a first simulation has wrong: the inductor by a tenth, no series resistance.
fn wrong() -> Parameters {
    let mut model = truth();
    (model.converter.inductance, model.capacitor.esr) = (110e-6, 0.0);
    model
}

#[test]
fn inductance_series_resistance_and_delays_are_read_off_and_fitted() {
    let delays = half().delays();
    for scope in [&CLEAN, &COARSE] {
        let record = read(&scope.table(half()), "r_load=10", &wrong()).unwrap();
        let found = diagnosed(&wrong(), vec![record]);
        // by itself
        let l = estimate(&found, "inductance");
        assert!(
            is_near(l.value, 100e-6, 0.03) && l.low < 100e-6 && l.high > 100e-6,
            "{l:?}"
        );
        let esr = estimate(&found, "esr");
        assert!(
            is_near(esr.value, 0.05, 0.1) && esr.low < 0.05 && esr.high > 0.05,
            "{esr:?}"
        );
        for (name, truth) in ["turn_on_delay", "turn_off_delay"].into_iter().zip(delays) {
            let late = estimate(&found, name);
            assert!((late.value - truth).abs() < 20e-9, "{late:?} {truth}");
            assert!(late.low - 5e-9 < truth && truth < late.high + 5e-9, "{late:?} {truth}");
        }
        assert_eq!(found.findings.captures[0].mode, Some("ccm"));
        // by the plant's own steady state
        let causes = &found.findings.causes;
        assert!(is_near(value(causes, "l_wrong", "inductance"), 100e-6, 0.03));
        assert!(is_near(value(causes, "esr", "esr"), 0.05, 0.1));
    }
}

#[test]
fn a_capture_of_a_healthy_model_is_consistent() {
    for scope in [&CLEAN, &COARSE] {
        let record = read(&scope.table(half()), "r_load=10", &truth()).unwrap();
        let found = diagnosed(&truth(), vec![record]);
        assert_eq!(
            found.findings.verdict,
            Verdict::Consistent,
            "{}",
            found.findings.sentence
        );
    }
}

/// A sweep of the duty shows a drop of voltage and not whose it is; a capture of the same board shows the diode by itself.
#[test]
fn a_capture_breaks_the_ties_of_a_duty_sweep() {
    let mut model = truth();
    (model.switch.v_f, model.switch.r_d) = (0.0, 0.0);
    let duties = [0.44, 0.47, 0.5, 0.53, 0.56];
    let point = |(n, duty): (usize, &f64)| {
        let load = 10.0;
        let board = run(
            &format!("sweep{n}"),
            *duty,
            load,
            duty * 23.7 - 0.5 * (1.0 - duty) - 0.02,
            "40n",
        );
        format!("{duty},{:.3},{load}\n", board.mean(&board.v_out))
    };
    let rows: String = duties.iter().enumerate().map(point).collect();
    let table = format!("duty,v_out,r_load\n{rows}");
    println!("{table}");
    let sweep = || read(&table, "", &model).unwrap();
    let alone = diagnosed(&model, vec![sweep()]);
    let rivals = |found: &Diagnosis| {
        found
            .findings
            .causes
            .iter()
            .map(|cause| cause.rivals.len())
            .sum::<usize>()
    };
    assert_eq!(
        alone.findings.verdict,
        Verdict::Ambiguous,
        "{}",
        alone.findings.sentence
    );
    let capture = read(&CLEAN.table(half()), "r_load=10", &model).unwrap();
    let both = diagnosed(&model, vec![sweep(), capture]);
    assert_eq!(both.findings.verdict, Verdict::Explained, "{}", both.findings.sentence);
    assert_eq!(rivals(&both), 0);
    assert_eq!(both.findings.causes[0].id, "diode");
}

/// A first simulation without any loss: a sweep and one capture of output and switch node show a drop, a slope and an ESR. What could stand in the
/// place of each is less usual, or the same resistance at another place of the loop.
#[test]
fn a_sweep_and_a_capture_of_a_board_whose_model_has_no_losses_give_its_resistances_and_its_drop() {
    const NODE: Scope = Scope {
        channels: &[("v_out", 16.0, 0.0), ("v_sw", 40.0, 0.0)],
        ..CLEAN
    };
    let mut model = truth();
    (model.inductor.dcr, model.capacitor.esr) = (0.0, 0.0);
    (model.switch.r_ds_on, model.switch.v_f, model.switch.r_d) = (0.0, 0.0, 0.0);
    // currents at which a resistance is more than the edges of a gate
    let load = 4.0;
    let row = |duty: f64| {
        let board = run(
            &format!("lossy{duty}"),
            duty,
            load,
            duty * 23.5 - 0.5 * (1.0 - duty),
            "40n",
        );
        format!("{duty},{:.3},{load}\n", board.mean(&board.v_out))
    };
    let rows: String = [0.2, 0.35, 0.5, 0.65, 0.8].map(row).concat();
    let sweep = read(&format!("duty,v_out,r_load\n{rows}"), "", &model).unwrap();
    let capture = read(&NODE.table(half()), "r_load=10", &model).unwrap();
    let found = diagnosed(&model, vec![sweep, capture]).findings;
    assert!(
        matches!(found.verdict, Verdict::Explained | Verdict::Ambiguous),
        "{}",
        found.sentence
    );
    let v_f = found
        .causes
        .iter()
        .find(|cause| cause.id == "diode")
        .map(|cause| &cause.parameters["v_f"]);
    assert!(v_f.is_some_and(|v_f| v_f.low < 0.45 && 0.45 < v_f.high), "{v_f:?}");
}

#[test]
fn a_current_that_rests_is_seen_and_its_slope_still_tells_the_inductance() {
    let board = run("light", 0.4, 100.0, 13.6, "10n");
    let record = read(&CLEAN.table(&board), "r_load=100", &wrong()).unwrap();
    let found = diagnosed(&wrong(), vec![record]);
    assert_eq!(found.findings.captures[0].mode, Some("dcm"));
    let l = estimate(&found, "inductance");
    assert!(is_near(l.value, 100e-6, 0.05), "{l:?}");
    let late = estimate(&found, "turn_on_delay");
    // the node turns on somewhere in its ring: nobody's delay to 20 ns
    assert!((late.value - board.delays()[0]).abs() < 40e-9, "{late:?}");
    // the ring, which the plant has not, is no delay
    let delays = ["turn_off_delay", "turn_on_delay", "dead_time", "duty_quantisation"];
    let named = found.findings.causes.iter().find(|cause| delays.contains(&cause.id));
    assert!(named.is_none(), "{named:?}");
}

#[test]
fn a_capture_of_the_output_alone_says_what_its_ripple_says() {
    const ALONE: Scope = Scope {
        channels: &[("v_out", 16.0, 0.0)],
        ..CLEAN
    };
    let record = read(&ALONE.table(half()), "r_load=10,duty=0.5", &truth()).unwrap();
    let found = diagnosed(&truth(), vec![record]);
    assert_eq!(found.findings.verdict, Verdict::Consistent);
    assert!(is_near(estimate(&found, "esr").value, 0.05, 0.1));
    let missing = found.findings.captures[0].missing.join("; ");
    for what in ["i_l:", "v_sw:", "v_in and i_in:"] {
        assert!(missing.contains(what), "{missing}");
    }
}

/// At 100 MS/s a period has a thousand rows; more than five hundred were once said to be a wrong frequency.
#[test]
fn a_thousand_rows_a_period_are_read() {
    const FAST: Scope = Scope {
        step: 1e-8,
        periods: 3.0,
        channels: &[("v_out", 16.0, 0.0), ("i_l", 2.5, 0.0), ("v_sw", 40.0, 0.0)],
        is_coarse: false,
    };
    let record = read(&FAST.table(half()), "r_load=10,duty=0.5", &truth()).unwrap();
    let capture = record.capture.as_ref().unwrap();
    assert_eq!(capture.bins.periods, 3.0);
    assert!(is_near(capture.period, PERIOD, 1e-3));
}

/// Problem and what was found, of a table that is refused.
fn refused(text: &str, map: &str, model: &Parameters) -> String {
    let faults = read(text, map, model).unwrap_err();
    faults
        .list
        .iter()
        .map(|fault| format!("{} {:?}", fault.problem, fault.found))
        .collect()
}

#[test]
fn what_is_no_capture_of_this_converter_is_refused_with_the_reason() {
    let table = CLEAN.table(half());
    let mut other = truth();
    other.converter.f_sw = 130e3;
    let said = refused(&table, "r_load=10", &other);
    assert!(
        said.contains("another switching period") && said.contains("v_pwm repeats every"),
        "{said}"
    );
    // by the ripple, where nothing has edges
    let cells: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let two = |a: usize, b: usize, rows: usize| -> String {
        cells
            .iter()
            .take(rows)
            .map(|row| format!("{},{}\n", row[a], row[b]))
            .collect()
    };
    let said = refused(&two(0, 2, 801), "r_load=10,duty=0.5", &other);
    assert!(
        said.contains("another switching period") && said.contains("i_l repeats every"),
        "{said}"
    );
    let said = refused(&two(0, 2, 80), "r_load=10,duty=0.5", &truth());
    assert!(said.contains("shorter than one switching period"), "{said}");
    let flat: String = (0..400)
        .map(|n| {
            format!(
                "{:.7},{:.3}\n",
                f64::from(n) * 1e-7,
                11.5 + 0.001 * f64::from(n * 7 % 5)
            )
        })
        .collect();
    let said = refused(&format!("t,v_out\n{flat}"), "r_load=10,duty=0.5", &truth());
    assert!(said.contains("nothing in the capture switches"), "{said}");
    let said = refused(&two(0, 2, 801), "r_load=10", &truth());
    assert!(
        said.contains("what the duty is") || said.contains("no column"),
        "{said}"
    );
    let said = refused(&table, "r_load=10,duty=0.3", &truth());
    assert!(said.contains("contradict each other"), "{said}");
    let drift: String = (0..800)
        .map(|n| f64::from(n) * 1e-7)
        .map(|t| {
            format!(
                "{t:.7},{:.5}\n",
                10.0 + 4e4 * t + 0.1 * (std::f64::consts::TAU * t / PERIOD).sin()
            )
        })
        .collect();
    let said = refused(&format!("t,v_out\n{drift}"), "r_load=10,duty=0.5", &truth());
    assert!(said.contains("not at rest"), "{said}");
}
