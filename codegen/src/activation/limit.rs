//! Parts that several curves share: a number limited to a magnitude, and one without its sign, without a branch in the binary.

use policy::Scalar;
use proc_macro2::{Literal, TokenStream};
use quote::quote;

use super::text::{C, Rust};
use crate::backend::rust::number;

/// The bits of a number of the format as a literal in C.
pub(super) fn c_bits(scalar: Scalar, value: f64) -> String {
    match scalar {
        Scalar::F32 => format!("0x{:08X}u", (value as f32).to_bits()),
        // C90 has no literals of 64 bits
        Scalar::F64 => {
            let bits = value.to_bits();
            let (high, low) = (bits >> 32, bits & 0xFFFF_FFFF);
            match low {
                0 => format!("(uint64_t)0x{high:08X}u << 32"),
                _ => format!("((uint64_t)0x{high:08X}u << 32) | 0x{low:08X}u"),
            }
        }
    }
}

/// The same in Rust.
pub(super) fn rust_bits(scalar: Scalar, value: f64) -> TokenStream {
    let text = match scalar {
        Scalar::F32 => format!("{:08X}", (value as f32).to_bits()),
        Scalar::F64 => format!("{:016X}", value.to_bits()),
    };
    let groups: Vec<&str> = (0..text.len())
        .step_by(4)
        .filter_map(|at| text.get(at..at + 4))
        .collect();
    // hexadecimal in groups, as the rest of the file has it: digits and underscores, so it always is a literal
    let literal: Literal = match format!("0x{}", groups.join("_")).parse() {
        Ok(literal) => literal,
        Err(error) => unreachable!("{text}: {error}"),
    };
    quote!(#literal)
}

/// `n_limit` in C.
pub(super) fn c_limit(c: &C<'_>) -> String {
    let C {
        n,
        number,
        word,
        magnitude,
        sign,
        top,
        ..
    } = c;
    // by bits: positive floats have the order of their bits, and a selection by comparison would be a branch
    format!(
        "
/* x limited to the magnitude with these bits, in integers so that loops over it can be vectorised */
static {number} {n}_limit({number} x, {word} limit)
{{
#if defined(__FRAMAC__)
    const {number} most = {n}_from_bits(limit);
    {number} limited = (({n}_bits(x) >> {top}) != 0u) ? -most : most;
    if ((x > -most) && (x < most)) {{
        /*@ admit !\\is_NaN(x); */
        limited = x;
    }}
    return limited;
#else
    const {word} bits = {n}_bits(x);
    const {word} magnitude = bits & {magnitude};
    const {word} below = ({word})0 - ((magnitude - limit) >> {top});
    return {n}_from_bits((bits & {sign}) | (magnitude & below) | (limit & ~below));
#endif
}}"
    )
}

/// `limit` in Rust.
pub(super) fn rust_limit(rust: &Rust) -> TokenStream {
    let function = match rust.scalar {
        Scalar::F32 => quote! {
            fn limit(x: f32, limit: u32) -> f32 {
                let magnitude = x.to_bits() & 0x7FFF_FFFF;
                let below = 0_u32.wrapping_sub(magnitude.wrapping_sub(limit) >> 31);
                f32::from_bits((x.to_bits() & 0x8000_0000) | (magnitude & below) | (limit & !below))
            }
        },
        Scalar::F64 => quote! {
            fn limit(x: f64, limit: u64) -> f64 {
                let magnitude = x.to_bits() & 0x7FFF_FFFF_FFFF_FFFF;
                let below = 0_u64.wrapping_sub(magnitude.wrapping_sub(limit) >> 63);
                f64::from_bits((x.to_bits() & 0x8000_0000_0000_0000) | (magnitude & below) | (limit & !below))
            }
        },
    };
    quote! {
        /// x limited to the magnitude with these bits, in integers so that loops over it can be vectorised
        #[inline(always)]
        #function
    }
}

/// `n_absolute` in C.
pub(super) fn c_absolute(c: &C<'_>) -> String {
    let C {
        n, number, magnitude, ..
    } = c;
    // by its bits: `fabs` would be a call of libm without optimisation
    format!(
        "
/* x without its sign */
static {number} {n}_absolute({number} x)
{{
#if defined(__FRAMAC__)
    return {n}_magnitude(x);
#else
    return {n}_from_bits({n}_bits(x) & {magnitude});
#endif
}}"
    )
}

/// `absolute` in Rust.
pub(super) fn rust_absolute(rust: &Rust) -> TokenStream {
    let kind = number::kind(rust.scalar);
    let magnitude = number::bits(rust.scalar).magnitude;
    quote! {
        /// x without its sign
        #[inline(always)]
        fn absolute(x: #kind) -> #kind {
            #magnitude
        }
    }
}
