//! Walks through the emitted Rust with terms in the place of numbers: expressions and statements. Calls are in `calls`.

use std::collections::BTreeMap;

use syn::{Block, Expr, Member, Pat, Stmt, UnOp};

use super::literals::{is_literal, literal, operator};
use super::unit::{Unit, at, joined, kind_of};
use crate::emitted::Network;
use crate::machine::{Binary, Kind, Machine, Number, Place, U32, U64, Value, Wrong, number};
use crate::refusal::Refusal;

/// A fault with its line.
pub(crate) type Fault = (usize, Wrong);

/// More turns than any loop of a step has.
const MOST_TURNS: usize = 1 << 18;

pub(crate) struct Walk<'a, 'u> {
    pub(super) unit: &'u Unit,
    pub machine: Machine<'a>,
    pub(super) network: &'u mut Network<'a>,
    pub(super) names: BTreeMap<String, Place>,
    pub(super) constants: BTreeMap<String, Place>,
    pub(super) depth: usize,
}

/// Nothing: what a statement gives.
pub(super) fn nothing() -> Value {
    Value::List(Vec::new())
}

impl<'a, 'u> Walk<'a, 'u> {
    pub(crate) fn new(unit: &'u Unit, network: &'u mut Network<'a>) -> Self {
        Walk {
            unit,
            machine: Machine::new(network.spec.float),
            network,
            names: BTreeMap::new(),
            constants: BTreeMap::new(),
            depth: 0,
        }
    }

    /// Calls a function by its name, `Self::step` or `clamp`; the receiver is the first argument.
    pub(crate) fn call(&mut self, name: &str, arguments: Vec<Value>) -> Result<Value, Refusal> {
        self.enter(name, arguments)
            .map_err(|(line, message)| Refusal::at(&self.unit.file, line, message))
    }

    pub(super) fn block(&mut self, block: &Block, hint: Option<Kind>) -> Result<Value, Fault> {
        let declares = block.stmts.iter().any(|statement| matches!(statement, Stmt::Local(_)));
        let names = declares.then(|| self.names.clone());
        let mut value = nothing();
        for statement in &block.stmts {
            value = self.statement(statement, hint)?;
        }
        if let Some(names) = names {
            self.names = names;
        }
        Ok(value)
    }

    fn statement(&mut self, statement: &Stmt, hint: Option<Kind>) -> Result<Value, Fault> {
        match statement {
            Stmt::Local(local) => {
                let (pattern, hint) = match &local.pat {
                    Pat::Type(typed) => (&*typed.pat, kind_of(&typed.ty)),
                    other => (other, None),
                };
                let first = local.init.as_ref().filter(|first| first.diverge.is_none());
                let first = first.ok_or_else(|| at(local, "a variable without a value"))?;
                let value = self.value(&first.expr, hint)?;
                if let (Some(kind), Value::Number(number)) = (hint, &value)
                    && number.kind != kind
                {
                    return Err(at(local, "a value of another type than its variable"));
                }
                self.bind(pattern, value)?;
                Ok(nothing())
            }
            Stmt::Expr(expr, None) => self.value(expr, hint),
            Stmt::Expr(expr, Some(_)) => {
                self.value(expr, None)?;
                Ok(nothing())
            }
            other => Err(at(other, "a statement that is not read here")),
        }
    }

    /// Gives the names of a pattern their values.
    pub(super) fn bind(&mut self, pattern: &Pat, value: Value) -> Result<(), Fault> {
        match (pattern, value) {
            (Pat::Ident(name), value) if name.by_ref.is_none() && name.subpat.is_none() => {
                let place = self.machine.put(value);
                self.names.insert(name.ident.to_string(), place);
                Ok(())
            }
            (Pat::Tuple(tuple), Value::List(values)) if tuple.elems.len() == values.len() => {
                let both = tuple.elems.iter().zip(values);
                both.into_iter()
                    .try_for_each(|(pattern, value)| self.bind(pattern, value))
            }
            (Pat::Wild(_), _) => Ok(()),
            (other, _) => Err(at(other, "a pattern that is not read here")),
        }
    }

    pub(super) fn number(&mut self, expr: &Expr, hint: Option<Kind>) -> Result<Number, Fault> {
        let value = self.value(expr, hint)?;
        number(&value).map_err(|message| at(expr, message))
    }

    pub(super) fn value(&mut self, expr: &Expr, hint: Option<Kind>) -> Result<Value, Fault> {
        match expr {
            Expr::Lit(expr_literal) => Ok(Value::Number(
                literal(&self.machine, &expr_literal.lit, hint).map_err(|m| at(expr, m))?,
            )),
            Expr::Paren(inner) => self.value(&inner.expr, hint),
            Expr::Group(inner) => self.value(&inner.expr, hint),
            Expr::Block(block) => self.block(&block.block, hint),
            Expr::Path(_) | Expr::Field(_) => {
                let place = self.place(expr)?;
                self.machine.read(&place).map_err(|message| at(expr, message))
            }
            Expr::Index(index) => self.indexed(expr, index),
            Expr::Reference(reference) => Ok(Value::Place(self.place(&reference.expr)?)),
            Expr::Unary(unary) => self.unary(unary, hint),
            Expr::Binary(binary) => self.binary(binary, hint),
            Expr::Cast(cast) => {
                let kind = kind_of(&cast.ty).ok_or_else(|| at(expr, "a cast to this type"))?;
                let value = self.number(&cast.expr, Some(kind))?;
                let converted = self.machine.convert(value, kind).map_err(|message| at(expr, message))?;
                Ok(Value::Number(converted))
            }
            Expr::Assign(assign) => {
                let place = self.place(&assign.left)?;
                let hint = self.kind_at(&place);
                let value = self.value(&assign.right, hint)?;
                self.machine.write(&place, value).map_err(|message| at(expr, message))?;
                Ok(nothing())
            }
            Expr::Tuple(tuple) => self.list(tuple.elems.iter(), None),
            Expr::Array(array) => self.list(array.elems.iter(), hint),
            Expr::Repeat(repeat) => {
                let element = self.value(&repeat.expr, hint)?;
                let length = self.length(&repeat.len)?;
                Ok(Value::List(vec![element; length]))
            }
            Expr::Struct(literal) => self.record(literal),
            Expr::ForLoop(turns) => self.turns(turns),
            Expr::If(branch) => self.branch(branch),
            Expr::Call(call) => self.called(call),
            Expr::MethodCall(call) => self.method(call, hint),
            other => Err(at(other, "an expression that is not read here")),
        }
    }

    fn list<'e>(&mut self, elements: impl Iterator<Item = &'e Expr>, hint: Option<Kind>) -> Result<Value, Fault> {
        let mut values = Vec::new();
        for element in elements {
            values.push(self.value(element, hint)?);
        }
        Ok(Value::List(values))
    }

    pub(super) fn length(&mut self, expr: &Expr) -> Result<usize, Fault> {
        let length = self.number(expr, Some(U64))?;
        let known = self
            .machine
            .terms
            .known(length.term)
            .and_then(|n| usize::try_from(n).ok());
        known
            .filter(|n| *n <= MOST_TURNS)
            .ok_or_else(|| at(expr, "a length that depends on the data"))
    }

    fn unary(&mut self, unary: &syn::ExprUnary, hint: Option<Kind>) -> Result<Value, Fault> {
        if matches!(unary.op, UnOp::Deref(_)) {
            return match self.value(&unary.expr, hint)? {
                Value::Place(place) => self.machine.read(&place).map_err(|message| at(unary, message)),
                _ => Err(at(unary, "`*` in front of something that is no reference")),
            };
        }
        let x = self.number(&unary.expr, hint)?;
        let terms = self.machine.terms;
        let term = match (&unary.op, x.kind) {
            (UnOp::Neg(_), Kind::Float(_)) => terms.binary("bvxor", x.term, self.machine.float.sign()),
            // of a literal alone: of anything else it could overflow
            (UnOp::Neg(_), Kind::Integer { signed: true, .. }) if terms.known(x.term).is_some() => {
                terms.unary("bvneg", x.term)
            }
            (UnOp::Not(_), Kind::Integer { .. }) => terms.unary("bvnot", x.term),
            (UnOp::Not(_), Kind::Truth) => terms.not(x.term),
            _ => return Err(at(unary, "an operation that is not read here")),
        };
        Ok(Value::Number(Number { term, kind: x.kind }))
    }

    fn binary(&mut self, binary: &syn::ExprBinary, hint: Option<Kind>) -> Result<Value, Fault> {
        let (op, assigns) = operator(&binary.op).ok_or_else(|| at(binary, "an operator that is not read here"))?;
        let shifts = matches!(op, Binary::Shl | Binary::Shr);
        let compares = matches!(
            op,
            Binary::Less
                | Binary::LessOrEqual
                | Binary::Greater
                | Binary::GreaterOrEqual
                | Binary::Equal
                | Binary::NotEqual
        );
        let hint = hint.filter(|_| !compares);
        // a literal takes the type of the other side
        let (x, y) = match is_literal(&binary.left) && !shifts {
            true => {
                let y = self.number(&binary.right, hint)?;
                (self.number(&binary.left, Some(y.kind))?, y)
            }
            false => {
                let x = self.number(&binary.left, hint)?;
                let hint = if shifts { U32 } else { x.kind };
                (x, self.number(&binary.right, Some(hint))?)
            }
        };
        let overflows = matches!(
            (op, x.kind),
            (Binary::Add | Binary::Sub | Binary::Mul, Kind::Integer { .. })
        );
        if overflows {
            return Err(at(binary, "arithmetic of integers that a debug build checks"));
        }
        let result = self.machine.binary(op, x, y).map_err(|message| at(binary, message))?;
        if !assigns {
            return Ok(Value::Number(result));
        }
        let place = self.place(&binary.left)?;
        let written = self.machine.write(&place, Value::Number(result));
        written.map_err(|message| at(binary, message))?;
        Ok(nothing())
    }

    fn indexed(&mut self, expr: &Expr, index: &syn::ExprIndex) -> Result<Value, Fault> {
        let at_index = self.number(&index.index, Some(U64))?;
        let list = self.place(&index.expr)?;
        let list = self.dereferenced(list).map_err(|message| at(expr, message))?;
        self.machine
            .element(&list, at_index)
            .map_err(|message| at(expr, message))
    }

    fn kind_at(&self, place: &Place) -> Option<Kind> {
        match &*self.machine.look(place).ok()? {
            Value::Number(number) => Some(number.kind),
            Value::List(list) => list
                .first()
                .and_then(|first| number(first).ok())
                .map(|first| first.kind),
            _ => None,
        }
    }

    /// Where the value of `expr` is; one that is nowhere is put into a new place.
    pub(super) fn place(&mut self, expr: &Expr) -> Result<Place, Fault> {
        match expr {
            Expr::Paren(inner) => self.place(&inner.expr),
            Expr::Path(path) => {
                let name = joined(&path.path);
                match self.names.get(&name) {
                    Some(place) => Ok(place.clone()),
                    None => self.constant(&name).map_err(|message| at(expr, message)),
                }
            }
            Expr::Field(field) => {
                let base = self.place(&field.base)?;
                let base = self.dereferenced(base).map_err(|message| at(expr, message))?;
                match &field.member {
                    Member::Named(name) => Ok(base.member(&name.to_string())),
                    Member::Unnamed(index) => Ok(base.element(index.index as usize)),
                }
            }
            Expr::Index(index) => {
                let list = self.place(&index.expr)?;
                let list = self.dereferenced(list).map_err(|message| at(expr, message))?;
                let known = self.length(&index.index)?;
                Ok(list.element(known))
            }
            Expr::Unary(unary) if matches!(unary.op, UnOp::Deref(_)) => match self.value(&unary.expr, None)? {
                Value::Place(place) => Ok(place),
                _ => Err(at(expr, "`*` in front of something that is no reference")),
            },
            other => {
                let value = self.value(other, None)?;
                Ok(self.machine.put(value))
            }
        }
    }

    /// Through references to what they refer to.
    pub(super) fn dereferenced(&self, mut place: Place) -> Result<Place, Wrong> {
        loop {
            let inner = match &*self.machine.look(&place)? {
                Value::Place(inner) => inner.clone(),
                _ => return Ok(place),
            };
            place = inner;
        }
    }

    fn constant(&mut self, name: &str) -> Result<Place, Wrong> {
        if let Some(place) = self.constants.get(name) {
            return Ok(place.clone());
        }
        let value = match (self.unit.constants.get(name), name) {
            (Some((of, expr)), _) => {
                let value = self.value(expr, kind_of(of));
                value.map_err(|(_, message)| format!("in `{name}`: {message}"))?
            }
            (None, "f32::MIN") => Value::Number(
                self.machine
                    .integer(u64::from(f32::MIN.to_bits()), Kind::Float(policy::Scalar::F32)),
            ),
            (None, "f64::MIN") => Value::Number(
                self.machine
                    .integer(f64::MIN.to_bits(), Kind::Float(policy::Scalar::F64)),
            ),
            (None, "i32::MIN") => Value::Number(self.machine.integer(1 << 31, crate::machine::I32)),
            _ => return Err(format!("the name `{name}`")),
        };
        let place = self.machine.put(value);
        self.constants.insert(name.to_owned(), place.clone());
        Ok(place)
    }

    fn record(&mut self, literal: &syn::ExprStruct) -> Result<Value, Fault> {
        let name = joined(&literal.path);
        let name = if name == "Self" { "Controller" } else { &name };
        let types = self.unit.records.get(name).cloned();
        let types = types.ok_or_else(|| at(literal, format!("the type `{name}`")))?;
        let mut members = match &literal.rest {
            Some(rest) => match self.value(rest, None)? {
                Value::Record(members) => members,
                _ => return Err(at(rest, "a rest that is no record")),
            },
            None => BTreeMap::new(),
        };
        for field in &literal.fields {
            let Member::Named(name) = &field.member else {
                return Err(at(field, "a member without a name"));
            };
            let name = name.to_string();
            let of = types
                .get(&name)
                .ok_or_else(|| at(field, format!("no member `{name}`")))?;
            let value = self.value(&field.expr, kind_of(of))?;
            if let (Some(kind), Value::Number(number)) = (kind_of(of), &value)
                && number.kind != kind
            {
                return Err(at(field, "a value of another type than its member"));
            }
            members.insert(name, value);
        }
        Ok(Value::Record(members))
    }

    fn turns(&mut self, turns: &syn::ExprForLoop) -> Result<Value, Fault> {
        let items = self.value(&turns.expr, None)?;
        for item in self.items(items).map_err(|message| at(&turns.expr, message))? {
            let names = self.names.clone();
            self.bind(&turns.pat, item)?;
            self.block(&turns.body, None)?;
            self.names = names;
        }
        Ok(nothing())
    }

    fn branch(&mut self, branch: &syn::ExprIf) -> Result<Value, Fault> {
        let condition = self.number(&branch.cond, Some(Kind::Truth))?;
        if condition.kind != Kind::Truth || branch.else_branch.is_some() {
            return Err(at(branch, "a branch of another form than `if condition { ... }`"));
        }
        let before = self.machine.clone();
        self.block(&branch.then_branch, None)?;
        self.machine
            .merge(condition.term, before)
            .map_err(|message| at(branch, message))?;
        Ok(nothing())
    }
}
