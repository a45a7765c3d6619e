//! What can be drawn in a panel.

use crate::colour::Colour;
use crate::error::ReportError;

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Line,
    Step,
    Points,
    Band,
}

/// Data against x. Each series brings its own x, in whatever order. Values that are NaN, infinite, beyond 1e150, or not
/// positive on a logarithmic axis leave a gap. The name stands in the legend; series of one name share a colour across
/// the panels of a chart, and an empty name stays out of the legend.
#[derive(Debug, Clone)]
pub struct Series {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) x: Vec<f64>,
    pub(crate) y: Vec<f64>,
    /// Upper edge of a band; empty otherwise.
    pub(crate) high: Vec<f64>,
    pub(crate) colour: Option<Colour>,
    pub(crate) dashed: bool,
}

impl Series {
    /// Points joined by straight lines.
    pub fn line(name: impl Into<String>, x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        Self::of(Kind::Line, name.into(), x.into(), y.into())
    }

    /// Each value holds until the x of the next one, as a duty ratio does.
    pub fn step(name: impl Into<String>, x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        Self::of(Kind::Step, name.into(), x.into(), y.into())
    }

    /// Markers only.
    pub fn points(name: impl Into<String>, x: impl Into<Vec<f64>>, y: impl Into<Vec<f64>>) -> Self {
        Self::of(Kind::Points, name.into(), x.into(), y.into())
    }

    /// Shaded area between `low` and `high`: an interval, a tolerance that changes over x.
    pub fn band(
        name: impl Into<String>,
        x: impl Into<Vec<f64>>,
        low: impl Into<Vec<f64>>,
        high: impl Into<Vec<f64>>,
    ) -> Self {
        Self {
            high: high.into(),
            ..Self::of(Kind::Band, name.into(), x.into(), low.into())
        }
    }

    /// Own colour instead of the next one of the palette.
    #[must_use]
    pub fn colour(mut self, colour: Colour) -> Self {
        self.colour = Some(colour);
        self
    }

    /// Dashed line.
    #[must_use]
    pub fn dashed(mut self) -> Self {
        self.dashed = true;
        self
    }

    fn of(kind: Kind, name: String, x: Vec<f64>, y: Vec<f64>) -> Self {
        Self {
            name,
            kind,
            x,
            y,
            high: Vec::new(),
            colour: None,
            dashed: false,
        }
    }

    /// Equal lengths, and at least one value.
    pub(crate) fn check(&self) -> Result<(), ReportError> {
        let expected = self.x.len();
        let found = match self.kind {
            // the lower edge is looked at first, so that the number in the fault is that of the wrong list
            Kind::Band if self.y.len() == expected => self.high.len(),
            _ => self.y.len(),
        };
        let what = self.name.clone();
        if found != expected {
            return Err(ReportError::Lengths { what, expected, found });
        }
        let finite = self.x.iter().zip(&self.y).any(|(x, y)| x.is_finite() && y.is_finite());
        if finite {
            Ok(())
        } else {
            Err(ReportError::Empty { what })
        }
    }
}

/// A marked value or interval on one of the axes.
#[derive(Debug, Clone)]
pub(crate) struct Mark {
    pub on_x: bool,
    pub from: f64,
    /// Same as `from` for a line.
    pub to: f64,
    pub label: String,
}
