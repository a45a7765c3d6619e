//! Captures as benches really write them: marks of no measurement, wrong probes, cut ripple, empty columns, no steady state.

use std::fmt::Write as _;

use diagnose::diagnosis::diagnose;
use diagnose::findings::Verdict;
use diagnose::record::Record;
use plant::{Parameters, Rectifier};

use super::board::{CLEAN, COARSE, PERIOD, Scope, half, read, run, truth};
use super::{diagnosed, estimate, is_near, refused, wrong};

/// The table with the cells of a column rewritten, by row and value.
fn edited(table: &str, column: &str, cell: impl Fn(usize, f64) -> String) -> String {
    let mut lines = table.lines();
    let header = lines.next().unwrap();
    let place = header.split(',').position(|name| name == column).unwrap();
    let row = |(n, line): (usize, &str)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        cells[place] = cell(n, cells[place].parse().unwrap());
        cells.join(",") + "\n"
    };
    format!("{header}\n{}", lines.enumerate().map(row).collect::<String>())
}

/// The table with one more column.
fn with(table: &str, name: &str, cell: impl Fn(usize) -> String) -> String {
    let rows = table.lines().enumerate();
    rows.map(|(n, line)| match n {
        0 => format!("{line},{name}\n"),
        n => format!("{line},{}\n", cell(n)),
    })
    .collect()
}

fn times(factor: f64) -> impl Fn(usize, f64) -> String {
    move |_, value| format!("{:.7}", factor * value)
}

fn is_said(record: &Record, words: &str) -> bool {
    record.repairs.iter().any(|note| note.contains(words))
}

#[test]
fn a_mark_of_no_measurement_and_a_wild_sample_count_nowhere() {
    for (mark, said) in [("9.9E+37", "9.9e37"), ("-9.9E+37", "9.9e37"), ("123456", "far from")] {
        for column in ["v_out", "i_l", "v_sw"] {
            let table = edited(&CLEAN.table(half()), column, |n, value| match n {
                300 => mark.to_owned(),
                _ => format!("{value}"),
            });
            let record = read(&table, "r_load=10", &truth()).unwrap();
            assert!(is_said(&record, said), "{:?}", record.repairs);
            let capture = record.capture.as_ref().unwrap();
            let noise = capture
                .folds
                .iter()
                .flatten()
                .map(|fold| fold.noise)
                .fold(0.0, f64::max);
            assert!(noise < 0.1 && capture.node.is_some(), "{column} {mark}: {noise}");
            assert!(is_near(capture.node.as_ref().unwrap().mean.value, 11.7, 0.03));
        }
    }
}

#[test]
fn a_probe_of_another_ratio_is_no_coupling_capacitor() {
    let table = CLEAN.table(half());
    for (column, factor, said) in [
        ("v_out", 0.1, "0.1 times"),
        ("v_out", 10.0, "10 times"),
        ("i_l", 0.1, "0.1 times"),
        ("i_l", 10.0, "10 times"),
        ("v_sw", 0.1, "0.1 times"),
        ("v_sw", 10.0, "10 times"),
        ("v_out", -1.0, "turned sign"),
        ("i_l", -1.0, "turned sign"),
        ("v_out", 1e-3, "not in V"),
    ] {
        let said_is = refused(&edited(&table, column, times(factor)), "r_load=10", &truth());
        assert!(said_is.contains(said), "{column} {factor}: {said_is}");
    }
    // alone: nothing else is there to agree with
    const ALONE: Scope = Scope {
        channels: &[("v_out", 16.0, 0.0)],
        ..CLEAN
    };
    let alone = edited(&ALONE.table(half()), "v_out", times(0.1));
    let said = refused(&alone, "r_load=10,duty=0.5", &truth());
    assert!(said.contains("0.1 times"), "{said}");
    // a factor in the map is the user's word
    let record = read(&alone, "r_load=10,duty=0.5,v_out=v_out*10", &truth()).unwrap();
    assert!(!record.capture.as_ref().unwrap().ac[0]);
    // the coupled one has no mean, and its ripple is the ripple
    let record = read(&COARSE.table(half()), "r_load=10", &truth()).unwrap();
    assert!(record.capture.as_ref().unwrap().ac[0]);
}

#[test]
fn a_ripple_that_is_cut_off_at_the_edge_of_the_screen_is_not_taken_as_measured() {
    for scope in [&CLEAN, &COARSE] {
        let table = edited(&scope.table(half()), "i_l", |_, value| format!("{:.6}", value.min(1.3)));
        let record = read(&table, "r_load=10", &wrong()).unwrap();
        assert!(is_said(&record, "cut off"), "{:?}", record.repairs);
        assert!(record.capture.as_ref().unwrap().mean(1).is_none());
        let found = diagnosed(&wrong(), vec![record]);
        let values = &found.findings.captures[0].values;
        assert!(values.iter().all(|one| one.name != "i_l_ripple"));
        assert!(is_near(estimate(&found, "inductance").value, 100e-6, 0.06));
        let whole = read(&scope.table(half()), "r_load=10", &wrong()).unwrap();
        assert!(!is_said(&whole, "cut off"), "{:?}", whole.repairs);
    }
    // the ground of a current that rests is no edge of a screen
    let board = run("rests", 0.4, 100.0, 13.6, "10n");
    let table = edited(&CLEAN.table(&board), "i_l", |_, value| {
        format!("{:.6}", if value < 0.02 { 0.0 } else { value })
    });
    let record = read(&table, "r_load=100", &truth()).unwrap();
    assert!(!is_said(&record, "cut off"), "{:?}", record.repairs);
}

#[test]
fn an_empty_column_is_left_out() {
    const TWO: Scope = Scope {
        channels: &[("v_out", 16.0, 0.0), ("v_sw", 40.0, 0.0), ("v_pwm", 8.0, 0.0)],
        ..CLEAN
    };
    let table = ["v_in", "i_l", "i_in", "i_out"]
        .iter()
        .fold(TWO.table(half()), |table, name| with(&table, name, |_| String::new()));
    let record = read(&table, "r_load=10", &truth()).unwrap();
    for name in ["v_in", "i_l", "i_in", "i_out"] {
        assert!(is_said(&record, &format!("{name} is empty")), "{:?}", record.repairs);
    }
    let capture = record.capture.as_ref().unwrap();
    assert!(capture.folds[1].is_none() && capture.folds[3].is_none() && capture.i_in.is_none());
    let mut model = truth();
    model.capacitor.esr = 0.0;
    let found = diagnosed(&model, vec![read(&table, "r_load=10", &model).unwrap()]);
    assert_ne!(found.findings.verdict, Verdict::Consistent);
    let values = &found.findings.captures[0].values;
    assert!(values.iter().all(|one| one.value.is_finite()), "{values:?}");
}

#[test]
fn a_current_that_rests_below_a_fifth_of_the_source_is_seen() {
    let board = run("low", 0.08, 100.0, 3.5, "10n");
    const NODE: Scope = Scope {
        channels: &[("v_out", 8.0, 0.0), ("v_sw", 40.0, 0.0), ("v_pwm", 8.0, 0.0)],
        ..CLEAN
    };
    let mean = board.mean(&board.v_out);
    println!("{mean} V");
    assert!(mean < 4.6, "{mean} V: not below a fifth");
    for scope in [&NODE, &CLEAN] {
        let record = read(&scope.table(&board), "r_load=100", &truth()).unwrap();
        let capture = record.capture.as_ref().unwrap();
        assert_eq!(capture.discontinuous, Some(true));
        assert_eq!(capture.node.as_ref().unwrap().off, None);
    }
}

/// A synchronous leg whose current is negative when its lower switch turns off: the node rises at once, through the body diode of
/// the upper switch.
fn synchronous() -> (Parameters, String) {
    let mut model = truth();
    model.converter.rectifier = Rectifier::Synchronous;
    model.switch.dead_time = 100e-9;
    (model.switch.r_ds_on, model.switch.r_ds_on_low) = (0.05, 0.05);
    let (v_in, duty, load) = (24.0, 0.5, 0.1);
    let v = duty * v_in - load * (0.05 + model.inductor.dcr);
    let half = 0.5 * v_in * duty * (1.0 - duty) * PERIOD / model.converter.inductance;
    let current = |phase: f64| match phase < duty {
        true => load + half * (2.0 * phase / duty - 1.0),
        false => load + half * (1.0 - 2.0 * (phase - duty) / (1.0 - duty)),
    };
    let node = |phase: f64| match phase {
        _ if phase < 100e-9 / PERIOD => v_in + model.switch.v_f,
        _ if phase < duty => v_in - 0.05 * current(phase),
        _ if phase < duty + 100e-9 / PERIOD => -model.switch.v_f,
        _ => -0.05 * current(phase),
    };
    let mut text = String::from("t,v_pwm,v_sw,v_out,i_l\n");
    for n in 0..2000 {
        let t = f64::from(n) * 4e-8;
        let phase = (t / PERIOD + 0.63).rem_euclid(1.0);
        let pin = if phase < duty { 5.0 } else { 0.0 };
        // as on a bench, a signal is never the same twice
        let noise = 1e-3 * (f64::from(n) * 2.399).sin();
        let _ = writeln!(
            text,
            "{t:.9},{:.5},{:.5},{:.5},{:.5}",
            pin + noise,
            node(phase) + 10.0 * noise,
            v + noise,
            current(phase) + noise
        );
    }
    (model, text)
}

#[test]
fn a_node_rises_at_once_where_its_current_is_negative() {
    let (model, table) = synchronous();
    for columns in [3, 5] {
        let cut = |line: &str| line.split(',').take(columns).collect::<Vec<_>>().join(",") + "\n";
        let table: String = table.lines().map(cut).collect();
        let record = read(&table, "i_load=0.1", &model).unwrap();
        let found = diagnosed(&model, vec![record]);
        let late = ["turn_on_delay", "turn_off_delay", "dead_time"];
        let named = found.findings.causes.iter().find(|cause| late.contains(&cause.id));
        assert!(named.is_none(), "{named:?}");
        let on = estimate(&found, "turn_on_delay");
        assert!(on.value.abs() < 10e-9 && on.model.unwrap().abs() < 10e-9, "{on:?}");
    }
}

#[test]
fn periods_that_are_not_like_each_other_are_no_steady_state() {
    const NINE: Scope = Scope { periods: 9.01, ..CLEAN };
    let table = NINE.table(half());
    for (column, size) in [("i_l", 0.03), ("i_l", 0.3), ("v_out", 0.005), ("v_out", 1.0)] {
        let alternates = edited(&table, column, |n, value| {
            let is_even = ((n as f64 * CLEAN.step / PERIOD) as usize).is_multiple_of(2);
            format!("{:.6}", value + if is_even { size } else { -size })
        });
        let said = refused(&alternates, "r_load=10", &truth());
        assert!(said.contains("not at rest"), "{column} {size}: {said}");
        let once = edited(&table, column, |n, value| {
            let is_third = (n as f64 * CLEAN.step / PERIOD) as usize == 3;
            format!("{:.6}", value + if is_third { 3.0 * size } else { 0.0 })
        });
        if size > 0.1 {
            let said = refused(&once, "r_load=10", &truth());
            assert!(said.contains("not at rest"), "{column} {size}: {said}");
        }
    }
}

#[test]
fn a_set_power_is_drawn_at_the_voltage_of_the_duty_where_v_out_shows_no_mean() {
    let mean = half().mean(&half().v_out);
    let table = edited(&CLEAN.table(half()), "v_out", |_, v| {
        format!("{:.6}", v - mean + 0.0008)
    });
    let record = read(&table, "p_load=13.39", &truth()).unwrap();
    let capture = record.capture.as_ref().unwrap();
    assert_eq!(capture.ac, [true, false, false, false], "{:?}", record.repairs);
}

#[test]
fn a_period_that_is_the_models_own_is_no_estimate() {
    const SHORT: Scope = Scope {
        periods: 2.0,
        channels: &[("v_out", 16.0, 0.0), ("i_l", 2.5, 0.0)],
        ..CLEAN
    };
    let record = read(&SHORT.table(half()), "r_load=10,duty=0.5", &truth()).unwrap();
    let found = diagnose(&truth(), vec![record], &[], &|_| ());
    let values = &found.findings.captures[0].values;
    assert!(values.iter().all(|one| one.name != "f_sw"), "{values:?}");
}

/// Where the current rests its least value is any sample of the rest.
#[test]
fn the_slope_of_a_current_that_rests_starts_at_an_edge() {
    let board = run("resting", 0.4, 100.0, 13.6, "10n");
    const PIN: Scope = Scope {
        channels: &[("v_out", 16.0, 0.0), ("i_l", 2.0, 0.0), ("v_pwm", 8.0, 0.0)],
        is_coarse: true,
        ..CLEAN
    };
    const NONE: Scope = Scope {
        channels: &[("v_out", 16.0, 0.0), ("i_l", 2.0, 0.0)],
        ..PIN
    };
    let record = read(&PIN.table(&board), "r_load=100", &truth()).unwrap();
    let found = diagnose(&truth(), vec![record], &[], &|_| ());
    assert_eq!(found.findings.captures[0].mode, Some("dcm"));
    let l = estimate(&found, "inductance");
    assert!(is_near(l.value, 100e-6, 0.08), "{l:?}");
    let record = read(&NONE.table(&board), "r_load=100,duty=0.4", &truth()).unwrap();
    let found = diagnose(&truth(), vec![record], &[], &|_| ());
    let captured = &found.findings.captures[0];
    assert!(
        captured.values.iter().all(|one| one.name != "inductance"),
        "{captured:?}"
    );
    assert!(
        captured.missing.iter().any(|text| text.contains("inductance")),
        "{captured:?}"
    );
}

#[test]
fn a_load_whose_column_is_empty_or_wild_is_not_zero() {
    let table = CLEAN.table(half());
    for name in ["i_out", "r_load", "p_load"] {
        let said = refused(&with(&table, name, |_| String::new()), "", &truth());
        assert!(said.contains("is empty"), "{name}: {said}");
    }
    let first = with(
        &table,
        "r_load",
        |n| if n == 1 { String::new() } else { "10".to_owned() },
    );
    let record = read(&first, "", &truth()).unwrap();
    assert_eq!(record.load[0].conductance, 0.1);
    let wild = with(&table, "i_out", |n| match n {
        200 => "123456".to_owned(),
        n => format!("{:.5}", 1.157 + 1e-4 * (n as f64).sin()),
    });
    let record = read(&wild, "", &truth()).unwrap();
    assert!(is_near(record.load[0].current, 1.157, 0.01), "{:?}", record.load);
}

/// A probe of the source that is put in the other way round makes no efficiency.
#[test]
fn an_efficiency_that_no_converter_has_is_not_shown() {
    let table = with(&CLEAN.table(half()), "v_in", |n| {
        format!("{:.4}", 24.0 + 1e-3 * (n as f64).sin())
    });
    for (i_in, is_shown) in [(0.62, true), (-0.62, false), (0.062, false)] {
        let table = with(&table, "i_in", |n| format!("{:.5}", i_in + 1e-4 * (n as f64).sin()));
        let found = diagnose(
            &truth(),
            vec![read(&table, "r_load=10", &truth()).unwrap()],
            &[],
            &|_| (),
        );
        let captured = &found.findings.captures[0];
        let has = captured.values.iter().any(|one| one.name == "efficiency");
        let is_missing = captured.missing.iter().any(|text| text.contains("efficiency"));
        assert_eq!((has, is_missing), (is_shown, !is_shown), "{i_in}: {captured:?}");
    }
}
