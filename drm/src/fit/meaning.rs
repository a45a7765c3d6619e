//! What the coefficients say about the converter, as far as the table separates it.

use crate::fit::causes::{self, Explanation};
use crate::fit::regression::Form;
use crate::fit::{Fit, Row};
use crate::table::Point;

/// A coefficient counts as known if it is this many standard errors away from no effect.
const KNOWN: f64 = 2.0;

pub(crate) fn of(fit: &Fit, points: &[Point], explanations: &[Explanation]) -> Vec<String> {
    let mut meaning = Vec::new();
    let apart = fit.separation.directions == fit.separation.predictors && fit.separation.condition <= 30.0;
    let v_in = points.iter().map(|p| p.v_in).sum::<f64>() / points.len().max(1) as f64;
    if apart {
        match fit.form {
            Form::ThreeTerm => three(fit, v_in, &mut meaning),
            Form::FourTerm => four(fit, v_in, &mut meaning),
        }
        meaning.push(
            "ties of every steady state: R of inductor, switch and diode can be exchanged (RL - k, Ron + k, rd + k); lost \
             duty = offset of v_out; gain of v_out = wrong v_in (both in a); gain of i_out = scale of all resistances"
                .to_owned(),
        );
    } else {
        meaning.push("a, b and c have no meaning of their own here: the table does not separate them".to_owned());
    }
    gained(fit, &mut meaning);
    let ties = causes::ties(explanations);
    if ties.len() > 1 {
        meaning.push("a tie: each of these explains the table as well, and it cannot say which is true:".to_owned());
        meaning.extend(ties.iter().map(|tie| format!("  {}", describe(tie))));
    }
    meaning
}

fn describe(explanation: &Explanation) -> String {
    let causes: Vec<String> = explanation.causes.iter().map(|(cause, value)| cause.describe(*value)).collect();
    format!(
        "{} (leaves {:.3} V rms, {:.3} V leave-one-out)",
        causes.join(" with "),
        explanation.rms_v,
        explanation.left_out_v
    )
}

fn three(fit: &Fit, v_in: f64, meaning: &mut Vec<String>) {
    let (k, se) = (fit.map.coefficients, fit.standard_errors);
    if k.b.abs() > KNOWN * se.b {
        meaning.push(format!(
            "b v_in = {:.4} +- {:.4} ohm: series resistance RL + d Ron + (1 - d) rd at the middle of the table, over 1 + V_f / v_in",
            k.b * v_in,
            se.b * v_in
        ));
    } else {
        meaning.push("b is not different from 0: the table shows no series resistance".to_owned());
    }
    meaning.push(format!(
        "a = {:.5} +- {:.5} holds V_f (lowers it), (Ron - rd) times the mean load current (raises it), gain of v_out and a \
         wrong v_in; c = {:.5} +- {:.5} holds lost duty, V_f and an offset of v_out: three terms do not separate them",
        k.a, se.a, k.c, se.c
    ));
}

fn four(fit: &Fit, v_in: f64, meaning: &mut Vec<String>) {
    let (k, se) = (fit.map.coefficients, fit.standard_errors);
    let (r, se_r) = (k.r.unwrap_or(0.0), se.r.unwrap_or(0.0));
    meaning.push("if v_out and v_in are measured without gain error:".to_owned());
    let v_f = v_in * (1.0 - k.a) / k.a;
    let se_v_f = v_in * se.a / (k.a * k.a);
    let claim = |name: &str, value: f64, error: f64, unit: &str| {
        if value.abs() > KNOWN * error {
            format!("  {name} = {value:.4} +- {error:.4}{unit}")
        } else {
            format!("  {name}: not different from 0 ({value:.4} +- {error:.4}{unit})")
        }
    };
    meaning.push(claim("V_f = v_in (1 - a) / a", v_f, se_v_f, " V"));
    let lost = k.c - (1.0 - k.a);
    let se_lost = (se.c * se.c + se.a * se.a).sqrt();
    meaning.push(claim("lost duty = c - (1 - a)", lost, se_lost, ""));
    let v = v_in + v_f;
    let rho = r * v / v_in;
    meaning.push(claim("Ron - rd = r (v_in + V_f)^2 / v_in", rho * v, se_r * v * v / v_in, " ohm"));
    let series = k.b * v - rho * v_f;
    meaning.push(claim("RL + rd = b (v_in + V_f) - (Ron - rd) V_f / (v_in + V_f)", series, se.b * v, " ohm"));
}

/// Losses take voltage away: where there is more than `d v_in`, something else is at work.
fn gained(fit: &Fit, meaning: &mut Vec<String>) {
    let above = |row: &&Row| row.without_v > 1e-3 * row.point.v_in;
    let lines: Vec<usize> = fit.rows.iter().filter(above).map(|row| row.point.line).collect();
    if lines.is_empty() {
        return;
    }
    meaning.push(format!(
        "{}: more voltage than d_real v_in, which losses cannot do: the switch turns off late (duty gained), v_out reads \
         high, v_in reads low, or the current rests (discontinuous)",
        crate::table::lines(&lines)
    ));
}
