//! Panels with a shared x axis.

use crate::alt;
use crate::axis::{Axis, Scale, Settled};
use crate::colour::Colour;
use crate::error::ReportError;
use crate::font::{SMALL, width};
use crate::frame::{
    Area, BAND_OPACITY, DASH, EDGE, Entry, Head, LINE, PANEL_TITLE, Svg, TICK_ROOM, WIDTH, below, border, grid,
    height_on, sheet, widest,
};
use crate::live;
use crate::marks::{label, zone};
use crate::markup::{Markup, Px};
use crate::path;
use crate::series::{Kind, Mark, Series};

/// One or more panels below each other over the same x axis.
///
/// ```
/// use report::{Axis, Chart, Panel, Series};
/// let t = [0.0, 1e-3, 2e-3];
/// let svg = Chart::new("Load step", Axis::new("time").unit("s"))
///     .panel(Panel::new(Axis::new("output voltage").unit("V")).series(Series::line("plant", t, [5.0, 4.8, 5.0])))
///     .panel(Panel::new(Axis::new("duty")).series(Series::step("plant", t, [0.4, 0.5, 0.45])))
///     .svg()?;
/// # Ok::<(), report::ReportError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Chart {
    title: String,
    x: Axis,
    panels: Vec<Panel>,
}

/// One panel of a [`Chart`]: its y axis and what is drawn against it, in the order added (bands first).
#[derive(Debug, Clone)]
pub struct Panel {
    y: Axis,
    height: f64,
    pub(crate) series: Vec<Series>,
    marks: Vec<Mark>,
}

impl Panel {
    /// Empty panel, 220 pixels high.
    pub fn new(y: Axis) -> Self {
        Self {
            y,
            height: 220.0,
            series: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// Height of the drawing area in pixels, at least 40.
    #[must_use]
    pub fn height(mut self, pixels: f64) -> Self {
        self.height = pixels.clamp(40.0, 4000.0);
        self
    }

    /// Adds a series.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Dashed horizontal line with a label: a reference, a limit. The axis reaches it.
    #[must_use]
    pub fn y_line(self, value: f64, label: impl Into<String>) -> Self {
        self.mark(false, value, value, label)
    }

    /// Dashed vertical line with a label: an event.
    #[must_use]
    pub fn x_line(self, value: f64, label: impl Into<String>) -> Self {
        self.mark(true, value, value, label)
    }

    /// Shaded stripe between two y values: a tolerance, forbidden ground. The axis reaches it.
    #[must_use]
    pub fn y_zone(self, from: f64, to: f64, label: impl Into<String>) -> Self {
        self.mark(false, from, to, label)
    }

    /// Shaded stripe between two x values.
    #[must_use]
    pub fn x_zone(self, from: f64, to: f64, label: impl Into<String>) -> Self {
        self.mark(true, from, to, label)
    }

    fn mark(mut self, on_x: bool, from: f64, to: f64, label: impl Into<String>) -> Self {
        let label = label.into();
        self.marks.push(Mark { on_x, from, to, label });
        self
    }

    fn ends(&self, on_x: bool) -> impl Iterator<Item = f64> {
        let of = move |mark: &Mark| (mark.on_x == on_x).then_some([mark.from, mark.to]);
        self.marks.iter().filter_map(of).flatten()
    }
}

impl Chart {
    /// Chart without panels.
    pub fn new(title: impl Into<String>, x: Axis) -> Self {
        Self {
            title: title.into(),
            x,
            panels: Vec::new(),
        }
    }

    /// Adds a panel below the others.
    #[must_use]
    pub fn panel(mut self, panel: Panel) -> Self {
        self.panels.push(panel);
        self
    }

    /// Draws the chart, 900 pixels wide.
    ///
    /// # Errors
    /// No panel, a series without a value that can be drawn or with lists of different length, an impossible range.
    pub fn svg(&self) -> Result<Svg, ReportError> {
        if self.panels.is_empty() {
            return Err(ReportError::Empty {
                what: self.title.clone(),
            });
        }
        for series in self.panels.iter().flat_map(|panel| &panel.series) {
            series.check()?;
        }
        let ys = self.panels.iter().map(y_axis).collect::<Result<Vec<_>, _>>()?;
        let colours = Colours::new(&self.panels);
        let mut svg = Svg::new(|sheet| self.drawn(sheet, &ys, &colours))?;
        let panels: Vec<live::Drawn> = (self.panels.iter().zip(&ys))
            .map(|(panel, y)| live::Drawn {
                y,
                height: panel.height,
                series: panel.series.iter().map(|series| (series, colours.of(series))).collect(),
                marks: &panel.marks,
            })
            .collect();
        svg.live = live::data(&self.title, &self.x_axis(WIDTH)?, &panels);
        Ok(svg)
    }

    fn x_axis(&self, sheet: f64) -> Result<Settled, ReportError> {
        let all_x = self.panels.iter().flat_map(|panel| {
            let series = panel.series.iter().flat_map(|series| series.x.iter().copied());
            series.chain(panel.ends(true))
        });
        let mut series = self.panels.iter().flat_map(|panel| &panel.series);
        // a marker at the edge would be cut in half
        let free = if series.any(|series| series.kind == Kind::Points) {
            0.02
        } else {
            0.0
        };
        // a tick for every 80 to 100 pixels: the widest usual label has room
        self.x.settle(all_x, [free; 2], if sheet < WIDTH { 4 } else { 9 })
    }

    fn drawn(&self, wide: f64, ys: &[Settled], colours: &Colours) -> Result<String, ReportError> {
        let x = self.x_axis(wide)?;
        let head = Head::new(&self.title, colours.entries.clone(), wide);
        let left = EDGE + ys.iter().map(widest).fold(24.0, f64::max) + 6.0;
        let mut labels = x.ticks.iter().rev().filter_map(|tick| tick.label.as_deref());
        // half of the last label stands beyond the end of the axis
        let right = EDGE + (width(labels.next().unwrap_or(""), SMALL) / 2.0).max(4.0);
        let mut areas = Vec::new();
        let mut top = head.height();
        for panel in &self.panels {
            let (y, height) = (top + PANEL_TITLE, height_on(wide, panel.height));
            areas.push(Area {
                x: left,
                y,
                width: wide - left - right,
                height,
            });
            top = y + height + 8.0;
        }
        let high = top + TICK_ROOM + LINE + EDGE - 8.0;

        let mut out = sheet(&alt::chart(&self.title, &x, &self.panels, ys), wide, high);
        head.draw(&mut out);
        let last = self.panels.len() - 1;
        for (n, ((panel, y), area)) in self.panels.iter().zip(ys).zip(areas).enumerate() {
            out.text("text", &[("x", &Px(EDGE)), ("y", &Px(area.y - 11.0))], &y.label);
            let (xs, ys) = (x.onto(area.x, area.right()), y.onto(area.bottom(), area.y));
            grid(&mut out, area, Some((xs, n == last)), Some(ys));
            draw(&mut out, panel, &x, y, area, colours)?;
            border(&mut out, area);
            if n == last {
                below(&mut out, area, &x.label);
            }
        }
        out.close("svg");
        Ok(out.finish())
    }
}

fn y_axis(panel: &Panel) -> Result<Settled, ReportError> {
    let data = panel
        .series
        .iter()
        .flat_map(|series| series.y.iter().chain(&series.high).copied());
    // a tick for every 42 pixels, two to eight: a convention
    let ticks = (panel.height / 42.0).clamp(2.0, 8.0) as usize;
    panel.y.settle(data.chain(panel.ends(false)), [0.06; 2], ticks)
}

/// Colour and dash by name, in order of appearance.
struct Colours {
    entries: Vec<Entry>,
}

impl Colours {
    fn new(panels: &[Panel]) -> Self {
        let mut entries: Vec<Entry> = Vec::new();
        let mut taken = 0;
        for series in panels.iter().flat_map(|panel| &panel.series) {
            if series.name.is_empty() || entries.iter().any(|entry| entry.name == series.name) {
                continue;
            }
            let (next, worn) = Colour::series(taken);
            // a colour of its own does not use up one of the palette
            taken += usize::from(series.colour.is_none());
            entries.push(Entry {
                name: series.name.clone(),
                colour: series.colour.unwrap_or(next),
                dashed: series.kind != Kind::Band && (series.dashed || worn && series.colour.is_none()),
                kind: series.kind,
            });
        }
        Self { entries }
    }

    fn of(&self, series: &Series) -> (Colour, bool) {
        let known = self.entries.iter().find(|entry| entry.name == series.name);
        let (colour, dashed) = known.map_or((Colour::BLUE, false), |entry| (entry.colour, entry.dashed));
        (series.colour.unwrap_or(colour), series.dashed || dashed)
    }
}

/// Data and marks of a panel, cut off at its edge by a nested `svg` (a clip path would need an id, and ids of several
/// charts on a page would clash).
fn draw(
    out: &mut Markup,
    panel: &Panel,
    x: &Settled,
    y: &Settled,
    area: Area,
    colours: &Colours,
) -> Result<(), ReportError> {
    let (xs, ys) = (x.onto(0.0, area.width), y.onto(area.height, 0.0));
    let (wide, high) = (Px(area.width), Px(area.height));
    let place: [(&str, &dyn std::fmt::Display); 4] = [
        ("x", &Px(area.x)),
        ("y", &Px(area.y)),
        ("width", &wide),
        ("height", &high),
    ];
    out.open("svg", &place);
    for mark in &panel.marks {
        zone(out, mark, xs, ys);
    }
    // bands first: what lies on top of a line would hide it
    let bands = panel.series.iter().filter(|series| series.kind == Kind::Band);
    let others = panel.series.iter().filter(|series| series.kind != Kind::Band);
    for series in bands.chain(others) {
        let (colour, dashed) = colours.of(series);
        trace(out, series, xs, ys, colour, dashed)?;
    }
    // labels last, over the data, and none over another
    let mut taken: Vec<Area> = Vec::new();
    for mark in &panel.marks {
        label(out, mark, xs, ys, &mut taken);
    }
    out.close("svg");
    Ok(())
}

fn trace(
    out: &mut Markup,
    series: &Series,
    xs: Scale,
    ys: Scale,
    colour: Colour,
    dashed: bool,
) -> Result<(), ReportError> {
    let points = |values: &[f64]| -> Vec<path::Point> {
        let pairs = series.x.iter().zip(values);
        pairs.map(|(x, y)| Some((xs.at(*x)?, ys.at(*y)?))).collect()
    };
    let low = points(&series.y);
    let data = match series.kind {
        // thinned in pixels, not in samples: so the extremes of each column of pixels stay
        Kind::Line => path::line(&path::thin(&low)),
        Kind::Step => path::line(&path::thin(&path::stairs(&low))),
        Kind::Band => path::area(&low, &points(&series.high)),
        Kind::Points => path::dots(&low),
    };
    if data.is_empty() {
        return Err(ReportError::Empty {
            what: series.name.clone(),
        });
    }
    match series.kind {
        Kind::Band => out.leaf(
            "path",
            &[("d", &data), ("fill", &colour), ("fill-opacity", &BAND_OPACITY)],
        ),
        // a line of no length with round ends is a dot: one path for all, where circles would be an element each
        Kind::Points => out.leaf(
            "path",
            &[
                ("d", &data),
                ("stroke", &colour),
                ("stroke-width", &7),
                ("stroke-linecap", &"round"),
                ("fill", &"none"),
            ],
        ),
        Kind::Line | Kind::Step => {
            let dash = if dashed { DASH } else { "none" };
            out.leaf(
                "path",
                &[
                    ("d", &data),
                    ("stroke", &colour),
                    ("stroke-width", &1.6),
                    ("stroke-linejoin", &"round"),
                    // round ends would close part of the gaps between dashes
                    ("stroke-linecap", &if dashed { "butt" } else { "round" }),
                    ("stroke-dasharray", &dash),
                    ("fill", &"none"),
                ],
            );
        }
    }
    Ok(())
}
