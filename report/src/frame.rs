//! What surrounds the data in every chart: sheet, title, legend, grid, tick labels.

use crate::axis::{Scale, Settled, Tick};
use crate::colour::Colour;
use crate::error::ReportError;
use crate::font::{LARGE, LEADING, SMALL, width, wrap};
use crate::markup::{Markup, Px};
use crate::series::Kind;

/// A finished picture: one `<svg>` element, complete as a file of its own and inside an HTML page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Svg {
    markup: String,
    /// The same for a small screen and for a column of print, where letters of the wide one could not be read.
    pub(crate) narrow: String,
    /// Its data for the script of a page, if there is something that can be asked of it.
    pub(crate) live: Option<String>,
}

impl Svg {
    /// What `draw` draws for each of both widths.
    pub(crate) fn new(draw: impl Fn(f64) -> Result<String, ReportError>) -> Result<Self, ReportError> {
        Ok(Self {
            markup: draw(WIDTH)?,
            narrow: draw(NARROW)?,
            live: None,
        })
    }

    /// The markup.
    pub fn as_str(&self) -> &str {
        &self.markup
    }
}

impl std::fmt::Display for Svg {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.markup)
    }
}

/// Width of a chart unless told otherwise, pixels.
// this and the pixels below are laid out by eye: conventions
pub const WIDTH: f64 = 900.0;
/// Width for a screen of 390 pixels with its edges, and for half a sheet of A4.
pub const NARROW: f64 = 356.0;
/// Free edge of the sheet.
pub const EDGE: f64 = 12.0;
/// Room below a panel for tick labels.
pub const TICK_ROOM: f64 = 20.0;
/// Room for one line of small text.
pub const LINE: f64 = SMALL * LEADING;
/// Room above a panel for the title of its vertical axis, clear of a tick label at the top.
pub const PANEL_TITLE: f64 = LINE + 8.0;

/// A rectangle of pixels.
#[derive(Debug, Clone, Copy)]
pub struct Area {
    pub x: f64,
    pub y: f64,
    pub width: f64,
    pub height: f64,
}

impl Area {
    pub fn right(&self) -> f64 {
        self.x + self.width
    }

    pub fn bottom(&self) -> f64 {
        self.y + self.height
    }
}

/// One entry of the legend.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    pub name: String,
    pub colour: Colour,
    pub dashed: bool,
    pub kind: Kind,
}

/// Title and legend, broken into lines; knows its height before it is drawn.
pub struct Head {
    title: Vec<String>,
    /// Entries with their left edge, row by row.
    rows: Vec<Vec<(f64, Entry)>>,
}

const SWATCH: f64 = 24.0;

impl Head {
    pub fn new(title: &str, entries: Vec<Entry>, sheet: f64) -> Self {
        let room = sheet - 2.0 * EDGE;
        let mut rows: Vec<Vec<(f64, Entry)>> = Vec::new();
        let mut x = EDGE;
        for entry in entries {
            let wide = SWATCH + width(&entry.name, SMALL) + 16.0;
            // an entry that is wider than the sheet has a row of its own; text is never cut
            if rows.is_empty() || x + wide > EDGE + room {
                rows.push(Vec::new());
                x = EDGE;
            }
            if let Some(row) = rows.last_mut() {
                row.push((x, entry));
            }
            x += wide;
        }
        // bold text is wider
        let title = wrap(title, LARGE * 1.08, room);
        Self { title, rows }
    }

    pub fn height(&self) -> f64 {
        let title = self.title.len() as f64 * LARGE * LEADING;
        EDGE + title + self.rows.len() as f64 * (LINE + 2.0) + 4.0
    }

    pub fn draw(&self, out: &mut Markup) {
        let mut y = EDGE;
        for line in &self.title {
            y += LARGE * LEADING;
            let attributes: [(&str, &dyn std::fmt::Display); 4] = [
                ("x", &Px(EDGE)),
                ("y", &Px(y - 6.0)),
                ("font-size", &LARGE),
                ("font-weight", &"bold"),
            ];
            out.text("text", &attributes, line);
        }
        for row in &self.rows {
            y += LINE + 2.0;
            for (x, entry) in row {
                swatch(out, *x, y - 8.0, entry);
                out.text("text", &[("x", &Px(x + SWATCH)), ("y", &Px(y - 4.0))], &entry.name);
            }
        }
    }
}

fn swatch(out: &mut Markup, x: f64, y: f64, entry: &Entry) {
    let colour = entry.colour;
    match entry.kind {
        Kind::Line | Kind::Step => {
            let dash = if entry.dashed { DASH } else { "none" };
            out.leaf(
                "path",
                &[
                    ("d", &format_args!("M{},{}h18", Px(x), Px(y))),
                    ("stroke", &colour),
                    ("stroke-width", &2),
                    ("stroke-dasharray", &dash),
                ],
            );
        }
        Kind::Points => dot(out, x + 9.0, y, 4.0, colour),
        Kind::Band => {
            // dashes mean nothing for a surface: here they say that its colour is full
            let opacity = if entry.dashed { 1.0 } else { BAND_OPACITY };
            rectangle(
                out,
                Area {
                    x,
                    y: y - 5.0,
                    width: 18.0,
                    height: 10.0,
                },
                colour,
                opacity,
            );
        }
    }
}

/// Dashes of a dashed line.
pub const DASH: &str = "6 4";
/// How much of a band covers what lies below.
pub const BAND_OPACITY: f64 = 0.22;

pub fn dot(out: &mut Markup, x: f64, y: f64, radius: f64, colour: Colour) {
    out.leaf(
        "circle",
        &[("cx", &Px(x)), ("cy", &Px(y)), ("r", &Px(radius)), ("fill", &colour)],
    );
}

pub fn rectangle(out: &mut Markup, area: Area, colour: Colour, opacity: f64) {
    let place: [(&str, &dyn std::fmt::Display); 6] = [
        ("x", &Px(area.x)),
        ("y", &Px(area.y)),
        ("width", &Px(area.width)),
        ("height", &Px(area.height)),
        ("fill", &colour),
        ("fill-opacity", &opacity),
    ];
    out.leaf("rect", if opacity == 1.0 { &place[..5] } else { &place });
}

/// Height of a drawing area on a sheet of some width: a small screen is low as well as narrow.
pub fn height_on(sheet: f64, height: f64) -> f64 {
    match sheet < WIDTH {
        // two ticks of the axis have room in 90 pixels
        true => (height * 0.65).max(height.min(90.0)),
        false => height,
    }
}

/// Opens the sheet: size, font, white background, so that the chart looks the same on a dark page. `alt` says in words and numbers
/// what there is to see.
pub fn sheet(alt: &str, wide: f64, high: f64) -> Markup {
    let mut out = Markup::default();
    out.open(
        "svg",
        &[
            ("xmlns", &"http://www.w3.org/2000/svg"),
            ("viewBox", &format_args!("0 0 {} {}", Px(wide), Px(high))),
            ("width", &Px(wide)),
            ("height", &Px(high)),
            ("role", &"img"),
            ("aria-label", &alt),
            // names only: no font is embedded or loaded
            ("font-family", &"system-ui, 'Segoe UI', Helvetica, Arial, sans-serif"),
            ("font-size", &SMALL),
            ("fill", &Colour::INK),
        ],
    );
    rectangle(
        &mut out,
        Area {
            x: 0.0,
            y: 0.0,
            width: wide,
            height: high,
        },
        Colour::PAPER,
        1.0,
    );
    out
}

/// Grid lines and tick labels of a panel, and its frame. `below` asks for labels under the panel.
pub fn grid(out: &mut Markup, area: Area, x: Option<(Scale, bool)>, y: Option<Scale>) {
    let (mut faint, mut strong) = (String::new(), String::new());
    let mut labels: Vec<(f64, f64, &str, String)> = Vec::new();
    if let Some((scale, labelled)) = x {
        for tick in &scale.settled.ticks {
            let at = scale.tick(tick);
            let line = format!("M{},{}V{}", Px(at), Px(area.y), Px(area.bottom()));
            if tick.label.is_some() { &mut strong } else { &mut faint }.push_str(&line);
        }
        if labelled {
            for (tick, label) in roomy(scale) {
                labels.push((scale.tick(tick), area.bottom() + 16.0, "middle", label.clone()));
            }
        }
    }
    if let Some(scale) = y {
        for tick in &scale.settled.ticks {
            let at = scale.tick(tick);
            let line = format!("M{},{}H{}", Px(area.x), Px(at), Px(area.right()));
            if tick.label.is_some() { &mut strong } else { &mut faint }.push_str(&line);
            if let Some(label) = &tick.label {
                labels.push((area.x - 6.0, at + 4.0, "end", label.clone()));
            }
        }
    }
    for (path, colour) in [(faint, Colour::FAINT), (strong, Colour::GRID)] {
        if !path.is_empty() {
            out.leaf("path", &[("d", &path), ("stroke", &colour), ("fill", &"none")]);
        }
    }
    out.open("g", &[("fill", &Colour::DIM)]);
    for (x, y, anchor, label) in labels {
        out.text(
            "text",
            &[("x", &Px(x)), ("y", &Px(y)), ("text-anchor", &anchor)],
            &label,
        );
    }
    out.close("g");
}

/// Labelled ticks whose labels do not run into each other.
fn roomy<'a>(scale: Scale<'a>) -> Vec<(&'a Tick, &'a String)> {
    let mut end = f64::NEG_INFINITY;
    let mut kept = Vec::new();
    for tick in &scale.settled.ticks {
        let Some(label) = &tick.label else { continue };
        let half = width(label, SMALL) / 2.0;
        let at = scale.tick(tick);
        // from the left, so that the first label always stands
        if at - half > end + 4.0 {
            end = at + half;
            kept.push((tick, label));
        }
    }
    kept
}

/// Frame over the data, so that clipped lines end at a clean edge.
pub fn border(out: &mut Markup, area: Area) {
    let d = format!(
        "M{},{}h{}v{}h-{}z",
        Px(area.x),
        Px(area.y),
        Px(area.width),
        Px(area.height),
        Px(area.width)
    );
    out.leaf("path", &[("d", &d), ("stroke", &Colour::GREY), ("fill", &"none")]);
}

/// Title of the horizontal axis, under its tick labels.
pub fn below(out: &mut Markup, area: Area, label: &str) {
    let (x, y) = (
        Px(area.x + area.width / 2.0),
        Px(area.bottom() + TICK_ROOM + LINE - 2.0),
    );
    out.text("text", &[("x", &x), ("y", &y), ("text-anchor", &"middle")], label);
}

/// Width of the widest tick label.
pub fn widest(axis: &Settled) -> f64 {
    let labels = axis.ticks.iter().filter_map(|tick| tick.label.as_deref());
    labels.map(|label| width(label, SMALL)).fold(0.0, f64::max)
}
