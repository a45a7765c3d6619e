//! The data of a chart for the script of a page, and that script.
//!
//! ```text
//! Chart ──► <svg>                            drawn, for print and where no script runs
//!      └──► JSON: series in 16 bits a value ──► live.js + uPlot: values under the pointer, zoom, toggles
//! ```
//!
//! uPlot is [`UPLOT`], of its own licence (MIT), inlined because a page loads nothing. The page's policy names the digest of the
//! script, so that no other runs in it, whatever a text on the page holds.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::axis::Settled;
use crate::colour::Colour;
use crate::number::shifted;
use crate::series::{Kind, Mark, Series};

const UPLOT: &str = include_str!("uplot.js");
const SCRIPT: &str = include_str!("live.js");
/// Style of what the script makes.
pub const STYLE: &str = include_str!("uplot.css");

/// Values of a series that a page holds at most: beyond it extremes of stretches stay.
// two for each pixel of a wide screen; six load steps of five controllers in three panels stay below 400 kB
const MOST_VALUES: usize = 2000;
/// No value.
const GAP: u16 = u16::MAX;
/// Steps between both ends of a series.
const STEPS: f64 = 65_534.0;

/// A panel as it was drawn.
pub struct Drawn<'a> {
    pub y: &'a Settled,
    /// Pixels.
    pub height: f64,
    /// With colour, and whether it is dashed.
    pub series: Vec<(&'a Series, (Colour, bool))>,
    pub marks: &'a [Mark],
}

#[derive(Serialize)]
struct Data<'a> {
    title: &'a str,
    x: Axis<'a>,
    xs: Vec<Codes>,
    panels: Vec<Panel<'a>>,
}

/// In the unit that is shown.
#[derive(Serialize)]
struct Axis<'a> {
    label: &'a str,
    low: f64,
    high: f64,
}

#[derive(Serialize)]
struct Panel<'a> {
    #[serde(flatten)]
    axis: Axis<'a>,
    fixed: bool,
    height: f64,
    series: Vec<Trace<'a>>,
    marks: Vec<Line<'a>>,
}

#[derive(Serialize)]
struct Trace<'a> {
    name: &'a str,
    colour: String,
    kind: &'static str,
    dashed: bool,
    /// Index into `xs`.
    x: usize,
    y: Codes,
    /// Upper edge of a band.
    #[serde(skip_serializing_if = "Option::is_none")]
    top: Option<Codes>,
}

#[derive(Serialize)]
struct Line<'a> {
    on_x: bool,
    from: f64,
    to: f64,
    label: &'a str,
}

/// Numbers in 16 bits, low byte first, in even steps from one end to the other.
#[derive(Serialize, PartialEq)]
struct Codes {
    from: f64,
    to: f64,
    codes: String,
}

impl Codes {
    fn new(values: &[f64]) -> Self {
        let finite = || values.iter().copied().filter(|value| value.is_finite());
        let (from, to) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        let (from, to) = if from <= to { (from, to) } else { (0.0, 0.0) };
        let code = |value: &f64| match value.is_finite() {
            false => GAP,
            true if to > from => ((value - from) / (to - from) * STEPS).round() as u16,
            true => 0,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| code(value).to_le_bytes()).collect();
        Self {
            from,
            to,
            codes: STANDARD.encode(bytes),
        }
    }
}

/// The data of a chart as JSON that may stand in a page; nothing where an axis is logarithmic or a series goes back along x, which the
/// script does not draw.
pub fn data(title: &str, x: &Settled, panels: &[Drawn<'_>]) -> Option<String> {
    let exponent = x.shown_exponent()?;
    let mut xs: Vec<Codes> = Vec::new();
    let mut shown = Vec::new();
    for panel in panels {
        let up = panel.y.shown_exponent()?;
        let mut series = Vec::new();
        for (one, (colour, dashed)) in &panel.series {
            if !one.x.windows(2).all(|pair| pair[0] <= pair[1]) {
                return None;
            }
            let rows = kept(one);
            let take = |values: &[f64], exponent: i32| -> Vec<f64> {
                let value = |row: &usize| values.get(*row).map_or(f64::NAN, |value| shifted(*value, -exponent));
                rows.iter().map(value).collect()
            };
            let along = Codes::new(&take(&one.x, exponent));
            let index = xs.iter().position(|other| *other == along).unwrap_or(xs.len());
            if index == xs.len() {
                xs.push(along);
            }
            series.push(Trace {
                name: &one.name,
                colour: colour.to_string(),
                kind: match one.kind {
                    Kind::Line => "line",
                    Kind::Step => "step",
                    Kind::Points => "points",
                    Kind::Band => "band",
                },
                dashed: *dashed,
                x: index,
                y: Codes::new(&take(&one.y, up)),
                top: (one.kind == Kind::Band).then(|| Codes::new(&take(&one.high, up))),
            });
        }
        let line = |mark: &'_ Mark| {
            let exponent = if mark.on_x { exponent } else { up };
            [mark.from, mark.to].map(|end| shifted(end, -exponent))
        };
        let marks = panel.marks.iter().map(|mark| {
            let [from, to] = line(mark);
            Line {
                on_x: mark.on_x,
                from,
                to,
                label: &mark.label,
            }
        });
        shown.push(Panel {
            axis: axis(panel.y, up),
            fixed: panel.y.is_fixed(),
            height: panel.height,
            series,
            marks: marks.collect(),
        });
    }
    let data = Data {
        title,
        x: axis(x, exponent),
        xs,
        panels: shown,
    };
    let json = serde_json::to_string(&data).ok()?;
    // no text in it may end the element that holds it
    Some(
        json.replace('&', "\\u0026")
            .replace('<', "\\u003c")
            .replace('>', "\\u003e"),
    )
}

fn axis(settled: &Settled, exponent: i32) -> Axis<'_> {
    Axis {
        label: &settled.label,
        low: shifted(settled.low, -exponent),
        high: shifted(settled.high, -exponent),
    }
}

/// Rows of a series that are shown: all, or of each stretch the first, the lowest, the highest and the last.
fn kept(series: &Series) -> Vec<usize> {
    let count = series.x.len();
    if count <= MOST_VALUES {
        return (0..count).collect();
    }
    let value = |row: usize| series.y.get(row).copied().unwrap_or(f64::NAN);
    let length = count.div_ceil(MOST_VALUES / 4);
    let mut rows = Vec::with_capacity(MOST_VALUES);
    for start in (0..count).step_by(length) {
        let stretch = start..(start + length).min(count);
        let finite = || stretch.clone().filter(|row| value(*row).is_finite());
        let low = finite().min_by(|a, b| value(*a).total_cmp(&value(*b)));
        let high = finite().max_by(|a, b| value(*a).total_cmp(&value(*b)));
        let gap = stretch.clone().find(|row| !value(*row).is_finite());
        let mut found: Vec<usize> = [Some(stretch.start), low, high, gap, stretch.end.checked_sub(1)]
            .into_iter()
            .flatten()
            .collect();
        found.sort_unstable();
        found.dedup();
        rows.extend(found);
    }
    rows
}

/// The script of a page, in a form that XML reads as well.
pub fn script() -> String {
    format!("//<![CDATA[\n{UPLOT}\n{SCRIPT}//]]>\n")
}

/// What a page may do: nothing but its own style, and this script if it has it.
pub fn content_policy(script: Option<&str>) -> String {
    let run = script.map_or("'none'".to_owned(), |script| {
        format!("'sha256-{}'", STANDARD.encode(Sha256::digest(script)))
    });
    format!("default-src 'none'; style-src 'unsafe-inline'; script-src {run}; base-uri 'none'; form-action 'none'")
}
