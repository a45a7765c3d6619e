//! C text to tokens: comments dropped, conditions and object-like macros of the preprocessor applied.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::machine::Wrong;
use crate::refusal::Refusal;

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Kind {
    Name(String),
    /// Digits as written, with their suffix.
    Number(String),
    /// What stands between the quotes.
    Text(String),
    Symbol(&'static str),
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Token {
    pub kind: Kind,
    /// From 1.
    pub line: usize,
}

/// Longest first.
const SYMBOLS: [&str; 38] = [
    "<<=", ">>=", "...", "->", "++", "--", "<<", ">>", "<=", ">=", "==", "!=", "&&", "||", "+=", "-=", "*=", "&=",
    "|=", "^=", "/=", "(", ")", "[", "]", "{", "}", ";", ",", "=", "+", "-", "*", "/", "&", "|", "^", "~",
];
const MORE: [&str; 9] = ["<", ">", "!", "?", ":", ".", "%", "#", "\\"];

/// Object-like macros: name to what stands for it.
pub(crate) type Macros = BTreeMap<String, Vec<Token>>;

/// Tokens of a file in which `macros` are defined; definitions of the file are added to them.
pub(crate) fn tokens(file: &str, text: &str, macros: &mut Macros) -> Result<Vec<Token>, Refusal> {
    let text = without_comments(text);
    let mut out = Vec::new();
    // per open condition: whether its lines count, and whether one of its branches has been taken
    let mut open: Vec<(bool, bool)> = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((index, first)) = lines.next() {
        let (line, mut whole) = (index + 1, Cow::Borrowed(first));
        while whole.ends_with('\\') {
            let whole = whole.to_mut();
            whole.pop();
            whole.push_str(lines.next().map_or("", |(_, next)| next));
        }
        let refused = |message: Wrong| Refusal::at(file, line, message);
        let active = open.iter().all(|(counts, _)| *counts);
        match whole.trim_start().strip_prefix('#') {
            Some(directive) => apply(directive.trim_start(), line, active, &mut open, macros).map_err(refused)?,
            None if active => {
                let mut found = split(&whole, line).map_err(refused)?;
                if found.iter().any(|token| stands_for_others(token, macros)) {
                    expand(&mut found, macros, 0);
                }
                out.append(&mut found);
            }
            None => {}
        }
    }
    match open.is_empty() {
        true => Ok(out),
        false => Err(Refusal::at(
            file,
            text.lines().count(),
            "a condition that does not end".into(),
        )),
    }
}

fn apply(
    directive: &str,
    line: usize,
    active: bool,
    open: &mut Vec<(bool, bool)>,
    macros: &mut Macros,
) -> Result<(), Wrong> {
    let end = directive
        .find(|c: char| !c.is_ascii_alphanumeric())
        .unwrap_or(directive.len());
    let (name, rest) = directive.split_at(end);
    let holds = |text: &str, macros: &Macros| -> Result<bool, Wrong> {
        let mut found = split(text, line)?;
        super::condition::holds(&mut found, macros)
    };
    let lone = |text: &str| text.trim().to_owned();
    match name {
        "if" | "ifdef" | "ifndef" => {
            let taken = active
                && match name {
                    "ifdef" => macros.contains_key(&lone(rest)),
                    "ifndef" => !macros.contains_key(&lone(rest)),
                    _ => holds(rest, macros)?,
                };
            // inside of what does not count no branch is ever taken
            open.push((taken, taken || !active));
        }
        "elif" => {
            let (_, taken) = open.pop().ok_or("an #elif without its #if")?;
            let now = !taken && holds(rest, macros)?;
            open.push((now, taken || now));
        }
        "else" => {
            let (_, taken) = open.pop().ok_or("an #else without its #if")?;
            open.push((!taken, true));
        }
        "endif" => {
            open.pop().ok_or("an #endif without its #if")?;
        }
        _ if !active => {}
        "define" => {
            let rest = rest.trim_start();
            let end = rest
                .find(|c: char| !c.is_ascii_alphanumeric() && c != '_')
                .unwrap_or(rest.len());
            let (name, body) = rest.split_at(end);
            if body.starts_with('(') {
                return Err(format!("the macro `{name}` with arguments"));
            }
            macros.insert(name.to_owned(), split(body, line)?);
        }
        "undef" => {
            macros.remove(&lone(rest));
        }
        // the header is read before the source, and types of fixed width are known
        "include" | "pragma" => {}
        "error" => return Err(format!("#error{rest}")),
        other => return Err(format!("the directive #{other}")),
    }
    Ok(())
}

fn stands_for_others(token: &Token, macros: &Macros) -> bool {
    matches!(&token.kind, Kind::Name(name) if macros.contains_key(name))
}

/// Puts the bodies of macros in the place of their names.
pub(crate) fn expand(tokens: &mut Vec<Token>, macros: &Macros, depth: usize) {
    // a macro that names itself stays as it is at the latest here
    if depth > 8 {
        return;
    }
    let mut out = Vec::with_capacity(tokens.len());
    for token in tokens.drain(..) {
        match &token.kind {
            Kind::Name(name) if macros.contains_key(name) => {
                let mut body = macros[name].clone();
                body.iter_mut().for_each(|t| t.line = token.line);
                expand(&mut body, macros, depth + 1);
                out.append(&mut body);
            }
            _ => out.push(token),
        }
    }
    *tokens = out;
}

/// Comments become a space; line ends stay, so that lines keep their numbers.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(start) = rest.find("/*") {
        let (before, comment) = rest.split_at(start);
        out.push_str(before);
        let end = comment.find("*/").map_or(comment.len(), |end| end + 2);
        let (comment, after) = comment.split_at(end);
        out.push(' ');
        out.extend(comment.chars().filter(|c| *c == '\n'));
        rest = after;
    }
    out.push_str(rest);
    out
}

/// Tokens of a line.
// by bytes: every file is read twice, once for each reader, and all that the C of a controller holds is ASCII
pub(crate) fn split(text: &str, line: usize) -> Result<Vec<Token>, Wrong> {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(text.len() / 4);
    let mut at = 0;
    while let Some(&first) = bytes.get(at) {
        let (kind, end) = match first {
            b' ' | b'\t'..=b'\r' => {
                at += 1;
                continue;
            }
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => {
                let end = end_of(bytes, at, |byte, _| byte.is_ascii_alphanumeric() || byte == b'_');
                (Kind::Name(text[at..end].to_owned()), end)
            }
            b'0'..=b'9' => {
                // the sign of an exponent belongs to the number, but not in hexadecimal
                let is_hex = matches!(bytes[at..], [b'0', b'x' | b'X', ..]);
                let signed = |byte, before| !is_hex && matches!(byte, b'+' | b'-') && matches!(before, b'e' | b'E');
                let end = end_of(bytes, at, |byte, before| {
                    byte.is_ascii_alphanumeric() || byte == b'.' || signed(byte, before)
                });
                (Kind::Number(text[at..end].to_owned()), end)
            }
            b'"' => {
                let inner = &text[at + 1..];
                let end = closing(inner).ok_or("a text without its end")?;
                (Kind::Text(inner[..end].to_owned()), at + end + 2)
            }
            _ => {
                let mut symbols = SYMBOLS.iter().chain(&MORE);
                // the first byte tells nearly all of them apart
                let is_it = |symbol: &&&str| {
                    let symbol = symbol.as_bytes();
                    symbol[0] == first && (symbol.len() == 1 || bytes[at..].starts_with(symbol))
                };
                match symbols.find(is_it) {
                    Some(symbol) => (Kind::Symbol(symbol), at + symbol.len()),
                    None => {
                        let other = text[at..].chars().next().unwrap_or(char::REPLACEMENT_CHARACTER);
                        // such as a space that does not break a line
                        if other.is_whitespace() {
                            at += other.len_utf8();
                            continue;
                        }
                        return Err(format!("the character `{other}`"));
                    }
                }
            }
        };
        out.push(Token { kind, line });
        at = end;
    }
    Ok(out)
}

/// One past the last byte of the word that begins at `start`; `belongs` is asked of a byte and the one before it.
fn end_of(bytes: &[u8], start: usize, belongs: impl Fn(u8, u8) -> bool) -> usize {
    let mut end = start + 1;
    while bytes.get(end).is_some_and(|byte| belongs(*byte, bytes[end - 1])) {
        end += 1;
    }
    end
}

/// Where the text ends; a quote behind a backslash does not end it.
fn closing(inner: &str) -> Option<usize> {
    let mut escaped = false;
    for (index, c) in inner.char_indices() {
        match c {
            '"' if !escaped => return Some(index),
            _ => escaped = c == '\\' && !escaped,
        }
    }
    None
}
