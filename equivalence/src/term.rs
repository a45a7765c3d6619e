//! Terms of SMT: bit vectors and truth values, every term once.
//!
//! A number of the format is a bit vector, its bit pattern. Rounded sums, products and conversions are uninterpreted functions over
//! patterns; comparisons are defined on the bits (`smt`), and a claim of its own shows that this definition is the one of IEEE 754.
//! Terms fold what is constant, so that loops with fixed bounds can be walked, and what [`simplify`](crate::simplify) knows: everything
//! else is left to the solver.

use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};
use std::rc::Rc;

/// A term of a [`Terms`]; without meaning in another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) struct Term(u32);

impl Term {
    /// Its place in the order of the store: behind those of its parts.
    pub(crate) fn number(self) -> u32 {
        self.0
    }
}

/// What a term is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Sort {
    /// True or false.
    Truth,
    /// A bit vector of that many bits, at most 64.
    Bits(u32),
}

/// How a term comes from others.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) enum Op {
    /// A constant; of a truth value 0 or 1.
    Constant(u64),
    /// Any value: an input of the goal.
    Input(String),
    /// An uninterpreted function.
    Call(&'static str),
    /// A comparison of two bit patterns as numbers of IEEE 754.
    Float(Comparison),
    Not,
    And,
    Or,
    Choose,
    Equal,
    /// Operations on bit vectors, by their names in SMT-LIB.
    Bits(&'static str),
    Extract(u32, u32),
    ZeroExtend(u32),
    SignExtend(u32),
}

/// Comparisons of IEEE 754: false if one side is NaN.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Comparison {
    Less,
    LessOrEqual,
    Equal,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(crate) struct Node {
    pub op: Op,
    pub args: Vec<Term>,
    pub sort: Sort,
}

#[derive(Debug, Default)]
struct Store {
    nodes: Vec<Rc<Node>>,
    index: HashMap<Rc<Node>, Term, BuildHasherDefault<Mixed>>,
    /// Truths whose opposite was made, both ways.
    opposites: HashMap<Term, Term, BuildHasherDefault<Mixed>>,
}

/// A hash by one multiplication a word: whose keys come out of one file has nobody to defend against, and a run makes them by the
/// hundred thousand.
#[derive(Debug, Default)]
struct Mixed(u64);

impl Mixed {
    fn word(&mut self, word: u64) {
        // 2^64 by the golden ratio, odd
        self.0 = (self.0.rotate_left(5) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
}

impl Hasher for Mixed {
    fn write(&mut self, bytes: &[u8]) {
        for word in bytes.chunks(8) {
            let mut whole = [0; 8];
            whole[..word.len()].copy_from_slice(word);
            self.word(u64::from_le_bytes(whole));
        }
    }

    fn write_u8(&mut self, number: u8) {
        self.word(number.into());
    }

    fn write_u32(&mut self, number: u32) {
        self.word(number.into());
    }

    fn write_u64(&mut self, number: u64) {
        self.word(number);
    }

    fn write_usize(&mut self, number: usize) {
        self.word(number as u64);
    }

    fn write_isize(&mut self, number: isize) {
        self.word(number as u64);
    }

    fn finish(&self) -> u64 {
        // a table looks at the lowest bits, and a product mixes the highest
        self.0 ^ (self.0 >> 32)
    }
}

/// The store of all terms of a run: equal terms are one, which is what lets both sides of a goal meet.
#[derive(Debug, Default)]
pub(crate) struct Terms {
    store: RefCell<Store>,
}

/// The lowest `width` bits.
pub(crate) fn mask(width: u32) -> u64 {
    match width {
        64.. => u64::MAX,
        _ => (1 << width) - 1,
    }
}

fn signed(value: u64, width: u32) -> i64 {
    let unused = 64 - width.min(64);
    ((value << unused) as i64) >> unused
}

impl Terms {
    /// The term as it stands, without any rule.
    pub(crate) fn make(&self, op: Op, args: Vec<Term>, sort: Sort) -> Term {
        let node = Rc::new(Node { op, args, sort });
        let mut store = self.store.borrow_mut();
        if let Some(term) = store.index.get(&node) {
            return *term;
        }
        // 2^32 terms would need a terabyte: memory ends first
        let term = Term(store.nodes.len() as u32);
        store.nodes.push(Rc::clone(&node));
        store.index.insert(node, term);
        term
    }

    /// How `term` was made.
    pub(crate) fn node(&self, term: Term) -> Rc<Node> {
        Rc::clone(&self.store.borrow().nodes[term.0 as usize])
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.store.borrow().nodes.len()
    }

    /// The term of that [`number`](Term::number).
    pub(crate) fn at(&self, number: usize) -> Term {
        // as in `make`
        Term(number as u32)
    }

    pub(crate) fn sort(&self, term: Term) -> Sort {
        self.store.borrow().nodes[term.0 as usize].sort
    }

    /// Width of a bit vector; 0 for a truth value.
    pub(crate) fn width(&self, term: Term) -> u32 {
        match self.sort(term) {
            Sort::Bits(width) => width,
            Sort::Truth => 0,
        }
    }

    /// The value of a constant.
    pub(crate) fn known(&self, term: Term) -> Option<u64> {
        match self.store.borrow().nodes[term.0 as usize].op {
            Op::Constant(value) => Some(value),
            _ => None,
        }
    }

    pub(crate) fn truth(&self, value: bool) -> Term {
        self.make(Op::Constant(u64::from(value)), Vec::new(), Sort::Truth)
    }

    pub(crate) fn bits(&self, value: u64, width: u32) -> Term {
        self.make(Op::Constant(value & mask(width)), Vec::new(), Sort::Bits(width))
    }

    pub(crate) fn input(&self, name: &str, width: u32) -> Term {
        self.make(Op::Input(name.to_owned()), Vec::new(), Sort::Bits(width))
    }

    /// Uninterpreted function. Its name carries the widths, so that a name has one signature.
    pub(crate) fn call(&self, name: &'static str, args: &[Term], width: u32) -> Term {
        self.make(Op::Call(name), args.to_vec(), Sort::Bits(width))
    }

    pub(crate) fn compare(&self, comparison: Comparison, x: Term, y: Term) -> Term {
        self.simple_compare(comparison, x, y)
            .unwrap_or_else(|| self.make(Op::Float(comparison), vec![x, y], Sort::Truth))
    }

    /// The opposite of a truth, if it was made.
    pub(crate) fn opposite(&self, x: Term) -> Option<Term> {
        self.store.borrow().opposites.get(&x).copied()
    }

    /// Keeps that two truths are opposites; what was kept first stays.
    pub(crate) fn keep_opposites(&self, x: Term, y: Term) {
        let mut store = self.store.borrow_mut();
        store.opposites.entry(x).or_insert(y);
        store.opposites.entry(y).or_insert(x);
    }

    pub(crate) fn choose(&self, condition: Term, yes: Term, no: Term) -> Term {
        match self.known(condition) {
            Some(0) => no,
            Some(_) => yes,
            None => self
                .simple_choice(condition, yes, no)
                .unwrap_or_else(|| self.make(Op::Choose, vec![condition, yes, no], self.sort(yes))),
        }
    }

    /// The same bits (or the same truth): not the equality of numbers.
    pub(crate) fn equal(&self, x: Term, y: Term) -> Term {
        match (self.known(x), self.known(y)) {
            (Some(a), Some(b)) => self.truth(a == b),
            _ => self
                .simple_equal(x, y)
                .unwrap_or_else(|| self.make(Op::Equal, vec![x, y], Sort::Truth)),
        }
    }

    /// Two-sided operations of one width: `bvadd`, `bvand`, ...
    pub(crate) fn binary(&self, name: &'static str, x: Term, y: Term) -> Term {
        let width = self.width(x);
        let [x, y] = self.in_order(name, x, y);
        if let (Some(a), Some(b)) = (self.known(x), self.known(y))
            && let Some(value) = fold(name, a, b, width)
        {
            return self.bits(value, width);
        }
        self.simple_binary(name, x, y)
            .unwrap_or_else(|| self.make(Op::Bits(name), vec![x, y], Sort::Bits(width)))
    }

    /// `bvnot`, `bvneg`.
    pub(crate) fn unary(&self, name: &'static str, x: Term) -> Term {
        let width = self.width(x);
        match (name, self.known(x)) {
            ("bvnot", Some(a)) => self.bits(!a, width),
            ("bvneg", Some(a)) => self.bits(a.wrapping_neg(), width),
            _ => self
                .simple_unary(name, x)
                .unwrap_or_else(|| self.make(Op::Bits(name), vec![x], Sort::Bits(width))),
        }
    }

    /// Orders of integers: `bvult`, `bvule`, `bvslt`, `bvsle`; of a strict one the opposite is made.
    pub(crate) fn order(&self, name: &'static str, x: Term, y: Term) -> Term {
        let width = self.width(x);
        if let (Some(a), Some(b)) = (self.known(x), self.known(y)) {
            let (s, t) = (signed(a, width), signed(b, width));
            return self.truth(match name {
                "bvult" => a < b,
                "bvule" => a <= b,
                "bvslt" => s < t,
                _ => s <= t,
            });
        }
        match name {
            // one word for one order
            "bvult" => self.not(self.order("bvule", y, x)),
            "bvslt" => self.not(self.order("bvsle", y, x)),
            _ => self.make(Op::Bits(name), vec![x, y], Sort::Truth),
        }
    }

    pub(crate) fn extract(&self, x: Term, high: u32, low: u32) -> Term {
        let width = high - low + 1;
        match self.known(x) {
            Some(value) => self.bits(value >> low, width),
            None if width == self.width(x) => x,
            None => self
                .each_constant(x, |constant| self.extract(constant, high, low))
                .unwrap_or_else(|| self.make(Op::Extract(high, low), vec![x], Sort::Bits(width))),
        }
    }

    /// To `width` bits: cut, or extended with zeros or with the sign.
    pub(crate) fn resize(&self, x: Term, width: u32, sign: bool) -> Term {
        let from = self.width(x);
        match self.known(x) {
            _ if width == from => x,
            _ if width < from => self.extract(x, width - 1, 0),
            Some(value) if sign => self.bits(signed(value, from) as u64, width),
            Some(value) => self.bits(value, width),
            None => self
                .each_constant(x, |constant| self.resize(constant, width, sign))
                .unwrap_or_else(|| {
                    let op = match sign {
                        true => Op::SignExtend(width - from),
                        false => Op::ZeroExtend(width - from),
                    };
                    self.make(op, vec![x], Sort::Bits(width))
                }),
        }
    }

    /// 1 or 0 of that width.
    pub(crate) fn number(&self, truth: Term, width: u32) -> Term {
        self.choose(truth, self.bits(1, width), self.bits(0, width))
    }
}

fn fold(name: &str, a: u64, b: u64, width: u32) -> Option<u64> {
    let amount = u32::try_from(b).ok().filter(|b| *b < width);
    Some(match name {
        "bvadd" => a.wrapping_add(b),
        "bvsub" => a.wrapping_sub(b),
        "bvmul" => a.wrapping_mul(b),
        "bvand" => a & b,
        "bvor" => a | b,
        "bvxor" => a ^ b,
        "bvshl" => a << amount?,
        "bvlshr" => a >> amount?,
        "bvashr" => (signed(a, width) >> amount?) as u64,
        "bvudiv" => a.checked_div(b)?,
        "bvurem" => a.checked_rem(b)?,
        _ => return None,
    })
}
