//! Conditions of the preprocessor: `defined`, integers, comparisons, `!`, `&&`, `||`.

use super::tokens::{Kind, Macros, Token, expand};
use crate::machine::Wrong;

/// Whether the condition of an `#if` holds. A name that is not defined is 0, as the standard has it.
pub(crate) fn holds(tokens: &mut Vec<Token>, macros: &Macros) -> Result<bool, Wrong> {
    answer_defined(tokens, macros);
    expand(tokens, macros, 0);
    let mut reader = Reader { tokens, next: 0 };
    let value = reader.either()?;
    match reader.next == reader.tokens.len() {
        true => Ok(value != 0),
        false => Err("a condition that goes on where it should end".into()),
    }
}

/// `defined(X)` and `defined X` become 0 or 1, before names are replaced.
fn answer_defined(tokens: &mut Vec<Token>, macros: &Macros) {
    let mut out = Vec::new();
    let mut rest = tokens.drain(..).peekable();
    while let Some(token) = rest.next() {
        if token.kind != Kind::Name("defined".into()) {
            out.push(token);
            continue;
        }
        let brackets = rest.next_if(|t| t.kind == Kind::Symbol("(")).is_some();
        let name = rest.next();
        if brackets {
            rest.next_if(|t| t.kind == Kind::Symbol(")"));
        }
        let is = matches!(name.map(|t| t.kind), Some(Kind::Name(name)) if macros.contains_key(&name));
        out.push(Token {
            kind: Kind::Number(u8::from(is).to_string()),
            line: token.line,
        });
    }
    drop(rest);
    *tokens = out;
}

struct Reader<'a> {
    tokens: &'a [Token],
    next: usize,
}

impl Reader<'_> {
    fn take(&mut self, symbols: &[&'static str]) -> Option<&'static str> {
        let Some(Kind::Symbol(found)) = self.tokens.get(self.next).map(|t| &t.kind) else {
            return None;
        };
        let symbol = symbols.iter().find(|symbol| *symbol == found)?;
        self.next += 1;
        Some(symbol)
    }

    fn either(&mut self) -> Result<i64, Wrong> {
        let mut value = self.both()?;
        while self.take(&["||"]).is_some() {
            let other = self.both()?;
            value = i64::from(value != 0 || other != 0);
        }
        Ok(value)
    }

    fn both(&mut self) -> Result<i64, Wrong> {
        let mut value = self.compared()?;
        while self.take(&["&&"]).is_some() {
            let other = self.compared()?;
            value = i64::from(value != 0 && other != 0);
        }
        Ok(value)
    }

    fn compared(&mut self) -> Result<i64, Wrong> {
        let x = self.shifted()?;
        let Some(symbol) = self.take(&["==", "!=", "<", ">", "<=", ">="]) else {
            return Ok(x);
        };
        let y = self.shifted()?;
        Ok(i64::from(match symbol {
            "==" => x == y,
            "!=" => x != y,
            "<" => x < y,
            ">" => x > y,
            "<=" => x <= y,
            _ => x >= y,
        }))
    }

    fn shifted(&mut self) -> Result<i64, Wrong> {
        let x = self.signed()?;
        match self.take(&[">>"]) {
            Some(_) => Ok(x >> self.signed()?.clamp(0, 63)),
            None => Ok(x),
        }
    }

    fn signed(&mut self) -> Result<i64, Wrong> {
        match self.take(&["!", "-", "("]) {
            Some("!") => Ok(i64::from(self.signed()? == 0)),
            Some("-") => Ok(self.signed()?.wrapping_neg()),
            Some(_) => {
                let value = self.either()?;
                self.take(&[")"]).ok_or("a bracket that does not close")?;
                Ok(value)
            }
            None => self.primary(),
        }
    }

    fn primary(&mut self) -> Result<i64, Wrong> {
        let token = self.tokens.get(self.next).ok_or("a condition that ends too early")?;
        self.next += 1;
        match &token.kind {
            Kind::Number(digits) => {
                let digits = digits.trim_end_matches(['u', 'U', 'l', 'L']);
                digits.parse().map_err(|_| format!("`{digits}` in a condition"))
            }
            Kind::Name(_) => Ok(0),
            _ => Err("something that a condition does not have".into()),
        }
    }
}
