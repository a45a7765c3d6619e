//! A fit as a page: errors, surface, leave-one-out, figures.

use report::{Axis, Chart, Colour, HeatMap, Page, Panel, Ramp, ReportError, Section, Series, Svg, Table, Verdict};

use crate::fit::{Fit, Report, Row};

/// Cells of the surface along each side.
// a convention: smooth to the eye
const CELLS: usize = 60;
/// How far the surface is drawn beyond the valid range, so that dots at its edge are whole.
const MARGIN: f64 = 0.04;

/// A self-contained HTML page of a fit; `title` names the table, `text` is the report in words.
///
/// # Errors
/// If a chart cannot be drawn.
pub fn page(report: &Report, title: &str, text: &str) -> Result<String, ReportError> {
    let fit = &report.fit;
    let sentence = format!(
        "Leave-one-out error {:.4} V rms, {:.4} V at most (line {}); without a mapping {:.4} V rms.",
        fit.left_out.rms_v, fit.left_out.max_v, fit.left_out.max_line, fit.without.rms_v
    );
    let told_apart = fit.separation.directions == fit.separation.predictors;
    let verdict = match told_apart && report.outliers.is_empty() {
        true => Verdict::Note,
        false => Verdict::Warn,
    };
    let mut page = Page::new(title).verdict(verdict, sentence).section(
        Section::new("Errors")
            .chart(errors(fit)?, "Measured minus expected voltage of each settled point.")
            .chart(
                left_out(fit)?,
                "Each point foretold by a fit without it, beside the fit with all points.",
            ),
    );
    page = page.section(
        Section::new("The mapping")
            .chart(
                surface(fit)?,
                "What the mapping adds to d_sim in its valid range and 4 % around; dots are measured points.",
            )
            .text("Far from every dot the surface is an extension, not a measurement."),
    );
    page = page.section(Section::new("Report").code(text));
    page.section(Section::new("").details(Section::new("Points").table(table(fit))))
        .html()
}

fn column(fit: &Fit, of: impl Fn(&Row) -> f64) -> Vec<f64> {
    fit.rows.iter().map(of).collect()
}

fn errors(fit: &Fit) -> Result<Svg, ReportError> {
    let v_out = || column(fit, |row| row.point.v_out);
    let error = || Axis::new("error").unit("V");
    Chart::new("Error over voltage", Axis::new("v_out").unit("V"))
        .panel(
            Panel::new(error())
                .height(150.0)
                .series(
                    Series::points("without a mapping", v_out(), column(fit, |row| row.without_v)).colour(Colour::GREY),
                )
                .y_line(0.0, ""),
        )
        .panel(
            Panel::new(error())
                .height(200.0)
                .series(Series::points(
                    "with the mapping",
                    v_out(),
                    column(fit, |row| row.with_v),
                ))
                .y_line(0.0, ""),
        )
        .svg()
}

fn left_out(fit: &Fit) -> Result<Svg, ReportError> {
    let line = || column(fit, |row| row.point.line as f64);
    Chart::new("Leave-one-out error", Axis::new("line of the table"))
        .panel(
            Panel::new(Axis::new("error").unit("V"))
                .series(Series::points("left out", line(), column(fit, |row| row.left_out_v)))
                .series(Series::points("in the fit", line(), column(fit, |row| row.with_v)).colour(Colour::GREY))
                .y_line(0.0, ""),
        )
        .svg()
}

fn surface(fit: &Fit) -> Result<Svg, ReportError> {
    let (i, d) = (fit.map.valid_i_out, fit.map.valid_d_sim);
    let steps = |low: f64, high: f64| -> Vec<f64> {
        let (from, wide) = (low - MARGIN * (high - low), (1.0 + 2.0 * MARGIN) * (high - low));
        (0..CELLS)
            .map(|k| from + wide * (k as f64 + 0.5) / CELLS as f64)
            .collect()
    };
    let (x, y) = (steps(d.low, d.high), steps(i.low, i.high));
    let added = y
        .iter()
        .flat_map(|i| x.iter().map(|d| fit.map.apply(*d, *i) - d))
        .collect::<Vec<f64>>();
    let mut map = HeatMap::new(
        "Correction of the duty ratio",
        Axis::new("d_sim"),
        Axis::new("i_out").unit("A"),
    );
    if added.iter().any(|a| *a < 0.0) && added.iter().any(|a| *a > 0.0) {
        map = map.ramp(Ramp::Diverging);
    }
    map.values(Axis::new("d_real - d_sim"), x, y, added)
        .dots(
            "measured",
            column(fit, |row| row.d_sim),
            column(fit, |row| row.point.i_out),
        )
        .svg()
}

fn table(fit: &Fit) -> Table {
    let mut table = Table::new("")
        .number("line", 0)
        .number("d_real", 5)
        .number("v_out (V)", 4)
        .number("i_out (A)", 4)
        .number("v_in (V)", 3)
        .number("without (V)", 4)
        .number("with (V)", 4)
        .number("left out (V)", 4);
    for row in &fit.rows {
        let p = &row.point;
        table = table.row([
            (p.line as f64).into(),
            p.d_real.into(),
            p.v_out.into(),
            p.i_out.into(),
            p.v_in.into(),
            row.without_v.into(),
            row.with_v.into(),
            row.left_out_v.into(),
        ]);
    }
    table
}
