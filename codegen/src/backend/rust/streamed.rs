//! The layers one after the other; the last one takes the outputs of the one before block by block.

use policy::Scalar;
use proc_macro2::{Ident, TokenStream};
use quote::quote;

use super::integrity::{flat, numbers};
use super::network::{columns, held, layer_items, sums, table};
use super::{ident, kernels, number, size};
use crate::program::LayerCode;

/// Tables and functions of all layers, and the body of `network`.
pub fn network(scalar: Scalar, layers: &[LayerCode]) -> (TokenStream, TokenStream) {
    let (before, streamed) = match layers {
        [before @ .., block, last] if last.is_streamed() => (before, Some((block, last))),
        _ => (layers, None),
    };
    let mut items = Vec::new();
    let mut calls = Vec::new();
    let mut value = quote!(observation);
    let mut result = quote!(observation);
    for (index, layer) in before.iter().enumerate() {
        let (tables, function) = layer_items(scalar, index, layer);
        items.push(quote!(#tables #function));
        let (name, sink) = (ident(&format!("layer{index}")), ident(&format!("hidden{index}")));
        let outputs = size(layer.outputs);
        calls.push(quote! {
            let mut #sink = [EMPTY; #outputs];
            #name(#value, &mut #sink);
        });
        value = quote!(filled(&#sink));
        result = quote!(*filled(&#sink));
    }
    let Some((block, last)) = streamed else {
        return (quote!(#(#items)*), quote!(#(#calls)* #result));
    };
    let index = before.len();
    let (tables, _) = layer_items(scalar, index, block);
    let (last_items, chunks) = (
        last_layer(scalar, index + 1, last),
        chunks(scalar, index, block, last, &value),
    );
    items.push(quote!(#tables #last_items));
    (quote!(#(#items)*), quote!(#(#calls)* #chunks))
}

/// Names of the tables of a streamed layer: blocks and shorter last block for the full chunks, then for the shorter last
/// chunk.
fn names(index: usize) -> [Ident; 4] {
    ["WEIGHTS", "TAIL_WEIGHTS", "LAST_WEIGHTS", "LAST_TAIL_WEIGHTS"].map(|name| ident(&format!("{name}{index}")))
}

/// Tables, and the function that adds a chunk of inputs to the sums.
fn last_layer(scalar: Scalar, index: usize, layer: &LayerCode) -> TokenStream {
    let number = number::kind(scalar);
    let [weights, tail_weights, last_weights, last_tail_weights] = names(index);
    let (rows, full, tail) = (layer.block_rows, layer.full_blocks(), layer.tail_rows());
    let (rest, count) = (layer.inputs % layer.chunk, layer.inputs / layer.chunk);
    // a chunk is its blocks, then its shorter last block
    let split = |chunk: &[f32], inputs: usize| {
        let (blocks, last) = chunk.split_at(full * rows * inputs);
        let blocks = blocks.chunks(rows * inputs).map(|block| columns(block, rows));
        (quote!([#(#blocks),*]), columns(last, tail.max(1)))
    };
    let (whole, shorter) = layer.table.split_at(count * layer.chunk * layer.outputs);
    let (blocks, tails): (Vec<_>, Vec<_>) = whole
        .chunks(layer.chunk * layer.outputs)
        .map(|chunk| split(chunk, layer.chunk))
        .unzip();
    let bias = ident(&format!("BIAS{index}"));
    let biases = sums(scalar, &layer.bias);
    let outputs = size(layer.outputs);
    let [rows, full, tail_rows, chunk, count, rest_size] = [rows, full, tail, layer.chunk, count, rest].map(size);
    let kind = quote!([[[[f32; #rows]; #chunk]; #full]; #count]);
    let of_blocks = table(layer, &weights, &kind, &quote!([#(#blocks),*]));
    let mut tables = vec![quote! {
        #of_blocks
        static #bias: [#number; #outputs] = #biases;
    }];
    if tail > 0 {
        let kind = quote!([[[f32; #tail_rows]; #chunk]; #count]);
        tables.push(table(layer, &tail_weights, &kind, &quote!([#(#tails),*])));
    }
    if rest > 0 {
        let (blocks, last) = split(shorter, rest);
        let kind = quote!([[[f32; #rows]; #rest_size]; #full]);
        tables.push(table(layer, &last_weights, &kind, &blocks));
        if tail > 0 {
            let kind = quote!([[f32; #tail_rows]; #rest_size]);
            tables.push(table(layer, &last_tail_weights, &kind, &last));
        }
    }
    let (parameter, tail_code) = if tail > 0 {
        (
            quote!(tail: &[[f32; #tail_rows]; INPUTS],),
            quote! {
                if let Some((out, _)) = rest.split_first_chunk_mut::<#tail_rows>() {
                    added(tail, x, out);
                }
            },
        )
    } else {
        (TokenStream::new(), quote!(let _ = rest;))
    };
    let name = ident(&format!("layer{index}"));
    let doc = format!(
        " {}: {} -> {}, what a chunk of its inputs adds",
        layer.name, layer.inputs, layer.outputs
    );
    quote! {
        #(#tables)*
        #[doc = #doc]
        #[inline(always)]
        fn #name<const INPUTS: usize>(
            weights: &[[[f32; #rows]; INPUTS]; #full],
            #parameter
            x: &[#number; INPUTS],
            sums: &mut [#number; #outputs],
        ) {
            let mut rest: &mut [#number] = sums;
            for weights in weights {
                if let Some((out, after)) = core::mem::take(&mut rest).split_first_chunk_mut::<#rows>() {
                    added(weights, x, out);
                    rest = after;
                }
            }
            #tail_code
        }
    }
}

/// Body of `network` from the outputs `value` of the layers before.
fn chunks(scalar: Scalar, index: usize, layer: &LayerCode, last: &LayerCode, value: &TokenStream) -> TokenStream {
    let next = index + 1;
    let [weights, tail_weights, last_weights, last_tail_weights] = names(next).map(|name| held(last, &name));
    let (before, bias) = (ident(&format!("WEIGHTS{index}")), ident(&format!("BIAS{index}")));
    let (before_tail, bias_tail) = (
        ident(&format!("TAIL_WEIGHTS{index}")),
        ident(&format!("TAIL_BIAS{index}")),
    );
    let (name, sums) = (ident(&format!("layer{next}")), ident(&format!("BIAS{next}")));
    let [before, before_tail] = [before, before_tail].map(|name| held(layer, &name));
    let store = |weights: &TokenStream, bias: &TokenStream| {
        kernels::store(
            scalar,
            layer.activation,
            &quote!(#weights, #bias, #value),
            &quote!(&mut part),
        )
    };
    let has_tail = last.tail_rows() > 0;
    let (iterator, pattern, argument, last_argument) = if has_tail {
        (
            quote!(#before.iter().zip(&#bias).zip(#weights.iter().zip(&#tail_weights))),
            quote!(((weights, bias), (next, tail))),
            quote!(tail,),
            quote!(&#last_tail_weights,),
        )
    } else {
        (
            quote!(#before.iter().zip(&#bias).zip(&#weights)),
            quote!(((weights, bias), next)),
            TokenStream::new(),
            TokenStream::new(),
        )
    };
    let shorter = (!last.inputs.is_multiple_of(last.chunk)).then(|| {
        let stored = store(&quote!(&#before_tail), &quote!(&#bias_tail));
        let length = size(last.inputs % last.chunk);
        quote! {
            let mut part = [EMPTY; #length];
            #stored
            #name(&#last_weights, #last_argument filled(&part), &mut q);
        }
    });
    let stored = store(&quote!(weights), &quote!(bias));
    let length = size(last.chunk);
    quote! {
        let mut q = #sums;
        for #pattern in #iterator {
            let mut part = [EMPTY; #length];
            #stored
            #name(next, #argument filled(&part), &mut q);
        }
        #shorter
        q
    }
}

/// Statements of the integrity check, in the order of the table.
pub fn integrity(scalar: Scalar, index: usize, layer: &LayerCode) -> TokenStream {
    let [weights, tail_weights, last_weights, last_tail_weights] = names(index).map(|name| held(layer, &name));
    let bias = ident(&format!("BIAS{index}"));
    let has_tail = layer.tail_rows() > 0;
    let full = if has_tail {
        quote! {
            for (blocks, tail) in core::hint::black_box(&#weights).iter().zip(core::hint::black_box(&#tail_weights)) {
                span.floats(blocks.as_flattened().as_flattened());
                span.floats(tail.as_flattened());
            }
        }
    } else {
        let weights = flat(&weights, 3);
        quote!(span.floats(#weights);)
    };
    let shorter = (!layer.inputs.is_multiple_of(layer.chunk)).then(|| {
        let (weights, tail) = (flat(&last_weights, 2), flat(&last_tail_weights, 1));
        let tail = has_tail.then(|| quote!(span.floats(#tail);));
        quote!(span.floats(#weights); #tail)
    });
    let (numbers, bias) = (numbers(scalar), flat(&quote!(#bias), 0));
    quote! { #full #shorter span.#numbers(#bias); }
}
