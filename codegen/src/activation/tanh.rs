//! The contract's rational function: numerator and denominator by Horner's rule in the square of the limited argument.

use policy::Scalar;
use policy::activation::{TANH_DENOMINATOR, TANH_NUMERATOR, TANH_RANGE};
use proc_macro2::TokenStream;
use quote::quote;

use super::number::Number;
use super::sigmoid::{Function, nearest};
use super::text::{C, Rust};
use crate::backend::rust::number::{self, number};
use crate::backend::rust::tokens::ident;

pub(super) struct Tanh;

impl Function for Tanh {
    const NAME: &'static str = "tanh";

    fn c(&self, c: &C<'_>) -> Vec<String> {
        let C {
            n,
            number,
            word,
            magnitude,
            sign,
            top,
            ..
        } = c;
        // C90 has no literals of 64 bits
        let [nine, one] = match c.scalar {
            Scalar::F32 => ["0x41100000u", "0x3F800000u"],
            Scalar::F64 => ["(uint64_t)0x40220000u << 32", "(uint64_t)0x3FF00000u << 32"],
        };
        // by bits: positive floats have the order of their bits, and a selection by comparison would be a branch
        let limit = format!(
            "
/* x limited to the magnitude with these bits, in integers so that loops over it can be vectorised */
static {number} {n}_limit({number} x, {word} limit)
{{
#if defined(__FRAMAC__)
    const {number} most = {n}_from_bits(limit);
    const {number} end = (({n}_bits(x) >> {top}) != 0u) ? -most : most;
    return ((x == x) && (x > -most) && (x < most)) ? x : end;
#else
    const {word} bits = {n}_bits(x);
    const {word} magnitude = bits & {magnitude};
    const {word} below = ({word})0 - ((magnitude - limit) >> {top});
    return {n}_from_bits((bits & {sign}) | (magnitude & below) | (limit & ~below));
#endif
}}

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
        std::iter::once(limit)
            .chain(steps.into_iter().flatten())
            .chain([end])
            .collect()
    }

    fn rust(&self, rust: &Rust) -> TokenStream {
        let kind = number::kind(rust.scalar);
        let (limit, nine, one) = limit(rust.scalar);
        let steps = |letter: &str, terms: &[f64; 5]| {
            let name = ident(letter);
            let [lower @ .., highest] = nearest(rust.scalar, terms).map(|term| number(rust.scalar, term));
            let lower = lower.iter().rev();
            quote! { let mut #name: #kind = #highest; #(#name = #name * z + #lower;)* }
        };
        let numerator = steps("p", &TANH_NUMERATOR);
        let denominator = steps("q", &TANH_DENOMINATOR);
        quote! {
            /// x limited to the magnitude with these bits, in integers so that loops over it can be vectorised
            #[inline(always)]
            #limit
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

/// `x` limited to the magnitude with the bits `limit`: the function, and the bits of 9 and of 1.
fn limit(scalar: Scalar) -> (TokenStream, TokenStream, TokenStream) {
    match scalar {
        Scalar::F32 => (
            quote! {
                fn limit(x: f32, limit: u32) -> f32 {
                    let magnitude = x.to_bits() & 0x7FFF_FFFF;
                    let below = 0_u32.wrapping_sub(magnitude.wrapping_sub(limit) >> 31);
                    f32::from_bits((x.to_bits() & 0x8000_0000) | (magnitude & below) | (limit & !below))
                }
            },
            // 9 and 1
            quote!(0x4110_0000),
            quote!(0x3F80_0000),
        ),
        Scalar::F64 => (
            quote! {
                fn limit(x: f64, limit: u64) -> f64 {
                    let magnitude = x.to_bits() & 0x7FFF_FFFF_FFFF_FFFF;
                    let below = 0_u64.wrapping_sub(magnitude.wrapping_sub(limit) >> 63);
                    f64::from_bits((x.to_bits() & 0x8000_0000_0000_0000) | (magnitude & below) | (limit & !below))
                }
            },
            // 9 and 1
            quote!(0x4022_0000_0000_0000),
            quote!(0x3FF0_0000_0000_0000),
        ),
    }
}
