//! `report.html`: what a campaign found, on one page.

use report::{Axis as ChartAxis, Cell, Chart, Page, Panel, ReportError, Section, Series, Table, Verdict, grouped};
use serde_json::Value;

use crate::figures::Figures;
use crate::kind::Kind;
use crate::results::{Listed, Results, State, plain};
use crate::task::Axis;

/// Columns of a training: figure, heading, factor on SI units, decimals.
const TRAINED: [(&str, &str, f64, usize); 5] = [
    ("deviation_V", "deviation V", 1.0, 3),
    ("settling_s", "settling ms", 1e3, 2),
    ("tail_max_V", "tail V", 1.0, 4),
    ("selection_cost", "cost in selection", 1.0, 3),
    ("evaluation_cost", "cost in evaluation", 1.0, 3),
];

/// Significant digits of any other number.
const DIGITS: usize = 4;

impl Results {
    /// The page.
    ///
    /// # Errors
    /// If the table and its rows do not fit, which would be a fault of this crate.
    pub fn page(&self) -> Result<String, ReportError> {
        let (verdict, sentence) = self.verdict();
        let mut page = Page::new(&self.name).verdict(verdict, sentence);
        if let Some(section) = self.failures() {
            page = page.section(section);
        }
        if let Some(section) = self.trainings()? {
            page = page.section(section);
        }
        for kind in Kind::ALL {
            if let Some(section) = self.of_kind(kind) {
                page = page.section(section);
            }
        }
        page.html()
    }

    /// The result in a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        self.verdict().1
    }

    fn verdict(&self) -> (Verdict, String) {
        let [done, failed, missing] = self.counts();
        let refused = self.refused().len();
        let mut parts = vec![format!(
            "{} of {} tasks are done",
            grouped(done as u64),
            grouped(self.rows.len() as u64)
        )];
        for (count, what) in [
            (failed, "failed"),
            (missing, "have not been run"),
            (refused, "have an answer that is no"),
        ] {
            if count > 0 {
                parts.push(format!("{} {what}", grouped(count as u64)));
            }
        }
        let verdict = match (failed + refused, missing) {
            (0, 0) => Verdict::Pass,
            (0, _) => Verdict::Warn,
            _ => Verdict::Fail,
        };
        (verdict, parts.join(", ") + ".")
    }

    fn failures(&self) -> Option<Section> {
        let mut table = Table::new("").text("task").text("why it has no result");
        let mut is_empty = true;
        for (listed, reason) in self.failed() {
            table = table.row([listed.title().into(), reason.into()]);
            is_empty = false;
        }
        (!is_empty).then(|| Section::new("Failed").table(table))
    }

    /// The best seed of each setting, and all of them as points.
    fn trainings(&self) -> Result<Option<Section>, ReportError> {
        let best = self.best();
        if best.is_empty() {
            return Ok(None);
        }
        let mut table = Table::new("")
            .text("training file")
            .text("best seed")
            .text("specification")
            .text("seeds that meet it");
        for (_, heading, _, decimals) in TRAINED {
            table = table.number(heading, decimals);
        }
        for (listed, figures) in &best {
            let settings = listed.axis("settings");
            let of_setting = self.rows.iter().filter(|(other, _)| other.axis("settings") == settings);
            let (mut done, mut met) = (0, 0);
            for (_, state) in of_setting {
                if let State::Done { figures, .. } = state {
                    done += 1;
                    met += usize::from(find(figures, "met") == Some(&Value::Bool(true)));
                }
            }
            let mut cells: Vec<Cell> = vec![
                settings.map(Axis::to_string).unwrap_or_default().into(),
                listed.axis("seed").map(Axis::to_string).unwrap_or_default().into(),
                specification(figures).into(),
                match find(figures, "met") {
                    Some(_) => format!("{met} of {done}").into(),
                    None => "–".into(),
                },
            ];
            cells.extend(numbers(figures));
            table = table.row(cells);
        }
        let section = Section::new("Best seed of each setting")
            .text(
                "The best seed is the one that did best on the selection scenarios; its figures are those of the evaluation, the worst of all \
                 load steps and instants. Its policy stands in the folder best.",
            )
            .table(table);
        Ok(Some(match self.points(&best) {
            Some(chart) => section.chart(
                chart.svg()?,
                "Each point is a seed: the nearer to the lower left corner, the better.",
            ),
            None => section,
        }))
    }

    /// Deviation over settling time of all seeds.
    fn points(&self, best: &[(&Listed, &Figures)]) -> Option<Chart> {
        let mut panel = Panel::new(ChartAxis::new("deviation").unit("V"));
        let mut count = 0;
        for (listed, _) in best {
            let settings = listed.axis("settings");
            let (mut x, mut y) = (Vec::new(), Vec::new());
            for (other, state) in &self.rows {
                let State::Done { figures, .. } = state else { continue };
                let figure = |name| find(figures, name).and_then(Value::as_f64);
                if let (true, Some(settling), Some(deviation)) = (
                    other.axis("settings") == settings,
                    figure("settling_s"),
                    figure("deviation_V"),
                ) {
                    x.push(settling);
                    y.push(deviation);
                }
            }
            count += x.len();
            panel = panel.series(Series::points(settings.map(Axis::to_string).unwrap_or_default(), x, y));
        }
        // one point says nothing that the table does not
        (count > 1).then(|| Chart::new("Seeds", ChartAxis::new("settling").unit("s")).panel(panel))
    }

    /// Every task of a kind.
    fn of_kind(&self, kind: Kind) -> Option<Section> {
        let rows: Vec<&(Listed, State)> = self.rows.iter().filter(|(listed, _)| listed.kind == kind).collect();
        let mut axes: Vec<&str> = Vec::new();
        let mut names: Vec<&str> = Vec::new();
        for (listed, state) in &rows {
            for (axis, _) in &listed.axes {
                if !axes.contains(&axis.as_str()) {
                    axes.push(axis);
                }
            }
            if let State::Done { figures, .. } = state {
                for (name, _) in figures {
                    if !names.contains(&name.as_str()) {
                        names.push(name);
                    }
                }
            }
        }
        if rows.is_empty() {
            return None;
        }
        let mut table = Table::new("");
        for axis in &axes {
            table = table.text(*axis);
        }
        table = table.text("state");
        for name in &names {
            table = table.text(name.replace('_', " "));
        }
        for (listed, state) in &rows {
            let axis = |name: &&str| Cell::from(listed.axis(name).map(Axis::to_string).unwrap_or_default());
            let mut cells: Vec<Cell> = axes.iter().map(axis).collect();
            let (word, figures) = match state {
                State::Done { exit: 0, figures } => ("done", figures.as_slice()),
                State::Done { figures, .. } => ("done: no", figures.as_slice()),
                State::Failed(_) => ("failed", [].as_slice()),
                State::Missing => ("missing", [].as_slice()),
            };
            cells.push(word.into());
            cells.extend(
                names
                    .iter()
                    .map(|name| Cell::from(find(figures, name).map(short).unwrap_or_default())),
            );
            table = table.row(cells);
        }
        let noun = if rows.len() == 1 { "task" } else { "tasks" };
        let heading = format!("{}: {} {noun}", kind.name(), grouped(rows.len() as u64));
        let inner = Section::new(heading).table(table);
        Some(match kind {
            // dozens of seeds, of which the best stand above
            Kind::Train => Section::new("").details(inner),
            _ => inner,
        })
    }
}

fn find<'a>(figures: &'a [(String, Value)], name: &str) -> Option<&'a Value> {
    figures.iter().find(|(own, _)| own == name).map(|(_, value)| value)
}

fn specification(figures: &[(String, Value)]) -> &'static str {
    match find(figures, "met").and_then(Value::as_bool) {
        Some(true) => "met",
        Some(false) => "missed",
        None => "none",
    }
}

fn numbers(figures: &[(String, Value)]) -> impl Iterator<Item = Cell> {
    TRAINED.into_iter().map(|(name, _, factor, _)| {
        let number = find(figures, name).and_then(Value::as_f64);
        Cell::Number(number.map_or(f64::NAN, |number| factor * number))
    })
}

/// A value for people.
fn short(value: &Value) -> String {
    match value {
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Number(number) => match (number.as_u64(), number.as_f64()) {
            (Some(whole), _) => grouped(whole),
            (None, Some(real)) => report::quantity(real, "", DIGITS),
            (None, None) => number.to_string(),
        },
        other => plain(other),
    }
}
