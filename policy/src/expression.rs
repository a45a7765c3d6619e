//! Source expressions: text to an affine tree with constants folded (contract section 3).
//!
//! ```text
//! sum     = product { ("+" | "-") product }
//! product = signed { ("*" | "/") signed }          one side of "*" is known, the right side of "/" always
//! signed  = ("+" | "-") signed | primary
//! primary = number | name | "(" sum ")"
//! ```
//!
//! Each rule gives a [`Value`]: known in binary64, or an [`Expr`] over inputs. Two known ones fold at once, so that a
//! constant is rounded to the format once. Nothing is reordered: the tree is what the controller computes.

use std::collections::BTreeMap;

use toml_input::{Message, Span};

use crate::catalogue;
use crate::limits;
use crate::model::{Expr, Input};
use crate::names::REMEMBERED;

/// Names an expression may use.
pub(crate) struct Scope<'a> {
    pub signals: &'a [String],
    /// What observers estimate.
    pub estimates: &'a [(String, Input)],
    pub parameters: &'a BTreeMap<String, f64>,
    /// Whether there are several outputs, whose duties have names of their own among the estimates.
    pub has_outputs: bool,
}

/// A fault at a byte range of the expression.
pub(crate) type Wrong = (Span, Message);

/// Parses and folds `text`.
pub(crate) fn parse(text: &str, scope: &Scope<'_>) -> Result<Expr, Wrong> {
    // before anything is parsed: the size of the text bounds the tree
    if text.chars().count() > limits::MAX_SOURCE_CHARS {
        let found = format!("{} characters", text.chars().count());
        let message = catalogue::expression("the expression is too long").found(found);
        return Err((
            0..text.len(),
            message.expected(format!("at most {}", limits::MAX_SOURCE_CHARS)),
        ));
    }
    let mut parser = Parser {
        tokens: tokens(text)?,
        next: 0,
        end: text.len(),
        depth: 0,
        scope,
    };
    let value = parser.sum()?;
    match parser.peek() {
        None => value.into_expr(0..text.len()),
        Some((_, span)) => Err((span.clone(), parser.unexpected("an operator: + - * /"))),
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Token {
    Number(f64),
    Name(String),
    Symbol(char),
}

fn tokens(text: &str) -> Result<Vec<(Token, Span)>, Wrong> {
    let bytes = text.as_bytes();
    let mut list = Vec::new();
    let mut at = 0;
    // whatever is taken below is ASCII, so `at` always stands between two characters
    while let Some(c) = text[at..].chars().next() {
        let start = at;
        let token = match c {
            ' ' | '\t' | '\n' | '\r' => {
                at += 1;
                continue;
            }
            '0'..='9' | '.' => {
                at = number_end(bytes, at);
                let span = start..at;
                Token::Number(number(text, &span).map_err(|message| (span, message))?)
            }
            'a'..='z' | 'A'..='Z' | '_' => {
                let word = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_';
                at += bytes[at..].iter().take_while(|b| word(b)).count();
                Token::Name(text[start..at].to_owned())
            }
            '+' | '-' | '*' | '/' | '(' | ')' => {
                at += 1;
                Token::Symbol(c)
            }
            _ => return Err((start..start + c.len_utf8(), stray(c))),
        };
        list.push((token, start..at));
    }
    Ok(list)
}

fn number_end(bytes: &[u8], start: usize) -> usize {
    let digits = |from: usize| from + bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut at = digits(start);
    if bytes.get(at) == Some(&b'.') {
        at = digits(at + 1);
    }
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
        let end = digits(at + 1 + sign);
        // without digits it is no exponent: `2e` is 2 before a name, and the fault says that an operator is missing
        if end > at + 1 + sign {
            at = end;
        }
    }
    at
}

fn number(text: &str, span: &Span) -> Result<f64, Message> {
    let written = &text[span.clone()];
    let value: f64 = written
        .parse()
        .map_err(|_| catalogue::expression("this is not a number").found(format!("`{written}`")))?;
    let follower = text[span.end..].chars().next();
    // `2v` is refused rather than read as a product: it may be a slip in a name
    if follower.is_some_and(|c| c.is_ascii_alphabetic() || c == '_') {
        let message = catalogue::expression("an operator is missing after this number");
        return Err(message
            .found(format!("`{written}`"))
            .hint(format!("write {written} * ...")));
    }
    if value.is_finite() {
        Ok(value)
    } else {
        Err(catalogue::not_finite(written, value))
    }
}

fn stray(c: char) -> Message {
    let hint = match c {
        ',' => "a decimal comma? write 1.5 instead of 1,5",
        '%' => "write a fraction: 0.44 instead of 44 %",
        '^' => "powers of signals are not affine; write a constant power as a number",
        '[' | '{' => "use round parentheses",
        '<' | '>' | '=' | '!' | '&' | '|' | '?' => "comparisons are not affine: a source cannot decide",
        _ => "allowed are names, numbers, + - * / and parentheses",
    };
    catalogue::expression("this character has no place in an expression")
        .found(format!("`{}`", c.escape_debug()))
        .hint(hint)
}

/// A sub-expression: known in binary64, or depending on an input.
enum Value {
    Known(f64),
    Open(Expr),
}

impl Value {
    fn into_expr(self, span: Span) -> Result<Expr, Wrong> {
        match self {
            Value::Known(value) => Ok(Expr::Constant(constant(value, span)?)),
            Value::Open(expr) => Ok(expr),
        }
    }
}

/// A constant that stays itself in binary32: finite, and zero only if it is zero.
fn constant(value: f64, span: Span) -> Result<f64, Wrong> {
    let rounded = value as f32;
    // a constant that rounds to 0 would take its term away without a word
    if f64::from(rounded.abs()) > limits::MAX_MAGNITUDE || (rounded == 0.0 && value != 0.0) || value.is_nan() {
        return Err((span, catalogue::not_in_f32("constant", value)));
    }
    Ok(value)
}

struct Parser<'a> {
    tokens: Vec<(Token, Span)>,
    next: usize,
    end: usize,
    depth: usize,
    scope: &'a Scope<'a>,
}

impl Parser<'_> {
    fn peek(&self) -> Option<&(Token, Span)> {
        self.tokens.get(self.next)
    }

    fn take_symbol(&mut self, allowed: &[char]) -> Option<(char, Span)> {
        let (Token::Symbol(c), span) = self.tokens.get(self.next)? else {
            return None;
        };
        let found = allowed.contains(c).then(|| (*c, span.clone()));
        self.next += usize::from(found.is_some());
        found
    }

    fn unexpected(&self, expected: &str) -> Message {
        let found = match self.peek() {
            None => "the end of the expression".to_owned(),
            Some((Token::Number(value), _)) => format!("the number {value}"),
            Some((Token::Name(name), _)) => format!("`{name}`"),
            Some((Token::Symbol(c), _)) => format!("`{c}`"),
        };
        catalogue::expression("the expression cannot be read")
            .found(found)
            .expected(expected)
    }

    /// From the token `first` to the last one taken.
    fn span_from(&self, first: usize) -> Span {
        let start = self.tokens.get(first).map_or(self.end, |(_, span)| span.start);
        let last = self.next.checked_sub(1).and_then(|last| self.tokens.get(last));
        start..last.map_or(self.end, |(_, span)| span.end)
    }

    fn sum(&mut self) -> Result<Value, Wrong> {
        let first = self.next;
        let mut left = self.product()?;
        while let Some((sign, _)) = self.take_symbol(&['+', '-']) {
            let second = self.next;
            // the sign was a token, so one stands before `second`
            let left_span = self.tokens[first].1.start..self.tokens[second.saturating_sub(1)].1.start;
            let right = self.product()?;
            left = match (left, right) {
                (Value::Known(a), Value::Known(b)) => {
                    known(if sign == '+' { a + b } else { a - b }, self.span_from(first))?
                }
                (a, b) => {
                    let a = Box::new(a.into_expr(left_span)?);
                    let b = Box::new(b.into_expr(self.span_from(second))?);
                    Value::Open(if sign == '+' { Expr::Add(a, b) } else { Expr::Sub(a, b) })
                }
            };
        }
        Ok(left)
    }

    fn product(&mut self) -> Result<Value, Wrong> {
        let first = self.next;
        let mut left = self.signed()?;
        while let Some((sign, symbol)) = self.take_symbol(&['*', '/']) {
            let second = self.next;
            let right = self.signed()?;
            let span = self.span_from(first);
            left = match (left, sign == '/', right) {
                // before the arms that fold: "not finite" would say less than a division by zero
                (_, true, Value::Known(0.0)) => {
                    return Err((self.span_from(second), catalogue::expression("division by zero")));
                }
                (Value::Known(a), false, Value::Known(b)) => known(a * b, span)?,
                (Value::Known(a), _, Value::Known(b)) => known(a / b, span)?,
                (Value::Known(k), false, Value::Open(e)) | (Value::Open(e), false, Value::Known(k)) => {
                    scale(k, e, span)?
                }
                // section 3 says so: the reciprocal in binary64, then one rounded product
                (Value::Open(e), _, Value::Known(k)) => scale(k.recip(), e, span)?,
                (_, true, Value::Open(_)) => {
                    let message = catalogue::expression("division by a signal is not affine");
                    return Err((self.span_from(second), message.expected("a constant divisor")));
                }
                (Value::Open(_), _, Value::Open(_)) => {
                    let message = catalogue::expression("a product of two signals is not affine");
                    return Err((symbol, message.expected("a constant on one side of `*`")));
                }
            };
        }
        Ok(left)
    }

    fn signed(&mut self) -> Result<Value, Wrong> {
        self.depth += 1;
        if self.depth > limits::MAX_SOURCE_DEPTH {
            let span = self.peek().map_or(self.end..self.end, |(_, span)| span.clone());
            let message = catalogue::expression("the expression is nested too deeply");
            return Err((
                span,
                message.expected(format!("at most {} levels", limits::MAX_SOURCE_DEPTH)),
            ));
        }
        let value = match self.take_symbol(&['+', '-']) {
            Some(('-', _)) => match self.signed()? {
                Value::Known(value) => Value::Known(-value),
                Value::Open(expr) => Value::Open(Expr::Neg(Box::new(expr))),
            },
            Some(_) => self.signed()?,
            None => self.primary()?,
        };
        // an error ends the whole parse, so the depth need not be put back there
        self.depth -= 1;
        Ok(value)
    }

    fn primary(&mut self) -> Result<Value, Wrong> {
        const EXPECTED: &str = "a name, a number or `(`";
        let Some((token, span)) = self.peek().cloned() else {
            return Err((self.end..self.end, self.unexpected(EXPECTED)));
        };
        match token {
            Token::Number(value) => {
                self.next += 1;
                Ok(Value::Known(value))
            }
            Token::Name(name) => {
                let value = self.lookup(&name, &span)?;
                self.next += 1;
                Ok(value)
            }
            Token::Symbol('(') => {
                self.next += 1;
                let value = self.sum()?;
                if self.take_symbol(&[')']).is_none() {
                    let at = self.peek().map_or(self.end..self.end, |(_, span)| span.clone());
                    return Err((at, self.unexpected("`)`")));
                }
                Ok(value)
            }
            Token::Symbol(_) => Err((span, self.unexpected(EXPECTED))),
        }
    }

    /// A duty of the step before where there are several.
    fn whose(&self, name: &str) -> Message {
        let ending = format!("_{name}");
        let own = self.scope.estimates.iter().map(|(own, _)| own.as_str());
        let own: Vec<&str> = own.filter(|own| own.ends_with(&ending)).collect();
        catalogue::expression(&format!("`{name}` does not say of which output"))
            .found(format!("{} outputs", own.len()))
            .hint(format!("write {}", own.join(" or ")))
    }

    fn lookup(&self, name: &str, span: &Span) -> Result<Value, Wrong> {
        let input = |input| Ok(Value::Open(Expr::Input(input)));
        if self.scope.has_outputs && REMEMBERED.contains(&name) {
            return Err((span.clone(), self.whose(name)));
        }
        match name {
            "previous_duty" => return input(Input::PreviousDuty),
            "previous_command" => return input(Input::PreviousCommand),
            _ => {}
        }
        // signals and parameters share one space of names: the order of these two looks does not matter
        if let Some(index) = self.scope.signals.iter().position(|signal| signal == name) {
            return input(Input::Signal(index));
        }
        if let Some((_, estimate)) = self.scope.estimates.iter().find(|(called, _)| called == name) {
            return input(*estimate);
        }
        if let Some(value) = self.scope.parameters.get(name) {
            return Ok(Value::Known(*value));
        }
        // only behind the known names: a signal may be called as a function is
        if matches!(self.tokens.get(self.next + 1), Some((Token::Symbol('('), _))) {
            let message = catalogue::expression("functions are not affine").found(format!("`{name}(...)`"));
            return Err((
                span.clone(),
                message.hint("delays, differences and averages go into `filters`"),
            ));
        }
        let estimates = self.scope.estimates.iter().map(|(name, _)| name);
        let known = self
            .scope
            .signals
            .iter()
            .chain(estimates)
            .chain(self.scope.parameters.keys());
        let known: Vec<&str> = known.map(String::as_str).chain(REMEMBERED).collect();
        Err((
            span.clone(),
            catalogue::unknown_name("signal or parameter", name, &known),
        ))
    }
}

fn known(value: f64, span: Span) -> Result<Value, Wrong> {
    if value.is_finite() {
        Ok(Value::Known(value))
    } else {
        Err((span, catalogue::not_finite("constant", value)))
    }
}

/// Multiplication by a constant; by exactly 1 it is left out.
fn scale(factor: f64, expr: Expr, span: Span) -> Result<Value, Wrong> {
    let factor = constant(factor, span)?;
    Ok(Value::Open(if factor == 1.0 {
        expr
    } else {
        Expr::Scale(factor, Box::new(expr))
    }))
}
