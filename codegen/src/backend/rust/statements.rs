//! Straight-line blocks as `let` statements, and the helpers they call.

use policy::Scalar;
use proc_macro2::{Ident, TokenStream};
use quote::quote;

use super::number::{self, number};
use super::tokens::{ident, size};
use crate::activation::{Rust, rust_lines};
use crate::program::{Block, Coefficient, Op, OutputCode, Program, ValueId};

/// Field of the controller that holds a coefficient of an output.
pub fn coefficient_field(output: &OutputCode, coefficient: Coefficient) -> Ident {
    ident(&output.named(&format!("mapping_{}", coefficient.name())))
}

/// A field of the controller that belongs to the output of that index.
pub fn remembered(program: &Program, stem: &str, output: usize) -> TokenStream {
    let name = ident(&program.named(stem, output));
    quote!(self.#name)
}

/// Prints one block inside a method of the controller; leaves stand where they are used.
pub struct Printer<'p> {
    program: &'p Program,
    operands: Vec<TokenStream>,
    named: usize,
    /// `let` statements in execution order.
    pub statements: Vec<TokenStream>,
}

impl<'p> Printer<'p> {
    /// Prints `block`.
    pub fn new(program: &'p Program, block: &Block) -> Self {
        let mut printer = Self {
            program,
            operands: Vec::new(),
            named: 0,
            statements: Vec::new(),
        };
        for op in &block.ops {
            let tokens = match printer.leaf(op) {
                Some(leaf) => leaf,
                None => printer.named(op),
            };
            printer.operands.push(tokens);
        }
        printer
    }

    /// Tokens of a value.
    pub fn operand(&self, id: ValueId) -> TokenStream {
        self.operands[id].clone()
    }

    fn named(&mut self, op: &Op) -> TokenStream {
        let (kind, letter) = if op.is_flag() {
            (quote!(u32), 'f')
        } else {
            (number::kind(self.program.scalar()), 'v')
        };
        let name = ident(&format!("{letter}{}", self.named));
        self.named += 1;
        let value = self.computed(op);
        self.statements.push(quote! { let #name: #kind = #value; });
        quote!(#name)
    }

    fn leaf(&self, op: &Op) -> Option<TokenStream> {
        Some(match op {
            Op::Measured(i) => {
                let name = ident(&self.program.signals[*i].name);
                quote!(measured.#name)
            }
            Op::Code(i) => {
                let name = ident(&self.program.signals[*i].name);
                let kind = number::kind(self.program.scalar());
                quote!((measured.#name as #kind))
            }
            Op::Held(i) => indexed(quote!(self.held), *i),
            Op::Sanitised(i) => indexed(quote!(front.signal), *i),
            Op::Memory(i) => indexed(quote!(self.memory), *i),
            Op::PreviousDuty(output) => remembered(self.program, "previous_duty", *output),
            Op::PreviousCommand(output) => remembered(self.program, "previous_command", *output),
            Op::SoftCap(output) => remembered(self.program, "soft_cap", *output),
            Op::Coefficient(output, name) => remembered(self.program, &format!("mapping_{}", name.name()), *output),
            Op::ChosenDuty(output) if self.program.has_several() => {
                let name = ident(&format!("chosen{output}"));
                quote!(#name)
            }
            Op::ChosenDuty(_) => quote!(chosen),
            Op::Output => quote!(output),
            Op::Gain(i) => indexed(quote!(outputs), *i),
            Op::Factor(i) => indexed(quote!(front.factor), *i),
            Op::Constant(literal) => number(self.program.scalar(), *literal),
            Op::Usable => quote!(front.usable),
            Op::Clipped => quote!(front.clipped),
            Op::Base => quote!(front.base),
            Op::Still => quote!(front.still),
            Op::HeldSample => quote!(front.held),
            Op::PrimedNow => quote!(front.primed_now),
            _ => return None,
        })
    }

    fn computed(&self, op: &Op) -> TokenStream {
        let v = |id: &ValueId| &self.operands[*id];
        match op {
            Op::Neg(x) => unary(quote!(-), v(x)),
            // no parentheses: operands are names or leaves, everything computed has a name
            Op::Add(x, y) => binary(v(x), quote!(+), v(y)),
            Op::Sub(x, y) => binary(v(x), quote!(-), v(y)),
            Op::Mul(x, y) => binary(v(x), quote!(*), v(y)),
            Op::Select { flag, then, otherwise } => call("select", &[v(flag), v(then), v(otherwise)]),
            Op::Clamp { x, low, high } => call("clamp", &[v(x), v(low), v(high)]),
            Op::LineSum {
                word,
                length,
                newest,
                primed,
            } => {
                let (first, skip, take) = (size(*word), size(word + 1), size(length - 1));
                let (newest, primed) = (v(newest), v(primed));
                quote!(line_sum(self.memory[#first], self.memory.iter().skip(#skip).take(#take), #newest, #primed))
            }
            Op::Within { x, low, high } => call("within", &[v(x), v(low), v(high)]),
            Op::Outside { x, low, high } => call("outside", &[v(x), v(low), v(high)]),
            Op::Difference(x, y) => {
                let (x, y) = (v(x), v(y));
                match self.program.scalar() {
                    Scalar::F32 => quote!(#x.to_bits() ^ #y.to_bits()),
                    // folded to a word
                    Scalar::F64 => {
                        quote!((#x.to_bits() ^ #y.to_bits()) as u32 | ((#x.to_bits() ^ #y.to_bits()) >> 32) as u32)
                    }
                }
            }
            Op::Squash(x, output) => {
                let curve = self.program.head.curve(*output).map_or("", policy::Activation::word);
                call(curve, &[v(x)])
            }
            // behind a barrier: of what is known to be 0 or 1 the optimiser makes a branch. No leaf, since each barrier takes
            // three instructions
            Op::Primed => quote!(core::hint::black_box(self.primed & 1)),
            Op::NotZero(x) => {
                let x = v(x);
                quote!(flag(#x != 0))
            }
            Op::Above(x, limit) => {
                let (x, limit) = (v(x), v(limit));
                quote!(flag(#x > #limit))
            }
            Op::And(x, y) => binary(v(x), quote!(&), v(y)),
            Op::Or(x, y) => binary(v(x), quote!(|), v(y)),
            leaf => self.leaf(leaf).unwrap_or_default(),
        }
    }
}

fn indexed(array: TokenStream, index: usize) -> TokenStream {
    let index = size(index);
    quote!(#array[#index])
}

fn unary(operator: TokenStream, x: &TokenStream) -> TokenStream {
    quote!(#operator #x)
}

fn binary(x: &TokenStream, operator: TokenStream, y: &TokenStream) -> TokenStream {
    quote!(#x #operator #y)
}

fn call(function: &str, arguments: &[&TokenStream]) -> TokenStream {
    let function = ident(function);
    quote!(#function(#(#arguments),*))
}

/// Branch-free helpers; a policy need not use all of them.
pub fn helpers(program: &Program) -> TokenStream {
    let scalar = program.scalar();
    let number = number::kind(scalar);
    let mask = number::bits(scalar).mask;
    let comparisons = super::guard::helpers(scalar);
    let lines = rust_lines(&Rust::of(program));
    // `within` and `outside` have one barrier each, since a barrier takes three instructions. They add their conditions: of an `and`
    // or an `or` of both rustc makes branches of different lengths on PowerPC, which has jumps for comparisons of floats. The 1 behind
    // the sum of `outside` makes of 0, 1, 2 what an `or` says, for whatever ends
    quote! {
        /// A condition as 0 or 1. The optimiser must not know that: it would turn selections back into branches.
        #[inline(always)]
        fn flag(condition: bool) -> u32 {
            core::hint::black_box(u32::from(condition))
        }
        /// flag (0 or 1) ? then : otherwise, without a branch
        #[inline(always)]
        #[allow(dead_code)]
        fn select(flag: u32, then: #number, otherwise: #number) -> #number {
            let mask = #mask;
            #number::from_bits((then.to_bits() & mask) | (otherwise.to_bits() & !mask))
        }
        #[inline(always)]
        #[allow(dead_code)]
        fn within(x: #number, low: #number, high: #number) -> u32 {
            core::hint::black_box(u32::from(x >= low).wrapping_add(u32::from(x <= high))) >> 1
        }
        #[inline(always)]
        #[allow(dead_code)]
        fn outside(x: #number, low: #number, high: #number) -> u32 {
            core::hint::black_box(u32::from(x < low).wrapping_add(u32::from(x > high)).wrapping_add(1)) >> 1
        }
        #[inline(always)]
        #[allow(dead_code)]
        fn clamp(x: #number, low: #number, high: #number) -> #number {
            // not `clamp` of core, which can panic; flags behind their barrier keep the selection free of branches
            let raised = select(flag(x < low), low, x);
            select(flag(raised > high), high, raised)
        }
        /// Oldest first, newest last; a line that is not primed reads as newest throughout.
        #[inline(always)]
        #[allow(dead_code)]
        fn line_sum<'a>(oldest: #number, rest: impl Iterator<Item = &'a #number>, newest: #number, primed: u32) -> #number {
            let mut sum = select(primed, oldest, newest);
            // an iterator and no slice: a range that could be wrong is a way to a panic
            for word in rest {
                sum += select(primed, *word, newest);
            }
            sum + newest
        }
        #lines
        #comparisons
    }
}
