//! What all curves have in common: a function of one number, and the way there and back for integers.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::number::Number;
use super::text::{C, Needs, Rust, Text};
use crate::backend::rust::tokens::{float, ident};
use crate::program::{Cut, Store};

/// A function of one number.
pub(super) trait Function {
    /// Its name in generated code.
    fn name(&self) -> &'static str;

    /// The functions that it calls.
    fn needs(&self) -> Needs;

    /// The function in C.
    fn c(&self, c: &C<'_>) -> Vec<String>;

    /// The function in Rust.
    fn rust(&self, rust: &Rust) -> TokenStream;

    /// Its value on the host.
    fn value<T: Number>(&self, x: T) -> T;
}

/// The activation that such a function is.
pub(super) struct Curve<F> {
    pub function: F,
    /// Whether all values are within +-1: then integers have the same exponent behind every layer.
    pub has_ends: bool,
}

impl<F: Function> Text for Curve<F> {
    fn needs(&self) -> Needs {
        self.function.needs()
    }

    fn c_helper(&self, c: &C<'_>) -> Vec<String> {
        self.function.c(c)
    }

    fn c(&self, c: &C<'_>, sum: &str) -> String {
        format!("{}_{}({sum})", c.n, self.function.name())
    }

    fn c_integer_helper(&self, c: &C<'_>) -> Vec<String> {
        // as in `integer` below: a positive number is cut off, for a cast of a negative one would round towards 0
        let (n, name) = (c.n, self.function.name());
        let (parameter, scale) = match self.has_ends {
            true => ("", "16384.0f"),
            false => (", float scale", "scale"),
        };
        vec![format!(
            "
static int32_t {n}_{name}_integer(int32_t sum, float unit{parameter})
{{
    return (int32_t)(({n}_{name}((float)sum * unit) * {scale}) + 32768.5f) - 32768;
}}"
        )]
    }

    fn c_integer(&self, c: &C<'_>, sum: &str, cut: &Cut) -> String {
        let unit = (c.literal)(Scalar::F32, cut.unit.value());
        let scale = match self.has_ends {
            true => String::new(),
            false => format!(", {}", (c.literal)(Scalar::F32, cut.scale.value())),
        };
        format!("{}_{}_integer({sum}, {unit}{scale})", c.n, self.function.name())
    }

    fn rust_helper(&self, rust: &Rust) -> TokenStream {
        self.function.rust(rust)
    }

    fn rust(&self, _scalar: Scalar) -> TokenStream {
        let name = ident(self.function.name());
        quote!(#name(sum))
    }

    fn rust_integer(&self, _store: &Store, cut: &Cut) -> TokenStream {
        let (name, unit) = (ident(self.function.name()), float(cut.unit.single()));
        let scale = match self.has_ends {
            true => quote!(16_384.0),
            false => float(cut.scale.single()),
        };
        quote!(((#name(sum as f32 * #unit) * #scale + 32_768.5) as i32).wrapping_sub(32_768) as i16)
    }

    fn single(&self, x: f32) -> f32 {
        self.function.value(x)
    }

    fn double(&self, x: f64) -> f64 {
        self.function.value(x)
    }

    fn integer(&self, sum: i32, cut: &Cut) -> i32 {
        // the sum of 32768.5 is positive, so that cutting it off rounds half up
        (self.function.value(sum as f32 * cut.unit.single()) * cut.scale.single() + 32_768.5) as i32 - 32_768
    }
}
