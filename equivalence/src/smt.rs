//! Goals as text of SMT-LIB 2.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::{self, Write};

use crate::term::{Comparison, Node, Op, Sort, Term, Terms};

/// How rounded operations are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Arithmetic {
    /// Functions of which nothing is known but that they are functions.
    Uninterpreted,
    /// IEEE 754, round to nearest, ties to even.
    Ieee,
}

/// Names of a script: what a solver is asked for after `sat`.
pub(crate) struct Script {
    pub text: String,
    /// Inputs that the goal depends on, with their widths.
    pub inputs: Vec<(String, u32)>,
    names: Names,
}

/// Names of the inputs and the constants as they are written; all other terms have a number.
#[derive(Default)]
struct Names(BTreeMap<Term, String>);

impl Names {
    fn write(&self, term: Term, text: &mut String) {
        let _ = match self.0.get(&term) {
            Some(name) => text.write_str(name),
            None => write!(text, "t{}", term.number()),
        };
    }
}

impl Script {
    /// The term as it stands in the script.
    pub(crate) fn name(&self, term: Term) -> String {
        let mut name = String::new();
        self.names.write(term, &mut name);
        name
    }
}

/// A script that is unsatisfiable exactly if `claim` follows from `given`. `shown` are defined in it too, for the model.
pub(crate) fn script(terms: &Terms, given: &[Term], claim: Term, shown: &[Term], arithmetic: Arithmetic) -> Script {
    let mut needed = vec![false; terms.count()];
    let roots = given.iter().chain([&claim]).chain(shown);
    let mut open: Vec<Term> = roots.copied().collect();
    while let Some(term) = open.pop() {
        if !std::mem::replace(&mut needed[term.number() as usize], true) {
            open.extend(&terms.node(term).args);
        }
    }
    let logic = match arithmetic {
        Arithmetic::Uninterpreted => "QF_UFBV",
        Arithmetic::Ieee => "QF_BVFP",
    };
    let mut script = Script {
        text: format!("(set-option :produce-models true)\n(set-logic {logic})\n"),
        inputs: Vec::new(),
        names: Names::default(),
    };
    definitions(&mut script.text);
    let mut declared = BTreeSet::new();
    // a term is made behind its parts, so the order of the store is one of definition
    let order = (0..needed.len()).filter(|number| needed[*number]);
    for term in order.map(|number| terms.at(number)) {
        let node = terms.node(term);
        define(terms, term, &node, arithmetic, &mut declared, &mut script);
    }
    for term in given {
        let _ = writeln!(script.text, "(assert {})", script.name(*term));
    }
    let _ = writeln!(script.text, "(assert (not {}))\n(check-sat)", script.name(claim));
    script
}

/// As SMT-LIB writes it.
impl fmt::Display for Sort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Sort::Truth => f.write_str("Bool"),
            Sort::Bits(width) => write!(f, "(_ BitVec {width})"),
        }
    }
}

fn constant(value: u64, kind: Sort) -> String {
    match kind {
        Sort::Truth => if value == 0 { "false" } else { "true" }.into(),
        Sort::Bits(width) if width % 4 == 0 => format!("#x{value:0digits$x}", digits = width as usize / 4),
        Sort::Bits(width) => format!("#b{value:0digits$b}", digits = width as usize),
    }
}

fn define(
    terms: &Terms,
    term: Term,
    node: &Node,
    arithmetic: Arithmetic,
    declared: &mut BTreeSet<&'static str>,
    script: &mut Script,
) {
    let width = node.args.first().map_or(0, |arg| terms.width(*arg));
    let head: Cow<'static, str> = match &node.op {
        Op::Constant(value) => {
            script.names.0.insert(term, constant(*value, node.sort));
            return;
        }
        Op::Input(name) => {
            let _ = writeln!(script.text, "(declare-const {name} {})", node.sort);
            script.inputs.push((name.clone(), terms.width(term)));
            script.names.0.insert(term, name.clone());
            return;
        }
        Op::Call(function) if arithmetic == Arithmetic::Ieee => {
            return ieee(terms, term, function, &node.args, script);
        }
        Op::Call(function) => {
            if declared.insert(function) {
                let sorts: Vec<String> = node.args.iter().map(|arg| terms.sort(*arg).to_string()).collect();
                let _ = writeln!(
                    script.text,
                    "(declare-fun {function} ({}) {})",
                    sorts.join(" "),
                    node.sort
                );
            }
            (*function).into()
        }
        Op::Float(comparison) => Cow::Owned(format!("{}{width}", comparison_name(*comparison))),
        Op::Not => "not".into(),
        Op::And => "and".into(),
        Op::Or => "or".into(),
        Op::Choose => "ite".into(),
        Op::Equal => "=".into(),
        Op::Bits(name) => (*name).into(),
        Op::Extract(high, low) => Cow::Owned(format!("(_ extract {high} {low})")),
        Op::ZeroExtend(by) => Cow::Owned(format!("(_ zero_extend {by})")),
        Op::SignExtend(by) => Cow::Owned(format!("(_ sign_extend {by})")),
    };
    let _ = write!(script.text, "(define-fun t{} () {} ({head}", term.number(), node.sort);
    for arg in &node.args {
        script.text.push(' ');
        script.names.write(*arg, &mut script.text);
    }
    script.text.push_str("))\n");
}

fn comparison_name(comparison: Comparison) -> &'static str {
    match comparison {
        Comparison::Less => "below",
        Comparison::LessOrEqual => "at_most",
        Comparison::Equal => "same_number",
    }
}

/// The result of an operation as any pattern whose number is the rounded one: which NaN comes out is left open.
fn ieee(terms: &Terms, term: Term, function: &str, args: &[Term], script: &mut Script) {
    let name = format!("t{}", term.number());
    let width = terms.width(term);
    let _ = writeln!(script.text, "(declare-const {name} (_ BitVec {width}))");
    let number = |text: &str| format!("({} {text})", to_number(width));
    let operands: Vec<String> = args.iter().map(|arg| number(&script.name(*arg))).collect();
    let operation = match function.get(..3) {
        Some("add") => "fp.add RNE",
        Some("sub") => "fp.sub RNE",
        Some("mul") => "fp.mul RNE",
        Some("div") => "fp.div RNE",
        _ => "fp.abs", // conversions of integers are in no goal of this kind
    };
    let _ = writeln!(
        script.text,
        "(assert (= {} ({operation} {})))",
        number(&name),
        operands.join(" ")
    );
}

/// Bits as a number of IEEE 754.
pub(crate) fn to_number(width: u32) -> &'static str {
    match width {
        64 => "(_ to_fp 11 53)",
        _ => "(_ to_fp 8 24)",
    }
}

/// Comparisons of IEEE 754 on bit patterns; a claim of its own shows that they are (`goals::comparisons`).
pub(crate) fn definitions(text: &mut String) {
    for (width, magnitude, infinity) in [
        (32, "#x7fffffff", "#x7f800000"),
        (64, "#x7fffffffffffffff", "#x7ff0000000000000"),
    ] {
        let bits = format!("(_ BitVec {width})");
        let top = width - 1;
        let _ = writeln!(
            text,
            "(define-fun is_number{width} ((x {bits})) Bool (bvule (bvand x {magnitude}) {infinity}))\n\
             (define-fun is_zero{width} ((x {bits})) Bool (= (bvand x {magnitude}) (bvxor x x)))\n\
             (define-fun is_below_zero{width} ((x {bits})) Bool (= ((_ extract {top} {top}) x) #b1))\n\
             (define-fun same_number{width} ((x {bits}) (y {bits})) Bool\n  \
               (and (is_number{width} x) (is_number{width} y) (or (= x y) (and (is_zero{width} x) (is_zero{width} y)))))\n\
             (define-fun below{width} ((x {bits}) (y {bits})) Bool\n  \
               (and (is_number{width} x) (is_number{width} y) (not (and (is_zero{width} x) (is_zero{width} y)))\n    \
                 (ite (is_below_zero{width} x)\n      \
                   (ite (is_below_zero{width} y) (bvult y x) true)\n      \
                   (ite (is_below_zero{width} y) false (bvult x y)))))\n\
             (define-fun at_most{width} ((x {bits}) (y {bits})) Bool (or (below{width} x y) (same_number{width} x y)))"
        );
    }
}
