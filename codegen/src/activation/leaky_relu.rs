//! x if x > 0, else slope * x: both are computed and the sign bit selects.

use policy::{Scalar, scales};
use proc_macro2::TokenStream;
use quote::quote;

use super::text::{C, Rust, Text, c_shifted, rust_shifted};
use crate::backend::rust::number;
use crate::backend::rust::tokens::signed;
use crate::program::{Cut, Literal, Store};

pub(super) struct LeakyRelu {
    pub slope: f64,
}

impl LeakyRelu {
    /// In 2^-15.
    fn integer_slope(&self) -> i32 {
        scales::slope_integer(self.slope) as i32
    }
}

impl Text for LeakyRelu {
    fn c_helper(&self, c: &C<'_>) -> Vec<String> {
        let C { n, number, .. } = c;
        // the sign bit is the flag already; zeros of both signs come out as by a comparison with 0
        let negative = match c.scalar {
            Scalar::F32 => format!("{n}_bits(x) >> 31"),
            Scalar::F64 => format!("(uint32_t)({n}_bits(x) >> 63)"),
        };
        vec![format!(
            "
static {number} {n}_leaky_relu({number} x, {number} slope)
{{
    return {n}_select({negative}, slope * x, x);
}}"
        )]
    }

    fn c(&self, c: &C<'_>, sum: &str) -> String {
        format!("{}_leaky_relu({sum}, {})", c.n, (c.literal)(c.scalar, self.slope))
    }

    // 16384 is half of 2^15, so that the shift rounds half up; 16 bits times 15 bits leave room for it in 32
    fn c_integer_helper(&self, c: &C<'_>) -> Vec<String> {
        vec![format!(
            "
static int32_t {n}_leaky_integer(int32_t x, int32_t slope)
{{
#if defined(__FRAMAC__)
    return (x < 0) ? (((x * slope) + 16384) >> 15) : x;
#else
    const int32_t negative = x >> 31;
    return (x & ~negative) | ((((x * slope) + 16384) >> 15) & negative);
#endif
}}",
            n = c.n
        )]
    }

    fn c_integer(&self, c: &C<'_>, sum: &str, cut: &Cut) -> String {
        format!(
            "{}_leaky_integer({}, {})",
            c.n,
            c_shifted(sum, cut),
            self.integer_slope()
        )
    }

    fn rust_helper(&self, rust: &Rust) -> TokenStream {
        let kind = number::kind(rust.scalar);
        let negative = number::bits(rust.scalar).negative;
        quote! {
            #[inline(always)]
            #[allow(dead_code)]
            fn leaky_relu(x: #kind, slope: #kind) -> #kind {
                select(#negative, slope * x, x)
            }
        }
    }

    fn rust(&self, scalar: Scalar) -> TokenStream {
        let slope = number::number(scalar, Literal::nearest(scalar, self.slope));
        quote!(leaky_relu(sum, #slope))
    }

    fn rust_integer_helper(&self) -> TokenStream {
        quote! {
            #[inline(always)]
            #[allow(dead_code)]
            fn leaky_integer(x: i32, slope: i32) -> i16 {
                let negative = x >> 31;
                ((x & !negative) | ((x.wrapping_mul(slope).wrapping_add(16_384) >> 15) & negative)) as i16
            }
        }
    }

    fn rust_integer(&self, _store: &Store, cut: &Cut) -> TokenStream {
        let (shifted, slope) = (rust_shifted(cut), signed(self.integer_slope()));
        quote!(leaky_integer(#shifted, #slope))
    }

    fn single(&self, x: f32) -> f32 {
        if x > 0.0 { x } else { self.slope as f32 * x }
    }

    fn double(&self, x: f64) -> f64 {
        if x > 0.0 { x } else { self.slope * x }
    }

    fn integer(&self, sum: i32, cut: &Cut) -> i32 {
        let shifted = sum >> cut.shift;
        match shifted > 0 {
            true => shifted,
            // rounded for itself: what the cut has rounded is an activation already (section 6b)
            false => (shifted * self.integer_slope() + (1 << 14)) >> 15,
        }
    }
}
