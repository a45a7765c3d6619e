//! The same controllers on converters whose parts are others than those they were made for.
//!
//! ```text
//!  --spread KEY=LOW,HIGH[,N] ─► N (or N x M) converters ─┐
//!  policy, law, classical controllers of the nominal one ┴─► worst of all load steps ─► table, map, spread.csv
//! ```

use std::fmt::Write;

use report::{Axis, HeatMap, Section, Svg, Table};
use toml_input::Message;

use super::findings::Setting;
use super::runs::knows;
use crate::controller::{Controller, follow};
use crate::converter::Converter;
use crate::faults::{Error, told};
use crate::read::no_number;
use crate::scenario::{Metrics, Task};
use crate::tables::{digits, time_digits};

/// Values of a number of the plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Spread {
    /// Its key, such as `converter.inductance`.
    pub key: String,
    /// Ascending, in the unit of the key.
    pub values: Vec<f64>,
}

/// Values of a spread unless their number is given.
// with the nominal value in the middle, where the ends are equally far away
const USUAL: usize = 5;
/// Values of a spread at most.
// 21 by 21 converters under five controllers take minutes
const MOST: usize = 21;
/// Instants of a load step on each converter, the first of them a sampling instant.
// the worst of six phases lies within a sixth of a period of the worst of all
const INSTANTS: usize = 6;

impl Spread {
    /// From `KEY=LOW,HIGH` or `KEY=LOW,HIGH,N`.
    ///
    /// # Errors
    /// If it is none, the plant has no such number, or the values are no range.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let wrong = |found: &str| -> Error {
            let message = Message::new("--spread is no range of a number of the plant").found(found.to_owned());
            let message = message.expected(format!("KEY=LOW,HIGH or KEY=LOW,HIGH,N with 2 to {MOST} values"));
            message.hint("--spread converter.inductance=57.8e-6,78.2e-6").into()
        };
        let (key, range) = text.split_once('=').ok_or_else(|| wrong(text))?;
        let parameter = plant::parameter(key).ok_or_else(|| no_number(key))?;
        let parts: Vec<&str> = range.split(',').map(str::trim).collect();
        let (ends, count) = match parts.as_slice() {
            [low, high] => ([low, high], Some(USUAL)),
            [low, high, count] => ([low, high], count.parse().ok()),
            _ => return Err(wrong(text)),
        };
        let [low, high] = ends.map(|end| end.parse::<f64>().ok().filter(|x| x.is_finite()));
        let (Some(low), Some(high), Some(count)) = (low, high, count) else {
            return Err(wrong(text));
        };
        if low >= high || !(2..=MOST).contains(&count) {
            return Err(wrong(text));
        }
        let step = (high - low) / (count - 1) as f64;
        Ok(Self {
            key: parameter.key.to_owned(),
            values: (0..count).map(|n| low + n as f64 * step).collect(),
        })
    }
}

/// What one converter showed.
#[derive(Debug, Clone, PartialEq)]
pub struct Cell {
    /// Its numbers, in the order of the keys.
    pub numbers: Vec<f64>,
    /// By controller: the worst of all load steps, figure by figure.
    pub worst: Vec<(String, Metrics)>,
}

/// All converters of a spread, the first key running fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Spreads {
    /// One or two.
    pub of: Vec<Spread>,
    /// By converter.
    pub cells: Vec<Cell>,
}

/// Runs all controllers on all converters; `tell` is called before each converter.
///
/// # Errors
/// If numbers make no converter, a controller fails, or `tell` ends it.
pub(super) fn run(
    setting: &Setting,
    controllers: &mut [(&str, &mut Box<dyn Controller>)],
    tell: &mut dyn FnMut(&str) -> Result<(), Error>,
) -> Result<Option<Spreads>, Error> {
    let of = &setting.spread;
    let [first, others @ ..] = of.as_slice() else {
        return Ok(None);
    };
    let rows: Vec<Option<f64>> = match others.first() {
        None => vec![None],
        Some(second) => second.values.iter().copied().map(Some).collect(),
    };
    let mut cells = Vec::new();
    for row in rows {
        for column in &first.values {
            let numbers: Vec<f64> = [Some(*column), row].into_iter().flatten().collect();
            let named: Vec<(&str, f64)> = of
                .iter()
                .map(|spread| spread.key.as_str())
                .zip(numbers.clone())
                .collect();
            let text = named
                .iter()
                .map(|(key, value)| format!("{key} = {value:.4e}"))
                .collect::<Vec<_>>()
                .join(", ");
            tell(&text)?;
            cells.push(cell(setting, &setting.converter.with(&named)?, numbers, controllers)?);
        }
    }
    Ok(Some(Spreads { of: of.clone(), cells }))
}

fn cell(
    setting: &Setting,
    converter: &Converter,
    numbers: Vec<f64>,
    controllers: &mut [(&str, &mut Box<dyn Controller>)],
) -> Result<Cell, Error> {
    let task = Task {
        instants: INSTANTS,
        sampling_instants: 1,
        ..setting.scenario.task.clone()
    };
    let mut worst = Vec::new();
    for (name, controller) in controllers {
        let mut metrics = Metrics::default();
        for step in setting.scenario.load_steps.iter().filter(|step| knows(name, **step)) {
            for instant in task.all_instants() {
                let trajectory = follow(converter, controller.as_mut(), setting.v_ref, &task, *step, instant)?;
                metrics = metrics.worst(trajectory.metrics);
            }
        }
        worst.push(((*name).to_owned(), metrics));
    }
    Ok(Cell { numbers, worst })
}

impl Spreads {
    fn controllers(&self) -> impl Iterator<Item = &str> {
        let first = self.cells.first().map_or(&[][..], |cell| cell.worst.as_slice());
        first.iter().map(|(name, _)| name.as_str())
    }

    /// The figures of a controller, converter by converter.
    fn of_controller<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Metrics> {
        let all = self.cells.iter().flat_map(|cell| &cell.worst);
        all.filter(move |(other, _)| other == name).map(|(_, metrics)| metrics)
    }

    /// A row for each controller: the worst of all converters.
    fn rows(&self) -> Vec<(String, [String; 4])> {
        let row = |name: &str| {
            let worst = self
                .of_controller(name)
                .fold(Metrics::default(), |worst, metrics| worst.worst(*metrics));
            let unsettled = if worst.is_settled() { "" } else { ">" };
            let (volts, times) = (digits(worst.band), time_digits(worst.settling));
            let cells = [
                format!("{:.volts$}", worst.deviation),
                format!("{unsettled}{:.times$}", 1e3 * worst.settling),
                format!("{:.*}", volts + 1, worst.tail_max),
                format!("{:.4}", worst.chatter.duty_activity),
            ];
            (name.to_owned(), cells)
        };
        self.controllers().map(row).collect()
    }

    fn words(&self) -> String {
        let range = |spread: &Spread| {
            let [low, high] = [spread.values.first(), spread.values.last()].map(|end| end.copied().unwrap_or_default());
            format!("{} from {low} to {high}", spread.key)
        };
        let ranges: Vec<String> = self.of.iter().map(range).collect();
        format!("{} converters, {}", self.cells.len(), ranges.join(" and "))
    }

    /// For the summary.
    pub(super) fn text(&self) -> String {
        let mut out = format!(
            "{}; the worst of all, of every load step at {INSTANTS} instants:\n\n",
            self.words()
        );
        let line = |first: &str, cells: [&str; 4]| {
            let cells = cells.map(|cell| format!("{cell:<15}")).join(" ");
            format!("{}\n", format!("{first:<17} {cells}").trim_end())
        };
        out.push_str(&line("", HEADINGS));
        for (name, cells) in self.rows() {
            out.push_str(&line(&name, cells.each_ref().map(String::as_str)));
        }
        out
    }

    /// `spread.csv`: the numbers of the converter, the controller, its figures in SI units.
    pub(super) fn csv(&self) -> String {
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

    /// A map of the deviation for each controller, where there are two numbers.
    pub(super) fn maps(&self) -> Result<Vec<(String, Svg)>, Error> {
        let [first, second] = self.of.as_slice() else {
            return Ok(Vec::new());
        };
        let map = |name: &str| {
            let deviations: Vec<f64> = self
                .of_controller(name)
                .map(|metrics| {
                    if metrics.deviation.is_finite() {
                        metrics.deviation
                    } else {
                        f64::NAN
                    }
                })
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

    /// For the page; `maps` are those of [`Spreads::maps`].
    pub(super) fn section(&self, maps: Vec<(String, Svg)>) -> Section {
        let text = format!(
            "{}; each figure is the worst of all load steps at {INSTANTS} instants. The classical controllers are designed on the nominal \
             converter, as policy and law are made for it.",
            self.words()
        );
        let mut table = Table::new("").text("worst of all");
        for heading in HEADINGS {
            table = table.text(heading);
        }
        for (name, cells) in self.rows() {
            let cells = cells.into_iter().map(report::Cell::from);
            table = table.row([report::Cell::from(name.as_str())].into_iter().chain(cells));
        }
        let section = Section::new("Other converters").text(text).table(table);
        maps.into_iter().fold(section, |section, (name, svg)| {
            section.chart(svg, format!("{name}: colours of one map are not those of another."))
        })
    }
}

const HEADINGS: [&str; 4] = ["deviation V", "settling ms", "tail max V", "duty changes"];
