//! The Rust type of the numbers, its literals and its bits.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::tokens::{double, float};
use crate::program::Literal;

/// The type that holds a number of the format.
pub fn kind(scalar: Scalar) -> TokenStream {
    match scalar {
        Scalar::F32 => quote!(f32),
        Scalar::F64 => quote!(f64),
    }
}

/// The unsigned integer of the same width.
pub fn word(scalar: Scalar) -> TokenStream {
    match scalar {
        Scalar::F32 => quote!(u32),
        Scalar::F64 => quote!(u64),
    }
}

/// A literal without suffix; the context gives the type.
pub fn number(scalar: Scalar, literal: Literal) -> TokenStream {
    match scalar {
        Scalar::F32 => float(literal.single()),
        Scalar::F64 => double(literal.value()),
    }
}

/// What depends on the width of a number.
pub struct Bits {
    /// `x` without its sign.
    pub magnitude: TokenStream,
    /// `flag` (0 or 1) as a mask of all bits.
    pub mask: TokenStream,
    /// The sign of `x` as 0 or 1, an `u32`.
    pub negative: TokenStream,
    /// `x` if its sign is clear, else +0.
    pub positive: TokenStream,
}

/// Expressions over the bits.
pub fn bits(scalar: Scalar) -> Bits {
    match scalar {
        Scalar::F32 => Bits {
            magnitude: quote!(f32::from_bits(x.to_bits() & 0x7FFF_FFFF)),
            mask: quote!(0_u32.wrapping_sub(flag)),
            negative: quote!(x.to_bits() >> 31),
            // where floats are a library: a comparison would be a call of it
            positive: quote!(f32::from_bits(x.to_bits() & (x.to_bits() >> 31).wrapping_sub(1))),
        },
        Scalar::F64 => Bits {
            magnitude: quote!(f64::from_bits(x.to_bits() & 0x7FFF_FFFF_FFFF_FFFF)),
            mask: quote!(0_u64.wrapping_sub(flag as u64)),
            negative: quote!((x.to_bits() >> 63) as u32),
            positive: quote!(f64::from_bits(x.to_bits() & (x.to_bits() >> 63).wrapping_sub(1))),
        },
    }
}

/// The words of the number `value`, low one first, as an expression that can be chained.
pub fn words(scalar: Scalar, value: &TokenStream) -> TokenStream {
    match scalar {
        Scalar::F32 => quote!(core::iter::once(#value.to_bits())),
        Scalar::F64 => quote!([#value.to_bits() as u32, (#value.to_bits() >> 32) as u32]),
    }
}

/// The words of all numbers of the array `values`, as an iterator.
pub fn all_words(scalar: Scalar, values: &TokenStream) -> TokenStream {
    match scalar {
        Scalar::F32 => quote!(#values.iter().map(|value| value.to_bits())),
        Scalar::F64 => {
            quote!(#values.iter().flat_map(|value| [value.to_bits() as u32, (value.to_bits() >> 32) as u32]))
        }
    }
}
