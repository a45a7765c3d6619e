//! Tables, layers and `q_values`.

use policy::Scalar;
use proc_macro2::{Ident, TokenStream};
use quote::quote;

use super::number::{self, number};
use super::{float, ident, integer, kernels, size, streamed};
use crate::lower::network::{TANH_DENOMINATOR, TANH_NUMERATOR};
use crate::program::{ActivationCode, LayerCode, Literal, NetworkCode, Program};

/// Everything between observation and Q values.
pub fn items(program: &Program) -> TokenStream {
    let scalar = program.scalar();
    let kind = number::kind(scalar);
    let duties = program.duties.iter().map(|duty| number(scalar, *duty));
    let tanh = program
        .network
        .activates(|activation| activation == ActivationCode::Tanh)
        .then(|| tanh(scalar));
    let network = match &program.network {
        NetworkCode::Real { fused, layers, .. } => real(program, layers, *fused),
        NetworkCode::Integer(network) => integer::items(program, network),
    };
    quote! {
        static DUTIES: [#kind; ACTIONS] = [#(#duties),*];
        #tanh
        #network
    }
}

/// What argmax compares: type, value below all others, name of the selection.
pub fn argmax(program: &Program) -> (TokenStream, TokenStream) {
    match program.network {
        NetworkCode::Real { scalar, .. } => {
            let kind = number::kind(scalar);
            (quote!(#kind::MIN), quote!(select))
        }
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
    let scalar = program.scalar();
    let (items, body) = streamed::network(scalar, layers);
    let kind = number::kind(scalar);
    let aligned = layers.iter().find_map(|layer| layer.alignment).map(aligned);
    let fma = fused.then(fma);
    let accumulate = match (scalar, fused) {
        (Scalar::F32, true) => quote!(*sum = fma(*weight, *x, *sum);),
        (Scalar::F32, false) => quote!(*sum += *weight * *x;),
        // weights are binary32
        (Scalar::F64, _) => quote!(*sum += *weight as f64 * *x;),
    };
    let blocks = kernels::items(program, layers, &accumulate);
    quote! {
        #fma
        #aligned
        #blocks
        #items
        fn network(observation: &[#kind; FEATURES]) -> [#kind; ACTIONS] {
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
pub(super) fn layer_items(scalar: Scalar, index: usize, layer: &LayerCode) -> (TokenStream, TokenStream) {
    let kind = number::kind(scalar);
    let name = ident(&format!("layer{index}"));
    let doc = format!(" {}: {} -> {}", layer.name, layer.inputs, layer.outputs);
    let (inputs, outputs) = (size(layer.inputs), size(layer.outputs));
    let (rows, full) = (layer.block_rows, layer.full_blocks());
    let split = full * rows;
    let (weights, bias) = (ident(&format!("WEIGHTS{index}")), ident(&format!("BIAS{index}")));
    let blocks = layer.table[..split * layer.inputs]
        .chunks(rows * layer.inputs)
        .map(|block| columns(block, rows));
    let biases = layer.bias[..split].chunks(rows).map(|biases| sums(scalar, biases));
    let (rows_size, full_size) = (size(rows), size(full));
    let stored = kernels::store(scalar, layer.activation, &quote!(weights, bias, x), &quote!(out));
    let (tail_tables, tail_loop) = tail(scalar, index, layer);
    let type_of_weights = quote!([[[f32; #rows_size]; #inputs]; #full_size]);
    let (held, table) = (
        held(layer, &weights),
        table(layer, &weights, &type_of_weights, &quote!([#(#blocks),*])),
    );
    let tables = quote! {
        #table
        static #bias: [[#kind; #rows_size]; #full_size] = [#(#biases),*];
        #tail_tables
    };
    let function = quote! {
        #[doc = #doc]
        #[inline(always)]
        fn #name(x: &[#kind; #inputs], y: &mut [Slot; #outputs]) {
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
fn tail(scalar: Scalar, index: usize, layer: &LayerCode) -> (TokenStream, TokenStream) {
    let kind = number::kind(scalar);
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
    let biases = sums(scalar, &layer.bias[split..]);
    let (inputs, rows) = (size(layer.inputs), size(rows));
    let table = table(layer, &weights, &quote!([[f32; #rows]; #inputs]), &values);
    let held = held(layer, &weights);
    let stored = kernels::store(scalar, layer.activation, &quote!(&#held, &#bias, x), &quote!(out));
    let tables = quote! {
        #table
        static #bias: [#kind; #rows] = #biases;
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

/// Biases: sums start with them, so they have their type.
pub(super) fn sums(scalar: Scalar, values: &[f32]) -> TokenStream {
    let literal = |value: &f32| Literal::nearest(scalar, f64::from(*value));
    let values = values.iter().map(|value| number(scalar, literal(value)));
    quote!([#(#values),*])
}

pub(super) fn activation(scalar: Scalar, activation: ActivationCode) -> TokenStream {
    match activation {
        ActivationCode::Identity => quote!(sum),
        ActivationCode::Relu => quote!(relu(sum)),
        ActivationCode::LeakyRelu(slope) => {
            let slope = number(scalar, slope);
            quote!(leaky_relu(sum, #slope))
        }
        ActivationCode::Tanh => quote!(tanh(sum)),
    }
}

fn tanh(scalar: Scalar) -> TokenStream {
    let kind = number::kind(scalar);
    let (limit, nine, one) = number::limit(scalar);
    let steps = |letter: &str, terms: &[f64; 5]| {
        let name = ident(letter);
        let [lower @ .., highest] = terms.map(|term| number(scalar, Literal::nearest(scalar, term)));
        let lower = lower.iter().rev();
        quote! { let mut #name: #kind = #highest; #(#name = #name * z + #lower;)* }
    };
    let numerator = steps("p", &TANH_NUMERATOR);
    let denominator = steps("q", &TANH_DENOMINATOR);
    quote! {
        /// x limited to the magnitude with these bits, in integers so that loops over it can be vectorised
        #[inline(always)]
        #limit
        /// Rational approximation, |error| < 4e-7.
        #[inline(always)]
        fn tanh(x: #kind) -> #kind {
            let t = limit(x, #nine);
            let z = t * t;
            #numerator
            #denominator
            limit((p * t) / q, #one)
        }
    }
}
