//! The contract's rational function: numerator and denominator by Horner's rule in the square of the limited argument.

use policy::activation::{TANH_DENOMINATOR, TANH_NUMERATOR, TANH_RANGE};
use proc_macro2::TokenStream;
use quote::quote;

use super::curve::Function;
use super::limit;
use super::number::Number;
use super::text::{C, Needs, Rust};
use crate::backend::rust::number::{self, number};
use crate::backend::rust::tokens::ident;
use crate::program::Literal;

pub(super) struct Tanh;

impl Function for Tanh {
    fn name(&self) -> &'static str {
        "tanh"
    }

    fn needs(&self) -> Needs {
        Needs {
            limit: true,
            ..Needs::default()
        }
    }

    fn c(&self, c: &C<'_>) -> Vec<String> {
        let C { n, number, .. } = c;
        let [nine, one] = [TANH_RANGE, 1.0].map(|end| limit::c_bits(c.scalar, end));
        let head = format!(
            "
/* rational approximation, |error| < 4e-7 */
static {number} {n}_tanh({number} x)
{{
    const {number} t = {n}_limit(x, {nine});
    const {number} z = t * t;"
        );
        let steps = [('p', TANH_NUMERATOR), ('q', TANH_DENOMINATOR)].map(|(letter, terms)| {
            let step = |(power, term): (usize, &f64)| {
                let term = (c.literal)(c.scalar, *term);
                let value = match power {
                    4 => term,
                    _ => format!("({letter}{} * z) + {term}", power + 1),
                };
                format!("    const {number} {letter}{power} = {value};")
            };
            terms.iter().enumerate().rev().map(step).collect::<Vec<_>>()
        });
        let end = format!(
            "    return {n}_limit((p0 * t) / q0, {one});
}}"
        );
        std::iter::once(head)
            .chain(steps.into_iter().flatten())
            .chain([end])
            .collect()
    }

    fn rust(&self, rust: &Rust) -> TokenStream {
        let kind = number::kind(rust.scalar);
        let [nine, one] = [TANH_RANGE, 1.0].map(|end| limit::rust_bits(rust.scalar, end));
        let steps = |letter: &str, terms: &[f64; 5]| {
            let name = ident(letter);
            let [lower @ .., highest] = terms.map(|term| number(rust.scalar, Literal::nearest(rust.scalar, term)));
            let lower = lower.iter().rev();
            quote! { let mut #name: #kind = #highest; #(#name = #name * z + #lower;)* }
        };
        let numerator = steps("p", &TANH_NUMERATOR);
        let denominator = steps("q", &TANH_DENOMINATOR);
        quote! {
            /// Rational approximation, |error| < 4e-7.
            #[inline(always)]
            fn tanh(x: #kind) -> #kind {
                let t = limit(x, #nine);
                let z = t * t;
                #numerator
                #denominator
                limit((p * t) / q, #one)
            }
        }
    }

    fn value<T: Number>(&self, x: T) -> T {
        let limited = |x: T, limit: f64| T::nearest(x.wide().clamp(-limit, limit));
        let t = limited(x, TANH_RANGE);
        let z = t * t;
        let polynomial = |terms: &[f64; 5]| {
            let [lower @ .., highest] = terms.map(T::nearest);
            lower.into_iter().rev().fold(highest, |sum, term| sum * z + term)
        };
        limited(polynomial(&TANH_NUMERATOR) * t / polynomial(&TANH_DENOMINATOR), 1.0)
    }
}
