//! Integers: rounding of the inputs, sums of a block, Q values.

use proc_macro2::TokenStream;
use quote::quote;

use super::tokens::{float, ident, signed, size};
use super::{integer_loops, tables};
use crate::activation::rust_integer_lines;
use crate::program::{Buffer, Element, Inner, IntegerCode, Program};

/// Tables, layers and `network`.
pub fn items(program: &Program, code: &IntegerCode) -> TokenStream {
    let network = &program.network;
    let weight = tables::kind(Element::Integer {
        bytes: code.weight_bytes,
    });
    let lanes = size(network.lanes.len());
    let names: Vec<_> = (0..network.lanes.len()).map(|i| ident(&format!("x{i}"))).collect();
    let products = network.lanes.iter().enumerate().map(|(at, lane)| {
        let (at, x) = (size(at), &names[*lane]);
        quote!(.wrapping_add(i32::from(weight[#at]).wrapping_mul(i32::from(*#x))))
    });
    let padded = network.length(Buffer::Input);
    let quantised = (0..padded).map(|i| match code.inputs.get(i) {
        Some(input) => {
            let i = size(i);
            let [unshifted, low, high] = [input.unshifted, input.low, input.high].map(signed);
            quote!(integer(observation[#i], #unshifted, #low, #high))
        }
        None => quote!(0),
    });
    let (layers, body) = integer_loops::network(program, code, &weight);
    let extremes = extremes(code.inner);
    let lines = rust_integer_lines();
    let q_value = (!program.has_fpu).then(|| q_value(code));
    let padded = size(padded);
    let doc = format!(
        " Sums of one block of outputs, within +-{} for every input.",
        code.accumulator_bound
    );
    // argmax selects by it; without one only some activations do
    let idle = (!program.head.is_choice()).then(|| quote!(#[allow(dead_code)]));
    let selection = quote! {
        #[inline(always)]
        #idle
        fn select_integer(flag: u32, then: i32, otherwise: i32) -> i32 {
            let mask = 0_u32.wrapping_sub(flag) as i32;
            (then & mask) | (otherwise & !mask)
        }
    };
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
        #lines
        #selection
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
            // no `chunks_exact`: where it is not inlined, its division is a way to a panic
            let mut rest = x;
            for column in weights {
                if let [#(#names),*, tail @ ..] = rest {
                    rest = tail;
                    for (sum, weight) in sums.iter_mut().zip(column) {
                        *sum = sum #(#products)*;
                    }
                }
            }
            sums
        }
        #layers
        /// Outputs as integers.
        fn network(observation: &[f32; FEATURES]) -> [i32; ACTIONS] {
            let input: Words<[i16; #padded]> = Words([#(#quantised),*]);
            #body
        }
    }
}

/// The larger and the smaller of two numbers: a selection where the cores have one, else by masks.
fn extremes(inner: Inner) -> TokenStream {
    let (most, least) = if inner == Inner::Dual {
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

/// An output as Q value by its bits: a library of floats would take longer for one than for another.
fn q_value(code: &IntegerCode) -> TokenStream {
    let field = signed(code.q_field);
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
pub fn q_values(code: &IntegerCode, has_fpu: bool) -> TokenStream {
    if !has_fpu {
        return quote!(network(observation).map(q_value));
    }
    let value = number(code, has_fpu, &quote!(q));
    quote!(network(observation).map(|q| #value))
}

/// An output of the network as a number.
pub fn number(code: &IntegerCode, has_fpu: bool, output: &TokenStream) -> TokenStream {
    if !has_fpu {
        return quote!(q_value(#output));
    }
    let unit = float(code.q_unit.single());
    quote!(#output as f32 * #unit)
}
