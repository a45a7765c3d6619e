//! Tables, layers and `q_values`.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::number;
use super::tokens::size;
use super::{integer, kernels, loops, tables};
use crate::activation::{Rust, rust_curves};
use crate::assembly;
use crate::program::{Arithmetic, Program};

/// Everything between observation and Q values.
pub fn items(program: &Program) -> TokenStream {
    let scalar = program.scalar();
    let kind = number::kind(scalar);
    let duties = tables::values(program, "duties");
    let curves = rust_curves(&program.network, &Rust::of(program));
    let network = match &program.network.arithmetic {
        Arithmetic::Real { fused, .. } => real(program, *fused),
        Arithmetic::Integer(code) => integer::items(program, code),
    };
    quote! {
        static DUTIES: [#kind; ACTIONS] = #duties;
        #curves
        #network
    }
}

/// What argmax compares: type, value below all others, name of the selection.
pub fn argmax(program: &Program) -> (TokenStream, TokenStream) {
    match program.network.arithmetic {
        Arithmetic::Real { scalar, .. } => {
            let kind = number::kind(scalar);
            (quote!(#kind::MIN), quote!(select))
        }
        Arithmetic::Integer(_) => (quote!(i32::MIN), quote!(select_integer)),
    }
}

/// Body of `q_values`.
pub fn q_values(program: &Program) -> TokenStream {
    match &program.network.arithmetic {
        Arithmetic::Real { .. } => quote!(network(observation)),
        Arithmetic::Integer(code) => integer::q_values(code, program.has_fpu),
    }
}

fn real(program: &Program, fused: bool) -> TokenStream {
    let scalar = program.scalar();
    let kind = number::kind(scalar);
    let (items, body) = loops::network(program);
    let aligned = program.alignment().map(aligned);
    let fma = fused.then(fma);
    let accumulate = match (scalar, fused) {
        (Scalar::F32, true) => quote!(*sum = fma(*weight, *x, *sum);),
        (Scalar::F32, false) => quote!(*sum += *weight * *x;),
        // weights are binary32
        (Scalar::F64, _) => quote!(*sum += *weight as f64 * *x;),
    };
    let block = kernels::block(&kind, &accumulate);
    let kernels = assembly::real::kernels(&program.network);
    let forms = if kernels.is_empty() {
        let forms = kernels::portable(&kind, &TokenStream::new());
        quote!(#(#forms)*)
    } else {
        assembly::rust::real(&kernels, program, &kernels::portable(&kind, &quote!(pub(super))))
    };
    quote! {
        #fma
        #aligned
        #block
        #forms
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

fn fma() -> TokenStream {
    quote! {
        /// x * y + z, rounded once: `core` has no fused multiply-add, so through binary64 rounded to odd.
        #[inline(always)]
        fn fma(x: f32, y: f32, z: f32) -> f32 {
            // the product is exact: 24 + 24 bits; the sum is not, and a cast would round it twice: its last bit
            // is set by what it lost
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
