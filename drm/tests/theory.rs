//! Fits of noise-free tables of the exact steady state against what theory says they leave.
#![allow(clippy::unwrap_used)]

mod common;

use drm::formula::Losses;
use drm::{Cause, FitOptions, Form, Report, Table};

const LOSSY: Losses = Losses {
    v_in: 195.0,
    v_f: 1.5,
    r_d: 0.02,
    r_on: 0.5,
    dcr: 0.1,
    lost_duty: 0.04,
    v_dead: 0.0,
};

const D_SIM: [f64; 5] = [0.3, 0.4, 0.5, 0.6, 0.7];
const I_OUT: [f64; 5] = [2.0, 4.0, 6.0, 8.0, 10.0];

fn table(losses: &Losses, change: impl Fn(usize, &mut [f64; 4])) -> Table {
    let mut text = "d_real,v_out,i_out,v_in\n".to_owned();
    for (index, (d_sim, i_out)) in D_SIM.iter().flat_map(|d| I_OUT.map(|i| (*d, i))).enumerate() {
        let mut row = [losses.d_real(d_sim, i_out), d_sim * losses.v_in, i_out, losses.v_in];
        change(index, &mut row);
        let [d_real, v_out, i_out, v_in] = row;
        text += &format!("{d_real},{v_out},{i_out},{v_in}\n");
    }
    common::table(&text)
}

fn fitted(table: &Table, form: Form) -> Report {
    let options = FitOptions {
        form: Some(form),
        ..FitOptions::default()
    };
    drm::fit(table, &options).unwrap()
}

fn rms_duty(report: &Report) -> f64 {
    let squares: f64 = report
        .fit
        .rows
        .iter()
        .map(|r| (r.point.d_real - r.d_mapped).powi(2))
        .sum();
    (squares / report.fit.rows.len() as f64).sqrt()
}

/// A table of the form itself is fitted to rounding: nothing is lost on the way.
#[test]
fn a_table_of_the_form_itself_is_fitted_exactly() {
    let losses = Losses { r_on: 0.02, ..LOSSY };
    let report = fitted(&table(&losses, |_, _| {}), Form::ThreeTerm);
    let expected = losses.three_term(0.0, 0.0);
    let found = report.fit.map.coefficients;
    // nine digits in the file
    assert!(
        (found.a - expected.a).abs() < 1e-9 && (found.b - expected.b).abs() < 1e-11,
        "{found:?}"
    );
    assert!((found.c - expected.c).abs() < 1e-10 && report.fit.left_out.max_v < 1e-6);
}

/// The error of both forms on the exact formula is that which `formula` derives, to the order it neglects (rho i = 2.4 %).
#[test]
fn three_and_four_terms_leave_what_theory_says() {
    for losses in [
        LOSSY,
        Losses {
            r_on: 0.2,
            r_d: 0.0,
            ..LOSSY
        },
        Losses {
            v_f: 0.0,
            lost_duty: 0.0,
            ..LOSSY
        },
        Losses {
            r_on: 0.0,
            r_d: 0.3,
            ..LOSSY
        },
    ] {
        let table = table(&losses, |_, _| {});
        let (three, four) = losses.expected_errors(&D_SIM, &I_OUT);
        for (form, expected) in [(Form::ThreeTerm, three), (Form::FourTerm, four)] {
            let found = rms_duty(&fitted(&table, form));
            assert!(
                (found / expected - 1.0).abs() < 0.06,
                "{form:?} of {losses:?}: {found:.3e}, theory {expected:.3e}"
            );
        }
    }
}

#[test]
fn four_terms_are_taken_where_the_product_is_real_and_three_where_it_is_not() {
    let chosen = |losses: &Losses| {
        drm::fit(&table(losses, |_, _| {}), &FitOptions::default())
            .unwrap()
            .fit
            .form
    };
    assert_eq!(chosen(&LOSSY), Form::FourTerm);
    let noisy = |index: usize, row: &mut [f64; 4]| row[1] += 0.02 * ((index * 7 % 11) as f64 - 5.0);
    let no_product = Losses { r_on: 0.02, ..LOSSY };
    let report = drm::fit(&table(&no_product, noisy), &FitOptions::default()).unwrap();
    assert_eq!(report.fit.form, Form::ThreeTerm);
    assert!(report.other.is_some());
}

#[test]
fn four_terms_give_the_losses_back() {
    let losses = Losses {
        r_on: 0.1,
        dcr: 0.2,
        ..LOSSY
    };
    let k = fitted(&table(&losses, |_, _| {}), Form::FourTerm).fit.map.coefficients;
    let v = losses.v_in / k.a;
    assert!((v - losses.v_in - losses.v_f).abs() < 0.01, "V_f from a");
    assert!((k.c - (1.0 - k.a) - losses.lost_duty).abs() < 1e-4, "lost duty from c");
    let apart = k.r.unwrap() * v * v / losses.v_in;
    assert!((apart - 0.08).abs() < 0.002, "Ron - rd from r: {apart}");
}

#[test]
fn one_bad_row_is_named_and_does_not_move_the_mapping() {
    let clean = fitted(&table(&LOSSY, |_, _| {}), Form::FourTerm);
    for (bad, column, factor) in [(7, 1, 1.03), (0, 2, 2.0), (24, 0, 0.9), (12, 1, 0.995)] {
        let spoil = |index: usize, row: &mut [f64; 4]| {
            if index == bad {
                row[column] *= factor;
            }
        };
        let table = table(&LOSSY, spoil);
        let report = fitted(&table, Form::FourTerm);
        let lines: Vec<usize> = report.outliers.iter().map(|outlier| outlier.line).collect();
        assert_eq!(lines, [bad + 2], "row {bad}, column {column}");
        for row in &clean.fit.rows {
            let (d, i) = (row.d_sim, row.point.i_out);
            let moved = (report.fit.map.apply(d, i) - row.d_mapped).abs();
            assert!(moved * 195.0 < 0.03, "row {bad}: {moved}");
        }
    }
}

#[test]
fn a_clean_table_has_no_outliers() {
    for losses in [LOSSY, Losses { r_on: 2.0, ..LOSSY }, Losses { r_d: 1.0, ..LOSSY }] {
        assert_eq!(fitted(&table(&losses, |_, _| {}), Form::ThreeTerm).outliers, []);
    }
}

/// One resistor: i_out follows d_sim, and only a sum of a and b is determined.
#[test]
fn a_single_resistor_leaves_a_and_b_untold() {
    let resistor = |_: usize, row: &mut [f64; 4]| {
        row[2] = row[1] / 20.0;
        row[0] = LOSSY.d_real(row[1] / row[3], row[2]);
    };
    let report = fitted(&table(&LOSSY, resistor), Form::ThreeTerm);
    assert_eq!((report.fit.separation.directions, report.fit.components), (1, 1));
    let finding = report.fit.separation.findings.join(" ");
    assert!(finding.contains("one resistor of 20.000 ohm"), "{finding}");
    assert!(
        report.meaning[0].contains("no meaning of their own"),
        "{:?}",
        report.meaning
    );
    assert!(
        report.notes.iter().any(|note| note.contains("corner")),
        "{:?}",
        report.notes
    );
    let found = report.fit.map;
    let at = |d: f64| found.apply(d, d * 195.0 / 20.0) - LOSSY.d_real(d, d * 195.0 / 20.0);
    assert!(at(0.5).abs() < 1e-3, "on the line it holds");
}

/// With one resistor the same three pairs fit equally well; a load that varies tells them apart.
#[test]
fn ties_are_said_and_vanish_with_a_better_table() {
    let simple = Losses {
        r_on: 0.1,
        r_d: 0.1,
        dcr: 0.1,
        ..LOSSY
    };
    let tied = |table: &Table| {
        let report = fitted(table, Form::ThreeTerm);
        let best = report
            .explanations
            .iter()
            .filter(|e| e.causes.len() == 2)
            .map(|e| e.rms_v);
        let best = best.fold(f64::INFINITY, f64::min);
        report
            .explanations
            .iter()
            .filter(|e| e.causes.len() == 2 && e.rms_v < 1.2 * best + 1e-9)
            .count()
    };
    let resistor = |_: usize, row: &mut [f64; 4]| {
        row[2] = row[1] / 20.0;
        row[0] = simple.d_real(row[1] / row[3], row[2]);
    };
    assert!(tied(&table(&simple, resistor)) >= 3);
    let said = fitted(&table(&simple, resistor), Form::ThreeTerm).meaning.join("\n");
    let (_, impossible) = said
        .split_once("no converter has it")
        .unwrap_or_else(|| panic!("{said}"));
    assert!(
        !impossible.contains("-100"),
        "no gain that explains v_out by itself: {said}"
    );
    let no_diode = Losses { v_f: 0.0, ..simple };
    assert_eq!(tied(&table(&no_diode, |_, _| {})), 1);
    let report = fitted(&table(&no_diode, |_, _| {}), Form::ThreeTerm);
    let best = report.explanations.iter().find(|e| e.causes.len() == 2).unwrap();
    let causes: Vec<Cause> = best.causes.iter().map(|(cause, _)| *cause).collect();
    assert_eq!(causes, [Cause::Resistance, Cause::LostDuty]);
}
