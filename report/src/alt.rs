//! What a picture shows, in words and numbers: for who does not see it.

use crate::axis::Settled;
use crate::bars::BarPanel;
use crate::chart::Panel;
use crate::number::{quantity, shifted};

/// Names of a list that are read out; who listens keeps no more, and the rest is a number.
const MOST: usize = 8;
/// Digits of a number that is read out.
const DIGITS: usize = 4;

/// Title, extent of the horizontal axis, and lowest and highest value of each series.
pub fn chart(title: &str, x: &Settled, panels: &[Panel], ys: &[Settled]) -> String {
    let mut text = format!("{title}. {} {}", x.label, between(x, [x.low, x.high], true));
    for (panel, y) in panels.iter().zip(ys) {
        let named = panel.series.iter().filter(|series| !series.name.is_empty());
        let said = named.filter_map(|series| {
            let values = series.y.iter().chain(&series.high).copied();
            Some(format!("{} {}", series.name, extent(y, values)?))
        });
        let said: Vec<String> = said.collect();
        if !said.is_empty() {
            text.push_str(&format!(". {}: {}", y.label, list(&said)));
        }
    }
    text.push('.');
    text
}

/// Title, and the lowest and highest value over the extent of both axes.
pub fn map(title: &str, x: &Settled, y: &Settled, value: &Settled, cells: &[f64]) -> String {
    let over = [x, y].map(|axis| format!("{} {}", axis.label, between(axis, [axis.low, axis.high], true)));
    let values = extent(value, cells.iter().copied()).unwrap_or_else(|| "without a value".to_owned());
    let label = if value.label.is_empty() { "values" } else { &value.label };
    format!("{title}. {label} {values}, over {} and {}.", over[0], over[1])
}

/// Title, and the values of every category; one axis for each panel.
pub fn bars(title: &str, axes: &[Settled], panels: &[BarPanel], categories: &[String]) -> String {
    let mut text = title.to_owned();
    for (axis, panel) in axes.iter().zip(panels) {
        let of = |n: usize| {
            let values = panel.series.iter().filter_map(|(name, values, _)| {
                let value = number(axis, *values.get(n)?, false)?;
                Some(format!("{name} {value}").trim_start().to_owned())
            });
            values.collect::<Vec<_>>().join(", ")
        };
        let said: Vec<String> = (categories.iter().enumerate())
            .map(|(n, name)| format!("{name}: {}", of(n)))
            .collect();
        text.push_str(&format!(". {}: {}", axis.label, list(&said)));
    }
    text.push('.');
    text
}

fn list(said: &[String]) -> String {
    let shown = said[..said.len().min(MOST)].join("; ");
    match said.len().saturating_sub(MOST) {
        0 => shown,
        more => format!("{shown}; and {more} more"),
    }
}

/// From the lowest to the highest of the values that have a place.
fn extent(axis: &Settled, values: impl Iterator<Item = f64>) -> Option<String> {
    let placed = values.filter(|value| axis.part(*value).is_some());
    let ends = placed.fold(None, |ends: Option<[f64; 2]>, value| {
        let [low, high] = ends.unwrap_or([value; 2]);
        Some([low.min(value), high.max(value)])
    })?;
    Some(between(axis, ends, false))
}

fn between(axis: &Settled, ends: [f64; 2], are_places: bool) -> String {
    let [low, high] = ends.map(|end| number(axis, end, are_places).unwrap_or_default());
    match low == high {
        true => low,
        false => format!("from {low} to {high}"),
    }
}

/// A number in the unit that the axis shows; on a logarithmic axis a place is a decade.
fn number(axis: &Settled, value: f64, is_place: bool) -> Option<String> {
    let value = match (axis.shown_exponent(), is_place) {
        (Some(exponent), _) => shifted(value, -exponent),
        (None, true) => libm::exp10(value),
        (None, false) => value,
    };
    value.is_finite().then(|| quantity(value, "", DIGITS))
}
