//! What the coefficients say about the converter, as far as the table separates it.

use crate::fit::causes::{self, Explanation};
use crate::fit::regression::Form;
use crate::fit::{Fit, Row};
use crate::table::Point;

/// A coefficient counts as known if it is this many standard errors away from no effect.
// a convention: about 95 %
const KNOWN: f64 = 2.0;

pub(crate) fn of(fit: &Fit, points: &[Point], explanations: &[Explanation], impossible: &[Explanation]) -> Vec<String> {
    let mut meaning = Vec::new();
    // the bound of `separation::WEAK`: beyond it a coefficient alone means nothing
    let apart = fit.separation.directions == fit.separation.predictors && fit.separation.condition <= 30.0;
    let mean = |of: &dyn Fn(&Point) -> f64| points.iter().map(of).sum::<f64>() / points.len().max(1) as f64;
    let (v_in, v_sim) = (mean(&|p| p.v_in), mean(&|p| p.simulation.v_in));
    // the formulas below start from v = d_sim v_in, which a simulation with losses does not have
    if points.iter().any(|p| !p.simulation.is_none()) {
        meaning.push("a, b and c are what the converter differs by from the nominal one, not its own parts".to_owned());
    } else if apart {
        match fit.form {
            Form::ThreeTerm => three(fit, v_in, &mut meaning),
            Form::FourTerm => four(fit, v_in, v_sim, &mut meaning),
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
        meaning.push(tie(&ties, fit));
        meaning.extend(ties.iter().map(|tie| format!("  {}", describe(tie))));
        let beside = causes::as_good(impossible, &ties);
        if !beside.is_empty() {
            meaning.push("as good in figures, but no converter has it:".to_owned());
            meaning.extend(beside.iter().map(|one| format!("  {}", describe(one))));
        }
    }
    meaning
}

/// A pair of causes that leaves this many times what the fit leaves does not explain the table.
/// Between pairs a fifth is the limit ([`causes::ties`]); what two causes of the first order leave out may double it.
const LEAVES_MORE: f64 = 2.0;

/// The line above the explanations that the table cannot tell apart.
fn tie(ties: &[&Explanation], fit: &Fit) -> String {
    let best = ties.iter().map(|tie| tie.rms_v).fold(f64::INFINITY, f64::min);
    let left = fit.with.rms_v;
    match best > LEAVES_MORE * left {
        false => "a tie: each of these explains the table as well, and it cannot say which is true:".to_owned(),
        true => format!(
            "no cause of the list, nor two together, leaves as little as the fit ({left:.4} V rms); these come nearest, and the \
             table cannot tell them apart:"
        ),
    }
}

fn describe(explanation: &Explanation) -> String {
    let causes: Vec<String> = explanation
        .causes
        .iter()
        .map(|(cause, value)| cause.describe(*value))
        .collect();
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

/// With `V = v_in + V_f`: a = v_sim / V, c = lost duty + V_f / V, r = (Ron - rd) v_sim / V^2 and
/// b = [RL + rd + (Ron - rd) V_f / V] / V (see [`crate::formula`]).
fn four(fit: &Fit, v_in: f64, v_sim: f64, meaning: &mut Vec<String>) {
    let (k, se) = (fit.map.coefficients, fit.standard_errors);
    let (r, se_r) = (k.r.unwrap_or(0.0), se.r.unwrap_or(0.0));
    meaning.push("if v_out, i_out and v_in have no gain error and are means over the period (samples at one instant of the ripple \
         shift V_f and lost duty), to first order in R i / v_in; +- is the scatter alone:"
            .to_owned(),
    );
    let (v, se_v) = (v_sim / k.a, v_sim * se.a / (k.a * k.a));
    let v_f = v - v_in;
    let claim = |name: &str, value: f64, error: f64, unit: &str| {
        if value.abs() > KNOWN * error {
            format!("  {name} = {value:.4} +- {error:.4}{unit}")
        } else {
            format!("  {name}: not different from 0 ({value:.4} +- {error:.4}{unit})")
        }
    };
    meaning.push(claim("V_f", v_f, se_v, " V"));
    // V_f is in c as well, so its uncertainty counts again
    let se_lost = (se.c * se.c + se_v * se_v / (v * v)).sqrt();
    meaning.push(claim("lost duty", k.c - v_f / v, se_lost, ""));
    let apart = r * v * v / v_sim;
    meaning.push(claim("Ron - rd", apart, se_r * v * v / v_sim, " ohm"));
    meaning.push(claim("RL + rd", k.b * v - apart * v_f / v, se.b * v, " ohm"));
}

/// Losses take voltage away: where there is more than `d v_in`, something else is at work.
fn gained(fit: &Fit, meaning: &mut Vec<String>) {
    // 0.2 V at 200 V, as much as good meters may be off together. A convention
    let above = |row: &&Row| row.point.v_out > (row.point.d_real + 1e-3) * row.point.v_in;
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
