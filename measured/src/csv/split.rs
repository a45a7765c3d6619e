//! A line cut into cells.
//!
//! Own code of forty lines and not the `csv` crate (1.4 was tried): that one knows the place of a record, not of a cell,
//! takes a quotation mark that is not closed for a cell that holds all lines to the end of the file, and has no columns
//! that are parted by blanks. No number holds a line end, so cells end with their line here.

use toml_input::Span;

/// What stands between two cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separator {
    /// One sign.
    Mark(char),
    /// Any number of blanks.
    Blanks,
}

impl Separator {
    /// The separator of a header: `;` before tab before comma, since a comma may also be a decimal one.
    pub fn of_header(header: &str) -> Self {
        let mut quoted = false;
        let outside: String = header
            .chars()
            .filter(|c| {
                // a name in quotes may hold any separator: "i_l, filtered"
                quoted ^= *c == '"';
                !quoted
            })
            .collect();
        match [';', '\t', ','].into_iter().find(|mark| outside.contains(*mark)) {
            Some(mark) => Separator::Mark(mark),
            // `v_out [mV]` alone is one column
            None if outside.split_whitespace().count() > 1 && !outside.contains(['[', '(']) => Separator::Blanks,
            None => Separator::Mark(','),
        }
    }

    /// The separator that a first line `sep=;` names.
    pub fn of_mark(mark: &str) -> Option<Self> {
        let mut marks = mark.chars();
        match (marks.next(), marks.next()) {
            (Some(mark @ (',' | ';' | '\t' | '|')), None) => Some(Separator::Mark(mark)),
            // `sep=` and a tab, which was trimmed off with the blanks
            (None, _) => Some(Separator::Mark('\t')),
            _ => None,
        }
    }
}

/// The cells of a line that begins at byte `start` of its text, without blanks and quotes around them.
///
/// A cell in quotes may hold separators; doubled quotes in it stay doubled.
///
/// # Errors
/// A cell whose quote is not closed.
pub(crate) fn cells(line: &str, start: usize, separator: Separator) -> Result<Vec<Span>, Span> {
    let Separator::Mark(mark) = separator else {
        return Ok(parted_by_blanks(line, start));
    };
    let mut cells = Vec::new();
    let mut rest = 0;
    loop {
        let begin = rest + line[rest..].len() - line[rest..].trim_start_matches(' ').len();
        let end = match line[begin..].strip_prefix('"') {
            // a separator counts behind the closing quote only
            Some(inner) => {
                let close = closing_quote(inner).ok_or(start + begin..start + line.len())?;
                begin + 1 + close + 1
            }
            None => begin,
        };
        let end = line[end..].find(mark).map_or(line.len(), |at| end + at);
        cells.push(trimmed(line, begin.min(end)..end, start));
        if end == line.len() {
            return Ok(cells);
        }
        rest = end + mark.len_utf8();
    }
}

/// Where the quote ends that `text` begins in.
fn closing_quote(text: &str) -> Option<usize> {
    let mut from = 0;
    loop {
        let at = from + text[from..].find('"')?;
        // a doubled quote stands for one within the cell
        if !text[at + 1..].starts_with('"') {
            return Some(at);
        }
        from = at + 2;
    }
}

fn parted_by_blanks(line: &str, start: usize) -> Vec<Span> {
    let cell = |word: &str| {
        // a word is a part of its line: the distance of the pointers is its place
        let at = word.as_ptr() as usize - line.as_ptr() as usize;
        trimmed(line, at..at + word.len(), start)
    };
    line.split_whitespace().map(cell).collect()
}

fn trimmed(line: &str, cell: Span, start: usize) -> Span {
    let outer = line[cell.clone()].trim();
    let inner = outer
        .strip_prefix('"')
        .and_then(|inner| inner.strip_suffix('"'))
        .unwrap_or(outer)
        .trim();
    let at = start + inner.as_ptr() as usize - line.as_ptr() as usize;
    at..at + inner.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(line: &str, separator: char) -> Vec<&str> {
        let cells = cells(line, 0, Separator::Mark(separator)).unwrap();
        cells.into_iter().map(|cell| &line[cell]).collect()
    }

    #[test]
    fn quotes_hold_separators_and_blanks_do_not_count() {
        assert_eq!(cut("a, b ,c", ','), ["a", "b", "c"]);
        assert_eq!(cut("\"1,5\", \"x \"\"y\"\"\" ,", ','), ["1,5", "x \"\"y\"\"", ""]);
        assert_eq!(cut("\"1\"x,2", ','), ["\"1\"x", "2"]);
        assert_eq!(cut("", ','), [""]);
        assert_eq!(cut(" \u{b5};", ';'), ["\u{b5}", ""]);
        assert_eq!(cells("1,\"2,3", 10, Separator::Mark(',')), Err(12..16));
        assert_eq!(cells(" 1  \"v\"", 10, Separator::Blanks), Ok(vec![11..12, 15..16]));
    }

    #[test]
    fn the_separator_is_read_off_the_header() {
        for (header, expected) in [
            ("t,v", Separator::Mark(',')),
            ("t;\"a,b\"", Separator::Mark(';')),
            ("\"a;b\",c", Separator::Mark(',')),
            ("t, s\tv, V", Separator::Mark('\t')),
            ("t v  i", Separator::Blanks),
            ("v_out", Separator::Mark(',')),
            ("v_out [mV]", Separator::Mark(',')),
        ] {
            assert_eq!(Separator::of_header(header), expected, "{header}");
        }
    }
}
