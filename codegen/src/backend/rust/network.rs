//! Tables, layers and `q_values`.

use proc_macro2::{Ident, TokenStream};
use quote::quote;

use super::{float, ident, integer, kernels, size, streamed};
use crate::lower::network::{TANH_DENOMINATOR, TANH_NUMERATOR};
use crate::program::{ActivationCode, LayerCode, NetworkCode, Program};

/// Everything between observation and Q values.
pub fn items(program: &Program) -> TokenStream {
    let duties = program.duties.iter().map(|duty| float(duty.value()));
    let tanh = program
        .network
        .activates(|activation| activation == ActivationCode::Tanh)
        .then(tanh);
    let network = match &program.network {
        NetworkCode::Real { fused, layers } => real(program, layers, *fused),
        NetworkCode::Integer(network) => integer::items(program, network),
    };
    quote! {
        static DUTIES: [f32; ACTIONS] = [#(#duties),*];
        #tanh
        #network
    }
}

/// What argmax compares: type, value below all others, name of the selection.
pub fn argmax(program: &Program) -> (TokenStream, TokenStream) {
    match program.network {
        NetworkCode::Real { .. } => (quote!(f32::MIN), quote!(select)),
        NetworkCode::Integer(_) => (quote!(i32::MIN), quote!(select_integer)),
    }
}

/// Body of `q_values`.
pub fn q_values(program: &Program) -> TokenStream {
    match &program.network {
        NetworkCode::Real { .. } => quote!(network(observation)),
        NetworkCode::Integer(network) => integer::q_values(network, program.has_fpu),
    }
}

fn real(program: &Program, layers: &[LayerCode], fused: bool) -> TokenStream {
    let (items, body) = streamed::network(layers);
    let aligned = layers.iter().find_map(|layer| layer.alignment).map(aligned);
    let fma = fused.then(fma);
    let accumulate = if fused {
        quote!(*sum = fma(*weight, *x, *sum);)
    } else {
        quote!(*sum += *weight * *x;)
    };
    let blocks = kernels::items(program, layers, &accumulate);
    quote! {
        #fma
        #aligned
        #blocks
        #items
        fn network(observation: &[f32; FEATURES]) -> [f32; ACTIONS] {
            #body
        }
    }
}

fn aligned(bytes: u32) -> TokenStream {
    let bytes = size(bytes as usize);
    quote! {
        /// So that no vector of weights lies across two lines of the cache.
        #[repr(align(#bytes))]
        struct Aligned<T>(T);
    }
}

/// Table of weights of a layer.
pub(super) fn table(layer: &LayerCode, name: &Ident, kind: &TokenStream, value: &TokenStream) -> TokenStream {
    match layer.alignment {
        Some(_) => quote! { static #name: Aligned<#kind> = Aligned(#value); },
        None => quote! { static #name: #kind = #value; },
    }
}

/// What [`table`] holds.
pub(super) fn held(layer: &LayerCode, name: &Ident) -> TokenStream {
    match layer.alignment {
        Some(_) => quote!(#name.0),
        None => quote!(#name),
    }
}

fn fma() -> TokenStream {
    quote! {
        /// x * y + z, rounded once: `core` has no fused multiply-add, so through binary64 rounded to odd.
        #[inline(always)]
        fn fma(x: f32, y: f32, z: f32) -> f32 {
            let (product, z) = (f64::from(x) * f64::from(y), f64::from(z));
            let sum = product + z;
            let back = sum - product;
            let error = (product - (sum - back)) + (z - back);
            let odd = (u64::from(error < 0.0) | u64::from(error > 0.0)) & !sum.to_bits();
            let towards = 1_u64.wrapping_sub(((error.to_bits() ^ sum.to_bits()) >> 63) << 1);
            f64::from_bits(sum.to_bits().wrapping_add(odd.wrapping_mul(towards))) as f32
        }
    }
}

/// Tables, and the function of the whole layer.
pub(super) fn layer_items(index: usize, layer: &LayerCode) -> (TokenStream, TokenStream) {
    let name = ident(&format!("layer{index}"));
    let doc = format!(" {}: {} -> {}", layer.name, layer.inputs, layer.outputs);
    let (inputs, outputs) = (size(layer.inputs), size(layer.outputs));
    let (rows, full) = (layer.block_rows, layer.full_blocks());
    let split = full * rows;
    let (weights, bias) = (ident(&format!("WEIGHTS{index}")), ident(&format!("BIAS{index}")));
    let blocks = layer.table[..split * layer.inputs]
        .chunks(rows * layer.inputs)
        .map(|block| columns(block, rows));
    let biases = layer.bias[..split].chunks(rows).map(row);
    let (rows_size, full_size) = (size(rows), size(full));
    let stored = kernels::store(layer.activation, &quote!(weights, bias, x), &quote!(out));
    let (tail_tables, tail_loop) = tail(index, layer);
    let kind = quote!([[[f32; #rows_size]; #inputs]; #full_size]);
    let (held, table) = (
        held(layer, &weights),
        table(layer, &weights, &kind, &quote!([#(#blocks),*])),
    );
    let tables = quote! {
        #table
        static #bias: [[f32; #rows_size]; #full_size] = [#(#biases),*];
        #tail_tables
    };
    let function = quote! {
        #[doc = #doc]
        #[inline(always)]
        fn #name(x: &[f32; #inputs], y: &mut [Slot; #outputs]) {
            let mut rest: &mut [Slot] = y;
            for (weights, bias) in #held.iter().zip(&#bias) {
                // no division and no slice index, so no way to a panic at any optimisation level
                if let Some((out, after)) = core::mem::take(&mut rest).split_first_chunk_mut::<#rows_size>() {
                    #stored
                    rest = after;
                }
            }
            #tail_loop
        }
    };
    (tables, function)
}

/// The shorter last block, if there is one.
fn tail(index: usize, layer: &LayerCode) -> (TokenStream, TokenStream) {
    let rows = layer.tail_rows();
    if rows == 0 {
        return (TokenStream::new(), TokenStream::new());
    }
    let split = layer.outputs - rows;
    let (weights, bias) = (
        ident(&format!("TAIL_WEIGHTS{index}")),
        ident(&format!("TAIL_BIAS{index}")),
    );
    let values = columns(&layer.table[split * layer.inputs..], rows);
    let biases = row(&layer.bias[split..]);
    let (inputs, rows) = (size(layer.inputs), size(rows));
    let table = table(layer, &weights, &quote!([[f32; #rows]; #inputs]), &values);
    let held = held(layer, &weights);
    let stored = kernels::store(layer.activation, &quote!(&#held, &#bias, x), &quote!(out));
    let tables = quote! {
        #table
        static #bias: [f32; #rows] = #biases;
    };
    let code = quote! {
        if let Some((out, _)) = rest.split_first_chunk_mut::<#rows>() {
            #stored
        }
    };
    (tables, code)
}

pub(super) fn columns(block: &[f32], rows: usize) -> TokenStream {
    let columns = block.chunks(rows).map(row);
    quote!([#(#columns),*])
}

pub(super) fn row(values: &[f32]) -> TokenStream {
    let values = values.iter().map(|value| float(*value));
    quote!([#(#values),*])
}

pub(super) fn activation(activation: ActivationCode) -> TokenStream {
    match activation {
        ActivationCode::Identity => quote!(sum),
        ActivationCode::Relu => quote!(relu(sum)),
        ActivationCode::LeakyRelu(slope) => {
            let slope = float(slope.value());
            quote!(leaky_relu(sum, #slope))
        }
        ActivationCode::Tanh => quote!(tanh(sum)),
    }
}

fn tanh() -> TokenStream {
    let steps = |letter: &str, terms: &[f32; 5]| {
        let name = ident(letter);
        let highest = float(terms[4]);
        let lower = terms.iter().rev().skip(1).map(|term| float(*term));
        quote! { let mut #name: f32 = #highest; #(#name = #name * z + #lower;)* }
    };
    let numerator = steps("p", &TANH_NUMERATOR);
    let denominator = steps("q", &TANH_DENOMINATOR);
    quote! {
        /// x limited to the magnitude with these bits, in integers so that loops over it can be vectorised
        #[inline(always)]
        fn limit(x: f32, limit: u32) -> f32 {
            let magnitude = x.to_bits() & 0x7FFF_FFFF;
            let below = 0_u32.wrapping_sub(magnitude.wrapping_sub(limit) >> 31);
            f32::from_bits((x.to_bits() & 0x8000_0000) | (magnitude & below) | (limit & !below))
        }
        /// Rational approximation, |error| < 4e-7.
        #[inline(always)]
        fn tanh(x: f32) -> f32 {
            let t = limit(x, 0x4110_0000);
            let z = t * t;
            #numerator
            #denominator
            limit((p * t) / q, 0x3F80_0000)
        }
    }
}

/// Statements of the integrity check: every table in the order of [`Program::table_words`]. `black_box`: the memory is
/// read, the compiler does not answer in its place.
pub fn integrity(program: &Program) -> TokenStream {
    let network = match &program.network {
        NetworkCode::Real { layers, .. } => {
            let layers = layers
                .iter()
                .enumerate()
                .map(|(index, layer)| match layer.is_streamed() {
                    true => streamed::integrity(index, layer),
                    false => layer_integrity(index, layer),
                });
            quote!(#(#layers)*)
        }
        NetworkCode::Integer(network) => integer::integrity(network),
    };
    quote! { #network crc = crc_floats(crc, core::hint::black_box(&DUTIES)); }
}

fn layer_integrity(index: usize, layer: &LayerCode) -> TokenStream {
    let (weights, bias) = (ident(&format!("WEIGHTS{index}")), ident(&format!("BIAS{index}")));
    let (tail_weights, tail_bias) = (
        ident(&format!("TAIL_WEIGHTS{index}")),
        ident(&format!("TAIL_BIAS{index}")),
    );
    let [weights, tail_weights] = [weights, tail_weights].map(|name| held(layer, &name));
    let full_weights = quote! {
        for column in core::hint::black_box(&#weights).iter().flatten() { crc = crc_floats(crc, column); }
    };
    let full_bias = quote! { for row in core::hint::black_box(&#bias) { crc = crc_floats(crc, row); } };
    if layer.tail_rows() == 0 {
        return quote! { #full_weights #full_bias };
    }
    quote! {
        #full_weights
        for column in core::hint::black_box(&#tail_weights) { crc = crc_floats(crc, column); }
        #full_bias
        crc = crc_floats(crc, core::hint::black_box(&#tail_bias));
    }
}
