//! The network in integers.

use proc_macro2::{Literal, TokenStream};
use quote::quote;
use targets::IntegerLoop;

use super::integrity::flat;
use super::{float, ident, kernels, size, word};
use crate::backend::assembly::Kernel;
use crate::program::{ActivationCode, IntegerLayer, IntegerNetwork, Program};

/// Tables, layers and `network`.
pub fn items(program: &Program, network: &IntegerNetwork) -> TokenStream {
    let weight = weight(network);
    let lanes = size(network.lanes.len());
    let (before, streamed) = network.pieces();
    let whole = before.iter().enumerate();
    let mut layers: Vec<TokenStream> = whole
        .map(|(index, layer)| layer_items(program, network, index, layer, None))
        .collect();
    if let Some((block, last)) = streamed {
        layers.push(last_tables(network, before.len() + 1, last));
        layers.push(layer_items(program, network, before.len(), block, Some(last)));
    }
    let names: Vec<_> = (0..network.lanes.len()).map(|i| ident(&format!("x{i}"))).collect();
    let products = network.lanes.iter().enumerate().map(|(at, lane)| {
        let (at, x) = (size(at), &names[*lane]);
        quote!(.wrapping_add(i32::from(weight[#at]).wrapping_mul(i32::from(*#x))))
    });
    let inputs = network.inputs.len();
    let padded = network.padded(inputs);
    let quantised = (0..padded).map(|i| match network.inputs.get(i) {
        Some(input) => {
            let i = size(i);
            let [unshifted, low, high] = [input.unshifted, input.low, input.high].map(|value| signed(i64::from(value)));
            quote!(integer(observation[#i], #unshifted, #low, #high))
        }
        None => quote!(0),
    });
    let (buffers, calls) = calls(network);
    let extremes = extremes(network);
    let q_value = (!program.has_fpu).then(|| q_value(network));
    let padded = size(padded);
    let doc = format!(
        " Sums of one block of outputs, within +-{} for every input.",
        network.accumulator_bound
    );
    quote! {
        #extremes
        /// x in the units of an input, rounded half up, from low to high. The mantissa is shifted by what x's exponent is
        /// below the one that needs no shift; a shift below 8 is beyond 16 bits, one above 30 leaves nothing.
        #[inline(always)]
        fn integer(x: f32, unshifted: i32, low: i32, high: i32) -> i16 {
            let bits = x.to_bits();
            let sign = (bits as i32) >> 31;
            let mantissa = ((bits & 0x007F_FFFF) | 0x0080_0000) as i32;
            let shift = least(most(unshifted.wrapping_sub(((bits >> 23) & 255) as i32), 8), 30);
            let half = 1_i32.wrapping_shl((shift as u32).wrapping_sub(1));
            let rounded = (mantissa ^ sign).wrapping_sub(sign).wrapping_add(half).wrapping_shr(shift as u32);
            least(most(rounded, low), high) as i16
        }
        #q_value
        #[inline(always)]
        #[allow(dead_code)]
        fn positive(x: i32) -> i16 {
            (x & !(x >> 31)) as i16
        }
        #[inline(always)]
        #[allow(dead_code)]
        fn leaky_integer(x: i32, slope: i32) -> i16 {
            let negative = x >> 31;
            ((x & !negative) | ((x.wrapping_mul(slope).wrapping_add(16_384) >> 15) & negative)) as i16
        }
        #[inline(always)]
        fn select_integer(flag: u32, then: i32, otherwise: i32) -> i32 {
            let mask = 0_u32.wrapping_sub(flag) as i32;
            (then & mask) | (otherwise & !mask)
        }
        /// Aligned to words, as the loops in assembly load them.
        #[repr(align(4))]
        struct Words<T>(T);
        #[doc = #doc]
        #[inline(always)]
        #[allow(dead_code)]
        fn block<const GROUPS: usize, const ROWS: usize>(
            weights: &[[[#weight; #lanes]; ROWS]; GROUPS],
            bias: &[i32; ROWS],
            x: &[i16],
        ) -> [i32; ROWS] {
            let mut sums = *bias;
            for (column, group) in weights.iter().zip(x.chunks_exact(#lanes)) {
                if let [#(#names),*] = group {
                    for (sum, weight) in sums.iter_mut().zip(column) {
                        *sum = sum #(#products)*;
                    }
                }
            }
            sums
        }
        #(#layers)*
        /// Outputs as integers.
        fn network(observation: &[f32; FEATURES]) -> [i32; ACTIONS] {
            let input: Words<[i16; #padded]> = Words([#(#quantised),*]);
            #buffers
            #calls
        }
    }
}

/// The larger and the smaller of two numbers: a selection where the cores have one, else by masks.
fn extremes(network: &IntegerNetwork) -> TokenStream {
    let (most, least) = if network.block.inner == IntegerLoop::Dual {
        (quote!(x.max(y)), quote!(x.min(y)))
    } else {
        (
            quote!(x.wrapping_sub(x.wrapping_sub(y) & core::hint::black_box(x.wrapping_sub(y) >> 31))),
            quote!(x.wrapping_add(y.wrapping_sub(x) & core::hint::black_box(y.wrapping_sub(x) >> 31))),
        )
    };
    quote! {
        /// The larger of two numbers whose difference fits.
        #[inline(always)]
        fn most(x: i32, y: i32) -> i32 {
            #most
        }
        /// The smaller of two numbers whose difference fits.
        #[inline(always)]
        fn least(x: i32, y: i32) -> i32 {
            #least
        }
    }
}

/// Output buffers of all layers, and the calls that fill them.
fn calls(network: &IntegerNetwork) -> (TokenStream, TokenStream) {
    let mut buffers = Vec::new();
    let mut calls = Vec::new();
    let mut source = ident("input");
    let (before, streamed) = network.pieces();
    for (index, layer) in before.iter().enumerate() {
        let (kind, length) = sink(network, index, layer);
        let (sink, function) = (ident(&format!("hidden{index}")), ident(&format!("layer{index}")));
        buffers.push(quote! { let mut #sink: Words<[#kind; #length]> = Words([0; #length]); });
        calls.push(quote! { #function(&#source, &mut #sink); });
        source = sink;
    }
    let Some((_, last)) = streamed else {
        return (quote!(#(#buffers)*), quote!(#(#calls)* #source.0));
    };
    let (function, bias) = (
        ident(&format!("layer{}", before.len())),
        ident(&format!("BIAS{}", before.len() + 1)),
    );
    buffers.push(quote! { let mut sums = Words(#bias); });
    calls.push(quote! { #function(&#source, &mut sums); });
    let cut = cut(last);
    (quote!(#(#buffers)*), quote!(#(#calls)* sums.0.map(|sum| #cut)))
}

/// Type and length of a layer's output.
fn sink(network: &IntegerNetwork, index: usize, layer: &IntegerLayer) -> (TokenStream, Literal) {
    if index + 1 == network.layers.len() {
        (quote!(i32), size(layer.outputs))
    } else {
        (quote!(i16), size(network.padded(layer.outputs)))
    }
}

/// An output as Q value by its bits: a library of floats would take longer for one than for another.
fn q_value(network: &IntegerNetwork) -> TokenStream {
    let field = signed(i64::from(network.q_field));
    quote! {
        /// An output as Q value, its bits put together: a library of floats would take longer for one than for another.
        #[inline(always)]
        fn q_value(output: i32) -> f32 {
            let sign = output >> 31;
            let mut mantissa = (output ^ sign).wrapping_sub(sign) as u32;
            let mut exponent = #field as u32;
            let mut step = 16_u32;
            while step != 0 {
                let small = flag(mantissa.wrapping_sub(1_u32.wrapping_shl(25_u32.wrapping_sub(step))) as i32 & i32::MIN != 0);
                mantissa = mantissa.wrapping_shl(small.wrapping_mul(step));
                exponent = exponent.wrapping_sub(small.wrapping_mul(step));
                step >>= 1;
            }
            let bits = ((sign as u32) << 31) | (exponent << 23) | ((mantissa >> 1) & 0x007F_FFFF);
            f32::from_bits(bits & 0_u32.wrapping_sub(mantissa >> 24))
        }
    }
}

/// Body of `q_values`.
pub fn q_values(network: &IntegerNetwork, has_fpu: bool) -> TokenStream {
    if !has_fpu {
        return quote!(network(observation).map(q_value));
    }
    let unit = float(network.q_unit.single());
    quote!(network(observation).map(|q| q as f32 * #unit))
}

/// Statements of the integrity check.
pub fn integrity(network: &IntegerNetwork) -> TokenStream {
    let layers = network.layers.iter().enumerate().map(|(index, layer)| {
        // biases of a streamed layer are one row, its weights have no blocks
        let (names, biases, depth): (Vec<_>, Vec<_>, usize) = if layer.is_streamed() {
            let names = chunks(index, layer).into_iter().map(|(weights, ..)| weights);
            (names.collect(), vec![ident(&format!("BIAS{index}"))], 2)
        } else {
            let (names, biases) = blocks(index, layer)
                .into_iter()
                .map(|(weights, bias, ..)| (weights, bias))
                .unzip();
            (names, biases, 3)
        };
        let weights = names.iter().map(|weights| flat(&quote!(#weights.0), depth));
        let biases = biases.iter().map(|bias| flat(&quote!(#bias), depth - 2));
        quote!(#(span.weights(#weights);)* #(span.biases(#biases);)*)
    });
    quote!(#(#layers)*)
}

/// Type of a weight.
pub fn weight(network: &IntegerNetwork) -> TokenStream {
    if network.weight_bytes == 1 {
        quote!(i8)
    } else {
        quote!(i16)
    }
}

/// Names of the weights of a streamed layer, inputs of a chunk and number of chunks: the full ones, then the shorter last one.
fn chunks(index: usize, layer: &IntegerLayer) -> Vec<(proc_macro2::Ident, usize, usize)> {
    let (full, rest) = (layer.inputs / layer.chunk, layer.inputs % layer.chunk);
    let mut all = vec![(ident(&format!("WEIGHTS{index}")), layer.chunk, full)];
    if rest > 0 {
        all.push((ident(&format!("TAIL_WEIGHTS{index}")), rest, 1));
    }
    all
}

/// Tables of a streamed layer: for each chunk of inputs the weights of every sum.
fn last_tables(network: &IntegerNetwork, index: usize, layer: &IntegerLayer) -> TokenStream {
    let kind = weight(network);
    let outputs = size(layer.outputs);
    let mut rest = layer.table.as_slice();
    let tables = chunks(index, layer).into_iter().map(|(name, inputs, count)| {
        let width = network.padded(inputs);
        let (part, after) = rest.split_at(count * layer.outputs * width);
        rest = after;
        let parts = part.chunks(layer.outputs * width).map(|chunk| {
            let rows = chunk.chunks(width).map(|row| {
                let row = row.iter().map(|weight| signed(i64::from(*weight)));
                quote!([#(#row),*])
            });
            quote!([#(#rows),*])
        });
        let (count, width) = (size(count), size(width));
        quote! { static #name: Words<[[[#kind; #width]; #outputs]; #count]> = Words([#(#parts),*]); }
    });
    let tables: Vec<TokenStream> = tables.collect();
    let name = ident(&format!("BIAS{index}"));
    let bias = layer.bias.iter().map(|bias| signed(i64::from(*bias)));
    quote! { #(#tables)* static #name: [i32; #outputs] = [#(#bias),*]; }
}

/// The loop over blocks of `height` outputs that adds each to the sums of the streamed layer.
fn added(
    network: &IntegerNetwork,
    layer: &IntegerLayer,
    names: [&proc_macro2::Ident; 3],
    height: usize,
) -> TokenStream {
    let [weights, bias, next] = names;
    let lanes = &network.lanes;
    let outputs: Vec<_> = (0..height).map(|i| ident(&format!("y{i}"))).collect();
    let products = (0..network.padded(height)).filter_map(|at| {
        let output = outputs.get(at / lanes.len() * lanes.len() + lanes[at % lanes.len()])?;
        let at = size(at);
        Some(quote!(.wrapping_add(i32::from(weight[#at]).wrapping_mul(i32::from(#output)))))
    });
    let activated = activated(layer, false);
    quote! {
        for ((weights, bias), next) in #weights.0.iter().zip(&#bias).zip(&#next.0) {
            let [#(#outputs),*] = block(weights, bias, &x.0).map(|sum| #activated);
            for (sum, weight) in y.0.iter_mut().zip(next) {
                *sum = sum #(#products)*;
            }
        }
    }
}

/// Names of weights and bias, first output and height of the full blocks and of the shorter last one.
fn blocks(index: usize, layer: &IntegerLayer) -> Vec<(proc_macro2::Ident, proc_macro2::Ident, usize, usize)> {
    let name = |kind: &str| ident(&format!("{kind}{index}"));
    let rows = layer.block_rows;
    let (full, tail) = (layer.outputs / rows, layer.outputs % rows);
    let mut all = vec![(name("WEIGHTS"), name("BIAS"), 0, rows)];
    if tail > 0 {
        all.push((name("TAIL_WEIGHTS"), name("TAIL_BIAS"), full * rows, tail));
    }
    all
}

/// Tables and function of a layer; with `last` its blocks go into the sums of that streamed layer.
fn layer_items(
    program: &Program,
    network: &IntegerNetwork,
    index: usize,
    layer: &IntegerLayer,
    streamed: Option<&IntegerLayer>,
) -> TokenStream {
    let is_last = index + 1 == network.layers.len();
    let lanes = network.lanes.len();
    let groups = network.groups(layer.inputs);
    let names = blocks(index, layer);
    let split = names.last().map_or(0, |(_, _, first, height)| {
        if *height == layer.block_rows {
            layer.outputs
        } else {
            *first
        }
    });
    let mut tables = Vec::new();
    let mut loops = Vec::new();
    let mut kernels = Vec::new();
    let mut kernel_calls = Vec::new();
    let next = streamed.map(|last| chunks(index + 1, last));
    for (at, (weights, bias, first, height)) in names.iter().enumerate() {
        let last = if *first == 0 { split } else { layer.outputs };
        let part = &layer.table[first * groups * lanes..last * groups * lanes];
        let parts = part
            .chunks(height * groups * lanes)
            .map(|block| nested(block, *height, lanes));
        let biases = layer.bias[*first..last].chunks(*height).map(|row| {
            let row = row.iter().map(|bias| signed(i64::from(*bias)));
            quote!([#(#row),*])
        });
        let (kind, lanes) = (weight(network), size(lanes));
        let (count, rows, groups) = (size((last - first) / height), size(*height), size(groups));
        let activated = activated(layer, is_last);
        tables.push(quote! {
            static #weights: Words<[[[[#kind; #lanes]; #rows]; #groups]; #count]> = Words([#(#parts),*]);
            static #bias: [[i32; #rows]; #count] = [#(#biases),*];
        });
        let next = next.as_ref().and_then(|next| next.get(at)).map(|(next, ..)| next);
        let whole = quote! {
            for (weights, bias) in #weights.0.iter().zip(&#bias) {
                if let Some((out, after)) = core::mem::take(&mut rest).split_first_chunk_mut::<#rows>() {
                    for (y, sum) in out.iter_mut().zip(block(weights, bias, &x.0)) {
                        *y = #activated;
                    }
                    rest = after;
                }
            }
        };
        loops.push(match next {
            Some(next) => added(network, layer, [weights, bias, next], *height),
            None => whole,
        });
        let blocks = ((last - first) / height, *height);
        if let Some(kernel) = kernel(program, network, index, layer, blocks, streamed) {
            let (name, first) = (
                kernel_name(index, *height),
                size(if next.is_some() { 0 } else { *first }),
            );
            let next = next.map(|next| quote!(, #next.0.as_ptr().cast()));
            kernels.push(kernel);
            kernel_calls.push(quote! {
                #name(x.0.as_ptr(), y.0.as_mut_ptr().add(#first), #weights.0.as_ptr().cast(), #bias.as_ptr().cast() #next);
            });
        }
    }
    let name = ident(&format!("layer{index}"));
    let doc = format!(
        " {}: {} -> {}, cut by {} bits",
        layer.name, layer.inputs, layer.outputs, layer.shift
    );
    let inputs = size(network.padded(layer.inputs));
    let (kind, length) = match streamed {
        Some(last) => (quote!(i32), size(last.outputs)),
        None => sink(network, index, layer),
    };
    let head = quote!(fn #name(x: &Words<[i16; #inputs]>, y: &mut Words<[#kind; #length]>));
    let rest = streamed
        .is_none()
        .then(|| quote! { let mut rest: &mut [#kind] = &mut y.0; });
    let portable = quote! { #rest #(#loops)* };
    if kernels.is_empty() {
        return quote! { #(#tables)* #[doc = #doc] #[inline(always)] #head { #portable } };
    }
    // all within the function, because on an item `allow` does not reach the item's own condition
    quote! {
        #(#tables)*
        #[doc = #doc]
        #[inline(always)]
        #[allow(unexpected_cfgs)]
        #head {
            #(#kernels)*
            // SAFETY: reads all of `x` and of the tables, writes outputs of `y`; all are aligned to words
            #[cfg(all(target_arch = "arm", policyc_assembly))]
            unsafe { #(#kernel_calls)* }
            #[cfg(not(all(target_arch = "arm", policyc_assembly)))]
            { #portable }
        }
    }
}

fn kernel_name(index: usize, height: usize) -> proc_macro2::Ident {
    ident(&format!("kernel{index}_{height}"))
}

/// All blocks of a height in assembly, for ARM cores with `SMLAD` if the build asks for it.
fn kernel(
    program: &Program,
    network: &IntegerNetwork,
    index: usize,
    layer: &IntegerLayer,
    blocks: (usize, usize),
    streamed: Option<&IntegerLayer>,
) -> Option<TokenStream> {
    let kernel = Kernel::of(network, layer, blocks, index + 1 == network.layers.len(), streamed)?;
    // braces of a register list are doubled: single ones are operands
    let text = kernel.text(&|registers| format!("{{{{{registers}}}}}"));
    let (name, weight) = (kernel_name(index, blocks.1), weight(network));
    let (sink, _) = sink(network, index, layer);
    let sink = if streamed.is_some() { quote!(i32) } else { sink };
    let next = streamed.map(|_| quote!(, next: *const #weight));
    let processor = kernels::processor(program);
    Some(quote! {
        /// `--cfg policyc_assembly` takes the loops in assembly (Armv7E-M and Armv8-M with DSP); the bits are the same.
        #[cfg(all(target_arch = "arm", policyc_assembly))]
        #[unsafe(naked)]
        unsafe extern "C" fn #name(x: *const i16, y: *mut #sink, weights: *const #weight, bias: *const i32 #next) {
            core::arch::naked_asm!(#processor, #(#text),*)
        }
    })
}

fn nested(block: &[i16], rows: usize, lanes: usize) -> TokenStream {
    let columns = block.chunks(rows * lanes).map(|column| {
        let weights = column.chunks(lanes).map(|group| {
            let group = group.iter().map(|weight| signed(i64::from(*weight)));
            quote!([#(#group),*])
        });
        quote!([#(#weights),*])
    });
    quote!([#(#columns),*])
}

/// A signed literal without suffix.
fn signed(value: i64) -> TokenStream {
    let magnitude = Literal::u64_unsuffixed(value.unsigned_abs());
    if value < 0 {
        quote!(-#magnitude)
    } else {
        quote!(#magnitude)
    }
}

fn cut(layer: &IntegerLayer) -> TokenStream {
    let shift = word(layer.shift);
    if layer.shift == 0 {
        quote!(sum)
    } else {
        quote!(sum >> #shift)
    }
}

fn activated(layer: &IntegerLayer, is_last: bool) -> TokenStream {
    let cut = cut(layer);
    match layer.activation {
        ActivationCode::Identity if is_last => cut,
        ActivationCode::Identity if layer.shift == 0 => quote!(sum as i16),
        ActivationCode::Identity => quote!((#cut) as i16),
        ActivationCode::Relu => quote!(positive(#cut)),
        ActivationCode::LeakyRelu(_) => {
            let slope = signed(i64::from(layer.slope));
            quote!(leaky_integer(#cut, #slope))
        }
        ActivationCode::Tanh => {
            let unit = float(layer.unit.single());
            quote!(((tanh(sum as f32 * #unit) * 16_384.0 + 32_768.5) as i32).wrapping_sub(32_768) as i16)
        }
    }
}
