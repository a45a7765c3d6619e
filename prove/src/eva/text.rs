//! Lines of C, with indentation.

use std::collections::BTreeMap;
use std::fmt::Write;

/// The label of each check, by the line that it stands in.
pub(super) type Labels = BTreeMap<usize, String>;

/// Label of the check that must fail: what stands behind all others was analysed.
pub(super) const REACHED: &str = "reached";

/// A text that grows line by line.
#[derive(Debug, Default)]
pub(super) struct Text {
    text: String,
    depth: usize,
    line: usize,
    labels: Labels,
}

impl Text {
    pub fn line(&mut self, line: impl AsRef<str>) {
        let line = line.as_ref();
        if line.starts_with('}') {
            self.depth = self.depth.saturating_sub(1);
        }
        let depth = match line.starts_with('#') {
            true => 0,
            false => 4 * self.depth,
        };
        // writing to a string does not fail
        let _ = writeln!(self.text, "{:depth$}{line}", "");
        self.line += 1;
        if line.ends_with('{') {
            self.depth += 1;
        }
    }

    pub fn lines<S: AsRef<str>>(&mut self, lines: impl IntoIterator<Item = S>) {
        for line in lines {
            self.line(line);
        }
    }

    /// A property that must hold here. The condition is C's: in ACSL a comparison of floats is one of real numbers.
    pub fn check(&mut self, label: &str, condition: &str) {
        self.line("{");
        self.line(format!("const int holds = ({condition}) ? 1 : 0;"));
        self.labelled(label, "holds == 1");
        self.line("}");
    }

    /// A check that fails, at the end of an entry.
    pub fn reached(&mut self) {
        self.labelled(REACHED, "\\false");
    }

    fn labelled(&mut self, label: &str, property: &str) {
        self.line(format!("//@ check {label}: {property};"));
        self.labels.insert(self.line, label.to_owned());
    }

    pub fn end(self) -> (String, Labels) {
        (self.text, self.labels)
    }
}
