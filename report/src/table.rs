//! Tables with numbers that line up.

use crate::error::ReportError;
use crate::markup::Markup;
use crate::number::fixed;

/// A table. Text columns stand left, number columns right with a fixed number of decimals, so the points line up.
#[derive(Debug, Clone)]
pub struct Table {
    caption: String,
    columns: Vec<(String, Option<usize>)>,
    rows: Vec<Vec<Cell>>,
}

/// Content of a cell.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// As it is; in a number column it stands right as well.
    Text(String),
    /// Formatted by the column; in a text column with six decimals.
    Number(f64),
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl Table {
    /// Table without columns; the caption stands above and may be empty.
    pub fn new(caption: impl Into<String>) -> Self {
        Self {
            caption: caption.into(),
            columns: Vec::new(),
            rows: Vec::new(),
        }
    }

    /// Adds a text column.
    #[must_use]
    pub fn text(mut self, heading: impl Into<String>) -> Self {
        self.columns.push((heading.into(), None));
        self
    }

    /// Adds a number column; the heading names the unit.
    #[must_use]
    pub fn number(mut self, heading: impl Into<String>, decimals: usize) -> Self {
        // a binary64 has no more digits
        self.columns.push((heading.into(), Some(decimals.min(17))));
        self
    }

    /// Adds a row, one cell for each column.
    #[must_use]
    pub fn row(mut self, cells: impl IntoIterator<Item = Cell>) -> Self {
        self.rows.push(cells.into_iter().collect());
        self
    }

    pub(crate) fn write(&self, out: &mut Markup) -> Result<(), ReportError> {
        let expected = self.columns.len();
        if let Some(row) = self.rows.iter().find(|row| row.len() != expected) {
            let (what, found) = (self.caption.clone(), row.len());
            return Err(ReportError::Lengths { what, expected, found });
        }
        // on a small screen a row of many cells stands as a list of headings and values
        let is_wide = expected > NARROW;
        let class = if is_wide { "table many" } else { "table" };
        out.open("div", &[("class", &class), ("tabindex", &0)]);
        out.open("table", &[]);
        if !self.caption.is_empty() {
            out.text("caption", &[], &self.caption);
        }
        out.open("thead", &[]);
        out.open("tr", &[]);
        for (heading, decimals) in &self.columns {
            cell(out, "th", decimals.is_some(), None, heading);
        }
        out.close("tr");
        out.close("thead");
        out.open("tbody", &[]);
        for row in &self.rows {
            out.open("tr", &[]);
            for (content, (heading, decimals)) in row.iter().zip(&self.columns) {
                let text = match content {
                    // an empty cell looks forgotten
                    Cell::Text(text) if text.is_empty() => "–".to_owned(),
                    Cell::Text(text) => text.clone(),
                    Cell::Number(value) if value.is_nan() => "–".to_owned(),
                    // `fixed` for its true minus sign
                    Cell::Number(value) if value.is_infinite() => fixed(*value, 0).replace("inf", "∞"),
                    Cell::Number(value) => fixed(*value, decimals.unwrap_or(6)),
                };
                cell(
                    out,
                    "td",
                    decimals.is_some(),
                    is_wide.then_some(heading.as_str()),
                    &text,
                );
            }
            out.close("tr");
        }
        for name in ["tbody", "table", "div"] {
            out.close(name);
        }
        Ok(())
    }
}

/// Columns that stand beside each other on any screen.
const NARROW: usize = 3;

fn cell(out: &mut Markup, name: &str, number: bool, heading: Option<&str>, text: &str) {
    let mut attributes: Vec<(&str, &dyn std::fmt::Display)> = Vec::new();
    if number {
        attributes.push(("class", &"n"));
    }
    if let Some(heading) = &heading {
        attributes.push(("data-of", heading));
    }
    out.text(name, &attributes, text);
}
