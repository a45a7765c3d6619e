//! The report as text.

use std::fmt::{self, Write};

use crate::fit::{Errors, Fit, Report};

/// The report for a reader at the bench.
///
/// # Errors
/// Never, in fact: writing to a text does not fail.
pub fn text(report: &Report) -> Result<String, fmt::Error> {
    let mut out = String::new();
    let fit = &report.fit;
    let k = &fit.map.coefficients;
    let product = if k.r.is_some() { " + r i_out d_sim" } else { "" };
    writeln!(
        out,
        "d_real = a d_sim + b i_out + c{product}   ({} points)",
        fit.rows.len()
    )?;
    let se = &fit.standard_errors;
    let mut entries = vec![("a", k.a, se.a, ""), ("b", k.b, se.b, " 1/A"), ("c", k.c, se.c, "")];
    if let (Some(r), Some(se)) = (k.r, se.r) {
        entries.push(("r", r, se, " 1/A"));
    }
    for (name, value, error, unit) in entries {
        let places = places(value);
        writeln!(out, "  {name} = {value:>12.places$} +- {error:.1e}{unit}")?;
    }
    let (i, d) = (fit.map.valid_i_out, fit.map.valid_d_sim);
    writeln!(
        out,
        "  valid for d_sim {:.4} to {:.4}, i_out {:.3} to {:.3} A; slope {:.4} to {:.4}",
        d.low,
        d.high,
        i.low,
        i.high,
        fit.map.slope(i.low).min(fit.map.slope(i.high)),
        fit.map.slope(i.low).max(fit.map.slope(i.high))
    )?;
    writeln!(out)?;
    error_head(&mut out)?;
    error_line(&mut out, "without a mapping", &fit.without)?;
    error_line(&mut out, "with it, on its own points", &fit.with)?;
    error_line(&mut out, "with it, leaving each point out", &fit.left_out)?;
    if let Some(other) = &report.other {
        error_line(
            &mut out,
            &format!("{} form, leaving each out", other.form.name()),
            &other.left_out,
        )?;
    }
    writeln!(out, "\npartial least squares: {}", components(fit))?;
    writeln!(
        out,
        "condition {:.1}, {} of {} directions determined",
        fit.separation.condition, fit.separation.directions, fit.separation.predictors
    )?;
    if !report.discontinuous.is_empty() {
        let lines = crate::table::lines(&report.discontinuous);
        writeln!(
            out,
            "left out, for the current rests or turns round in each period: {lines}"
        )?;
    }
    for outlier in &report.outliers {
        // a table without noise makes any deviation as many as one likes
        let sigmas = if outlier.sigmas < 1e4 {
            format!("{:.0}", outlier.sigmas)
        } else {
            "over 10,000".to_owned()
        };
        writeln!(
            out,
            "outlier: line {}, {:+.3} V from what the others foretell ({sigmas} standard deviations)",
            outlier.line, outlier.error_v
        )?;
    }
    writeln!(out, "\nmeaning, as far as the table separates it")?;
    for sentence in &report.meaning {
        wrapped(&mut out, "  ", sentence)?;
    }
    for note in &report.notes {
        writeln!(out)?;
        wrapped(&mut out, "", &format!("note: {note}"))?;
    }
    Ok(out)
}

/// Writes a sentence in lines of readable length, the second and later ones set in.
pub(crate) fn wrapped(out: &mut String, indent: &str, sentence: &str) -> fmt::Result {
    const WIDTH: usize = 100;
    let lead = sentence.len() - sentence.trim_start().len();
    let mut line = format!("{indent}{}", &sentence[..lead]);
    let mut empty = true;
    for word in sentence.split_whitespace() {
        if !empty && line.chars().count() + 1 + word.chars().count() > WIDTH {
            writeln!(out, "{line}")?;
            line = format!("{indent}{}  ", &sentence[..lead]);
            empty = true;
        }
        if !empty {
            line.push(' ');
        }
        line.push_str(word);
        empty = false;
    }
    writeln!(out, "{line}")
}

/// The head of a table of errors.
pub(crate) fn error_head(out: &mut String) -> fmt::Result {
    writeln!(
        out,
        "{:<34} {:>10} {:>9} {:>9}",
        "voltage error, measured - expected", "mean", "rms", "max"
    )
}

/// One line of a table of errors.
pub(crate) fn error_line(out: &mut String, title: &str, errors: &Errors) -> fmt::Result {
    writeln!(
        out,
        "  {title:<32} {:>+10.4} {:>9.4} {:>9.4} V (line {})",
        errors.mean_v, errors.rms_v, errors.max_v, errors.max_line
    )
}

fn components(fit: &Fit) -> String {
    let list: Vec<String> = fit
        .components_v
        .iter()
        .enumerate()
        .map(|(index, error)| format!("{}: {error:.4} V", index + 1))
        .collect();
    format!(
        "{} components; leave-one-out rms with {}",
        fit.components,
        list.join(", ")
    )
}

/// What stands above the mapping in its file: which program fitted it to what, and how large the errors are, V.
#[must_use]
pub fn comment(report: &Report) -> String {
    let fit = &report.fit;
    let mut text = format!(
        "Duty ratio mapping, fitted by policyc {} to {} settled points ({} components).\n\
         Voltage error rms {:.4} V, leave-one-out {:.4} V rms, {:.4} V at most; without a mapping {:.4} V rms.",
        env!("CARGO_PKG_VERSION"),
        fit.rows.len(),
        fit.components,
        fit.with.rms_v,
        fit.left_out.rms_v,
        fit.left_out.max_v,
        fit.without.rms_v
    );
    for finding in &fit.separation.findings {
        text += &format!("\nNote: {finding}.");
    }
    text
}

/// Decimal places that show seven digits of a coefficient.
fn places(value: f64) -> usize {
    match value.abs().log10().floor() {
        order if order.is_finite() => (6.0 - order).clamp(0.0, 15.0) as usize,
        _ => 6,
    }
}
