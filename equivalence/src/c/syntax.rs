//! The emitted subset of C as a tree.

use crate::machine::Binary;

/// A type by its name; pointers are places and carry none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Type {
    pub name: String,
    pub pointer: bool,
}

#[derive(Debug, Clone)]
pub(crate) enum Expr {
    /// Value and whether it is unsigned.
    Integer(u64, bool),
    /// Digits without suffix, and whether the suffix was `f`.
    Decimal(String, bool),
    Name(String),
    Call(String, Vec<Expr>),
    /// `x.member`, or `x->member` if the flag is set.
    Member(Box<Expr>, String, bool),
    Index(Box<Expr>, Box<Expr>),
    Minus(Box<Expr>),
    /// `~x`
    Complement(Box<Expr>),
    AddressOf(Box<Expr>),
    Deref(Box<Expr>),
    Cast(Type, Box<Expr>),
    Binary(Binary, Box<Expr>, Box<Expr>),
    Choose(Box<Expr>, Box<Expr>, Box<Expr>),
    /// `sizeof(name)`; as an argument of a copy only
    SizeOf,
}

#[derive(Debug, Clone)]
pub(crate) struct Statement {
    pub line: usize,
    pub what: What,
}

#[derive(Debug, Clone)]
pub(crate) enum What {
    Declare {
        kind: Type,
        name: String,
        length: Option<Expr>,
        first: Option<Expr>,
    },
    /// The operator of `x |= y`; none of `x = y`.
    Assign(Expr, Option<Binary>, Expr),
    Evaluate(Expr),
    For {
        start: Box<Statement>,
        condition: Expr,
        step: Box<Statement>,
        body: Vec<Statement>,
    },
    If(Expr, Vec<Statement>, Vec<Statement>),
    Return(Option<Expr>),
    Block(Vec<Statement>),
    /// Assembly without an instruction: the optimiser must not look through it.
    Barrier,
}

/// A function: parameters by type and name, and its statements.
#[derive(Debug, Clone)]
pub(crate) struct Function {
    pub parameters: Vec<(Type, String)>,
    pub result: Type,
    pub body: Vec<Statement>,
}

/// A member of a record: type, name, length of an array.
#[derive(Debug, Clone)]
pub(crate) struct Member {
    pub kind: Type,
    pub name: String,
    pub length: Option<Expr>,
}
