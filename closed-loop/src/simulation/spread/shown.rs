//! A spread in the summary, in `spread.csv`, in `metrics.json` and on the page.

use std::collections::BTreeMap;
use std::fmt::Write;

use report::{Axis, Chart, HeatMap, Panel, Section, Series, Svg, Table};
use serde::Serialize;

use super::figures::{Standing, Summed, standings};
use super::{INSTANTS, Spread, Spreads};
use crate::faults::{Error, told};
use crate::scenario::Metrics;
use crate::simulation::POLICY;
use crate::tables::{digits, time_digits};

/// What `metrics.json` says of it. Figures that are not finite are null.
#[derive(Serialize)]
pub(in crate::simulation) struct Json<'a> {
    converters: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    seed: Option<u64>,
    keys: BTreeMap<&'a str, [f64; 2]>,
    controllers: BTreeMap<&'a str, Summed>,
    /// Beside each of the others.
    #[serde(skip_serializing_if = "Option::is_none")]
    policy_against: Option<BTreeMap<&'a str, Standing>>,
    /// Beside the best of the others in each figure.
    #[serde(skip_serializing_if = "Option::is_none")]
    policy_against_the_best: Option<Standing>,
}

impl Spreads {
    fn words(&self) -> String {
        let range = |spread: &Spread| {
            let [low, high] = spread.ends();
            format!("{} from {low} to {high}", spread.key)
        };
        let ranges: Vec<String> = self.of.iter().map(range).collect();
        let (count, ranges) = (self.cells.len(), ranges.join(" and "));
        match self.draws {
            None => format!("{count} converters, {ranges}"),
            Some(draws) => format!("{count} converters, drawn with seed {} from {ranges}", draws.seed),
        }
    }

    /// What a controller's figures are, in words.
    fn headings(&self) -> Vec<&'static str> {
        match self.draws {
            None => vec!["deviation V", "settling ms", "tail max V", "duty changes"],
            Some(_) => vec![
                "deviation V",
                "settling ms",
                "tail max V",
                "not settled",
                "policy better, worse",
            ],
        }
    }

    /// A row for each controller: the worst of all converters, of drawn ones the median beside it.
    fn rows(&self) -> Vec<(String, Vec<String>)> {
        match self.draws {
            None => self.worst_rows(),
            Some(_) => self.drawn_rows(),
        }
    }

    fn worst_rows(&self) -> Vec<(String, Vec<String>)> {
        let row = |name: &str| {
            let worst = self
                .of_controller(name)
                .fold(Metrics::default(), |worst, metrics| worst.worst(*metrics));
            let unsettled = if worst.is_settled() { "" } else { ">" };
            let (volts, times) = (digits(worst.band), time_digits(worst.settling));
            let cells = vec![
                format!("{:.volts$}", worst.deviation),
                format!("{unsettled}{:.times$}", 1e3 * worst.settling),
                format!("{:.*}", volts + 1, worst.tail_max),
                format!("{:.4}", worst.chatter.duty_activity),
            ];
            (name.to_owned(), cells)
        };
        self.controllers().map(row).collect()
    }

    fn drawn_rows(&self) -> Vec<(String, Vec<String>)> {
        let summed = self.summed();
        let against = standings(&summed).map(|(each, _)| each).unwrap_or_default();
        let bands = self
            .cells
            .iter()
            .flat_map(|cell| &cell.worst)
            .map(|(_, metrics)| metrics.band);
        let volts = digits(bands.fold(0.0, f64::max));
        let longest = summed.iter().map(|(_, own)| own.settling.worst).fold(0.0, f64::max);
        let times = time_digits(longest);
        let row = |(name, own): &(&str, Summed)| {
            let standing = against.iter().find(|(other, _)| other == name);
            let unsettled = if own.unsettled == 0 { "" } else { ">" };
            let cells = vec![
                // a digit more than elsewhere: what is compared are small differences
                format!(
                    "{:.*} / {:.*}",
                    volts + 1,
                    own.deviation.median,
                    volts + 1,
                    own.deviation.worst
                ),
                format!(
                    "{:.times$} / {unsettled}{:.times$}",
                    1e3 * own.settling.median,
                    1e3 * own.settling.worst
                ),
                format!(
                    "{:.*} / {:.*}",
                    volts + 2,
                    own.tail_max.median,
                    volts + 2,
                    own.tail_max.worst
                ),
                own.unsettled.to_string(),
                standing.map_or("-".to_owned(), |(_, own)| format!("{}, {}", own.better, own.worse)),
            ];
            ((*name).to_owned(), cells)
        };
        summed.iter().map(row).collect()
    }

    /// How the policy stands beside the best of the others, where converters are drawn and there are others.
    fn verdict(&self) -> Option<String> {
        self.draws?;
        let (_, best) = standings(&self.summed())?;
        let even = 6 - best.better - best.worse;
        Some(format!(
            "the policy beside the best of the others in each of the six figures: better in {}, worse in {}, equal in {even}",
            best.better, best.worse
        ))
    }

    fn explanation(&self) -> String {
        let figures = match self.draws {
            None => "each figure is the worst of all load steps",
            Some(_) => "median / worst of all converters, each with the worst of all load steps",
        };
        format!("{}; {figures} at {INSTANTS} instants", self.words())
    }

    /// For the summary.
    pub(in crate::simulation) fn text(&self) -> String {
        let mut out = format!("{}:\n\n", self.explanation());
        let width = if self.draws.is_some() { 17 } else { 15 };
        let line = |first: &str, cells: &[String]| {
            let cells: Vec<String> = cells.iter().map(|cell| format!("{cell:<width$}")).collect();
            format!("{}\n", format!("{first:<17} {}", cells.join(" ")).trim_end())
        };
        let headings: Vec<String> = self.headings().into_iter().map(str::to_owned).collect();
        out.push_str(&line("", &headings));
        for (name, cells) in self.rows() {
            out.push_str(&line(&name, &cells));
        }
        if let Some(verdict) = self.verdict() {
            out.push_str(&format!("\n{verdict}\n"));
        }
        out
    }

    /// `spread.csv`: the numbers of the converter, the controller, its figures in SI units.
    pub(in crate::simulation) fn csv(&self) -> String {
        let keys: Vec<&str> = self.of.iter().map(|spread| spread.key.as_str()).collect();
        let mut out = format!("{},controller,{}\n", keys.join(","), crate::tables::FIGURES);
        for cell in &self.cells {
            let numbers: Vec<String> = cell.numbers.iter().map(f64::to_string).collect();
            for (name, metrics) in &cell.worst {
                // writing to a String cannot fail
                let _ = writeln!(out, "{},{name},{}", numbers.join(","), crate::tables::figures(metrics));
            }
        }
        out
    }

    /// For `metrics.json`.
    pub(in crate::simulation) fn json(&self) -> Json<'_> {
        let summed = self.summed();
        let standings = self.draws.and_then(|_| standings(&summed));
        Json {
            converters: self.cells.len(),
            seed: self.draws.map(|draws| draws.seed),
            keys: self
                .of
                .iter()
                .map(|spread| (spread.key.as_str(), spread.ends()))
                .collect(),
            policy_against_the_best: standings.as_ref().map(|(_, best)| *best),
            policy_against: standings.map(|(each, _)| each.into_iter().collect()),
            controllers: summed.into_iter().collect(),
        }
    }

    /// Of a grid a map of the deviation for each controller, where there are two numbers; of drawn converters one picture of all.
    /// By the end of the file's name.
    pub(in crate::simulation) fn pictures(&self) -> Result<Vec<(String, Svg)>, Error> {
        match self.draws {
            Some(_) => Ok(vec![("draws".to_owned(), self.ordered()?)]),
            None => self.maps(),
        }
    }

    fn maps(&self) -> Result<Vec<(String, Svg)>, Error> {
        let [first, second] = self.of.as_slice() else {
            return Ok(Vec::new());
        };
        let map = |name: &str| {
            let deviations: Vec<f64> = self
                .of_controller(name)
                .map(|metrics| finite(metrics.deviation))
                .collect();
            // nowhere a number: there is nothing to draw
            if deviations.iter().all(|x| x.is_nan()) {
                return None;
            }
            let axis = |spread: &Spread| Axis::new(spread.key.as_str());
            let map = HeatMap::new(format!("{name}: largest deviation"), axis(first), axis(second));
            let map = map.values(
                Axis::new("deviation").unit("V"),
                first.values.clone(),
                second.values.clone(),
                deviations,
            );
            Some(map.svg().map(|svg| (name.to_owned(), svg)).map_err(told))
        };
        self.controllers().filter_map(map).collect()
    }

    /// Each controller's figures in ascending order: its median is in the middle, its worst at the right end.
    fn ordered(&self) -> Result<Svg, Error> {
        let share: Vec<f64> = (0..self.cells.len())
            .map(|n| 100.0 * (n as f64 + 0.5) / self.cells.len() as f64)
            .collect();
        let panel = |axis: Axis, figure: fn(&Metrics) -> f64| {
            self.controllers().fold(Panel::new(axis).height(170.0), |panel, name| {
                let mut values: Vec<f64> = self.of_controller(name).map(figure).collect();
                values.sort_by(f64::total_cmp);
                let values: Vec<f64> = values.into_iter().map(finite).collect();
                // a controller that always diverges has no line
                if values.iter().all(|x| x.is_nan()) {
                    return panel;
                }
                panel.series(Series::line(name, share.clone(), values))
            })
        };
        Chart::new(
            "Drawn converters, each figure in ascending order",
            Axis::new("converters").unit("%"),
        )
        .panel(panel(Axis::new("deviation").unit("V"), |m| m.deviation))
        .panel(panel(Axis::new("settling").unit("ms"), |m| 1e3 * m.settling))
        .panel(panel(Axis::new("tail").unit("V"), |m| m.tail_max))
        .svg()
        .map_err(told)
    }

    /// For the page; `pictures` are those of [`Spreads::pictures`].
    pub(in crate::simulation) fn section(&self, pictures: Vec<(String, Svg)>) -> Section {
        let text = format!(
            "{}. The classical controllers are designed on the nominal converter, as policy and law are made for it.",
            self.explanation()
        );
        let first = if self.draws.is_some() {
            "median / worst"
        } else {
            "worst of all"
        };
        let mut table = Table::new("").text(first);
        for heading in self.headings() {
            table = table.text(heading);
        }
        for (name, cells) in self.rows() {
            let cells = cells.into_iter().map(report::Cell::from);
            table = table.row([report::Cell::from(name.as_str())].into_iter().chain(cells));
        }
        let mut section = Section::new("Other converters").text(text).table(table);
        if let Some(verdict) = self.verdict() {
            section = section.text(format!("{}.", verdict.replacen("the policy", "The policy", 1)));
        }
        let caption = |name: &str| match self.draws {
            None => format!("{name}: colours of one map are not those of another."),
            Some(_) => format!(
                "In each panel every controller has its own order of converters. A line that ends early diverges on the rest; `{POLICY}` is the first."
            ),
        };
        pictures
            .into_iter()
            .fold(section, |section, (name, svg)| section.chart(svg, caption(&name)))
    }
}

/// What is drawn of a figure: nothing of one that is infinite.
fn finite(x: f64) -> f64 {
    if x.is_finite() { x } else { f64::NAN }
}
