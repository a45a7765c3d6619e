//! Values over a plane as colours.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::alt;
use crate::axis::{Axis, Settled, Tick};
use crate::colour::{Colour, Ramp};
use crate::error::ReportError;
use crate::font::{SMALL, width};
use crate::frame::{
    Area, EDGE, Entry, Head, LINE, PANEL_TITLE, Svg, TICK_ROOM, WIDTH, below, border, grid, height_on, rectangle,
    sheet, widest,
};
use crate::markup::{Markup, Px};
use crate::path;
use crate::series::Kind;

/// A grid of values as coloured cells: a fitted surface, a policy over its observations.
///
/// ```
/// use report::{Axis, HeatMap, Ramp};
/// let v_in = [10.0, 12.0, 14.0];
/// let load = [1.0, 2.0];
/// let duty = [0.5, 0.42, 0.36, 0.51, 0.43, 0.37];
/// let svg = HeatMap::new("Fit", Axis::new("input voltage").unit("V"), Axis::new("load").unit("A"))
///     .values(Axis::new("duty"), v_in, load, duty)
///     .svg()?;
/// # Ok::<(), report::ReportError>(())
/// ```
#[derive(Debug, Clone)]
pub struct HeatMap {
    title: String,
    x: Axis,
    y: Axis,
    value: Axis,
    columns: Vec<f64>,
    rows: Vec<f64>,
    cells: Vec<f64>,
    colours: Colours,
    dots: Vec<(String, Vec<f64>, Vec<f64>)>,
}

#[derive(Debug, Clone)]
enum Colours {
    Smooth(Ramp),
    Levels(Ramp, Vec<f64>),
    Categories(Vec<String>),
}

/// Colour of a cell without value.
const MISSING: Colour = Colour(0xd0, 0xd3, 0xd8);
/// Around a dot; not the paper, which a dark page replaces.
const RIM: Colour = Colour(0xfe, 0xfe, 0xfe);
/// Steps of a smooth ramp; more cannot be told apart.
// fewer colours also make fewer paths, each of a whole map
const STEPS: f64 = 64.0;
// pixels from here on, laid out by eye
const HEIGHT: f64 = 380.0;
const BAR: f64 = 16.0;
/// Room between map and colour bar.
const BESIDE: f64 = 28.0;

impl HeatMap {
    /// Map without values.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis) -> Self {
        Self {
            title: title.into(),
            x,
            y,
            value: Axis::new(""),
            columns: Vec::new(),
            rows: Vec::new(),
            cells: Vec::new(),
            colours: Colours::Smooth(Ramp::Sequential),
            dots: Vec::new(),
        }
    }

    /// The grid: cell centres ascending along x and y, and the values row by row, the row of the lowest y first
    /// (`cells[row * columns + column]`). Cells meet half way between centres. NaN is drawn grey.
    #[must_use]
    pub fn values(
        mut self,
        value: Axis,
        x: impl Into<Vec<f64>>,
        y: impl Into<Vec<f64>>,
        cells: impl Into<Vec<f64>>,
    ) -> Self {
        self.value = value;
        (self.columns, self.rows, self.cells) = (x.into(), y.into(), cells.into());
        self
    }

    /// Colour scale; [`Ramp::Diverging`] is made symmetric about zero.
    #[must_use]
    pub fn ramp(mut self, ramp: Ramp) -> Self {
        self.colours = match self.colours {
            Colours::Levels(_, levels) => Colours::Levels(ramp, levels),
            _ => Colours::Smooth(ramp),
        };
        self
    }

    /// One colour for each interval between ascending levels, as filled contours have. Values beyond the outer levels
    /// take the colour of the outer interval.
    #[must_use]
    pub fn levels(mut self, levels: impl Into<Vec<f64>>) -> Self {
        let ramp = if let Colours::Smooth(ramp) = self.colours {
            ramp
        } else {
            Ramp::Sequential
        };
        self.colours = Colours::Levels(ramp, levels.into());
        self
    }

    /// The values are indices into these names, which the legend lists; neighbours in the list have neighbouring
    /// colours.
    #[must_use]
    pub fn categories<S: Into<String>>(mut self, names: impl IntoIterator<Item = S>) -> Self {
        self.colours = Colours::Categories(names.into_iter().map(Into::into).collect());
        self
    }

    /// Dots on top, such as the points a surface was fitted to.
    #[must_use]
    pub fn dots(mut self, name: impl Into<String>, x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        self.dots.push((name.into(), x.into(), y.into()));
        self
    }

    /// Draws the map, 900 pixels wide.
    ///
    /// # Errors
    /// Centres that do not ascend, fewer than two of them on an axis, a number of values that is not columns times
    /// rows, no finite value, levels that do not ascend.
    pub fn svg(&self) -> Result<Svg, ReportError> {
        let expected = self.columns.len() * self.rows.len();
        lengths(&self.value.label, expected, self.cells.len())?;
        for (name, x, y) in &self.dots {
            lengths(name, x.len(), y.len())?;
        }
        Svg::new(|sheet| self.drawn(sheet))
    }

    fn drawn(&self, wide: f64) -> Result<String, ReportError> {
        let is_narrow = wide < WIDTH;
        let (x, x_edges) = edges(&self.x, &self.columns, if is_narrow { 4 } else { 9 })?;
        let (y, y_edges) = edges(&self.y, &self.rows, 7)?;
        let value = self.value_axis()?;
        let head = Head::new(&self.title, self.legend(), wide);
        let categories = matches!(self.colours, Colours::Categories(_));
        // on a narrow sheet the title of the colours has a line of its own
        let title_room = if is_narrow && !categories { LINE } else { 0.0 };
        let top = head.height() + title_room + PANEL_TITLE;
        let left = EDGE + widest(&y).max(24.0) + 6.0;
        let beside = if is_narrow { BESIDE / 2.0 } else { BESIDE };
        let bar = BAR + 6.0 + widest(&value);
        let bar = if is_narrow {
            bar
        } else {
            bar.max(width(&value.label, SMALL))
        };
        let right = EDGE + if categories { 8.0 } else { beside + bar };
        // whole pixels, so that cells, frame and grid meet without half-covered edges
        let area = Area {
            x: left.round(),
            y: top.round(),
            width: (wide - left - right).floor(),
            height: height_on(wide, HEIGHT),
        };
        let area = Area {
            height: area.height.floor(),
            ..area
        };
        let alt = alt::map(&self.title, &x, &y, &value, &self.cells);
        let mut out = sheet(&alt, wide, area.bottom() + TICK_ROOM + LINE + EDGE);
        head.draw(&mut out);
        out.text("text", &[("x", &Px(EDGE)), ("y", &Px(area.y - 11.0))], &y.label);
        let (xs, ys) = (x.onto(area.x, area.right()), y.onto(area.bottom(), area.y));
        // before the cells, which cover its lines: its labels are what is wanted
        grid(&mut out, area, Some((xs, true)), Some(ys));
        self.cells(&mut out, &value, area, &x_edges, &y_edges);
        for (_, x, y) in &self.dots {
            let points = x.iter().zip(y).map(|(x, y)| {
                let inside = |part: f64| (0.0..=1.0).contains(&part);
                (inside(xs.settled.part(*x)?) && inside(ys.settled.part(*y)?)).then_some((xs.at(*x)?, ys.at(*y)?))
            });
            let data = path::dots(&points.collect::<Vec<_>>());
            // dark on a light rim is seen on every colour of the map
            for (colour, size) in [(RIM, 7.0), (Colour::INK, 4.0)] {
                out.leaf(
                    "path",
                    &[
                        ("d", &data),
                        ("stroke", &colour),
                        ("stroke-width", &size),
                        ("stroke-linecap", &"round"),
                    ],
                );
            }
        }
        border(&mut out, area);
        below(&mut out, area, &x.label);
        if !categories {
            let bar = Area {
                x: area.right() + beside,
                width: BAR,
                ..area
            };
            let title = match is_narrow {
                true => (EDGE, format!("colour: {}", value.label)),
                false => (bar.x, value.label.clone()),
            };
            let above = area.y - 11.0 - title_room;
            out.text("text", &[("x", &Px(title.0)), ("y", &Px(above))], &title.1);
            self.bar(&mut out, &value, bar);
        }
        out.close("svg");
        Ok(out.finish())
    }

    fn value_axis(&self) -> Result<Settled, ReportError> {
        let cells = || self.cells.iter().copied();
        match &self.colours {
            Colours::Smooth(Ramp::Sequential) | Colours::Categories(_) => self.value.settle(cells(), [0.0; 2], 7),
            // with all values mirrored the range is symmetric, and white is zero
            Colours::Smooth(Ramp::Diverging) => self.value.settle(cells().chain(cells().map(|v| -v)), [0.0; 2], 7),
            Colours::Levels(_, levels) => {
                let ascending = levels.windows(2).all(|pair| pair[0] < pair[1]);
                match (levels.first(), levels.last()) {
                    (Some(low), Some(high)) if ascending && levels.len() > 1 => {
                        let fixed = self.value.clone().range(*low, *high);
                        let mut axis = fixed.settle(cells(), [0.0; 2], 7)?;
                        if !fixed.is_log() {
                            axis.ticks = fixed.ticks_at(levels);
                        }
                        Ok(axis)
                    }
                    _ => Err(ReportError::Order {
                        axis: self.value.label.clone(),
                    }),
                }
            }
        }
    }

    fn legend(&self) -> Vec<Entry> {
        let dots = self.dots.iter().filter(|(name, ..)| !name.is_empty());
        let entry = |name: &str, colour, kind| Entry {
            name: name.to_owned(),
            colour,
            dashed: true,
            kind,
        };
        let mut entries: Vec<Entry> = dots.map(|(name, ..)| entry(name, Colour::INK, Kind::Points)).collect();
        if let Colours::Categories(names) = &self.colours {
            let named = names.iter().enumerate();
            entries.extend(named.map(|(n, name)| entry(name, category(n, names.len()), Kind::Band)));
        }
        entries
    }

    fn colour(&self, value: f64, axis: &Settled) -> Colour {
        let Some(part) = axis.part(value) else { return MISSING };
        match &self.colours {
            Colours::Smooth(ramp) => ramp.at((part * STEPS).round() / STEPS),
            Colours::Levels(ramp, levels) => {
                let below = levels.iter().filter(|level| **level <= value).count();
                interval(*ramp, below.saturating_sub(1).min(levels.len() - 2), levels.len() - 1)
            }
            Colours::Categories(names) => {
                // equal, not near: 1.5 is no category
                let known = (0..names.len()).find(|n| *n as f64 == value);
                known.map_or(MISSING, |n| category(n, names.len()))
            }
        }
    }

    /// One path for each colour; equal neighbours of a row are one rectangle.
    fn cells(&self, out: &mut Markup, value: &Settled, area: Area, x: &[f64], y: &[f64]) {
        // ordered, so that equal maps have equal bytes
        let mut paths: BTreeMap<Colour, String> = BTreeMap::new();
        // whole pixels: short, and neighbours meet without a seam
        let across = |part: f64| Px((area.x + part * area.width).round());
        let up = |part: f64| Px((area.bottom() - part * area.height).round());
        for (row, cells) in self.cells.chunks(self.columns.len()).enumerate() {
            let colours: Vec<Colour> = cells.iter().map(|cell| self.colour(*cell, value)).collect();
            let mut from = 0;
            for run in colours.chunk_by(|a, b| a == b) {
                let to = from + run.len();
                let (left, right) = (across(x[from]), across(x[to]));
                let (low, high) = (up(y[row]), up(y[row + 1]));
                // writing to a `String` cannot fail
                let _ = write!(paths.entry(run[0]).or_default(), "M{left},{low}H{right}V{high}H{left}z");
                from = to;
            }
        }
        out.open("g", &[("shape-rendering", &"crispEdges")]);
        for (colour, d) in paths {
            out.leaf("path", &[("d", &d), ("fill", &colour)]);
        }
        out.close("g");
    }

    /// Colour bar with its numbers.
    fn bar(&self, out: &mut Markup, value: &Settled, bar: Area) {
        out.open("g", &[("shape-rendering", &"crispEdges")]);
        let piece = |out: &mut Markup, low: f64, high: f64, colour| {
            let (y, end) = (
                (bar.bottom() - high * bar.height).round(),
                (bar.bottom() - low * bar.height).round(),
            );
            let height = end - y;
            rectangle(out, Area { y, height, ..bar }, colour, 1.0);
        };
        match &self.colours {
            Colours::Levels(ramp, levels) => {
                let parts: Vec<f64> = levels.iter().filter_map(|level| value.part(*level)).collect();
                for (n, pair) in parts.windows(2).enumerate() {
                    piece(out, pair[0], pair[1], interval(*ramp, n, parts.len() - 1));
                }
            }
            Colours::Smooth(ramp) => {
                for n in 0..STEPS as u32 {
                    let (low, high) = (f64::from(n) / STEPS, f64::from(n + 1) / STEPS);
                    piece(out, low, high, ramp.at((low + high) / 2.0));
                }
            }
            Colours::Categories(_) => {}
        }
        out.close("g");
        border(out, bar);
        let scale = value.onto(bar.bottom(), bar.y);
        for tick in &value.ticks {
            let Tick { label: Some(label), .. } = tick else {
                continue;
            };
            let y = scale.tick(tick);
            out.text(
                "text",
                &[
                    ("x", &Px(bar.right() + 6.0)),
                    ("y", &Px(y + 4.0)),
                    ("fill", &Colour::DIM),
                ],
                label,
            );
        }
    }
}

fn lengths(what: &str, expected: usize, found: usize) -> Result<(), ReportError> {
    let what = what.to_owned();
    if expected == found {
        Ok(())
    } else {
        Err(ReportError::Lengths { what, expected, found })
    }
}

fn interval(ramp: Ramp, n: usize, of: usize) -> Colour {
    ramp.at((n as f64 + 0.5) / of as f64)
}

fn category(n: usize, of: usize) -> Colour {
    Ramp::Sequential.at(if of < 2 { 0.5 } else { n as f64 / (of - 1) as f64 })
}

/// Axis from the outer edge of the first cell to that of the last, and all edges as parts of the way.
fn edges(axis: &Axis, centres: &[f64], ticks: usize) -> Result<(Settled, Vec<f64>), ReportError> {
    let places: Vec<f64> = centres.iter().filter_map(|centre| axis.place(*centre)).collect();
    let ascending = places.windows(2).all(|pair| pair[0] < pair[1]);
    let [first, second, ..] = places[..] else {
        return Err(ReportError::Empty {
            what: axis.label.clone(),
        });
    };
    if places.len() != centres.len() || !ascending {
        return Err(ReportError::Order {
            axis: axis.label.clone(),
        });
    }
    // the outer cells are as wide as the way to their neighbour says
    let mut edges = vec![first - (second - first) / 2.0];
    edges.extend(places.windows(2).map(|pair| (pair[0] + pair[1]) / 2.0));
    if let [.., before, last] = places[..] {
        edges.push(last + (last - before) / 2.0);
    }
    let (low, high) = (edges[0], edges[places.len()]);
    let settled = axis.settle_between(low, high, ticks);
    let parts = edges.iter().map(|edge| (edge - low) / (high - low)).collect();
    Ok((settled, parts))
}
