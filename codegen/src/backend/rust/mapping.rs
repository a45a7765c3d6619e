//! The coefficients of the mapping: how they are set, and the check word beside them.

use policy::Scalar;
use proc_macro2::{Ident, TokenStream};
use quote::quote;

use super::guard::unsuffixed;
use super::number::{self, number};
use super::statements::coefficient_field;
use super::tokens::ident;
use crate::program::{Coefficient, Literal, MappingCode, OutputCode, Program};

/// The methods that set them, one for each mapping.
pub fn set_mapping(program: &Program) -> TokenStream {
    let methods = program.outputs.iter().filter_map(|output| {
        let mapping = output.mapping.as_ref()?;
        Some(method(program.scalar(), output, mapping))
    });
    quote!(#(#methods)*)
}

fn method(scalar: Scalar, output: &OutputCode, mapping: &MappingCode) -> TokenStream {
    let kind = number::kind(scalar);
    let names: Vec<_> = mapping
        .coefficients
        .iter()
        .map(|(name, ..)| ident(name.name()))
        .collect();
    let fields = mapping
        .coefficients
        .iter()
        .map(|(name, ..)| coefficient_field(output, *name));
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
    let [function, check_field] = ["set_mapping", "mapping_check"].map(|stem| ident(&output.named(stem)));
    let about = about(output);
    quote! {
        #(#[doc = #about])*
        #[must_use]
        pub fn #function(&mut self, #(#names: #kind),*) -> bool {
            let accepted = #(#conditions)&*;
            if accepted {
                #(self.#fields = #names;)*
                self.#check_field = #check;
            }
            accepted
        }
    }
}

/// Documentation of a function that sets them.
pub fn about(output: &OutputCode) -> [String; 2] {
    let of = output
        .name
        .as_ref()
        .map_or(String::new(), |name| format!(" of the output `{name}`"));
    [
        format!(
            " Replaces the coefficients of the duty ratio mapping{of}. False, changing nothing, if one is outside its"
        ),
        " interval or the mapping would not increase with the duty.".to_owned(),
    ]
}

/// The methods that compare the coefficients of a mapping with their check word, and their names.
pub fn flips(program: &Program) -> Vec<(TokenStream, Ident)> {
    let scalar = program.scalar();
    let bits = number::word(scalar);
    let method = |output: &OutputCode| {
        let own = check_word(scalar, output.mapping.as_ref()?, |name| {
            let field = coefficient_field(output, name);
            quote!(self.#field)
        });
        let [function, check] = ["mapping_flips", "mapping_check"].map(|stem| ident(&output.named(stem)));
        let about = " Bits that flipped in the coefficients of the mapping or in their check word: 0 as `new` and `set_mapping` leave them.";
        let text = quote! {
            #[doc = #about]
            #[inline(always)]
            fn #function(&self) -> #bits {
                self.#check ^ #own
            }
        };
        Some((text, function))
    };
    program.outputs.iter().filter_map(method).collect()
}

/// The check word of the coefficients that `place` names.
fn check_word(scalar: Scalar, mapping: &MappingCode, place: impl Fn(Coefficient) -> TokenStream) -> TokenStream {
    let constant = unsuffixed(scalar, mapping.check_constant);
    let places = mapping.coefficients.iter().map(|(name, ..)| place(*name));
    quote!(#constant #(^ #places.to_bits())*)
}
