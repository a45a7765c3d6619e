//! Statements and expressions of the emitted C. What is not known here is refused with its line.

use super::syntax::{Expr, Statement, Type, What};
use super::tokens::{Kind, Token};
use crate::machine::{Binary, Wrong};

/// A fault with its line.
pub(crate) type Fault = (usize, Wrong);

pub(crate) struct Parser<'a> {
    tokens: &'a [Token],
    next: usize,
    /// Whether a name is one of a type.
    is_type: &'a dyn Fn(&str) -> bool,
}

/// Binary operators from loose to tight, one row a level.
const LEVELS: [&[(&str, Binary)]; 8] = [
    &[("|", Binary::Or)],
    &[("^", Binary::Xor)],
    &[("&", Binary::And)],
    &[("==", Binary::Equal), ("!=", Binary::NotEqual)],
    &[
        ("<", Binary::Less),
        ("<=", Binary::LessOrEqual),
        (">", Binary::Greater),
        (">=", Binary::GreaterOrEqual),
    ],
    &[("<<", Binary::Shl), (">>", Binary::Shr)],
    &[("+", Binary::Add), ("-", Binary::Sub)],
    &[("*", Binary::Mul), ("/", Binary::Div)],
];

const ASSIGNMENTS: [(&str, Option<Binary>); 7] = [
    ("=", None),
    ("+=", Some(Binary::Add)),
    ("-=", Some(Binary::Sub)),
    ("&=", Some(Binary::And)),
    ("|=", Some(Binary::Or)),
    ("^=", Some(Binary::Xor)),
    (">>=", Some(Binary::Shr)),
];

/// Words that say nothing about the value.
const QUALIFIERS: [&str; 8] = [
    "const",
    "static",
    "volatile",
    "restrict",
    "__restrict",
    "__inline__",
    "inline",
    "register",
];

impl<'a> Parser<'a> {
    pub(crate) fn new(tokens: &'a [Token], is_type: &'a dyn Fn(&str) -> bool) -> Self {
        Parser {
            tokens,
            next: 0,
            is_type,
        }
    }

    pub(crate) fn line(&self) -> usize {
        let last = self.tokens.last();
        self.tokens.get(self.next).or(last).map_or(0, |token| token.line)
    }

    pub(crate) fn is_done(&self) -> bool {
        self.next >= self.tokens.len()
    }

    fn fault<T>(&self, message: impl Into<Wrong>) -> Result<T, Fault> {
        Err((self.line(), message.into()))
    }

    fn peek(&self, ahead: usize) -> Option<&'a Kind> {
        self.tokens.get(self.next + ahead).map(|token| &token.kind)
    }

    fn is(&self, symbol: &str) -> bool {
        matches!(self.peek(0), Some(Kind::Symbol(found)) if *found == symbol)
    }

    pub(crate) fn take(&mut self, symbol: &str) -> bool {
        let found = self.is(symbol);
        self.next += usize::from(found);
        found
    }

    pub(crate) fn expect(&mut self, symbol: &str) -> Result<(), Fault> {
        match self.take(symbol) {
            true => Ok(()),
            false => self.fault(format!("`{symbol}` expected, {} found", self.found())),
        }
    }

    fn found(&self) -> String {
        match self.peek(0) {
            Some(Kind::Name(text) | Kind::Number(text) | Kind::Text(text)) => format!("`{text}`"),
            Some(Kind::Symbol(symbol)) => format!("`{symbol}`"),
            None => "the end".into(),
        }
    }

    fn take_word(&mut self, word: &str) -> bool {
        let found = matches!(self.peek(0), Some(Kind::Name(name)) if name == word);
        self.next += usize::from(found);
        found
    }

    pub(crate) fn name(&mut self) -> Result<String, Fault> {
        match self.peek(0) {
            Some(Kind::Name(name)) => {
                self.next += 1;
                Ok(name.clone())
            }
            _ => self.fault(format!("a name expected, {} found", self.found())),
        }
    }

    /// Qualifiers and attributes; whether there were any.
    pub(crate) fn qualifiers(&mut self) -> Result<bool, Fault> {
        let start = self.next;
        loop {
            if self.take_word("__attribute__") {
                self.skip_brackets()?;
            } else if !QUALIFIERS.iter().any(|word| self.take_word(word)) {
                return Ok(self.next > start);
            }
        }
    }

    fn skip_brackets(&mut self) -> Result<(), Fault> {
        self.expect("(")?;
        let mut depth = 1;
        while depth > 0 {
            match self.peek(0) {
                Some(Kind::Symbol("(")) => depth += 1,
                Some(Kind::Symbol(")")) => depth -= 1,
                Some(_) => {}
                None => return self.fault("a bracket that does not close"),
            }
            self.next += 1;
        }
        Ok(())
    }

    /// `const T *const`
    pub(crate) fn a_type(&mut self) -> Result<Type, Fault> {
        self.qualifiers()?;
        let name = self.name()?;
        if !(self.is_type)(&name) {
            return self.fault(format!("`{name}` is no type that is known here"));
        }
        self.qualifiers()?;
        let pointer = self.take("*");
        self.qualifiers()?;
        Ok(Type { name, pointer })
    }

    fn starts_type(&self, ahead: usize) -> bool {
        matches!(self.peek(ahead), Some(Kind::Name(name)) if QUALIFIERS.contains(&name.as_str()) || (self.is_type)(name))
    }

    pub(crate) fn block(&mut self) -> Result<Vec<Statement>, Fault> {
        self.expect("{")?;
        let mut statements = Vec::new();
        while !self.take("}") {
            statements.push(self.statement()?);
        }
        Ok(statements)
    }

    fn statement(&mut self) -> Result<Statement, Fault> {
        let line = self.line();
        let what = if self.is("{") {
            What::Block(self.block()?)
        } else if self.take_word("for") {
            self.a_for()?
        } else if self.take_word("if") {
            self.an_if()?
        } else if self.take_word("return") {
            let value = if self.is(";") { None } else { Some(self.expression()?) };
            self.expect(";")?;
            What::Return(value)
        } else if self.take_word("__asm__") {
            self.assembly()?
        } else if self.starts_type(0) {
            self.declaration()?
        } else {
            let what = self.simple()?;
            self.expect(";")?;
            what
        };
        Ok(Statement { line, what })
    }

    fn declaration(&mut self) -> Result<What, Fault> {
        let kind = self.a_type()?;
        let name = self.name()?;
        let length = self.length()?;
        let first = if self.take("=") { Some(self.expression()?) } else { None };
        self.expect(";")?;
        Ok(What::Declare {
            kind,
            name,
            length,
            first,
        })
    }

    /// `[n]` behind a name.
    pub(crate) fn length(&mut self) -> Result<Option<Expr>, Fault> {
        if !self.take("[") {
            return Ok(None);
        }
        let length = self.expression()?;
        self.expect("]")?;
        Ok(Some(length))
    }

    /// An assignment, `++i`, or an expression for its effect.
    fn simple(&mut self) -> Result<What, Fault> {
        if self.take("++") {
            let place = self.unary()?;
            return Ok(What::Assign(place, Some(Binary::Add), Expr::Integer(1, true)));
        }
        let place = self.expression()?;
        for (symbol, op) in ASSIGNMENTS {
            if self.take(symbol) {
                return Ok(What::Assign(place, op, self.expression()?));
            }
        }
        Ok(What::Evaluate(place))
    }

    fn a_for(&mut self) -> Result<What, Fault> {
        self.expect("(")?;
        let line = self.line();
        let start = self.simple()?;
        self.expect(";")?;
        let condition = self.expression()?;
        self.expect(";")?;
        let step = self.simple()?;
        self.expect(")")?;
        let statement = |what| Box::new(Statement { line, what });
        Ok(What::For {
            start: statement(start),
            condition,
            step: statement(step),
            body: self.block()?,
        })
    }

    fn an_if(&mut self) -> Result<What, Fault> {
        self.expect("(")?;
        let condition = self.expression()?;
        self.expect(")")?;
        let yes = self.block()?;
        let no = if self.take_word("else") {
            self.block()?
        } else {
            Vec::new()
        };
        Ok(What::If(condition, yes, no))
    }

    /// Only assembly without an instruction, which keeps its operand.
    fn assembly(&mut self) -> Result<What, Fault> {
        let barrier = [
            Kind::Symbol("("),
            Kind::Text(String::new()),
            Kind::Symbol(":"),
            Kind::Text("+r".into()),
        ];
        if !(0..).zip(&barrier).all(|(n, kind)| self.peek(n) == Some(kind)) {
            return self.fault("assembly with an instruction");
        }
        self.skip_brackets()?;
        self.expect(";")?;
        Ok(What::Barrier)
    }

    pub(crate) fn expression(&mut self) -> Result<Expr, Fault> {
        let condition = self.either()?;
        if !self.take("?") {
            return Ok(condition);
        }
        let yes = self.expression()?;
        self.expect(":")?;
        let no = self.expression()?;
        Ok(chosen(condition, yes, no))
    }

    /// `x || y` is `x ? 1 : (y ? 1 : 0)`: no operand of the subset has an effect.
    fn either(&mut self) -> Result<Expr, Fault> {
        let mut left = self.both()?;
        while self.take("||") {
            let right = truth(self.both()?);
            left = chosen(left, Expr::Integer(1, false), right);
        }
        Ok(left)
    }

    /// `x && y` is `x ? (y ? 1 : 0) : 0`.
    fn both(&mut self) -> Result<Expr, Fault> {
        let mut left = self.level(0)?;
        while self.take("&&") {
            let right = truth(self.level(0)?);
            left = chosen(left, right, Expr::Integer(0, false));
        }
        Ok(left)
    }

    fn level(&mut self, level: usize) -> Result<Expr, Fault> {
        let Some(operators) = LEVELS.get(level) else {
            return self.unary();
        };
        let mut left = self.level(level + 1)?;
        while let Some((_, op)) = operators.iter().find(|(symbol, _)| self.is(symbol)) {
            self.next += 1;
            let right = self.level(level + 1)?;
            left = Expr::Binary(*op, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn unary(&mut self) -> Result<Expr, Fault> {
        if self.take("-") {
            return Ok(Expr::Minus(Box::new(self.unary()?)));
        }
        if self.take("~") {
            return Ok(Expr::Complement(Box::new(self.unary()?)));
        }
        if self.take("&") {
            return Ok(Expr::AddressOf(Box::new(self.unary()?)));
        }
        if self.take("*") {
            return Ok(Expr::Deref(Box::new(self.unary()?)));
        }
        if self.take_word("sizeof") {
            self.skip_brackets()?;
            return Ok(Expr::SizeOf);
        }
        if self.is("(") && self.starts_type(1) {
            self.expect("(")?;
            let kind = self.a_type()?;
            self.expect(")")?;
            return Ok(Expr::Cast(kind, Box::new(self.unary()?)));
        }
        self.postfix()
    }

    fn postfix(&mut self) -> Result<Expr, Fault> {
        let mut expr = self.primary()?;
        loop {
            expr = if self.take("[") {
                let index = self.expression()?;
                self.expect("]")?;
                Expr::Index(Box::new(expr), Box::new(index))
            } else if self.take("->") {
                Expr::Member(Box::new(expr), self.name()?, true)
            } else if self.take(".") {
                Expr::Member(Box::new(expr), self.name()?, false)
            } else {
                return Ok(expr);
            };
        }
    }

    fn primary(&mut self) -> Result<Expr, Fault> {
        if self.take("(") {
            let inner = self.expression()?;
            self.expect(")")?;
            return Ok(inner);
        }
        match self.peek(0) {
            Some(Kind::Number(digits)) => {
                let literal = literal(digits).map_err(|message| (self.line(), message))?;
                self.next += 1;
                Ok(literal)
            }
            Some(Kind::Name(name)) => {
                self.next += 1;
                if !self.take("(") {
                    return Ok(Expr::Name(name.clone()));
                }
                let mut arguments = Vec::new();
                while !self.take(")") {
                    arguments.push(self.expression()?);
                    if !self.is(")") {
                        self.expect(",")?;
                    }
                }
                Ok(Expr::Call(name.clone(), arguments))
            }
            _ => self.fault(format!("an expression expected, {} found", self.found())),
        }
    }
}

/// `0x1Fu`, `12`, `0.5f`, `1e-3`
fn chosen(condition: Expr, yes: Expr, no: Expr) -> Expr {
    Expr::Choose(Box::new(condition), Box::new(yes), Box::new(no))
}

/// 1 or 0.
fn truth(x: Expr) -> Expr {
    chosen(x, Expr::Integer(1, false), Expr::Integer(0, false))
}

fn literal(digits: &str) -> Result<Expr, Wrong> {
    let wrong = |_| format!("the number `{digits}`");
    if let Some(hex) = digits.strip_prefix("0x").or_else(|| digits.strip_prefix("0X")) {
        let value = u64::from_str_radix(hex.trim_end_matches(['u', 'U', 'l', 'L']), 16).map_err(wrong)?;
        return Ok(Expr::Integer(value, hex.contains(['u', 'U'])));
    }
    if digits.contains(['.', 'e', 'E']) {
        let text = digits.strip_suffix(['f', 'F']);
        return Ok(Expr::Decimal(text.unwrap_or(digits).to_owned(), text.is_some()));
    }
    let plain = digits.trim_end_matches(['u', 'U', 'l', 'L']);
    // a leading 0 would make it octal
    if plain.len() > 1 && plain.starts_with('0') {
        return Err(format!("the octal number `{digits}`"));
    }
    Ok(Expr::Integer(
        plain.parse().map_err(wrong)?,
        digits.contains(['u', 'U']),
    ))
}
