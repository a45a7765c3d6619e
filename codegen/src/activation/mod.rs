//! What an activation is in generated code: one file a kind, with its text in C and Rust, in floats and in integers.
//!
//! ```text
//!  Store { activation, cut }  ─► text_of ─► dyn Text ─► c, c_integer          an expression over the name of a sum
//!                                                       rust, rust_integer
//!                                                       ..._helper            the functions that the expressions call
//!                                                       single, double        the same on the host: known answers
//! ```
//!
//! What is true of an activation (bounded, homogeneous, a rectifier) stands in [`policy::activation`]; who decides by such a fact
//! asks there. The one invariant: no file but the one of a kind knows the kind by its name, and `text_of` is the only list, so
//! the compiler asks for a new kind here.

mod identity;
mod leaky_relu;
mod relu;
mod sigmoid;
mod softsign;
mod tanh;

use policy::{Activation, Scalar};
use proc_macro2::TokenStream;
use quote::quote;

use crate::backend::rust::tokens::word;
use crate::program::{Cut, Network, Program, Store};

/// The text of one kind.
pub trait Text {
    /// Functions that [`Text::c`] calls; empty lines part them.
    fn c_helper(&self, _c: &C<'_>) -> Vec<String> {
        Vec::new()
    }

    /// The output in C that the sum of floats of this name becomes.
    fn c(&self, c: &C<'_>, sum: &str) -> String;

    /// Functions that [`Text::c_integer`] calls.
    fn c_integer_helper(&self, _c: &C<'_>) -> Vec<String> {
        Vec::new()
    }

    /// The output in C that the sum of integers of this name becomes; one that goes on to a layer fits 16 bits.
    fn c_integer(&self, c: &C<'_>, sum: &str, cut: &Cut) -> String;

    /// Functions that [`Text::rust`] calls.
    fn rust_helper(&self, _rust: &Rust) -> TokenStream {
        TokenStream::new()
    }

    /// The output in Rust that the float `sum` becomes.
    fn rust(&self, scalar: Scalar) -> TokenStream;

    /// Functions that [`Text::rust_integer`] calls.
    fn rust_integer_helper(&self) -> TokenStream {
        TokenStream::new()
    }

    /// The output in Rust that the integer `sum` becomes: 16 bits, or 32 where it is stored as a sum.
    fn rust_integer(&self, store: &Store, cut: &Cut) -> TokenStream;

    /// The output in binary32.
    fn single(&self, x: f32) -> f32;

    /// The output in binary64.
    fn double(&self, x: f64) -> f64;

    /// The output of a sum of integers.
    fn integer(&self, sum: i32, cut: &Cut) -> i32;
}

/// What the text in C needs to know of the program it stands in.
#[derive(Debug, Clone)]
pub struct C<'a> {
    /// Prefix of functions.
    pub n: &'a str,
    /// Prefix of macros.
    pub u: String,
    /// Format of the numbers.
    pub scalar: Scalar,
    /// Type of the numbers.
    pub number: &'static str,
    /// The unsigned integer of its width.
    pub word: &'static str,
    /// Of its literals and of the compiler's functions that take it.
    pub suffix: &'static str,
    /// Mask of all bits but the sign.
    pub magnitude: &'static str,
    /// Mask of the sign.
    pub sign: &'static str,
    /// Number of the sign bit.
    pub top: u32,
    /// Whether the target computes in the format in hardware.
    pub has_fpu: bool,
    /// A literal of the format, rounded to nearest.
    pub literal: fn(Scalar, f64) -> String,
}

/// What the text in Rust needs to know of the program it stands in.
#[derive(Debug, Clone, Copy)]
pub struct Rust {
    /// Format of the numbers.
    pub scalar: Scalar,
    /// Whether the target computes in the format in hardware.
    pub has_fpu: bool,
}

impl Rust {
    pub(crate) fn of(program: &Program) -> Self {
        Self {
            scalar: program.scalar(),
            has_fpu: program.has_fpu,
        }
    }
}

/// The text of an activation.
#[must_use]
pub fn text_of(activation: Activation) -> Box<dyn Text> {
    match activation {
        Activation::Relu => Box::new(relu::Relu),
        Activation::Tanh => Box::new(sigmoid::Curve(tanh::Tanh)),
        Activation::Softsign => Box::new(sigmoid::Curve(softsign::Softsign)),
        Activation::LeakyRelu { slope } => Box::new(leaky_relu::LeakyRelu { slope }),
        Activation::Identity => Box::new(identity::Identity),
    }
}

/// One of each kind, in the order of their functions in a file: straight lines first, then curves, which are longer.
fn kinds() -> impl Iterator<Item = Activation> {
    let of = |is_curve: bool| {
        Activation::EACH
            .iter()
            .filter(move |kind| kind.limit().is_some() == is_curve)
    };
    of(false).chain(of(true)).copied()
}

/// The kinds of a network, in that order.
pub(crate) fn used(network: &Network) -> impl Iterator<Item = Activation> {
    kinds().filter(|kind| network.activates(|activation| activation.word() == kind.word()))
}

/// Functions for floats that every Rust file has, whether it calls them or not: those of straight lines.
pub(crate) fn rust_lines(rust: &Rust) -> TokenStream {
    kinds()
        .filter(|kind| kind.limit().is_none())
        .map(|kind| text_of(kind).rust_helper(rust))
        .collect()
}

/// The same of integers.
pub(crate) fn rust_integer_lines() -> TokenStream {
    kinds()
        .filter(|kind| kind.limit().is_none())
        .map(|kind| text_of(kind).rust_integer_helper())
        .collect()
}

/// Functions in Rust of the curves that the network has.
pub(crate) fn rust_curves(network: &Network, rust: &Rust) -> TokenStream {
    used(network)
        .filter(|kind| kind.limit().is_some())
        .map(|kind| text_of(kind).rust_helper(rust))
        .collect()
}

/// A sum of integers without the bits that are cut off it, in C.
fn c_shifted(sum: &str, cut: &Cut) -> String {
    match cut.shift {
        0 => sum.to_owned(),
        bits => format!("{sum} >> {bits}"),
    }
}

/// The integer `sum` without them, in Rust.
fn rust_shifted(cut: &Cut) -> TokenStream {
    rust_cut(cut.shift)
}

/// The integer `sum` without so many low bits, in Rust.
pub(crate) fn rust_cut(shift: u32) -> TokenStream {
    let bits = word(shift);
    if shift == 0 { quote!(sum) } else { quote!(sum >> #bits) }
}
