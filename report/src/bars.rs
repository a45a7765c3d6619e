//! Bars and dots by category.

use crate::alt;
use crate::axis::{Axis, Settled};
use crate::colour::Colour;
use crate::error::ReportError;
use crate::font::{LEADING, SMALL, width, wrap};
use crate::frame::{
    Area, EDGE, Entry, Head, LINE, PANEL_TITLE, Svg, TICK_ROOM, WIDTH, below, border, dot, grid, height_on, rectangle,
    sheet, widest,
};
use crate::markup::{Markup, Px};
use crate::series::Kind;

/// Values by category, as grouped bars or as dots.
///
/// Horizontal charts (rows, the default) suit many or long names; several [`BarPanel`]s stand side by side. Vertical
/// ones (columns) stack their panels. On a logarithmic axis bars start at its lower end, which means nothing: prefer
/// [`dots`](BarChart::dots) there.
///
/// ```
/// use report::{Axis, BarChart, BarPanel};
/// let svg = BarChart::new("Losses", ["light load", "full load"])
///     .panel(BarPanel::new(Axis::new("power").unit("W")).bars("switching", [0.1, 0.4]).bars("conduction", [0.05, 1.2]))
///     .svg()?;
/// # Ok::<(), report::ReportError>(())
/// ```
#[derive(Debug, Clone)]
pub struct BarChart {
    title: String,
    categories: Vec<String>,
    panels: Vec<BarPanel>,
    vertical: bool,
    dots: bool,
}

/// One value axis of a [`BarChart`] with its series.
#[derive(Debug, Clone)]
pub struct BarPanel {
    axis: Axis,
    pub(crate) series: Vec<(String, Vec<f64>, Option<Colour>)>,
}

impl BarPanel {
    /// Panel without series.
    pub fn new(axis: Axis) -> Self {
        Self {
            axis,
            series: Vec::new(),
        }
    }

    /// Adds a series, one value for each category. NaN, and zero or less on a logarithmic axis, draws nothing.
    #[must_use]
    pub fn bars(mut self, name: impl Into<String>, values: impl Into<Vec<f64>>) -> Self {
        self.series.push((name.into(), values.into(), None));
        self
    }

    /// As [`bars`](BarPanel::bars) with a colour of its own.
    #[must_use]
    pub fn bars_in(mut self, colour: Colour, name: impl Into<String>, values: impl Into<Vec<f64>>) -> Self {
        self.series.push((name.into(), values.into(), Some(colour)));
        self
    }

    fn settle(&self, ticks: usize) -> Result<Settled, ReportError> {
        let data = || self.series.iter().flat_map(|(_, values, _)| values.iter().copied());
        // the length of a bar is its value only if it starts at zero
        let zero = (!self.axis.is_log()).then_some(0.0);
        // no free part below zero where no bar goes there: the foot of the bars is the edge of the panel
        let foot = if zero.is_some() && !data().any(|value| value < 0.0) {
            0.0
        } else {
            0.04
        };
        self.axis.settle(data().chain(zero), [foot, 0.04], ticks)
    }
}

/// Height of a row with one bar, pixels.
// pixels here and below are laid out by eye
const ROW: f64 = 18.0;
const ROW_OF_GROUP: f64 = 10.0;
const GAP: f64 = 28.0;

impl BarChart {
    /// Chart without panels.
    pub fn new<S: Into<String>>(title: impl Into<String>, categories: impl IntoIterator<Item = S>) -> Self {
        Self {
            title: title.into(),
            categories: categories.into_iter().map(Into::into).collect(),
            panels: Vec::new(),
            vertical: false,
            dots: false,
        }
    }

    /// Adds a panel.
    #[must_use]
    pub fn panel(mut self, panel: BarPanel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Columns instead of rows.
    #[must_use]
    pub fn vertical(mut self) -> Self {
        self.vertical = true;
        self
    }

    /// Dots in place of bars; those of one category are joined by a thin line.
    #[must_use]
    pub fn dots(mut self) -> Self {
        self.dots = true;
        self
    }

    /// Draws the chart, 900 pixels wide.
    ///
    /// # Errors
    /// No category or panel, a panel without a value that can be drawn, a series whose length is not that of the
    /// categories.
    pub fn svg(&self) -> Result<Svg, ReportError> {
        let expected = self.categories.len();
        if expected == 0 || self.panels.is_empty() {
            let what = self.title.clone();
            return Err(ReportError::Empty { what });
        }
        for (name, values, _) in self.panels.iter().flat_map(|panel| &panel.series) {
            if values.len() != expected {
                let (what, found) = (name.clone(), values.len());
                return Err(ReportError::Lengths { what, expected, found });
            }
        }
        Svg::new(|sheet| match self.vertical {
            true => self.columns(sheet),
            false => self.rows(sheet),
        })
    }

    fn alt(&self, axes: &[Settled]) -> String {
        alt::bars(&self.title, axes, &self.panels, &self.categories)
    }

    fn entries(&self) -> Vec<Entry> {
        let mut entries: Vec<Entry> = Vec::new();
        for (name, _, colour) in self.panels.iter().flat_map(|panel| &panel.series) {
            if !entries.iter().any(|entry| entry.name == *name) {
                let colour = colour.unwrap_or(Colour::series(entries.len()).0);
                let kind = if self.dots { Kind::Points } else { Kind::Band };
                // a swatch of full colour
                let entry = Entry {
                    name: name.clone(),
                    colour,
                    dashed: true,
                    kind,
                };
                entries.push(entry);
            }
        }
        entries
    }

    /// Bars of a group; dots share one line.
    fn lanes(&self) -> usize {
        let most = self.panels.iter().map(|panel| panel.series.len()).max();
        if self.dots { 1 } else { most.unwrap_or(1).max(1) }
    }

    /// Panels beside each other, or below each other where the sheet is narrow.
    fn rows(&self, sheet_width: f64) -> Result<String, ReportError> {
        let beside = if sheet_width < WIDTH { 1 } else { self.panels.len() };
        // long names take at most this much; the bars are what the chart is for
        let room = sheet_width * 0.45;
        let names: Vec<Vec<String>> = self.categories.iter().map(|name| wrap(name, SMALL, room)).collect();
        let widest = names
            .iter()
            .flatten()
            .map(|line| width(line, SMALL))
            .fold(0.0, f64::max);
        let left = EDGE + widest.min(room) + 8.0;
        let wide = ((sheet_width - left - EDGE - 12.0 - (beside as f64 - 1.0) * GAP) / beside as f64).max(40.0);
        // a tick for every 75 pixels: the widest usual label has room
        let axes = self.panels.iter().map(|panel| panel.settle((wide / 75.0) as usize));
        let axes = axes.collect::<Result<Vec<_>, _>>()?;
        let entries = self.entries();
        let head = Head::new(&self.title, legend(&entries), sheet_width);
        let lines = names.iter().map(Vec::len).max().unwrap_or(1) as f64;
        let row = ROW
            .max(self.lanes() as f64 * ROW_OF_GROUP + 6.0)
            .max(lines * SMALL * LEADING + 4.0);
        let top = head.height() + 8.0;
        let high = row * self.categories.len() as f64;
        let pitch = high + TICK_ROOM + LINE + EDGE;
        let below_each_other = self.panels.len().div_ceil(beside);
        let mut out = sheet(&self.alt(&axes), sheet_width, top + pitch * below_each_other as f64);
        head.draw(&mut out);
        for (n, (panel, axis)) in self.panels.iter().zip(&axes).enumerate() {
            let area = Area {
                x: left + (n % beside) as f64 * (wide + GAP),
                y: top + pitch * (n / beside) as f64,
                width: wide,
                height: high,
            };
            if n % beside == 0 {
                category_names(&mut out, &names, area, row);
            }
            let scale = axis.onto(area.x, area.right());
            grid(&mut out, area, Some((scale, true)), None);
            self.draw(&mut out, panel, axis, area, &entries);
            border(&mut out, area);
            below(&mut out, area, &axis.label);
        }
        out.close("svg");
        Ok(out.finish())
    }

    fn columns(&self, sheet_width: f64) -> Result<String, ReportError> {
        let panel_height = height_on(sheet_width, 200.0);
        let axes = self
            .panels
            .iter()
            .map(|panel| panel.settle(5))
            .collect::<Result<Vec<_>, _>>()?;
        let entries = self.entries();
        let head = Head::new(&self.title, legend(&entries), sheet_width);
        let left = EDGE + axes.iter().map(widest).fold(24.0, f64::max) + 6.0;
        let wide = sheet_width - left - EDGE;
        let column = wide / self.categories.len() as f64;
        let names: Vec<_> = self
            .categories
            .iter()
            .map(|name| wrap(name, SMALL, column - 4.0))
            .collect();
        let lines = names.iter().map(Vec::len).max().unwrap_or(1) as f64;
        let pitch = PANEL_TITLE + panel_height + 8.0;
        let top = head.height();
        let bottom = top + pitch * self.panels.len() as f64;
        let mut out = sheet(&self.alt(&axes), sheet_width, bottom + lines * LINE + EDGE);
        head.draw(&mut out);
        for (n, (panel, axis)) in self.panels.iter().zip(&axes).enumerate() {
            let y = top + n as f64 * pitch + PANEL_TITLE;
            let area = Area {
                x: left,
                y,
                width: wide,
                height: panel_height,
            };
            out.text("text", &[("x", &Px(EDGE)), ("y", &Px(y - 11.0))], &axis.label);
            grid(&mut out, area, None, Some(axis.onto(area.bottom(), area.y)));
            self.draw(&mut out, panel, axis, area, &entries);
            border(&mut out, area);
        }
        for (n, lines) in names.iter().enumerate() {
            let x = left + column * (n as f64 + 0.5);
            for (line, text) in lines.iter().enumerate() {
                let y = bottom + 8.0 + line as f64 * SMALL * LEADING;
                out.text(
                    "text",
                    &[("x", &Px(x)), ("y", &Px(y)), ("text-anchor", &"middle")],
                    text,
                );
            }
        }
        out.close("svg");
        Ok(out.finish())
    }

    fn draw(&self, out: &mut Markup, panel: &BarPanel, axis: &Settled, area: Area, entries: &[Entry]) {
        let colours = panel.series.iter().map(|(name, ..)| {
            let entry = entries.iter().find(|entry| entry.name == *name);
            entry.map_or(Colour::BLUE, |entry| entry.colour)
        });
        let colours: Vec<Colour> = colours.collect();
        let (along, across) = if self.vertical {
            (area.height, area.width)
        } else {
            (area.width, area.height)
        };
        let slot = across / self.categories.len() as f64;
        // a logarithmic axis has no zero to start from
        let start = if panel.axis.is_log() {
            0.0
        } else {
            axis.part(0.0).unwrap_or(0.0).clamp(0.0, 1.0) * along
        };
        for n in 0..self.categories.len() {
            let ends = panel
                .series
                .iter()
                .map(|(_, values, _)| Some(axis.part(values[n])?.clamp(0.0, 1.0) * along));
            let ends: Vec<Option<f64>> = ends.collect();
            if self.dots {
                let middle = slot * (n as f64 + 0.5);
                let known = || ends.iter().flatten().copied();
                let (low, high) = (known().fold(f64::INFINITY, f64::min), known().fold(0.0, f64::max));
                // no line for a single dot, and none for no dot, where `low` is infinite
                if high > low {
                    self.bar(out, area, (low, high), (middle - 0.75, 1.5), Colour::GRID);
                }
                // backwards, so that the first series lies on top where dots meet
                for (end, colour) in ends.iter().zip(&colours).rev() {
                    let Some(end) = end else { continue };
                    let (x, y) = if self.vertical {
                        (area.x + middle, area.bottom() - end)
                    } else {
                        (area.x + end, area.y + middle)
                    };
                    dot(out, x, y, 4.0, *colour);
                }
                continue;
            }
            // a fifth of the slot stays free between groups; 40 pixels are enough, few categories would make blocks
            let thick = (slot * 0.8 / self.lanes() as f64).min(40.0);
            let first = slot * (n as f64 + 0.5) - thick * self.lanes() as f64 / 2.0;
            for (lane, (end, colour)) in ends.iter().zip(&colours).enumerate() {
                let Some(end) = *end else { continue };
                self.bar(
                    out,
                    area,
                    (start, end),
                    (first + lane as f64 * thick, thick - 1.0),
                    *colour,
                );
            }
        }
    }

    /// From `ends.0` to `ends.1` along the value axis; start and thickness across it.
    fn bar(&self, out: &mut Markup, area: Area, ends: (f64, f64), across: (f64, f64), colour: Colour) {
        let (low, high) = (ends.0.min(ends.1), ends.0.max(ends.1));
        let bar = if self.vertical {
            Area {
                x: area.x + across.0,
                y: area.bottom() - high,
                width: across.1,
                height: high - low,
            }
        } else {
            Area {
                x: area.x + low,
                y: area.y + across.0,
                width: high - low,
                height: across.1,
            }
        };
        rectangle(out, bar, colour, 1.0);
    }
}

/// To the left of a panel, each in the middle of its row.
fn category_names(out: &mut Markup, names: &[Vec<String>], area: Area, row: f64) {
    for (n, lines) in names.iter().enumerate() {
        let first = area.y + row * (n as f64 + 0.5) + 4.0 - (lines.len() as f64 - 1.0) * SMALL * LEADING / 2.0;
        for (line, text) in lines.iter().enumerate() {
            let y = first + line as f64 * SMALL * LEADING;
            out.text(
                "text",
                &[("x", &Px(area.x - 8.0)), ("y", &Px(y)), ("text-anchor", &"end")],
                text,
            );
        }
    }
}

/// A series without name is named by the axis.
fn legend(entries: &[Entry]) -> Vec<Entry> {
    let named = entries.iter().filter(|entry| !entry.name.is_empty());
    named.cloned().collect()
}
