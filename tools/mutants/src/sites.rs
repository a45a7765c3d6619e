//! Where a source file can be changed, and into what.
//!
//! ```text
//! text ─► syn ─► operators, numbers, statements, guards, arms, bodies ─► Mutant: a range, and what stands there instead
//! ```
//!
//! Nothing is changed that a compiler evaluates (constants, patterns, lengths): a switch cannot stand there. It is counted.

use std::ops::Range;

use proc_macro2::Span;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::{BinOp, Block, Expr, Lit, Pat, ReturnType, Signature, Stmt, Type, UnOp};

use crate::changes;

/// A part of what stands in the place of the changed code.
#[derive(Clone, Debug, PartialEq)]
pub enum Piece {
    /// As it is.
    Text(String),
    /// The code at this range of the file, in which other mutants may lie.
    Source(Range<usize>),
    /// A call that is true while this mutant is on.
    Switch,
}

/// One change.
#[derive(Clone, Debug)]
pub struct Mutant {
    /// The code that is replaced; empty where something is inserted.
    pub range: Range<usize>,
    /// Line and column from 1.
    pub place: (usize, usize),
    /// What becomes of what, on one line.
    pub text: String,
    /// What stands there instead.
    pub pieces: Vec<Piece>,
}

/// What was found in a file.
#[derive(Debug, Default)]
pub struct Found {
    /// In the order of the file.
    pub mutants: Vec<Mutant>,
    /// Places that are evaluated while it compiles, where no switch can stand.
    pub constant: usize,
    /// Calls of macros: what is in them is not looked at.
    pub macros: usize,
}

/// Everything in a file that can be changed.
///
/// # Errors
/// If the text is no Rust.
pub fn find(text: &str) -> Result<Found, String> {
    let file = syn::parse_file(text).map_err(|error| error.to_string())?;
    let mut finder = Finder {
        text,
        found: Found::default(),
        is_constant: false,
    };
    finder.visit_file(&file);
    Ok(finder.found)
}

struct Finder<'a> {
    text: &'a str,
    found: Found,
    is_constant: bool,
}

impl Finder<'_> {
    fn add(&mut self, range: Range<usize>, at: Span, text: &str, pieces: Vec<Piece>) {
        if self.is_constant {
            self.found.constant += 1;
            return;
        }
        let start = at.start();
        self.found.mutants.push(Mutant {
            range,
            place: (start.line, start.column + 1),
            text: text.split_whitespace().collect::<Vec<_>>().join(" "),
            pieces,
        });
    }

    /// `(if SWITCH { changed } else { as it is })`.
    fn either(&mut self, span: Span, at: Span, text: &str, changed: Vec<Piece>) {
        let range = span.byte_range();
        let mut pieces = vec![word("(if "), Piece::Switch, word(" { ")];
        pieces.extend(changed);
        pieces.extend([word(" } else { "), Piece::Source(range.clone()), word(" })")]);
        self.add(range, at, text, pieces);
    }

    fn within_constant(&mut self, visit: impl FnOnce(&mut Self)) {
        let before = std::mem::replace(&mut self.is_constant, true);
        visit(self);
        self.is_constant = before;
    }

    fn body(&mut self, signature: &Signature, block: &Block) {
        let at = block.brace_token.span.open();
        let start = at.byte_range().end;
        let values = match &signature.output {
            ReturnType::Default if block.stmts.is_empty() => Vec::new(),
            ReturnType::Default => vec![String::new()],
            ReturnType::Type(_, kind) => changes::values(kind),
        };
        for value in values {
            let pieces = vec![
                word(" if "),
                Piece::Switch,
                Piece::Text(format!(" {{ return {value}; }} ")),
            ];
            let text = match value.as_str() {
                "" => format!("{} does nothing", signature.ident),
                _ => format!("{} returns {value}", signature.ident),
            };
            self.add(start..start, at, &text, pieces);
        }
    }

    fn binary(&mut self, node: &syn::ExprBinary) {
        let at = node.op.span();
        let operator = &self.text[at.byte_range()];
        let (left, right) = (node.left.span().byte_range(), node.right.span().byte_range());
        let is_assignment = operator.ends_with('=') && !matches!(operator, "==" | "!=" | "<=" | ">=");
        for other in changes::others(operator) {
            let text = format!("{operator} becomes {other} in `{}`", self.excerpt(node.span()));
            let (open, close) = if is_assignment { ("", "") } else { ("(", ")") };
            let changed = vec![
                word(open),
                Piece::Source(left.clone()),
                Piece::Text(format!("{close} {other} (")),
                Piece::Source(right.clone()),
                word(")"),
            ];
            self.either(node.span(), at, &text, changed);
        }
    }

    fn excerpt(&self, span: Span) -> String {
        let words: Vec<&str> = self.text[span.byte_range()].split_whitespace().collect();
        let line = words.join(" ");
        match line.char_indices().nth(80) {
            Some((end, _)) => format!("{} ...", &line[..end]),
            None => line,
        }
    }

    fn number(&mut self, literal: &Lit) {
        for value in changes::near(literal) {
            let text = format!("{} becomes {value}", self.excerpt(literal.span()));
            self.either(literal.span(), literal.span(), &text, vec![Piece::Text(value)]);
        }
    }

    /// An arm that is never taken, where another one takes everything.
    fn arms(&mut self, node: &syn::ExprMatch) {
        let Some((last, arms)) = node.arms.split_last() else {
            return;
        };
        let takes_all = match &last.pat {
            Pat::Wild(_) => true,
            // `None` is one, too
            Pat::Ident(name) => name.ident.to_string().starts_with(|first: char| first.is_lowercase()),
            _ => false,
        };
        for arm in arms.iter().filter(|arm| takes_all && !matches!(arm.pat, Pat::Guard(_))) {
            let end = arm.pat.span().byte_range().end;
            let text = format!("no arm `{}`", self.excerpt(arm.pat.span()));
            self.add(end..end, arm.pat.span(), &text, vec![word(" if !"), Piece::Switch]);
        }
    }
}

fn word(text: &str) -> Piece {
    Piece::Text(text.to_owned())
}

/// Whether `let` is one of the conditions: it must not stand in parentheses.
fn has_let(expression: &Expr) -> bool {
    match expression {
        Expr::Let(_) => true,
        Expr::Binary(node) if matches!(node.op, BinOp::And(_)) => has_let(&node.left) || has_let(&node.right),
        _ => false,
    }
}

/// `#[cfg(test)]` and `#[test]`.
fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| match &attribute.meta {
        syn::Meta::Path(path) => path.is_ident("test"),
        syn::Meta::List(list) => list.path.is_ident("cfg") && list.tokens.to_string() == "test",
        syn::Meta::NameValue(_) => false,
    })
}

impl<'ast> Visit<'ast> for Finder<'_> {
    fn visit_item_mod(&mut self, node: &'ast syn::ItemMod) {
        if !is_test(&node.attrs) {
            visit::visit_item_mod(self, node);
        }
    }

    fn visit_item_fn(&mut self, node: &'ast syn::ItemFn) {
        if is_test(&node.attrs) {
            return;
        }
        if node.sig.constness.is_some() {
            return self.within_constant(|finder| visit::visit_item_fn(finder, node));
        }
        self.body(&node.sig, &node.block);
        visit::visit_item_fn(self, node);
    }

    fn visit_impl_item_fn(&mut self, node: &'ast syn::ImplItemFn) {
        if is_test(&node.attrs) {
            return;
        }
        if node.sig.constness.is_some() {
            return self.within_constant(|finder| visit::visit_impl_item_fn(finder, node));
        }
        self.body(&node.sig, &node.block);
        visit::visit_impl_item_fn(self, node);
    }

    fn visit_item_const(&mut self, node: &'ast syn::ItemConst) {
        self.within_constant(|finder| visit::visit_item_const(finder, node));
    }

    fn visit_impl_item_const(&mut self, node: &'ast syn::ImplItemConst) {
        self.within_constant(|finder| visit::visit_impl_item_const(finder, node));
    }

    fn visit_item_static(&mut self, node: &'ast syn::ItemStatic) {
        self.within_constant(|finder| visit::visit_item_static(finder, node));
    }

    fn visit_item_enum(&mut self, node: &'ast syn::ItemEnum) {
        self.within_constant(|finder| visit::visit_item_enum(finder, node));
    }

    fn visit_type(&mut self, node: &'ast Type) {
        self.within_constant(|finder| visit::visit_type(finder, node));
    }

    fn visit_generic_argument(&mut self, node: &'ast syn::GenericArgument) {
        self.within_constant(|finder| visit::visit_generic_argument(finder, node));
    }

    fn visit_expr_const(&mut self, node: &'ast syn::ExprConst) {
        self.within_constant(|finder| visit::visit_expr_const(finder, node));
    }

    fn visit_expr_repeat(&mut self, node: &'ast syn::ExprRepeat) {
        self.visit_expr(&node.expr);
        self.within_constant(|finder| finder.visit_expr(&node.len));
    }

    fn visit_pat(&mut self, node: &'ast Pat) {
        let Pat::Guard(guarded) = node else {
            return self.within_constant(|finder| visit::visit_pat(finder, node));
        };
        self.visit_pat(&guarded.pat);
        if !has_let(&guarded.guard) {
            let (span, text) = (guarded.guard.span(), self.excerpt(guarded.guard.span()));
            for value in ["true", "false"] {
                let text = format!("guard `{text}` becomes {value}");
                self.either(span, span, &text, vec![word(value)]);
            }
        }
        self.visit_expr(&guarded.guard);
    }

    fn visit_attribute(&mut self, _: &'ast syn::Attribute) {}

    fn visit_macro(&mut self, _: &'ast syn::Macro) {
        self.found.macros += 1;
    }

    fn visit_expr_binary(&mut self, node: &'ast syn::ExprBinary) {
        if !has_let(&node.left) && !has_let(&node.right) {
            self.binary(node);
        }
        visit::visit_expr_binary(self, node);
    }

    fn visit_expr_unary(&mut self, node: &'ast syn::ExprUnary) {
        let sign = match node.op {
            UnOp::Not(_) => "!",
            UnOp::Neg(_) => "-",
            _ => "",
        };
        if !sign.is_empty() {
            let text = format!("no {sign} in `{}`", self.excerpt(node.span()));
            let inner = Piece::Source(node.expr.span().byte_range());
            self.either(node.span(), node.span(), &text, vec![inner]);
        }
        visit::visit_expr_unary(self, node);
    }

    fn visit_expr_lit(&mut self, node: &'ast syn::ExprLit) {
        self.number(&node.lit);
    }

    fn visit_expr_match(&mut self, node: &'ast syn::ExprMatch) {
        self.arms(node);
        visit::visit_expr_match(self, node);
    }

    fn visit_stmt(&mut self, node: &'ast Stmt) {
        if let Stmt::Expr(expression, Some(_)) = node
            && (matches!(
                expression,
                Expr::MethodCall(_) | Expr::Call(_) | Expr::Assign(_) | Expr::Try(_)
            ) || matches!(expression, Expr::Binary(_)))
        {
            let range = node.span().byte_range();
            let text = format!("without `{}`", self.excerpt(node.span()));
            let pieces = vec![
                word("if !"),
                Piece::Switch,
                word(" { "),
                Piece::Source(range.clone()),
                word(" }"),
            ];
            self.add(range, node.span(), &text, pieces);
        }
        visit::visit_stmt(self, node);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(source: &str) -> Vec<String> {
        let found = find(source).unwrap();
        found.mutants.into_iter().map(|mutant| mutant.text).collect()
    }

    #[test]
    fn operators_numbers_and_bodies_are_found() {
        assert_eq!(
            texts("fn f(a: u8) -> u8 { a + 2 }"),
            [
                "f returns 0",
                "f returns 1",
                "+ becomes - in `a + 2`",
                "+ becomes * in `a + 2`",
                "2 becomes 3",
                "2 becomes 1"
            ]
        );
        assert_eq!(
            texts("fn f() -> &'static X { g(!a, -b) }"),
            ["no ! in `!a`", "no - in `-b`"]
        );
    }

    #[test]
    fn statements_guards_and_arms_are_found() {
        assert_eq!(
            texts("fn f() { g(); match x { 1 => a, b if c => d, _ => e } }"),
            [
                "f does nothing",
                "without `g();`",
                "no arm `1`",
                "guard `c` becomes true",
                "guard `c` becomes false"
            ]
        );
    }

    #[test]
    fn an_arm_stays_where_no_other_takes_everything() {
        assert_eq!(texts("fn f() -> &X { match x { Some(y) => y, None => z } }"), [""; 0]);
        assert_eq!(texts("fn f() -> &X { match x { A => y, other => z } }"), ["no arm `A`"]);
    }

    #[test]
    fn what_a_compiler_evaluates_is_counted_and_left_out() {
        let found =
            find("const A: [u8; 2] = [1, 1 + 1]; const fn f() -> u8 { 3 } #[cfg(test)] mod t { fn f() -> u8 { 1 } }");
        let found = found.unwrap();
        assert!(found.mutants.is_empty());
        assert_eq!(found.constant, 2 + 2 + 2 + 4 + 2);
        assert_eq!(find("fn f() -> &X { x!(1 + 1) }").unwrap().macros, 1);
    }

    #[test]
    fn a_condition_with_let_stays_without_parentheses() {
        assert_eq!(
            texts("fn f() -> &X { if a && let B = b && c {} }"),
            ["&& becomes ||"; 0]
        );
    }

    #[test]
    fn places_count_bytes_and_columns_from_the_start() {
        let found = find("// ─►\nfn f() -> &X {\n    é(a - b)\n}\n").unwrap();
        let minus = &found.mutants[0];
        assert_eq!(minus.place, (3, 9));
        assert_eq!(minus.range, 32..37);
    }
}
