//! The coefficients of the mapping: how they are set, and the check word beside them.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::guard::unsuffixed;
use super::number::{self, number};
use super::statements::coefficient_field;
use super::tokens::ident;
use crate::program::{Coefficient, Literal, MappingCode, Program};

/// The method that sets them; nothing without a mapping.
pub fn set_mapping(program: &Program) -> Option<TokenStream> {
    let mapping = program.mapping.as_ref()?;
    let scalar = program.scalar();
    let kind = number::kind(scalar);
    let names: Vec<_> = mapping
        .coefficients
        .iter()
        .map(|(name, ..)| ident(name.name()))
        .collect();
    let fields = mapping.coefficients.iter().map(|(name, ..)| coefficient_field(*name));
    let mut conditions: Vec<TokenStream> = Vec::new();
    for (name, _, low, high) in &mapping.coefficients {
        let (name, low, high) = (ident(name.name()), number(scalar, *low), number(scalar, *high));
        conditions.push(quote!((#name >= #low) & (#name <= #high)));
    }
    if mapping.coefficients.iter().any(|(name, ..)| *name == Coefficient::R) {
        let (low, high): (Literal, Literal) = mapping.valid_i_out;
        for end in [low, high].map(|end| number(scalar, end)) {
            conditions.push(quote!((a + r * #end > 0.0)));
        }
    }
    let check = check_word(scalar, mapping, |name| {
        let name = ident(name.name());
        quote!(#name)
    });
    Some(quote! {
        /// Replaces the coefficients of the duty ratio mapping. False, changing nothing, if one is outside its
        /// interval or the mapping would not increase with the duty.
        #[must_use]
        pub fn set_mapping(&mut self, #(#names: #kind),*) -> bool {
            let accepted = #(#conditions)&*;
            if accepted {
                #(self.#fields = #names;)*
                self.mapping_check = #check;
            }
            accepted
        }
    })
}

/// The method that compares the coefficients of the mapping with their check word.
pub fn flips(scalar: Scalar, mapping: &MappingCode) -> TokenStream {
    let bits = number::word(scalar);
    let own = check_word(scalar, mapping, |name| {
        let field = coefficient_field(name);
        quote!(self.#field)
    });
    quote! {
        /// Bits that flipped in the coefficients of the mapping or in their check word: 0 as `new` and `set_mapping` leave them.
        #[inline(always)]
        fn mapping_flips(&self) -> #bits {
            self.mapping_check ^ #own
        }
    }
}

/// The check word of the coefficients that `place` names.
fn check_word(scalar: Scalar, mapping: &MappingCode, place: impl Fn(Coefficient) -> TokenStream) -> TokenStream {
    let constant = unsuffixed(scalar, mapping.check_constant);
    let places = mapping.coefficients.iter().map(|(name, ..)| place(*name));
    quote!(#constant #(^ #places.to_bits())*)
}
