//! What the text of an activation is asked for, and what it may ask of the program it stands in.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use crate::backend::rust::tokens::word;
use crate::program::{Cut, Program, Store};

/// Functions of one number that curves rest on, beside their own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Needs {
    /// The rectifier.
    pub relu: bool,
    /// A number without its sign.
    pub absolute: bool,
    /// A number limited to a magnitude.
    pub limit: bool,
    /// The contract's tanh.
    pub tanh: bool,
}

impl Needs {
    /// What either needs.
    #[must_use]
    pub fn and(self, other: Needs) -> Needs {
        Needs {
            relu: self.relu || other.relu,
            absolute: self.absolute || other.absolute,
            limit: self.limit || other.limit,
            tanh: self.tanh || other.tanh,
        }
    }
}

/// The text of one kind.
pub trait Text {
    /// Functions that [`Text::c_helper`] and [`Text::rust_helper`] call.
    fn needs(&self) -> Needs {
        Needs::default()
    }

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

/// A sum of integers without the bits that are cut off it, in C.
pub(super) fn c_shifted(sum: &str, cut: &Cut) -> String {
    match cut.shift {
        0 => sum.to_owned(),
        bits => format!("{sum} >> {bits}"),
    }
}

/// The integer `sum` without them, in Rust.
pub(super) fn rust_shifted(cut: &Cut) -> TokenStream {
    rust_cut(cut.shift)
}

/// The integer `sum` without so many low bits, in Rust.
pub(crate) fn rust_cut(shift: u32) -> TokenStream {
    let bits = word(shift);
    if shift == 0 { quote!(sum) } else { quote!(sum >> #bits) }
}
