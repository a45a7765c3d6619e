//! How wide text is, without a font: the picture is drawn with whatever sans-serif the reader has.

/// Size of tick labels, legend and axis titles, pixels.
pub const SMALL: f64 = 12.0;
/// Size of the title of a chart, pixels.
pub const LARGE: f64 = 15.0;
/// Line pitch in multiples of the size.
pub const LEADING: f64 = 1.35;

/// Upper estimate in pixels: the widths of DejaVu Sans, the widest of the common sans-serif fonts.
pub fn width(text: &str, size: f64) -> f64 {
    let em: f64 = text.chars().map(advance).sum();
    em * size
}

fn advance(c: char) -> f64 {
    match c {
        'i' | 'j' | 'l' | '\'' | '|' => 0.28,
        ' ' | '.' | ',' | ':' | ';' | '!' | '-' | '/' | '(' | ')' | '[' | ']' | 'f' | 't' | 'r' => 0.38,
        'm' | 'w' | 'M' | 'W' | '%' | '@' | '−' | '+' | '=' | '<' | '>' | '×' | '±' => 0.9,
        'A'..='Z' => 0.72,
        '⁰'..='⁹' | '⁻' | '¹' | '²' | '³' => 0.42,
        c if c.is_ascii() => 0.63,
        // from here on the scripts of East Asia, which are as wide as high
        c if u32::from(c) < 0x2e80 => 0.7,
        _ => 1.0,
    }
}

/// Breaks at spaces so that a line stays within `room` pixels; a longer word has a line of its own.
pub fn wrap(text: &str, size: f64, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            // .38 is the width of a blank
            Some(line) if width(line, size) + width(word, size) + size * 0.38 <= room => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}
