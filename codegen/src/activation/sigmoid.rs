//! What all curves within +-1 have in common: a function of one number, and the way there and back for integers.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::number::Number;
use super::text::{C, Rust, Text};
use crate::backend::rust::tokens::{float, ident};
use crate::program::{Cut, Literal, Store};

/// A function of one number, by its name in generated code.
pub(super) trait Function {
    const NAME: &'static str;

    /// The function in C.
    fn c(&self, c: &C<'_>) -> Vec<String>;

    /// The function in Rust.
    fn rust(&self, rust: &Rust) -> TokenStream;

    /// Its value on the host.
    fn value<T: Number>(&self, x: T) -> T;
}

/// The activation that such a function is.
pub(super) struct Curve<F>(pub F);

impl<F: Function> Text for Curve<F> {
    fn c_helper(&self, c: &C<'_>) -> Vec<String> {
        self.0.c(c)
    }

    fn c(&self, c: &C<'_>, sum: &str) -> String {
        format!("{}_{}({sum})", c.n, F::NAME)
    }

    fn c_integer_helper(&self, c: &C<'_>) -> Vec<String> {
        // as in `integer` below: a positive number is cut off, for a cast of a negative one would round towards 0
        let (n, name) = (c.n, F::NAME);
        vec![format!(
            "
static int32_t {n}_{name}_integer(int32_t sum, float unit)
{{
    return (int32_t)(({n}_{name}((float)sum * unit) * 16384.0f) + 32768.5f) - 32768;
}}"
        )]
    }

    fn c_integer(&self, c: &C<'_>, sum: &str, cut: &Cut) -> String {
        let unit = (c.literal)(Scalar::F32, cut.unit.value());
        format!("{}_{}_integer({sum}, {unit})", c.n, F::NAME)
    }

    fn rust_helper(&self, rust: &Rust) -> TokenStream {
        self.0.rust(rust)
    }

    fn rust(&self, _scalar: Scalar) -> TokenStream {
        let name = ident(F::NAME);
        quote!(#name(sum))
    }

    fn rust_integer(&self, _store: &Store, cut: &Cut) -> TokenStream {
        let (name, unit) = (ident(F::NAME), float(cut.unit.single()));
        quote!(((#name(sum as f32 * #unit) * 16_384.0 + 32_768.5) as i32).wrapping_sub(32_768) as i16)
    }

    fn single(&self, x: f32) -> f32 {
        self.0.value(x)
    }

    fn double(&self, x: f64) -> f64 {
        self.0.value(x)
    }

    fn integer(&self, sum: i32, cut: &Cut) -> i32 {
        // the sum of 32768.5 is positive, so that cutting it off rounds half up
        (self.0.value(sum as f32 * cut.unit.single()) * 16_384.0 + 32_768.5) as i32 - 32_768
    }
}

/// The contract's constants, rounded to the format.
pub(super) fn nearest(scalar: Scalar, terms: &[f64; 5]) -> [Literal; 5] {
    terms.map(|term| Literal::nearest(scalar, term))
}
