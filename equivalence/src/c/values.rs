//! Expressions of the emitted C: values, conversions and places.

use std::collections::BTreeMap;

use super::execute::{MOST_TURNS, Walk};
use super::syntax::{Expr, Type};
use super::unit::scalar;
use crate::machine::{Binary, I32, Kind, Number, Place, Step, U32, Value, Wrong, number};

impl Walk<'_, '_> {
    pub(super) fn number(&mut self, expr: &Expr) -> Result<Number, Wrong> {
        number(&self.value(expr)?)
    }

    pub(super) fn value(&mut self, expr: &Expr) -> Result<Value, Wrong> {
        Ok(Value::Number(match expr {
            Expr::Integer(value, unsigned) => {
                let kind = match (unsigned, *value > u64::from(u32::MAX)) {
                    (true, false) => U32,
                    (false, false) if *value <= i32::MAX as u64 => I32,
                    _ => return Err(format!("the number {value} without a type of its width")),
                };
                self.machine.integer(*value, kind)
            }
            Expr::Decimal(text, is_float) => {
                let format = if *is_float {
                    policy::Scalar::F32
                } else {
                    policy::Scalar::F64
                };
                self.machine.decimal(text, format)?
            }
            Expr::Name(_) | Expr::Member(..) | Expr::Deref(_) => return self.load(expr),
            Expr::Index(base, index) => return self.indexed(base, index),
            Expr::AddressOf(inner) => return Ok(Value::Place(self.place(inner)?)),
            Expr::Call(name, arguments) if name.starts_with("__builtin_fabs") => self.magnitude(arguments)?,
            Expr::Call(..) => return self.effect(expr)?.ok_or_else(|| "a call without a value".into()),
            Expr::Minus(inner) => self.minus(inner)?,
            Expr::Complement(inner) => {
                let x = self.promoted(inner)?;
                let term = self.machine.terms.unary("bvnot", x.term);
                Number { term, kind: x.kind }
            }
            Expr::Cast(kind, inner) => {
                let kind = scalar(&kind.name)
                    .filter(|_| !kind.pointer)
                    .ok_or("a cast to this type")?;
                let value = self.number(inner)?;
                self.machine.convert(value, kind)?
            }
            Expr::Binary(op, x, y) => {
                let (x, y) = (self.number(x)?, self.number(y)?);
                self.binary(*op, x, y)?
            }
            Expr::Choose(condition, yes, no) => {
                let condition = self.condition(condition)?;
                let (yes, no) = (self.number(yes)?, self.number(no)?);
                let (yes, no) = self.arithmetic(yes, no)?;
                let term = self.machine.terms.choose(condition, yes.term, no.term);
                Number { term, kind: yes.kind }
            }
            Expr::SizeOf => return Err("a size outside of a copy".into()),
        }))
    }

    /// Without its sign, exact.
    fn magnitude(&mut self, arguments: &[Expr]) -> Result<Number, Wrong> {
        let [only] = arguments else {
            return Err("a magnitude of more than one number".into());
        };
        let x = self.number(only)?;
        match x.kind {
            Kind::Float(format) if format == self.machine.float.format => {
                let rest = self.machine.terms.unary("bvnot", self.machine.float.sign());
                let term = self.machine.terms.binary("bvand", x.term, rest);
                Ok(Number { term, kind: x.kind })
            }
            _ => Err("the magnitude of something that is no number of the format".into()),
        }
    }

    pub(super) fn minus(&mut self, inner: &Expr) -> Result<Number, Wrong> {
        let x = self.promoted(inner)?;
        match x.kind {
            Kind::Float(_) => Ok(Number {
                term: self.machine.terms.binary("bvxor", x.term, self.machine.float.sign()),
                kind: x.kind,
            }),
            kind => {
                let zero = self.machine.integer(0, kind);
                self.binary(Binary::Sub, zero, x)
            }
        }
    }

    pub(super) fn promoted(&mut self, expr: &Expr) -> Result<Number, Wrong> {
        let x = self.number(expr)?;
        self.promote(x)
    }

    /// What is narrower than an `int` becomes one.
    pub(super) fn promote(&self, x: Number) -> Result<Number, Wrong> {
        match x.kind {
            Kind::Integer { bits, .. } if bits < 32 => self.machine.convert(x, I32),
            _ => Ok(x),
        }
    }

    /// The usual arithmetic conversions, of integers alone: the emitted code casts wherever a float is involved.
    pub(super) fn arithmetic(&self, x: Number, y: Number) -> Result<(Number, Number), Wrong> {
        let (x, y) = (self.promote(x)?, self.promote(y)?);
        let (Kind::Integer { bits: a, signed: s }, Kind::Integer { bits: b, signed: t }) = (x.kind, y.kind) else {
            return Ok((x, y));
        };
        let signed = match a.cmp(&b) {
            std::cmp::Ordering::Equal => s && t,
            std::cmp::Ordering::Greater => s,
            std::cmp::Ordering::Less => t,
        };
        let kind = Kind::Integer { bits: a.max(b), signed };
        Ok((self.machine.convert(x, kind)?, self.machine.convert(y, kind)?))
    }

    pub(super) fn binary(&mut self, op: Binary, x: Number, y: Number) -> Result<Number, Wrong> {
        let (x, y) = match op {
            Binary::Shl | Binary::Shr => (self.promote(x)?, self.promote(y)?),
            _ => self.arithmetic(x, y)?,
        };
        self.no_overflow(op, x, y);
        let result = self.machine.binary(op, x, y)?;
        match result.kind {
            // a comparison is an int
            Kind::Truth => self.machine.convert(result, I32),
            _ => Ok(result),
        }
    }

    /// Overflow of signed numbers is undefined.
    pub(super) fn no_overflow(&mut self, op: Binary, x: Number, y: Number) {
        let (Kind::Integer { bits, signed: true }, Binary::Add | Binary::Sub | Binary::Mul) = (x.kind, op) else {
            return;
        };
        let terms = self.machine.terms;
        let name = match op {
            Binary::Add => "bvadd",
            Binary::Sub => "bvsub",
            _ => "bvmul",
        };
        // 64 bits hold sum and product of two numbers of 32
        let wide = terms.binary(name, terms.resize(x.term, 64, true), terms.resize(y.term, 64, true));
        let narrow = terms.resize(terms.extract(wide, bits - 1, 0), 64, true);
        self.machine.obligations.push(terms.equal(wide, narrow));
    }

    pub(super) fn implicitly(&self, x: Number, kind: Kind) -> Result<Number, Wrong> {
        match (x.kind, kind) {
            (Kind::Integer { .. }, Kind::Integer { .. }) => self.machine.convert(x, kind),
            (from, to) if from == to => Ok(x),
            _ => Err("a conversion without a cast".into()),
        }
    }

    pub(super) fn as_type(&self, kind: &Type, value: Value) -> Result<Value, Wrong> {
        match (scalar(&kind.name), &value) {
            (Some(to), Value::Number(x)) if !kind.pointer => Ok(Value::Number(self.implicitly(*x, to)?)),
            (_, Value::Place(_)) if kind.pointer => Ok(value),
            _ => Err(format!("a value that is no `{}`", kind.name)),
        }
    }

    pub(super) fn load(&mut self, expr: &Expr) -> Result<Value, Wrong> {
        let place = self.place(expr)?;
        match &*self.machine.look(&place)? {
            // an array stands for the address of its first element
            Value::List(_) => Ok(Value::Place(place.element(0))),
            Value::Unset(_) => Err("a read before anything was written".into()),
            value => Ok(value.clone()),
        }
    }

    pub(super) fn indexed(&mut self, base: &Expr, index: &Expr) -> Result<Value, Wrong> {
        let index = self.number(index)?;
        let base = self.value(base)?;
        if self.machine.terms.known(index.term).is_some() {
            let place = self.offset(base, index)?;
            return match self.machine.read(&place)? {
                Value::Unset(_) => Err("a read before anything was written".into()),
                value => Ok(value),
            };
        }
        let Value::Place(mut place) = base else {
            return Err("an index into a value".into());
        };
        match place.steps.pop() {
            Some(Step::Element(0)) => self.machine.element(&place, index),
            _ => Err("an index that depends on the data, into a part of an array".into()),
        }
    }

    pub(super) fn offset(&self, base: Value, index: Number) -> Result<Place, Wrong> {
        let (Value::Place(mut place), Some(by)) = (base, self.machine.terms.known(index.term)) else {
            return Err("an index that depends on the data".into());
        };
        match place.steps.last_mut() {
            Some(Step::Element(at)) => *at += usize::try_from(by).map_err(|_| "an index beyond memory")?,
            _ => return Err("an index into something that is no array".into()),
        }
        Ok(place)
    }

    pub(super) fn place(&mut self, expr: &Expr) -> Result<Place, Wrong> {
        match expr {
            Expr::Name(name) => match self.names.get(name) {
                Some((place, _)) => Ok(place.clone()),
                None => self.table(name),
            },
            Expr::Member(inner, member, false) => Ok(self.place(inner)?.member(member)),
            Expr::Member(inner, member, true) => match self.value(inner)? {
                Value::Place(place) => Ok(place.member(member)),
                _ => Err("`->` behind something that is no address".into()),
            },
            Expr::Index(base, index) => {
                let index = self.number(index)?;
                let base = self.value(base)?;
                self.offset(base, index)
            }
            Expr::Deref(inner) => match self.value(inner)? {
                Value::Place(place) => Ok(place),
                _ => Err("`*` in front of something that is no address".into()),
            },
            _ => Err("something that has no address".into()),
        }
    }

    pub(super) fn table(&mut self, name: &str) -> Result<Place, Wrong> {
        if let Some(place) = self.tables.get(name) {
            return Ok(place.clone());
        }
        let found = self.unit.table(name).ok_or_else(|| format!("the name `{name}`"))?;
        let (kind, numbers) = found.map_err(|(line, message)| {
            self.line = line;
            message
        })?;
        let mut elements = Vec::new();
        for expr in &numbers {
            let value = self.value(expr)?;
            elements.push(self.as_type(&kind, value)?);
        }
        let place = self.machine.put(Value::List(elements));
        self.tables.insert(name.to_owned(), place.clone());
        Ok(place)
    }

    /// What a variable holds before anything is written.
    pub(super) fn empty(&mut self, kind: &Type, length: Option<&Expr>) -> Result<Value, Wrong> {
        if let Some(length) = length {
            let length = self.number(length)?;
            let length = self
                .machine
                .terms
                .known(length.term)
                .and_then(|n| usize::try_from(n).ok());
            let length = length
                .filter(|n| *n <= MOST_TURNS)
                .ok_or("an array of unknown length")?;
            let element = self.empty(kind, None)?;
            return Ok(Value::List(vec![element; length]));
        }
        if kind.pointer {
            return Ok(Value::Unset(None));
        }
        if let Some(scalar) = scalar(&kind.name) {
            return Ok(Value::Unset(Some(scalar)));
        }
        let record = self.unit.record(&kind.name).cloned();
        let record = record.ok_or_else(|| format!("the type `{}`", kind.name))?;
        let scalars = record
            .members
            .iter()
            .map(|m| scalar(&m.kind.name).map(|kind| (m.name.clone(), kind)));
        let is_plain = record.members.iter().all(|member| member.length.is_none());
        match scalars.collect::<Option<BTreeMap<_, _>>>() {
            Some(members) if record.is_union && is_plain => return Ok(Value::Union(members, None)),
            // a union of arrays: only functions outside write and read it, each member whole
            _ => {}
        }
        let mut members = BTreeMap::new();
        for member in &record.members {
            members.insert(member.name.clone(), self.empty(&member.kind, member.length.as_ref())?);
        }
        Ok(Value::Record(members))
    }
}
