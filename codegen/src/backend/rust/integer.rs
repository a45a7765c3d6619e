//! The network in integers.

use proc_macro2::{Literal, TokenStream};
use quote::quote;

use super::network::calls;
use super::{float, ident, size, word};
use crate::backend::assembly::Kernel;
use crate::program::{ActivationCode, IntegerLayer, IntegerNetwork};

/// Tables, layers and `network`.
pub fn items(network: &IntegerNetwork) -> TokenStream {
    let weight = weight(network);
    let lanes = size(network.lanes.len());
    let layers = network
        .layers
        .iter()
        .enumerate()
        .map(|(index, layer)| layer_items(network, index, layer));
    let names: Vec<_> = (0..network.lanes.len()).map(|i| ident(&format!("x{i}"))).collect();
    let products = network.lanes.iter().enumerate().map(|(at, lane)| {
        let (at, x) = (size(at), &names[*lane]);
        quote!(.wrapping_add(i32::from(weight[#at]).wrapping_mul(i32::from(*#x))))
    });
    let inputs = network.inputs.len();
    let padded = network.padded(inputs);
    let quantised = (0..padded).map(|i| match network.inputs.get(i) {
        Some(input) => {
            let (i, factor) = (size(i), float(input.factor.value()));
            let (low, high) = (word(input.low.0), word(input.high.0));
            quote!(integer(observation[#i] * #factor + 32_768.5, #low, #high))
        }
        None => quote!(0),
    });
    let calls = calls(network.layers.len(), quote!(&input));
    let kernels = kernels(network);
    let padded = size(padded);
    let doc = format!(
        " Sums of one block of outputs, within +-{} for every input.",
        network.accumulator_bound
    );
    quote! {
        /// Shifted to the positive numbers, clamped by its bits (a positive float's bits ascend with it), truncated.
        #[inline(always)]
        fn integer(shifted: f32, low: u32, high: u32) -> i16 {
            let bits = shifted.to_bits();
            let positive = bits & (bits >> 31).wrapping_sub(1);
            let over = positive.wrapping_sub(low);
            let raised = low.wrapping_add(over & (over >> 31).wrapping_sub(1));
            let under = high.wrapping_sub(raised);
            let clamped = high.wrapping_sub(under & (under >> 31).wrapping_sub(1));
            ((f32::from_bits(clamped) as i32).wrapping_sub(32_768)) as i16
        }
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
        #kernels
        #(#layers)*
        /// Outputs as integers.
        fn network(observation: &[f32; FEATURES]) -> [i32; ACTIONS] {
            let input: Words<[i16; #padded]> = Words([#(#quantised),*]);
            let output = { #calls };
            output.0
        }
    }
}

/// Body of `q_values`.
pub fn q_values(network: &IntegerNetwork) -> TokenStream {
    let unit = float(network.q_unit.value());
    quote!(network(observation).map(|q| q as f32 * #unit))
}

/// Statements of the integrity check.
pub fn integrity(network: &IntegerNetwork) -> TokenStream {
    let layers = network.layers.iter().enumerate().map(|(index, layer)| {
        let names = blocks(index, layer);
        let weights = names.iter().map(|(weights, ..)| {
            quote! {
                for weight in core::hint::black_box(&#weights.0).iter().flatten().flatten().flatten() {
                    crc = crc_word(crc, i32::from(*weight) as u32);
                }
            }
        });
        let biases = names.iter().map(|(_, bias, ..)| {
            quote! { for bias in core::hint::black_box(&#bias).iter().flatten() { crc = crc_word(crc, *bias as u32); } }
        });
        quote!(#(#weights)* #(#biases)*)
    });
    quote!(#(#layers)*)
}

fn weight(network: &IntegerNetwork) -> TokenStream {
    if network.weight_bytes == 1 {
        quote!(i8)
    } else {
        quote!(i16)
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

fn layer_items(network: &IntegerNetwork, index: usize, layer: &IntegerLayer) -> TokenStream {
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
    for (weights, bias, first, height) in &names {
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
        let sums = kernel_name(index, *height);
        tables.push(quote! {
            static #weights: Words<[[[[#kind; #lanes]; #rows]; #groups]; #count]> = Words([#(#parts),*]);
            static #bias: [[i32; #rows]; #count] = [#(#biases),*];
        });
        loops.push(quote! {
            for (weights, bias) in #weights.0.iter().zip(&#bias) {
                if let Some((out, after)) = core::mem::take(&mut rest).split_first_chunk_mut::<#rows>() {
                    for (y, sum) in out.iter_mut().zip(kernels::#sums(weights, bias, &x.0)) {
                        *y = #activated;
                    }
                    rest = after;
                }
            }
        });
    }
    let name = ident(&format!("layer{index}"));
    let doc = format!(
        " {}: {} -> {}, cut by {} bits",
        layer.name, layer.inputs, layer.outputs, layer.shift
    );
    let inputs = size(network.padded(layer.inputs));
    let (kind, length) = if is_last {
        (quote!(i32), layer.outputs)
    } else {
        (quote!(i16), network.padded(layer.outputs))
    };
    let length = size(length);
    quote! {
        #(#tables)*
        #[doc = #doc]
        #[inline(always)]
        fn #name(x: &Words<[i16; #inputs]>) -> Words<[#kind; #length]> {
            let mut y = Words([0; #length]);
            let mut rest: &mut [#kind] = &mut y.0;
            #(#loops)*
            y
        }
    }
}

fn kernel_name(index: usize, height: usize) -> proc_macro2::Ident {
    ident(&format!("sums{index}_{height}"))
}

/// Sums of a block, per layer and height: in assembly on ARM cores with `SMLAD` if the build asks for it.
fn kernels(network: &IntegerNetwork) -> TokenStream {
    let functions = network.layers.iter().enumerate().flat_map(|(index, layer)| {
        let heights = blocks(index, layer).into_iter().map(|(_, _, _, height)| height);
        heights
            .map(|height| kernel(network, index, layer, height))
            .collect::<Vec<_>>()
    });
    quote! {
        /// `--cfg policyc_assembly` takes the loops in assembly (Armv7E-M and Armv8-M with DSP); the bits are the same.
        #[allow(unexpected_cfgs)]
        mod kernels { #(#functions)* }
    }
}

fn kernel(network: &IntegerNetwork, index: usize, layer: &IntegerLayer, height: usize) -> TokenStream {
    let name = kernel_name(index, height);
    let kernel = Kernel {
        is_quad: network.weight_bytes == 1,
        groups: network.groups(layer.inputs),
        height,
        registers: ["r2", "r3", "r4", "r5"],
    };
    let text = kernel.text(&|operand| format!("{{{operand}}}"));
    // braces of a register list are doubled: single ones are operands
    let text = text.iter().map(|line| match line.split_once(", {r") {
        Some((head, registers)) => format!("{head}, {{{{r{registers}}}"),
        None => line.clone(),
    });
    let sums: Vec<_> = (0..height).map(|row| ident(&format!("s{row}"))).collect();
    let temporaries: &[&str] = if kernel.is_quad {
        &["x01", "x23", "even"]
    } else {
        &["x01"]
    };
    let temporaries: Vec<_> = temporaries.iter().map(|name| ident(name)).collect();
    let overwritten = kernel.clobbered();
    // with one turn there is no loop and no counter
    let counter = (kernel.turns() > 1).then(|| {
        let turns = size(kernel.turns());
        quote!(turns = inout(reg) #turns as u32 => _,)
    });
    let (kind, lanes, rows) = (weight(network), size(network.lanes.len()), size(height));
    let (groups, inputs) = (size(kernel.groups), size(network.padded(layer.inputs)));
    let (weights, x) = (quote!(&[[[#kind; #lanes]; #rows]; #groups]), quote!(&[i16; #inputs]));
    quote! {
        #[cfg(all(target_arch = "arm", policyc_assembly))]
        #[inline(always)]
        pub fn #name(weights: #weights, bias: &[i32; #rows], x: #x) -> [i32; #rows] {
            let [#(mut #sums),*] = *bias;
            // SAFETY: reads all of `weights` and of `x`, which are aligned to words, and writes registers only
            unsafe {
                core::arch::asm!(
                    #(#text,)*
                    #(#sums = inout(reg) #sums,)*
                    w = inout(reg) weights.as_ptr() => _,
                    input = inout(reg) x.as_ptr() => _,
                    #counter
                    #(#temporaries = out(reg) _,)*
                    #(out(#overwritten) _,)*
                    options(nostack, readonly)
                );
            }
            [#(#sums),*]
        }
        #[cfg(not(all(target_arch = "arm", policyc_assembly)))]
        #[inline(always)]
        pub fn #name(weights: #weights, bias: &[i32; #rows], x: #x) -> [i32; #rows] {
            super::block(weights, bias, x)
        }
    }
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

fn activated(layer: &IntegerLayer, is_last: bool) -> TokenStream {
    let shift = word(layer.shift);
    let cut = if layer.shift == 0 {
        quote!(sum)
    } else {
        quote!((sum >> #shift))
    };
    match layer.activation {
        ActivationCode::Identity if is_last => cut,
        ActivationCode::Identity => quote!(#cut as i16),
        ActivationCode::Relu => quote!(positive(#cut)),
        ActivationCode::LeakyRelu(_) => {
            let slope = signed(i64::from(layer.slope));
            quote!(leaky_integer(#cut, #slope))
        }
        ActivationCode::Tanh => {
            let unit = float(layer.unit.value());
            quote!(((tanh(sum as f32 * #unit) * 16_384.0 + 32_768.5) as i32).wrapping_sub(32_768) as i16)
        }
    }
}
