//! What all curves have in common: a function of one number, and the way there and back for integers.

use policy::activation::Curve as Facts;
use policy::{Activation, Scalar};
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
    /// Which one it is.
    pub activation: Activation,
}

impl<F: Function> Curve<F> {
    /// Whether all values are within +-1: then integers have the same exponent behind every layer.
    fn has_ends(&self) -> bool {
        self.activation.range().is_some()
    }

    /// What a prover of intervals reads in the place of `y = curve(x)`. It does not see that the terms of a curve come from one number, so
    /// it is told where y lies for a finite x, which is what section 6 of the contract says: where the real function lies, and that less than
    /// `A + R max(x, 0)` is between the two, which `interp` tries with every number. Where y lies for the sums of a neuron is for its driver
    /// to say: it knows the neurons.
    fn proved(&self, n: &str) -> String {
        let call = format!("{n}_{}(x)", self.function.name());
        match (self.activation.range(), self.activation.curve()) {
            (None, Some(facts)) => {
                let (low, high, slack) = beside_relu(facts);
                format!(
                    "    const float above = (x > 0.0f) ? x : 0.0f;
    const float y = {call};
    /*@ admit ((above + ({low:.9})) - ({slack:.9} * above)) <= y <= ((above + {high:.9}) + ({slack:.9} * above)); */\n"
                )
            }
            (Some(range), _) => format!(
                "    const float y = {call};\n    /*@ admit {:.1} <= y <= {:.1}; */\n",
                range.low, range.high
            ),
            (None, None) => format!("    const float y = {call};\n"),
        }
    }
}

/// `low - slack * max(x, 0) <= y - max(x, 0) <= high + slack * max(x, 0)` of a curve without an upper end, in binary32.
fn beside_relu(facts: &Facts) -> (f64, f64, f64) {
    // nine digits behind the point are written
    const DIGIT: f64 = 1e-9;
    let (beside, error) = (facts.beside_relu(), facts.error_32);
    let (low, high) = (beside.low - error.absolute, beside.high + error.absolute);
    (low - DIGIT, high + DIGIT, error.relative + DIGIT)
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
        let (parameter, scale) = match self.has_ends() {
            true => ("", "16384.0f"),
            false => (", float scale", "scale"),
        };
        let proved = self.proved(n);
        vec![format!(
            "
static int32_t {n}_{name}_integer(int32_t sum, float unit{parameter})
{{
    const float x = (float)sum * unit;
#if defined(__FRAMAC__)
{proved}#else
    const float y = {n}_{name}(x);
#endif
    return (int32_t)((y * {scale}) + 32768.5f) - 32768;
}}"
        )]
    }

    fn c_integer(&self, c: &C<'_>, sum: &str, cut: &Cut) -> String {
        let unit = (c.literal)(Scalar::F32, cut.unit.value());
        let scale = match self.has_ends() {
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
        let scale = match self.has_ends() {
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

#[cfg(test)]
mod tests {
    use super::super::text_of;
    use super::*;

    #[test]
    fn what_a_prover_is_told_of_a_curve_holds_for_what_the_code_computes() {
        let last = (policy::limits::MAX_MAGNITUDE as f32).to_bits();
        for activation in Activation::EACH.iter().filter(|each| each.range().is_none()) {
            let Some(facts) = activation.curve() else { continue };
            let ((low, high, slack), text) = (beside_relu(facts), text_of(*activation));
            for x in (0..=last).step_by(40_009).map(f32::from_bits).flat_map(|x| [x, -x]) {
                let above = f64::from(x.max(0.0));
                let beside = f64::from(text.single(x)) - above;
                let inside = low - slack * above <= beside && beside <= high + slack * above;
                assert!(inside, "{} of {x}: {beside}", activation.word());
            }
        }
    }
}
