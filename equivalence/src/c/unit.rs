//! A translation unit: where its types, tables and functions stand. Bodies are read when they are called, so that what a step never
//! reaches (the network, the checks of the tables) may hold anything.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Range;
use std::rc::Rc;

use super::parse::{Fault, Parser};
use super::syntax::{Expr, Function, Member, Type};
use super::tokens::{Kind, Macros, Token, tokens};
use crate::Reading;
use crate::machine;
use crate::refusal::Refusal;

/// The macros under which a reader sees the code. A compiler knows the extensions of GNU, but no vectors and no assembly of a core.
pub(crate) fn defined(reading: Reading, policy: &policy::Policy) -> Vec<(String, &'static str)> {
    let mut all = match reading {
        Reading::Compiler => vec![("__GNUC__".to_owned(), "12")],
        Reading::FramaC => {
            let portable = format!("{}_PORTABLE", policy.name.to_uppercase());
            vec![("__FRAMAC__".to_owned(), "1"), (portable, "1")]
        }
    };
    // the preprocessor of either says that `double` is binary64, which a fused sum in C asks for
    all.push(("__DBL_MANT_DIG__".to_owned(), "53"));
    all
}

const SCALARS: [(&str, machine::Kind); 11] = [
    ("float", machine::Kind::Float(policy::Scalar::F32)),
    ("double", machine::Kind::Float(policy::Scalar::F64)),
    ("uint32_t", machine::U32),
    ("uint64_t", machine::U64),
    ("int32_t", machine::I32),
    ("int", machine::I32),
    ("int64_t", integer(64, true)),
    ("uint16_t", integer(16, false)),
    ("int16_t", integer(16, true)),
    ("uint8_t", integer(8, false)),
    ("int8_t", integer(8, true)),
];

const fn integer(bits: u32, signed: bool) -> machine::Kind {
    machine::Kind::Integer { bits, signed }
}

/// The scalar of that name.
pub(crate) fn scalar(name: &str) -> Option<machine::Kind> {
    SCALARS.iter().find(|(known, _)| *known == name).map(|(_, kind)| *kind)
}

/// A record, or a union of scalars.
#[derive(Debug, Clone)]
pub(crate) struct Record {
    pub is_union: bool,
    pub members: Vec<Member>,
}

#[derive(Debug)]
struct Definition {
    /// Tokens of the type, name and parameters, or of a table's type and name.
    head: Range<usize>,
    /// Tokens of the body or of the initial value, brackets included.
    body: Range<usize>,
}

#[derive(Debug)]
pub(crate) struct Unit {
    pub file: String,
    tokens: Vec<Token>,
    records: BTreeMap<String, Record>,
    functions: BTreeMap<String, Definition>,
    tables: BTreeMap<String, Definition>,
    /// Functions that were parsed: a step is walked through several times.
    parsed: RefCell<BTreeMap<String, Rc<Function>>>,
}

impl Unit {
    /// Reads header and source as one, as a compiler does, with these macros.
    pub(crate) fn read(
        header: (&str, &str),
        source: (&str, &str),
        defined: &[(String, &'static str)],
    ) -> Result<Self, Refusal> {
        let mut macros = Macros::new();
        for (name, value) in defined {
            let kind = Kind::Number((*value).to_owned());
            macros.insert(name.clone(), vec![Token { kind, line: 0 }]);
        }
        let mut all = tokens(header.0, header.1, &mut macros)?;
        all.append(&mut tokens(source.0, source.1, &mut macros)?);
        let mut unit = Unit {
            file: source.0.to_owned(),
            tokens: all,
            records: BTreeMap::new(),
            functions: BTreeMap::new(),
            tables: BTreeMap::new(),
            parsed: RefCell::default(),
        };
        unit.scan()
            .map_err(|(line, message)| Refusal::at(source.0, line, message))?;
        Ok(unit)
    }

    fn symbol(&self, at: usize) -> Option<&'static str> {
        match self.tokens.get(at).map(|token| &token.kind) {
            Some(Kind::Symbol(symbol)) => Some(symbol),
            _ => None,
        }
    }

    fn named(&self, at: usize) -> Option<&str> {
        match self.tokens.get(at).map(|token| &token.kind) {
            Some(Kind::Name(name)) => Some(name),
            _ => None,
        }
    }

    /// One past the bracket that closes the one at `open`.
    fn closing(&self, open: usize) -> Result<usize, Fault> {
        let mut depth = 0_usize;
        for at in open..self.tokens.len() {
            match self.symbol(at) {
                Some("(" | "[" | "{") => depth += 1,
                Some(")" | "]" | "}") => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                return Ok(at + 1);
            }
        }
        Err((
            self.tokens.get(open).map_or(0, |t| t.line),
            "a bracket that does not close".into(),
        ))
    }

    /// Finds what stands on the outermost level.
    fn scan(&mut self) -> Result<(), Fault> {
        let mut start = 0;
        while start < self.tokens.len() {
            // an item ends with `;`, or with the body of a function
            let (mut at, mut name, mut body) = (start, None, None);
            loop {
                match self.symbol(at) {
                    Some(";") => break,
                    Some("(") => {
                        // the last name in front of a bracket that is not of an attribute
                        let before = at.checked_sub(1).and_then(|at| self.named(at));
                        if let Some(found) = before.filter(|name| *name != "__attribute__" && name != &"vector_size") {
                            name = Some(found.to_owned());
                        }
                        at = self.closing(at)?;
                    }
                    Some("{") => {
                        let end = self.closing(at)?;
                        let is_function = at > start && self.symbol(at - 1) == Some(")");
                        body = Some(at..end);
                        at = end;
                        if is_function && self.named(start) != Some("typedef") {
                            break;
                        }
                    }
                    Some("[") => at = self.closing(at)?,
                    None if at >= self.tokens.len() => break,
                    _ => at += 1,
                }
            }
            let end = at;
            self.item(start, end, name, body)?;
            start = end + usize::from(self.symbol(end) == Some(";"));
        }
        Ok(())
    }

    fn item(
        &mut self,
        start: usize,
        end: usize,
        name: Option<String>,
        body: Option<Range<usize>>,
    ) -> Result<(), Fault> {
        let Some(body) = body else {
            return Ok(()); // a prototype, or a type that a step does not use
        };
        if self.named(start) == Some("typedef") {
            let is_union = self.named(start + 1) == Some("union");
            if let Some(name) = self.named(end.saturating_sub(1)).map(str::to_owned) {
                let members = self.members(body)?;
                self.records.insert(name, Record { is_union, members });
            }
            return Ok(());
        }
        let head = start..body.start;
        match name {
            Some(name) if self.symbol(body.start - 1) == Some(")") => {
                self.functions.insert(name, Definition { head, body });
            }
            _ => {
                // `static const T name[n] = { ... }`
                let open = head
                    .clone()
                    .find(|at| self.symbol(*at) == Some("[") && !self.is_attribute(*at));
                if let Some(name) = open.and_then(|open| self.named(open - 1)).map(str::to_owned) {
                    self.tables.insert(name, Definition { head, body });
                }
            }
        }
        Ok(())
    }

    fn is_attribute(&self, at: usize) -> bool {
        at.checked_sub(1).is_some_and(|before| self.named(before).is_none())
    }

    fn members(&self, body: Range<usize>) -> Result<Vec<Member>, Fault> {
        let known = |name: &str| self.is_type(name);
        let mut parser = Parser::new(&self.tokens[body.start + 1..body.end - 1], &known);
        let mut members = Vec::new();
        while !parser.is_done() {
            let kind = parser.a_type()?;
            let name = parser.name()?;
            let length = parser.length()?;
            parser.expect(";")?;
            members.push(Member { kind, name, length });
        }
        Ok(members)
    }

    pub(crate) fn is_type(&self, name: &str) -> bool {
        name == "void" || scalar(name).is_some() || self.records.contains_key(name)
    }

    pub(crate) fn record(&self, name: &str) -> Option<&Record> {
        self.records.get(name)
    }

    pub(crate) fn has_function(&self, name: &str) -> bool {
        self.functions.contains_key(name)
    }

    /// A function, parsed when it is first asked for.
    pub(crate) fn function(&self, name: &str) -> Result<Rc<Function>, Fault> {
        if let Some(function) = self.parsed.borrow().get(name) {
            return Ok(Rc::clone(function));
        }
        let function = Rc::new(self.parse(name)?);
        self.parsed.borrow_mut().insert(name.to_owned(), Rc::clone(&function));
        Ok(function)
    }

    fn parse(&self, name: &str) -> Result<Function, Fault> {
        let definition = self
            .functions
            .get(name)
            .ok_or((0, format!("the function `{name}` is not there")))?;
        let known = |name: &str| self.is_type(name);
        let mut head = Parser::new(&self.tokens[definition.head.clone()], &known);
        let result = head.a_type()?;
        head.name()?;
        head.expect("(")?;
        let mut parameters = Vec::new();
        while !head.take(")") {
            let kind = head.a_type()?;
            if kind.name == "void" && head.take(")") {
                break;
            }
            parameters.push((kind, head.name()?));
            head.take(",");
        }
        let body = Parser::new(&self.tokens[definition.body.clone()], &known).block()?;
        Ok(Function {
            parameters,
            result,
            body,
        })
    }

    /// Type and numbers of a table of one dimension; nothing if there is none of that name.
    pub(crate) fn table(&self, name: &str) -> Option<Result<(Type, Vec<Expr>), Fault>> {
        let definition = self.tables.get(name)?;
        Some(self.read_table(definition))
    }

    fn read_table(&self, definition: &Definition) -> Result<(Type, Vec<Expr>), Fault> {
        let known = |name: &str| self.is_type(name);
        let kind = Parser::new(&self.tokens[definition.head.clone()], &known).a_type()?;
        let mut parser = Parser::new(&self.tokens[definition.body.clone()], &known);
        parser.expect("{")?;
        let mut numbers = Vec::new();
        while !parser.take("}") {
            numbers.push(parser.expression()?);
            if !parser.take(",") {
                parser.expect("}")?;
                break;
            }
        }
        Ok((kind, numbers))
    }
}
