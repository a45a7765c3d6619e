//! Loops over floats: functions of the layers, and the body of `network`.
//!
//! A layer of several blocks is one function over its slices. The last two layers, where the last is streamed, are a loop in
//! `network` with the block of the one written out and one function, generic over the length of a block, of the other.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::kernels::store;
use super::tokens::{self, hidden, size};
use super::{number, tables};
use crate::program::{Buffer, Layer, Loop, Part, Program, Shape, Store};

/// Tables and functions of all layers, and the body of `network`.
pub fn network(program: &Program) -> (TokenStream, TokenStream) {
    let printer = Printer {
        program,
        scalar: program.scalar(),
    };
    let mut items = Vec::new();
    let mut statements = Vec::new();
    for node in &program.network.loops {
        match node {
            Loop::Layer(layer) => {
                items.extend([tables::layer(program, layer.index, false), printer.whole(layer)]);
                statements.push(printer.call(layer));
            }
            Loop::Begin(last) => {
                let biases = tables::biases(program, *last, Part::Full);
                statements.push(quote!(let mut q = #biases;));
            }
            Loop::Repeat { blocks, body, .. } => {
                if let [Loop::Layer(block), Loop::Layer(last)] = body.as_slice() {
                    if *blocks == Part::Full {
                        let [of_block, of_last] = [block, last].map(|layer| tables::layer(program, layer.index, false));
                        items.extend([of_block, of_last, printer.added(last)]);
                    }
                    statements.push(printer.piece(*blocks, block, last));
                }
            }
            Loop::Sums(_) | Loop::Store(_) | Loop::Add(_) | Loop::Pad { .. } => {}
        }
    }
    let result = match program.network.loops.last() {
        Some(Loop::Layer(layer)) => {
            let sink = hidden(layer.index);
            quote!(*filled(&#sink))
        }
        _ => quote!(q),
    };
    (quote!(#(#items)*), quote!(#(#statements)* #result))
}

struct Printer<'a> {
    program: &'a Program,
    scalar: Scalar,
}

impl Printer<'_> {
    fn shape(&self, layer: &Layer) -> &Shape {
        &self.program.network.layers[layer.index]
    }

    /// The function of a layer.
    fn whole(&self, layer: &Layer) -> TokenStream {
        let (kind, name) = (number::kind(self.scalar), tokens::layer(layer.index));
        let doc = format!(" {}: {} -> {}", self.shape(layer).name, layer.inputs, layer.outputs);
        let (inputs, outputs) = (size(layer.inputs), size(layer.outputs));
        let loops = blocks(layer).map(|(part, node)| {
            let weights = tables::weights(self.program, layer.index, part);
            let biases = tables::biases(self.program, layer.index, part);
            let rows = size(node.rows);
            if part == Part::Rest {
                let stored = store(
                    self.scalar,
                    node.activation,
                    &quote!(#(&#weights,)* &#biases, x),
                    &quote!(out),
                );
                return quote! { if let Some((out, _)) = rest.split_first_chunk_mut::<#rows>() { #stored } };
            }
            let stored = store(self.scalar, node.activation, &quote!(weights, bias, x), &quote!(out));
            quote! {
                for (weights, bias) in #(#weights)*.iter().zip(&#biases) {
                    // no division and no slice index, so no way to a panic at any optimisation level
                    if let Some((out, after)) = core::mem::take(&mut rest).split_first_chunk_mut::<#rows>() {
                        #stored
                        rest = after;
                    }
                }
            }
        });
        quote! {
            #[doc = #doc]
            #[inline(always)]
            fn #name(x: &[#kind; #inputs], y: &mut [Slot; #outputs]) {
                let mut rest: &mut [Slot] = y;
                #(#loops)*
            }
        }
    }

    fn call(&self, layer: &Layer) -> TokenStream {
        let (name, sink, outputs) = (tokens::layer(layer.index), hidden(layer.index), size(layer.outputs));
        let value = value(layer.from);
        quote! {
            let mut #sink = [EMPTY; #outputs];
            #name(#value, &mut #sink);
        }
    }

    /// The function that adds a block of inputs to the sums of the last layer.
    fn added(&self, last: &Layer) -> TokenStream {
        let (kind, name, shape) = (number::kind(self.scalar), tokens::layer(last.index), self.shape(last));
        let doc = format!(
            " {}: {} -> {}, what a chunk of its inputs adds",
            shape.name, shape.inputs, shape.outputs
        );
        let outputs = size(last.outputs);
        let (mut parameters, mut loops) = (Vec::new(), Vec::new());
        for (part, count, body) in last.blocks() {
            let rows = size(stored(body).map_or(0, |node| node.rows));
            if part == Part::Full {
                let count = size(count);
                parameters.push(quote!(weights: &[[[f32; #rows]; INPUTS]; #count],));
                loops.push(quote! {
                    for weights in weights {
                        if let Some((out, after)) = core::mem::take(&mut rest).split_first_chunk_mut::<#rows>() {
                            added(weights, x, out);
                            rest = after;
                        }
                    }
                });
            } else {
                parameters.push(quote!(tail: &[[f32; #rows]; INPUTS],));
                loops.push(quote! {
                    if let Some((out, _)) = rest.split_first_chunk_mut::<#rows>() {
                        added(tail, x, out);
                    }
                });
            }
        }
        if loops.len() == 1 {
            loops.push(quote!(let _ = rest;));
        }
        quote! {
            #[doc = #doc]
            #[inline(always)]
            fn #name<const INPUTS: usize>(
                #(#parameters)*
                x: &[#kind; INPUTS],
                sums: &mut [#kind; #outputs],
            ) {
                let mut rest: &mut [#kind] = sums;
                #(#loops)*
            }
        }
    }

    /// One kind of blocks of the last layer but one, each with what it adds to the sums.
    fn piece(&self, part: Part, block: &Layer, last: &Layer) -> TokenStream {
        let weights = tables::weights(self.program, block.index, part);
        let biases = tables::biases(self.program, block.index, part);
        let next = tables::weights(self.program, last.index, part);
        let (function, length, x) = (tokens::layer(last.index), size(block.outputs), value(block.from));
        let activation = blocks(block).next().map(|(_, node)| node.activation);
        let stored = |tables: TokenStream| {
            activation.map(|activation| store(self.scalar, activation, &quote!(#tables, #x), &quote!(&mut part)))
        };
        if part == Part::Rest {
            let stored = stored(quote!(#(&#weights,)* &#biases));
            return quote! {
                let mut part = [EMPTY; #length];
                #stored
                #function(#(&#next,)* filled(&part), &mut q);
            };
        }
        let stored = stored(quote!(weights, bias));
        let (iterator, pattern, arguments) = match next.as_slice() {
            [next, tail] => (
                quote!(#next.iter().zip(&#tail)),
                quote!((next, tail)),
                quote!(next, tail,),
            ),
            _ => (quote!(#(&#next)*), quote!(next), quote!(next,)),
        };
        quote! {
            for ((weights, bias), #pattern) in #(#weights)*.iter().zip(&#biases).zip(#iterator) {
                let mut part = [EMPTY; #length];
                #stored
                #function(#arguments filled(&part), &mut q);
            }
        }
    }
}

/// The blocks of outputs of a layer, and what becomes of their sums.
fn blocks(layer: &Layer) -> impl Iterator<Item = (Part, &Store)> {
    layer.blocks().filter_map(|(part, _, body)| Some((part, stored(body)?)))
}

fn stored(body: &[Loop]) -> Option<&Store> {
    body.iter().find_map(|node| match node {
        Loop::Store(store) => Some(store),
        _ => None,
    })
}

/// A buffer as the input of a layer.
fn value(buffer: Buffer) -> TokenStream {
    match buffer {
        Buffer::Hidden(index) => {
            let name = hidden(index);
            quote!(filled(&#name))
        }
        Buffer::Input | Buffer::Block | Buffer::Output => quote!(observation),
    }
}
