//! Just enough Rust lexing for the rules: literals and comments masked, items found by their braces.

/// Replaces comments, strings and character literals by spaces; line breaks stay where they are.
pub fn mask(source: &str) -> String {
    let bytes = source.as_bytes();
    let mut masked = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let end = literal_end(bytes, at);
        if end == at {
            masked.push(bytes[at]);
            at += 1;
            continue;
        }
        let blank = |byte: &u8| if *byte == b'\n' { b'\n' } else { b' ' };
        masked.extend(bytes[at..end].iter().map(blank));
        at = end;
    }
    String::from_utf8_lossy(&masked).into_owned()
}

/// Blanks every item under `#[cfg(test)]` in masked source.
pub fn without_tests(masked: &str) -> String {
    const ATTRIBUTE: &str = "#[cfg(test)]";
    let mut kept = String::with_capacity(masked.len());
    let mut rest = masked;
    while let Some(start) = rest.find(ATTRIBUTE) {
        let after = start + ATTRIBUTE.len();
        let end = after + item_end(&rest[after..]);
        kept.push_str(&rest[..start]);
        kept.extend(rest[start..end].chars().filter(|c| *c == '\n'));
        rest = &rest[end..];
    }
    kept + rest
}

/// A function with a body.
#[derive(Debug, PartialEq)]
pub struct Function {
    pub name: String,
    /// Line of the `fn`, from 1.
    pub line: usize,
    /// From the `fn` to the closing brace.
    pub lines: usize,
}

/// All functions of masked source, nested ones too.
pub fn functions(masked: &str) -> Vec<Function> {
    let mut found = Vec::new();
    for (at, _) in masked.match_indices("fn ") {
        if masked[..at].ends_with(is_word) {
            continue;
        }
        let rest = &masked[at..];
        let name: String = rest[3..].trim_start().chars().take_while(|c| is_word(*c)).collect();
        let item = &rest[..item_end(rest)];
        if name.is_empty() || !item.ends_with('}') {
            continue;
        }
        found.push(Function {
            name,
            line: masked[..at].matches('\n').count() + 1,
            lines: item.matches('\n').count() + 1,
        });
    }
    found
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Just after the `;` or the `}` that ends the item at the start of masked source.
fn item_end(masked: &str) -> usize {
    let mut nested = 0_usize;
    let mut braces = 0_usize;
    for (at, byte) in masked.bytes().enumerate() {
        match byte {
            b'(' | b'[' => nested += 1,
            b')' | b']' => nested = nested.saturating_sub(1),
            b'{' => braces += 1,
            b'}' if braces == 1 && nested == 0 => return at + 1,
            b'}' if braces == 0 => return at,
            b'}' => braces -= 1,
            b';' if braces == 0 && nested == 0 => return at + 1,
            _ => {}
        }
    }
    masked.len()
}

/// End of the comment or literal that starts at `at`; `at` itself when none does.
fn literal_end(bytes: &[u8], at: usize) -> usize {
    let rest = &bytes[at..];
    let length = match rest[0] {
        b'/' if rest.starts_with(b"//") => rest.iter().position(|b| *b == b'\n'),
        b'/' if rest.starts_with(b"/*") => Some(block_comment(rest)),
        b'"' => Some(string(rest)),
        b'\'' => Some(character(rest)),
        b'r' if at == 0 || !is_raw_prefix(&bytes[..at]) => Some(raw_string(rest)),
        _ => Some(0),
    };
    at + length.unwrap_or(rest.len()).min(rest.len())
}

/// Whether the `r` after `before` belongs to a longer word; `br` and `cr` start raw strings as well.
fn is_raw_prefix(before: &[u8]) -> bool {
    let word = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
    match before {
        [.., first, b'b' | b'c'] => word(first),
        [b'b' | b'c'] => false,
        [.., last] => word(last),
        [] => false,
    }
}

fn block_comment(rest: &[u8]) -> usize {
    let (mut depth, mut at) = (0_usize, 0);
    while at < rest.len() {
        match &rest[at..] {
            [b'/', b'*', ..] => (depth, at) = (depth + 1, at + 2),
            [b'*', b'/', ..] => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
        if depth == 0 {
            break;
        }
    }
    at
}

fn string(rest: &[u8]) -> usize {
    let mut at = 1;
    while at < rest.len() && rest[at] != b'"' {
        at += if rest[at] == b'\\' { 2 } else { 1 };
    }
    at + 1
}

fn raw_string(rest: &[u8]) -> usize {
    let hashes = rest[1..].iter().take_while(|b| **b == b'#').count();
    let open = 1 + hashes;
    if rest.get(open) != Some(&b'"') {
        return 0;
    }
    let close = [b"\"", &rest[1..open]].concat();
    let body = &rest[open + 1..];
    let found = body.windows(close.len()).position(|w| w == close);
    found.map_or(rest.len(), |end| open + 1 + end + close.len())
}

/// A character literal; 0 for a lifetime.
fn character(rest: &[u8]) -> usize {
    let quote = |from: usize| rest.iter().skip(from).position(|b| *b == b'\'');
    match rest.get(1) {
        Some(b'\\') => quote(3).map_or(0, |found| found + 4),
        Some(first) => {
            let width = match first {
                0..0x80 => 1,
                0x80..0xE0 => 2,
                0xE0..0xF0 => 3,
                _ => 4,
            };
            match rest.get(1 + width) {
                Some(b'\'') => width + 2,
                _ => 0,
            }
        }
        None => 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn literals_and_comments_are_masked() {
        let cases = [
            ("a /* { /* } */ { */ b", "a b"),
            ("a // {\nb", "a \nb"),
            (r#"a "{ \" {" b"#, "a b"),
            ("a r#\"{ \" {\"# b", "a b"),
            ("a br\"\\\" b", "a b b"),
            (r"a '{' '\'' '\u{7b}' 'ß' b", "a b"),
            ("<'a, 'b> fn", "<'a, 'b> fn"),
            ("r#type car\"{\"", "r#type car"),
            ("\"open {", ""),
        ];
        for (source, expected) in cases {
            let masked = mask(source);
            assert_eq!(masked.len(), source.len(), "{source}");
            let words = |text: &str| text.split(' ').filter(|w| !w.is_empty()).collect::<String>();
            assert_eq!(words(&masked), words(expected), "{source}");
        }
    }

    #[test]
    fn functions_are_measured_to_their_closing_brace() {
        let source = "\
struct S(fn (u8) -> u8);
trait T {
    fn declared(&self, a: [u8; 3]);
}
pub fn outer(a: [u8; 2]) -> bool
where
    u8: Copy,
{
    fn inner() {}
    let s = \"} fn no() {\"; // }
    a[0] == b'}'
}
";
        let function = |name: &str, line, lines| Function {
            name: name.into(),
            line,
            lines,
        };
        let expected = [function("outer", 5, 8), function("inner", 9, 1)];
        assert_eq!(functions(&mask(source)), expected);
    }

    #[test]
    fn test_items_are_blanked_and_lines_stay() {
        let source = "\
fn a() {}
#[cfg(test)]
#[allow(dead_code)]
mod tests {
    fn b() {}
}
#[cfg(test)]
mod more;
fn c() {}
";
        let kept = without_tests(&mask(source));
        let names: Vec<_> = functions(&kept).into_iter().map(|f| (f.name, f.line)).collect();
        assert_eq!(names, [("a".to_string(), 1), ("c".to_string(), 9)]);
    }
}
