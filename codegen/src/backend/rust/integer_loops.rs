//! Loops over integers: functions of the layers, and the body of `network`.
//!
//! ```text
//!  for (weights, bias) in WEIGHTS0, BIAS0          one turn a block
//!      block(weights, bias, x)                     its sums, over all groups of inputs
//!      cut, activation ─► y                        or, where the last layer is streamed,
//!      cut, activation ─► registers ─► y += ...    into every sum of that layer
//! ```
//!
//! In: `x`, whole groups of 16-bit integers, with zeros behind the last input. Out: `y`, the next layer's `x` or the sums of the
//! last layer. The one invariant: no index and no division, so no way to a panic; slices and outputs are walked side by side.

use proc_macro2::{Ident, TokenStream};
use quote::quote;

use super::tables;
use super::tokens::{self, hidden, ident, size};
use crate::activation::{rust_cut, text_of};
use crate::assembly;
use crate::assembly::integer::Kernel;
use crate::program::{Add, Buffer, IntegerCode, Layer, Loop, Part, Program};

/// Tables and functions of all layers, and the body of `network`.
pub fn network(program: &Program, code: &IntegerCode, weight: &TokenStream) -> (TokenStream, TokenStream) {
    let printer = Printer { program, weight };
    let (mut items, mut buffers, mut calls) = (Vec::new(), Vec::new(), Vec::new());
    let mut result = quote!();
    for layer in program.network.pieces() {
        items.extend(layer.next.map(|last| tables::layer(program, last, true)));
        items.push(tables::layer(program, layer.index, false));
        items.push(printer.function(layer));
        let (name, source) = (tokens::layer(layer.index), buffer(layer.from));
        let (sink, value) = match layer.next {
            Some(last) => {
                // sums of a streamed layer start from its biases; they are cut at the end, when all blocks are in
                let biases = tables::biases(program, last, Part::Full);
                let cut = rust_cut(code.output_shift);
                result = quote!(sums.0.map(|sum| #cut));
                (ident("sums"), quote!(let mut sums = Words(#biases);))
            }
            None => {
                let sink = hidden(layer.index);
                let (kind, length) = printer.sink(layer);
                result = quote!(#sink.0);
                (
                    sink.clone(),
                    quote!(let mut #sink: Words<[#kind; #length]> = Words([0; #length]);),
                )
            }
        };
        buffers.push(value);
        calls.push(quote! { #name(&#source, &mut #sink); });
    }
    (quote!(#(#items)*), quote!(#(#buffers)* #(#calls)* #result))
}

struct Printer<'a> {
    program: &'a Program,
    weight: &'a TokenStream,
}

impl Printer<'_> {
    /// Type and length of what a layer writes.
    fn sink(&self, layer: &Layer) -> (TokenStream, TokenStream) {
        let length = size(self.program.network.length(layer.to));
        let kind = match layer.to {
            Buffer::Hidden(_) => quote!(i16),
            _ => quote!(i32),
        };
        (kind, quote!(#length))
    }

    fn function(&self, layer: &Layer) -> TokenStream {
        let shape = &self.program.network.layers[layer.index];
        let doc = format!(
            " {}: {} -> {}, cut by {} bits",
            shape.name, shape.inputs, shape.outputs, shape.shift
        );
        let (name, inputs) = (
            tokens::layer(layer.index),
            size(self.program.network.padded(layer.inputs)),
        );
        let (kind, length) = self.sink(layer);
        let head = quote!(fn #name(x: &Words<[i16; #inputs]>, y: &mut Words<[#kind; #length]>));
        let rest = layer
            .next
            .is_none()
            .then(|| quote! { let mut rest: &mut [#kind] = &mut y.0; });
        let loops = layer
            .blocks()
            .filter_map(|(part, _, body)| self.repeat(layer, part, body));
        let portable = quote! { #rest #(#loops)* };
        if !layer.has_assembly {
            return quote! { #[doc = #doc] #[inline(always)] #head { #portable } };
        }
        let (kernels, calls) = self.kernels(layer);
        // all within the function, because on an item `allow` does not reach the item's own condition
        quote! {
            #[doc = #doc]
            #[inline(always)]
            #[allow(unexpected_cfgs)]
            #head {
                #(#kernels)*
                // SAFETY: reads all of `x` and of the tables, writes outputs of `y`; all are aligned to words
                #[cfg(all(target_arch = "arm", policyc_assembly))]
                unsafe { #(#calls)* }
                #[cfg(not(all(target_arch = "arm", policyc_assembly)))]
                { #portable }
            }
        }
    }

    /// The loop over blocks of one height.
    fn repeat(&self, layer: &Layer, part: Part, body: &[Loop]) -> Option<TokenStream> {
        let weights = tables::weights(self.program, layer.index, part);
        let biases = tables::biases(self.program, layer.index, part)?;
        let [Loop::Sums(_), Loop::Store(store), added @ ..] = body else {
            return None;
        };
        let activated = text_of(store.activation).rust_integer(store, &store.cut?);
        let rows = size(store.rows);
        if let [Loop::Add(add)] = added {
            let next = tables::weights(self.program, add.layer, part);
            // names and no array: outputs stay in registers, and no index could be wrong
            let outputs: Vec<Ident> = (0..add.inputs).map(|i| ident(&format!("y{i}"))).collect();
            let products = self.products(add, &outputs);
            return Some(quote! {
                for ((weights, bias), next) in #(#weights)*.iter().zip(&#biases).zip(#(&#next)*) {
                    let [#(#outputs),*] = block(weights, bias, &x.0).map(|sum| #activated);
                    for (sum, weight) in y.0.iter_mut().zip(next) {
                        *sum = sum #(#products)*;
                    }
                }
            });
        }
        Some(quote! {
            for (weights, bias) in #(#weights)*.iter().zip(&#biases) {
                if let Some((out, after)) = core::mem::take(&mut rest).split_first_chunk_mut::<#rows>() {
                    for (y, sum) in out.iter_mut().zip(block(weights, bias, &x.0)) {
                        *y = #activated;
                    }
                    rest = after;
                }
            }
        })
    }

    /// What a block of outputs adds to a sum; weights of outputs that the last group lacks are left out.
    fn products(&self, add: &Add, outputs: &[Ident]) -> Vec<TokenStream> {
        let network = &self.program.network;
        let lanes = &network.lanes;
        let products = (0..network.padded(add.inputs)).filter_map(|at| {
            let output = outputs.get(at / lanes.len() * lanes.len() + lanes[at % lanes.len()])?;
            let at = size(at);
            Some(quote!(.wrapping_add(i32::from(weight[#at]).wrapping_mul(i32::from(#output)))))
        });
        products.collect()
    }

    /// The kernels of a layer, one a height of blocks, and their calls.
    fn kernels(&self, layer: &Layer) -> (Vec<TokenStream>, Vec<TokenStream>) {
        let (mut kernels, mut calls, mut first) = (Vec::new(), Vec::new(), 0);
        for (part, count, body) in layer.blocks() {
            let Some(kernel) = Kernel::of(&self.program.network, count, body) else {
                continue;
            };
            let name = ident(&format!("kernel{}_{}", layer.index, kernel.height));
            let weights = tables::weights(self.program, layer.index, part);
            let biases = tables::biases(self.program, layer.index, part);
            let next = layer.next.map(|last| tables::weights(self.program, last, part));
            let next = next.into_iter().flatten().map(|next| quote!(, #next.as_ptr().cast()));
            // every block of a streamed layer adds to all sums, from the first
            let at = size(if layer.next.is_some() { 0 } else { first });
            kernels.push(assembly::rust::integer(&kernel, &name, self.program, self.weight));
            calls.push(quote! {
                #name(x.0.as_ptr(), y.0.as_mut_ptr().add(#at), #(#weights)*.as_ptr().cast(), #biases.as_ptr().cast() #(#next)*);
            });
            first += count * kernel.height;
        }
        (kernels, calls)
    }
}

fn buffer(buffer: Buffer) -> Ident {
    match buffer {
        Buffer::Hidden(index) => hidden(index),
        Buffer::Input | Buffer::Block | Buffer::Output => ident("input"),
    }
}
