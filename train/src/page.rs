//! `report.html` of a training: all seeds, the specification, and what the best policy decides.

use std::collections::BTreeMap;

use closed_loop::{Converter, decision_map, digits, time_digits};
use policy::Policy;
use report::{Axis, Chart, HeatMap, Page, Panel, Ramp, Section, Series, Svg, Table, Verdict, grouped};

use crate::faults::Error;
use crate::outcome::Outcome;
use crate::rest_page::around_rest;
use crate::seeds::{SeedRun, chosen};
use crate::settings::{Instants, Settings};
use crate::summary::Worst;
use crate::trainer::Look;
use crate::verdict::{self, Verdict as Limit};

/// Cells of the map along each side: smooth to the eye, and a moment's work.
const CELLS: usize = 60;
/// How far the map reaches around the wanted voltage, as a share of it; there a policy decides, and beyond it commands its ends.
const AROUND: f64 = 0.1;

/// The page; `best` is the outcome of one of the `runs`, `converter` what they were trained at.
///
/// # Errors
/// If the policy does not run at the converter, or a table does not fit its columns, which would be a fault of this crate.
pub fn page(settings: &Settings, runs: &[SeedRun], best: &Outcome, converter: &Converter) -> Result<String, Error> {
    let verdict = match (settings.specification.is_empty(), best.evaluated.met) {
        (true, _) => Verdict::Note,
        (false, true) => Verdict::Pass,
        (false, false) => Verdict::Fail,
    };
    let mut page = Page::new(format!("Training of {}", best.policy.name))
        .verdict(verdict, sentence(settings, runs, best))
        .section(seeds(settings, runs, best));
    if !settings.specification.is_empty() {
        page = page.section(specification(best));
    }
    let caption = "The duty before mapping and limits after a long rest at one measurement; all other signals in the middle of their range.";
    let mut decided = Section::new("What the best policy decides");
    decided = match map(&best.policy, settings.reward.v_ref)? {
        Some(svg) => decided.chart_or_reason(svg, caption),
        None => decided.text("A policy of one signal has no map."),
    };
    decided = around_rest(decided, settings, best, converter)?;
    let report = best
        .files
        .get("report.txt")
        .map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    decided = decided.details(Section::new("Report of the best seed").code(report.unwrap_or_default()));
    page.section(decided).html().map_err(crate::faults::told)
}

fn outcomes(runs: &[SeedRun]) -> impl Iterator<Item = &Outcome> {
    runs.iter().filter_map(|run| run.outcome.as_ref())
}

fn sentence(settings: &Settings, runs: &[SeedRun], best: &Outcome) -> String {
    let count = outcomes(runs).count();
    let worst = Worst::of(&best.findings);
    let volts = digits(closed_loop::scenario::settled_band(settings.reward.v_ref));
    let met = match (settings.specification.is_empty(), best.evaluated.met) {
        (true, _) => "",
        (false, true) => " It meets the specification.",
        (false, false) => " It misses the specification.",
    };
    let on_spread = if settings.spread.is_empty() {
        ""
    } else {
        "; on the converters of the spread they are others"
    };
    format!(
        "Seed {}, {} ({count} trained). In its evaluation the largest deviation is {:.volts$} V, the longest settling {:.times$} ms, the largest error \
         at rest {:.tail$} V{on_spread}.{met}",
        best.seed,
        chosen(settings, best),
        worst.deviation,
        1e3 * worst.settling,
        worst.tail_max,
        times = time_digits(worst.settling),
        tail = volts + 1,
    )
}

/// All seeds: their courses, and what they came to.
fn seeds(settings: &Settings, runs: &[SeedRun], best: &Outcome) -> Section {
    let volts = digits(closed_loop::scenario::settled_band(settings.reward.v_ref));
    let mut table = Table::new("The worst of all load steps and instants of each seed's evaluation")
        .text("seed")
        .text("control periods")
        .text("kept after")
        .text("specification")
        .number("deviation V", volts)
        .number("settling ms", 2)
        .number("at rest V", volts + 1)
        .number("cost in selection", 3);
    for outcome in outcomes(runs) {
        let worst = Worst::of(&outcome.findings);
        let run = runs
            .iter()
            .find(|run| run.outcome.as_ref().is_some_and(|own| own.seed == outcome.seed));
        let met = match (settings.specification.is_empty(), outcome.evaluated.met) {
            (true, _) => "none",
            (false, true) => "met",
            (false, false) => "missed",
        };
        let mark = if outcome.seed == best.seed { ", best" } else { "" };
        table = table.row([
            format!("{}{mark}", outcome.seed).into(),
            grouped(run.map_or(0, |run| run.steps)).into(),
            grouped(outcome.best_step).into(),
            met.into(),
            worst.deviation.into(),
            (1e3 * worst.settling).into(),
            worst.tail_max.into(),
            outcome.selected.cost.into(),
        ]);
    }
    let mut section = Section::new("All seeds").table(table);
    if outcomes(runs).all(|outcome| outcome.curve.len() < 2) {
        return section;
    }
    section = section.chart_or_reason(
        courses(runs),
        "What each seed met on its way, means between two looks: noisy, since it explores and its loads are drawn.",
    );
    section.chart_or_reason(
        costs(settings, runs),
        "Each look at the selection scenarios. The cost is the mean of figure over limit, and a thousand times what exceeds a limit: at or below 1 \
         the specification is met. A look that cannot beat the best one ends early and shows a lower bound.",
    )
}

fn steps(outcome: &Outcome) -> Vec<f64> {
    outcome.curve.iter().map(|look| look.step as f64).collect()
}

fn over(runs: &[SeedRun], mut panel: Panel, figure: fn(&Look) -> f64) -> Panel {
    for outcome in outcomes(runs) {
        let values: Vec<f64> = outcome.curve.iter().map(figure).collect();
        // a course without a number is no course
        if values.iter().any(|value| value.is_finite()) {
            panel = panel.series(Series::line(format!("seed {}", outcome.seed), steps(outcome), values));
        }
    }
    panel
}

fn courses(runs: &[SeedRun]) -> Result<Svg, report::ReportError> {
    Chart::new("On the way", Axis::new("control periods"))
        .panel(over(
            runs,
            Panel::new(Axis::new("mean error").unit("V")).height(150.0),
            |look| look.error,
        ))
        .panel(over(runs, Panel::new(Axis::new("mean reward")).height(110.0), |look| {
            look.reward
        }))
        .svg()
}

fn costs(settings: &Settings, runs: &[SeedRun]) -> Result<Svg, report::ReportError> {
    let mut panel = over(runs, Panel::new(Axis::new("cost").log()).height(200.0), |look| {
        look.cost
    });
    if !settings.specification.is_empty() {
        panel = panel.y_line(1.0, "specification");
    }
    Chart::new("Cost on the selection scenarios", Axis::new("control periods"))
        .panel(panel)
        .svg()
}

/// Every limit on every converter, and the figure of the best seed's evaluation that comes nearest to it or exceeds it most.
fn specification(best: &Outcome) -> Section {
    let spread = best.judged.len() > 1;
    let mut table = Table::new("The evaluation of the best seed; of each limit the load step that comes nearest to it");
    if spread {
        table = table.text("converter");
    }
    table = table
        .text("limit of")
        .text("instants")
        .text("holds")
        .text("found")
        .text("limit")
        .text("at");
    // in the order of the training file, and the largest figure of each limit
    let mut tightest: BTreeMap<(usize, usize, &str), &Limit> = BTreeMap::new();
    for (place, judged) in best.judged.iter().enumerate() {
        for verdict in &judged.verdicts {
            let kept = tightest.entry((place, verdict.spec, verdict.figure)).or_insert(verdict);
            if verdict.found.total_cmp(&kept.found).is_gt() {
                *kept = verdict;
            }
        }
    }
    for verdict in tightest.into_values() {
        let [from, to] = verdict.load_step;
        let unit = verdict::unit(verdict.figure);
        let converter = match verdict.converter.as_str() {
            "" => "as in the plant file",
            other => other,
        };
        let cells = [
            converter.into(),
            verdict.figure.into(),
            match verdict.instants {
                Instants::Sample => "sampling",
                Instants::Worst => "all",
            }
            .into(),
            if verdict.holds() { "yes" } else { "NO" }.into(),
            report::quantity(verdict.found, unit, 4).into(),
            report::quantity(verdict.limit, unit, 4).into(),
            format!("{from} -> {to} {}", verdict.unit).into(),
        ];
        table = table.row(cells.into_iter().skip(usize::from(!spread)));
    }
    Section::new("Specification").table(table)
}

/// The duty over the first two signals of the contract; nothing with fewer.
fn map(policy: &Policy, v_ref: f64) -> Result<Option<Result<Svg, report::ReportError>>, Error> {
    let [first, second, ..] = policy.signals.as_slice() else {
        return Ok(None);
    };
    let centres = |low: f64, high: f64| -> Vec<f64> {
        (0..CELLS)
            .map(|n| low + (high - low) * (n as f64 + 0.5) / CELLS as f64)
            .collect()
    };
    let axis = |signal: &policy::Signal| {
        let (low, high) = (signal.range.low, signal.range.high);
        // a voltage that is held is looked at where it is held
        match signal.unit == "V" && low < v_ref && v_ref < high {
            true => centres(low.max(v_ref * (1.0 - AROUND)), high.min(v_ref * (1.0 + AROUND))),
            false => centres(low, high),
        }
    };
    let (x, y) = ((0, axis(first)), (1, axis(second)));
    let middle: Vec<f64> = policy
        .signals
        .iter()
        .map(|signal| 0.5 * (signal.range.low + signal.range.high))
        .collect();
    let found = decision_map(policy, &x, &y, &middle)?;
    let named = |signal: &policy::Signal| Axis::new(signal.name.as_str()).unit(signal.unit.as_str());
    let picture = HeatMap::new("Decisions", named(first), named(second))
        .values(Axis::new("duty"), x.1, y.1, found.duties)
        .ramp(Ramp::Sequential);
    Ok(Some(picture.svg()))
}
