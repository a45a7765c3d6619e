//! Tables as arrays of arrays, and how the integrity check takes them.

use policy::Scalar;
use proc_macro2::{Ident, TokenStream};
use quote::quote;

use super::number::number;
use super::tokens::{float, ident, signed, size, word};
use crate::program::{Element, Literal, Part, Program, Slice, Table};

/// Type of a value.
pub fn kind(element: Element) -> TokenStream {
    match element {
        Element::Float(Scalar::F32) => quote!(f32),
        Element::Float(Scalar::F64) => quote!(f64),
        Element::Integer { bytes: 1 } => quote!(i8),
        Element::Integer { bytes: 2 } => quote!(i16),
        Element::Integer { .. } => quote!(i32),
        Element::Word => quote!(u32),
    }
}

/// The values of a plain table as an array.
pub fn values(program: &Program, name: &str) -> TokenStream {
    let table = program.table(name);
    table.map_or_else(TokenStream::new, |table| {
        nested(table.element, &table.values, &[table.values.len()])
    })
}

/// The two tables of a layer as statics: each slice of the weights with its biases; or `biases_last`.
pub fn layer(program: &Program, index: usize, biases_last: bool) -> TokenStream {
    let [weights, biases] = of_layer(index).map(|name| program.table(&name).map_or_else(Vec::new, declared));
    let places = 0..weights.len().max(biases.len());
    let tables: Vec<&TokenStream> = if biases_last {
        weights.iter().chain(&biases).collect()
    } else {
        places
            .flat_map(|place| weights.get(place).into_iter().chain(biases.get(place)))
            .collect()
    };
    quote!(#(#tables)*)
}

/// Names of the tables of weights and of biases.
fn of_layer(index: usize) -> [String; 2] {
    [format!("weights{index}"), format!("bias{index}")]
}

/// What holds the slices of a layer's weights that a loop over blocks of inputs, or of outputs, takes.
pub fn weights(program: &Program, index: usize, part: Part) -> Vec<TokenStream> {
    let [weights, _] = of_layer(index);
    program.table(&weights).map_or_else(Vec::new, |table| held(table, part))
}

/// The same of its biases.
pub fn biases(program: &Program, index: usize, part: Part) -> Option<TokenStream> {
    let [_, biases] = of_layer(index);
    held(program.table(&biases)?, part).into_iter().next()
}

fn held(table: &Table, part: Part) -> Vec<TokenStream> {
    let strips = match part {
        // every table has a strip, and the shorter blocks stand in those behind it
        Part::Full => &table.strips[..1],
        Part::Rest => &table.strips[1..],
    };
    let slices = strips.iter().flat_map(|strip| &strip.slices);
    slices.map(|slice| place(table, slice)).collect()
}

fn name(table: &Table, prefix: &str) -> Ident {
    ident(&format!("{prefix}{}", table.name.to_uppercase()))
}

/// Expression of the array itself.
fn place(table: &Table, slice: &Slice) -> TokenStream {
    let name = name(table, slice.prefix);
    match table.alignment {
        Some(_) => quote!(#name.0),
        None => quote!(#name),
    }
}

/// The slices of a table as statics.
fn declared(table: &Table) -> Vec<TokenStream> {
    let slices = table.slices().into_iter().map(|(prefix, lengths, values)| {
        let (name, value) = (name(table, prefix), nested(table.element, &values, &lengths));
        let kind = lengths.iter().rev().fold(kind(table.element), |kind, length| {
            let length = size(*length);
            quote!([#kind; #length])
        });
        match (table.alignment, table.element) {
            (None, _) => quote! { static #name: #kind = #value; },
            (Some(_), Element::Integer { .. }) => quote! { static #name: Words<#kind> = Words(#value); },
            (Some(_), _) => quote! { static #name: Aligned<#kind> = Aligned(#value); },
        }
    });
    slices.collect()
}

fn nested(element: Element, values: &[Literal], lengths: &[usize]) -> TokenStream {
    match lengths {
        [] | [_] => {
            let values = values.iter().map(|value| literal(element, *value));
            quote!([#(#values),*])
        }
        [length, inner @ ..] => {
            let parts = values.chunks((values.len() / (*length).max(1)).max(1));
            let parts = parts.map(|part| nested(element, part, inner));
            quote!([#(#parts),*])
        }
    }
}

fn literal(element: Element, value: Literal) -> TokenStream {
    match element {
        Element::Float(Scalar::F32) => float(value.single()),
        Element::Float(scalar) => number(scalar, value),
        Element::Integer { .. } => signed(value.value() as i64),
        Element::Word => {
            let word = word(value.value() as u32);
            quote!(#word)
        }
    }
}

/// Method of `Span` that takes tables of this element; the name of the checksum, too.
pub fn method(element: Element) -> Ident {
    ident(match element {
        Element::Float(Scalar::F32) => "floats",
        Element::Float(Scalar::F64) => "numbers",
        Element::Integer { bytes: 4 } => "biases",
        Element::Integer { .. } | Element::Word => "weights",
    })
}

/// Every checked table in order, as statements of the integrity check. `black_box`: the memory is read, the compiler does not
/// answer in its place.
pub fn checked(program: &Program) -> TokenStream {
    let mut statements = Vec::new();
    for table in program.checked_tables() {
        let method = method(table.element);
        for strip in &table.strips {
            let places: Vec<TokenStream> = strip.slices.iter().map(|slice| place(table, slice)).collect();
            let depths: Vec<usize> = strip.slices.iter().map(|slice| slice.item.len()).collect();
            statements.push(match (places.as_slice(), depths.as_slice()) {
                ([blocks, tails], [depth, tail_depth]) => {
                    let (flat, tail_flat) = (flattened(depth - 1), flattened(tail_depth - 1));
                    quote! {
                        for (blocks, tail) in core::hint::black_box(&#blocks).iter().zip(core::hint::black_box(&#tails)) {
                            span.#method(blocks #flat);
                            span.#method(tail #tail_flat);
                        }
                    }
                }
                _ => {
                    let flat = depths.first().map(|depth| flattened(*depth));
                    quote!(#(span.#method(core::hint::black_box(&#places) #flat);)*)
                }
            });
        }
    }
    quote!(#(#statements)*)
}

fn flattened(depth: usize) -> TokenStream {
    let calls = (0..depth).map(|_| quote!(.as_flattened()));
    quote!(#(#calls)*)
}
