//! Names and literals as tokens.

use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::quote;

pub fn ident(name: &str) -> Ident {
    Ident::new(name, Span::call_site())
}

/// A float literal without suffix; the context gives the type.
pub fn float(value: f32) -> TokenStream {
    negated(value.is_sign_negative(), Literal::f32_unsuffixed(value.abs()))
}

/// [`float`] in binary64.
pub fn double(value: f64) -> TokenStream {
    negated(value.is_sign_negative(), Literal::f64_unsuffixed(value.abs()))
}

/// A signed literal without suffix.
pub fn signed(value: impl Into<i64>) -> TokenStream {
    let value = value.into();
    negated(value < 0, Literal::u64_unsuffixed(value.unsigned_abs()))
}

/// The function of a layer.
pub fn layer(index: usize) -> Ident {
    ident(&format!("layer{index}"))
}

/// The outputs of a hidden layer.
pub fn hidden(index: usize) -> Ident {
    ident(&format!("hidden{index}"))
}

pub fn size(value: usize) -> Literal {
    Literal::usize_unsuffixed(value)
}

pub fn word(value: u32) -> Literal {
    Literal::u32_unsuffixed(value)
}

fn negated(is_negative: bool, magnitude: Literal) -> TokenStream {
    // a minus of its own: a negative literal may not survive the way through a token stream; by the sign, so that -0
    // keeps it
    if is_negative {
        quote!(-#magnitude)
    } else {
        quote!(#magnitude)
    }
}
