//! Writes XML and HTML so that text cannot end up as markup.

use std::fmt::{self, Display, Write};

/// Attributes in the order they are written.
pub type Attributes<'a> = &'a [(&'a str, &'a dyn Display)];

/// Growing document. Every text and attribute value passes through [`escape`].
#[derive(Debug, Default)]
pub struct Markup {
    out: String,
}

impl Markup {
    /// Start tag; the caller closes it.
    pub fn open(&mut self, name: &str, attributes: Attributes) {
        self.tag(name, attributes);
        self.out.push_str(">\n");
    }

    /// End tag on a line of its own.
    pub fn close(&mut self, name: &str) {
        self.out.push_str("</");
        self.out.push_str(name);
        self.out.push_str(">\n");
    }

    /// Element without content.
    pub fn leaf(&mut self, name: &str, attributes: Attributes) {
        self.tag(name, attributes);
        self.out.push_str("/>\n");
    }

    /// Element that holds one text.
    pub fn text(&mut self, name: &str, attributes: Attributes, text: &str) {
        self.tag(name, attributes);
        self.out.push('>');
        escape(&mut self.out, text);
        self.close(name);
    }

    /// Text that is markup already, from this crate alone.
    pub fn raw(&mut self, markup: &str) {
        self.out.push_str(markup);
    }

    /// The document.
    pub fn finish(self) -> String {
        self.out
    }

    fn tag(&mut self, name: &str, attributes: Attributes) {
        self.out.push('<');
        self.out.push_str(name);
        for (key, value) in attributes {
            self.out.push(' ');
            self.out.push_str(key);
            self.out.push_str("=\"");
            // writing to a `String` cannot fail
            let _ = write!(Escaped(&mut self.out), "{value}");
            self.out.push('"');
        }
    }
}

struct Escaped<'a>(&'a mut String);

impl Write for Escaped<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        escape(self.0, text);
        Ok(())
    }
}

/// Appends `text` with the five special characters as entities. Control characters have no place in XML 1.0 and become
/// U+FFFD.
fn escape(out: &mut String, text: &str) {
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // `&apos;` is XML, but HTML 4 does not know it
            '\'' => out.push_str("&#39;"),
            '\n' | '\t' => out.push(c),
            // no characters of XML 1.0 either
            '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            c if c.is_control() => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
}

/// A length or place in the picture, in pixels: at most one decimal, so small and the same everywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Px(pub f64);

impl Px {
    /// In tenths of a pixel. Far outside the picture (a range narrower than the data) one place is as good as another.
    pub fn tenths(self) -> i64 {
        (self.0 * 10.0).round().clamp(-1e7, 1e7) as i64
    }
}

impl Display for Px {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tenths = self.tenths();
        let sign = if tenths < 0 { "-" } else { "" };
        let (whole, part) = (tenths.unsigned_abs() / 10, tenths.unsigned_abs() % 10);
        match (whole, part) {
            (whole, 0) => write!(f, "{sign}{whole}"),
            (0, part) => write!(f, "{sign}.{part}"),
            (whole, part) => write!(f, "{sign}{whole}.{part}"),
        }
    }
}
