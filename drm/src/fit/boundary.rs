//! Points in which the inductor current rests, or turns round: in the fit, beside it, or told.

use crate::dcm::Conduction;
use crate::fit::regression::error_v;
use crate::fit::{FitOptions, Form, Models, separation, validation};
use crate::table::{Point, Table, lines};

/// The points in continuous conduction, and the lines of the others.
pub(super) fn continuous(table: &Table, options: &FitOptions, notes: &mut Vec<String>) -> (Vec<Point>, Vec<usize>) {
    let Some(conduction) = &options.conduction else {
        match &options.turns_round {
            Some(leg) => return turning(&table.points, leg, options, notes),
            None if options.is_averaged => {}
            None => {
                let how = "give --plant, or --inductance and --f-sw";
                notes.push(format!("discontinuous conduction was not looked for: {how}"));
            }
        }
        return (table.points.clone(), Vec::new());
    };
    let share = |p: &Point| p.i_out / conduction.boundary(p.v_out, p.v_in);
    let (kept, rest): (Vec<Point>, Vec<Point>) = table.points.iter().partition(|p| share(p) >= 1.0);
    // 10 % is a common tolerance of an inductance, by which the boundary moves; a note alone
    let near: Vec<usize> = kept.iter().filter(|p| share(p) < 1.1).map(|p| p.line).collect();
    if !near.is_empty() {
        notes.push(format!("within 10 % of discontinuous conduction: {}", lines(&near)));
    }
    (kept, rest.iter().map(|p| p.line).collect())
}

/// Points in which the current of a synchronous leg turns round count, for the plant file has no dead time; but not where the
/// table shows that the converter has one.
fn turning(
    points: &[Point],
    leg: &Conduction,
    options: &FitOptions,
    notes: &mut Vec<String>,
) -> (Vec<Point>, Vec<usize>) {
    let (above, below): (Vec<Point>, Vec<Point>) =
        points.iter().partition(|p| p.i_out >= leg.boundary(p.v_out, p.v_in));
    if below.is_empty() {
        return (above, Vec::new());
    }
    let of_below: Vec<usize> = below.iter().map(|p| p.line).collect();
    let where_ = format!(
        "below half of the ripple, where the inductor current turns round in each period: {}",
        lines(&of_below)
    );
    if let Some(volts) = another_law(points, &above, &below, options) {
        notes.push(format!(
            "{where_}. The rest foretells their voltage wrong by {volts:+.3} V, as that of a leg with a dead time that the plant \
             file has not: they are left out, and a policy at such loads has this error. Write `dead_time` into [switch] if the leg has one"
        ));
        return (above, of_below);
    }
    notes.push(format!(
        "{where_}. They count, since the plant file has no dead time. A bench that has one gets its lost duty back there: \
         write `dead_time` into [switch] (`policyc diagnose` finds it and writes plant.extended.toml) and give that file to \
         `drm fit --plant`"
    ));
    (points.to_vec(), Vec::new())
}

/// By how much the points below, in the mean, are above what a fit of those above the boundary foretells, V; `None` if they may
/// follow the same law.
fn another_law(all: &[Point], above: &[Point], below: &[Point], options: &FitOptions) -> Option<f64> {
    // a duty that a modulator of 10 bits does not resolve is no reason to give points up
    const LEAST_DUTY: f64 = 1e-3;
    // errors of a dozen points scatter by a fifth, and a fit foretells beyond its points two or three times as badly as between them
    const CLEARLY: f64 = 5.0;
    if options.keep_outliers || above.len() < Form::FourTerm.fewest_points() {
        return None;
    }
    let left_out = |points: &[Point]| {
        let model = Models::new(points, options).richest();
        let cap = separation::examine(&model, points).directions;
        let (components, errors_v) = validation::choose_components(&model, points, cap);
        (
            model,
            components,
            errors_v.get(components - 1).copied().unwrap_or(f64::INFINITY),
        )
    };
    let (model, components, of_above) = left_out(above);
    let (.., of_all) = left_out(all);
    let map = model.map(above, &model.fit(above, components));
    let errors: Vec<f64> = below.iter().map(|p| error_v(&map, p, model.load_line)).collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let least = below.iter().map(Point::v_per_duty).fold(0.0, f64::max) * LEAST_DUTY;
    // a dead time costs duty above the boundary alone: below it the voltage is higher than foretold
    (mean > least && mean > CLEARLY * of_above && of_all > 2.0 * of_above).then_some(mean)
}
