//! What both languages do alike: typed numbers as terms, aggregates, places in memory, and the merge of two courses.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;

use policy::Scalar;

use crate::float::{Float, width};
use crate::term::{Term, Terms};

/// Type of a scalar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Float(Scalar),
    Integer { bits: u32, signed: bool },
    Truth,
}

pub(crate) const U32: Kind = Kind::Integer {
    bits: 32,
    signed: false,
};
pub(crate) const I32: Kind = Kind::Integer { bits: 32, signed: true };
pub(crate) const U64: Kind = Kind::Integer {
    bits: 64,
    signed: false,
};

impl Kind {
    /// Width as a bit vector.
    pub(crate) fn width(self) -> u32 {
        match self {
            Kind::Float(format) => width(format),
            Kind::Integer { bits, .. } => bits,
            Kind::Truth => 0,
        }
    }
}

/// A scalar with its type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Number {
    pub term: Term,
    pub kind: Kind,
}

/// What a variable holds.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    Number(Number),
    Record(BTreeMap<String, Value>),
    List(Vec<Value>),
    /// Members that share their bits, and what is in them.
    Union(BTreeMap<String, Kind>, Option<Term>),
    /// Address or reference.
    Place(Place),
    /// Not written yet; to read it is refused.
    Unset(Option<Kind>),
}

/// A part of a variable.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Place {
    pub root: usize,
    pub steps: Vec<Step>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Step {
    Member(String),
    Element(usize),
}

impl Place {
    pub(crate) fn member(mut self, name: &str) -> Self {
        self.steps.push(Step::Member(name.to_owned()));
        self
    }

    pub(crate) fn element(mut self, index: usize) -> Self {
        self.steps.push(Step::Element(index));
        self
    }
}

/// Why a text is refused; the place is added where it is known.
pub(crate) type Wrong = String;

/// Operations of two numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Binary {
    Add,
    Sub,
    Mul,
    Div,
    And,
    Or,
    Xor,
    Shl,
    Shr,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
    Equal,
    NotEqual,
}

/// Variables, and what has to hold so that their use is defined.
#[derive(Clone)]
pub(crate) struct Machine<'a> {
    pub terms: &'a Terms,
    pub float: Float<'a>,
    pub store: Vec<Value>,
    /// Each must be true: an index inside of its table, a sum of signed numbers without overflow.
    pub obligations: Vec<Term>,
}

impl<'a> Machine<'a> {
    pub(crate) fn new(float: Float<'a>) -> Self {
        Machine {
            terms: float.terms,
            float,
            store: Vec::new(),
            obligations: Vec::new(),
        }
    }

    /// A new variable.
    pub(crate) fn put(&mut self, value: Value) -> Place {
        self.store.push(value);
        Place {
            root: self.store.len() - 1,
            steps: Vec::new(),
        }
    }

    pub(crate) fn read(&self, place: &Place) -> Result<Value, Wrong> {
        self.look(place).map(Cow::into_owned)
    }

    /// What [`read`](Self::read) gives, without a copy of it: a state is long, and most of those who ask want one number of it.
    pub(crate) fn look(&self, place: &Place) -> Result<Cow<'_, Value>, Wrong> {
        let mut value = self.store.get(place.root).ok_or("a place outside of memory")?;
        for step in &place.steps {
            value = match (step, value) {
                (Step::Member(name), Value::Record(members)) => {
                    members.get(name).ok_or_else(|| format!("no member `{name}`"))?
                }
                (Step::Member(name), Value::Union(members, bits)) => {
                    let kind = *members.get(name).ok_or_else(|| format!("no member `{name}`"))?;
                    // nobody can compute with what is not set
                    return Ok(Cow::Owned(match *bits {
                        Some(term) => Value::Number(Number { term, kind }),
                        None => Value::Unset(Some(kind)),
                    }));
                }
                (Step::Element(index), Value::List(elements)) => {
                    let length = elements.len();
                    elements
                        .get(*index)
                        .ok_or_else(|| format!("element {index} of an array of {length}"))?
                }
                (step, _) => return Err(format!("{step} of something that has none")),
            };
        }
        Ok(Cow::Borrowed(value))
    }

    pub(crate) fn write(&mut self, place: &Place, new: Value) -> Result<(), Wrong> {
        let mut value = self.store.get_mut(place.root).ok_or("a place outside of memory")?;
        for step in &place.steps {
            value = match (step, value) {
                (Step::Member(name), Value::Record(members)) => {
                    members.get_mut(name).ok_or_else(|| format!("no member `{name}`"))?
                }
                (Step::Member(name), Value::Union(members, bits)) => {
                    let kind = *members.get(name).ok_or_else(|| format!("no member `{name}`"))?;
                    let Value::Number(number) = new else {
                        return Err("a union takes numbers".into());
                    };
                    if number.kind != kind {
                        return Err(format!("`{name}` takes another type"));
                    }
                    *bits = Some(number.term);
                    return Ok(());
                }
                (Step::Element(index), Value::List(elements)) => {
                    let length = elements.len();
                    elements
                        .get_mut(*index)
                        .ok_or_else(|| format!("element {index} of an array of {length}"))?
                }
                (step, _) => return Err(format!("{step} of something that has none")),
            };
        }
        if let (Some(old), Value::Number(number)) = (kind_of(value), &new)
            && old != number.kind
        {
            return Err("the value has another type than its place".into());
        }
        *value = new;
        Ok(())
    }

    /// The element of a list at an index that need not be known: one of all, and the index must be inside.
    pub(crate) fn element(&mut self, list: &Place, index: Number) -> Result<Value, Wrong> {
        let list = self.look(list)?;
        let Value::List(elements) = &*list else {
            return Err("an index into something that is no array".into());
        };
        if let Some(known) = self.terms.known(index.term) {
            let found = usize::try_from(known).ok().and_then(|index| elements.get(index));
            return found
                .cloned()
                .ok_or_else(|| format!("element {known} of an array of {}", elements.len()));
        }
        let width = self.terms.width(index.term);
        let inside = self
            .terms
            .order("bvult", index.term, self.terms.bits(elements.len() as u64, width));
        let numbers: Vec<Number> = elements.iter().map(number).collect::<Result<_, _>>()?;
        let mut chosen = *numbers.last().ok_or("an index into an empty array")?;
        let entries: Vec<Term> = numbers.iter().map(|number| number.term).collect();
        chosen.term = self.terms.entry(index.term, &entries).unwrap_or(chosen.term);
        self.obligations.push(inside);
        Ok(Value::Number(chosen))
    }

    pub(crate) fn integer(&self, value: u64, kind: Kind) -> Number {
        Number {
            term: self.terms.bits(value, kind.width()),
            kind,
        }
    }

    /// A decimal literal, rounded to the format once.
    pub(crate) fn decimal(&self, text: &str, format: Scalar) -> Result<Number, Wrong> {
        let wrong = || format!("`{text}` is no number");
        let bits = match format {
            Scalar::F32 => u64::from(text.parse::<f32>().map_err(|_| wrong())?.to_bits()),
            Scalar::F64 => text.parse::<f64>().map_err(|_| wrong())?.to_bits(),
        };
        Ok(self.integer(bits, Kind::Float(format)))
    }

    pub(crate) fn truth(&self, term: Term) -> Number {
        Number {
            term,
            kind: Kind::Truth,
        }
    }

    /// An operation on two numbers of one type; of integers modulo their width.
    pub(crate) fn binary(&self, op: Binary, x: Number, y: Number) -> Result<Number, Wrong> {
        let shifts = matches!(op, Binary::Shl | Binary::Shr);
        if x.kind != y.kind && !shifts {
            return Err(format!("operands of two types, {:?} and {:?}", x.kind, y.kind));
        }
        match x.kind {
            Kind::Float(format) if format == self.float.format => self.on_floats(op, x, y),
            Kind::Float(_) => Err("arithmetic in another format than the policy's".into()),
            Kind::Integer { bits, signed } => self.on_integers(op, x, y, bits, signed),
            Kind::Truth => self.on_truths(op, x, y),
        }
    }

    fn on_floats(&self, op: Binary, x: Number, y: Number) -> Result<Number, Wrong> {
        let (float, a, b) = (self.float, x.term, y.term);
        let term = match op {
            Binary::Add => float.add(a, b),
            Binary::Sub => float.sub(a, b),
            Binary::Mul => float.mul(a, b),
            Binary::Div => float.div(a, b),
            Binary::Less => return Ok(self.truth(float.lt(a, b))),
            Binary::LessOrEqual => return Ok(self.truth(float.le(a, b))),
            Binary::Greater => return Ok(self.truth(float.gt(a, b))),
            Binary::GreaterOrEqual => return Ok(self.truth(float.ge(a, b))),
            Binary::Equal => return Ok(self.truth(float.eq(a, b))),
            Binary::NotEqual => return Ok(self.truth(self.terms.not(float.eq(a, b)))),
            _ => return Err(format!("{op:?} of real numbers")),
        };
        Ok(Number { term, kind: x.kind })
    }

    fn on_integers(&self, op: Binary, x: Number, y: Number, bits: u32, signed: bool) -> Result<Number, Wrong> {
        let (terms, a, b) = (self.terms, x.term, y.term);
        let (less, less_or_equal, shift) = match signed {
            true => ("bvslt", "bvsle", "bvashr"),
            false => ("bvult", "bvule", "bvlshr"),
        };
        let shifted = |name| {
            // a shift by the width or more is undefined in C and a panic in Rust
            let amount = terms.known(b).filter(|amount| *amount < u64::from(bits));
            let amount = amount.ok_or("a shift by something that is not a number below the width")?;
            Ok::<Term, Wrong>(terms.binary(name, a, terms.bits(amount, bits)))
        };
        let term = match op {
            Binary::Add => terms.binary("bvadd", a, b),
            Binary::Sub => terms.binary("bvsub", a, b),
            Binary::Mul => terms.binary("bvmul", a, b),
            Binary::Div => return Err("a division of integers".into()),
            Binary::And => terms.binary("bvand", a, b),
            Binary::Or => terms.binary("bvor", a, b),
            Binary::Xor => terms.binary("bvxor", a, b),
            Binary::Shl => shifted("bvshl")?,
            Binary::Shr => shifted(shift)?,
            Binary::Less => return Ok(self.truth(terms.order(less, a, b))),
            Binary::LessOrEqual => return Ok(self.truth(terms.order(less_or_equal, a, b))),
            Binary::Greater => return Ok(self.truth(terms.order(less, b, a))),
            Binary::GreaterOrEqual => return Ok(self.truth(terms.order(less_or_equal, b, a))),
            Binary::Equal => return Ok(self.truth(terms.equal(a, b))),
            Binary::NotEqual => return Ok(self.truth(terms.not(terms.equal(a, b)))),
        };
        Ok(Number { term, kind: x.kind })
    }

    fn on_truths(&self, op: Binary, x: Number, y: Number) -> Result<Number, Wrong> {
        let (terms, a, b) = (self.terms, x.term, y.term);
        Ok(self.truth(match op {
            Binary::And => terms.and(a, b),
            Binary::Or => terms.or(a, b),
            Binary::Equal => terms.equal(a, b),
            Binary::Xor | Binary::NotEqual => terms.not(terms.equal(a, b)),
            _ => return Err(format!("{op:?} of conditions")),
        }))
    }

    /// A conversion of value: between integers modulo the width, of a condition to 0 or 1, of an i32 to the format.
    pub(crate) fn convert(&self, x: Number, kind: Kind) -> Result<Number, Wrong> {
        let terms = self.terms;
        let term = match (x.kind, kind) {
            (from, to) if from == to => x.term,
            (Kind::Integer { signed, .. }, Kind::Integer { bits, .. }) => terms.resize(x.term, bits, signed),
            (Kind::Truth, Kind::Integer { bits, .. }) => terms.number(x.term, bits),
            (I32, Kind::Float(format)) if format == self.float.format => self.float.of_i32(x.term),
            (from, to) => return Err(format!("a conversion of {from:?} to {to:?}")),
        };
        Ok(Number { term, kind })
    }

    /// The same bits as another type.
    pub(crate) fn reinterpret(&self, x: Number, kind: Kind) -> Result<Number, Wrong> {
        match x.kind.width() == kind.width() {
            true => Ok(Number { term: x.term, kind }),
            false => Err("bits of another width".into()),
        }
    }

    /// Memory where `condition` decided between `self` and `other`, which began as copies of one.
    pub(crate) fn merge(&mut self, condition: Term, other: Machine<'a>) -> Result<(), Wrong> {
        let obligations = other.obligations.into_iter().skip(self.obligations.len());
        // stricter than need be: what either course asks for has to hold in both
        self.obligations.extend(obligations);
        for (mine, theirs) in self.store.iter_mut().zip(other.store) {
            merge_values(self.terms, condition, mine, theirs)?;
        }
        Ok(())
    }
}

fn merge_values(terms: &Terms, condition: Term, mine: &mut Value, theirs: Value) -> Result<(), Wrong> {
    match (mine, theirs) {
        (mine, theirs) if *mine == theirs => Ok(()),
        (Value::Number(mine), Value::Number(theirs)) if mine.kind == theirs.kind => {
            mine.term = terms.choose(condition, mine.term, theirs.term);
            Ok(())
        }
        (Value::Record(mine), Value::Record(theirs)) => {
            let pairs = mine.values_mut().zip(theirs.into_values());
            pairs
                .into_iter()
                .try_for_each(|(mine, theirs)| merge_values(terms, condition, mine, theirs))
        }
        (Value::List(mine), Value::List(theirs)) => {
            let pairs = mine.iter_mut().zip(theirs);
            pairs
                .into_iter()
                .try_for_each(|(mine, theirs)| merge_values(terms, condition, mine, theirs))
        }
        _ => Err("a branch that leaves memory in two forms".into()),
    }
}

fn kind_of(value: &Value) -> Option<Kind> {
    match value {
        Value::Number(number) => Some(number.kind),
        Value::Unset(kind) => *kind,
        _ => None,
    }
}

/// The number in `value`.
pub(crate) fn number(value: &Value) -> Result<Number, Wrong> {
    match value {
        Value::Number(number) => Ok(*number),
        Value::Unset(_) => Err("a read before anything was written".into()),
        _ => Err("an aggregate where a number is needed".into()),
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Step::Member(name) => write!(f, "member `{name}`"),
            Step::Element(index) => write!(f, "element {index}"),
        }
    }
}
