//! Tables, layers and `q_values`.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::number;
use super::tokens::size;
use super::{integer, kernels, loops, several, tables};
use crate::activation::rust_curves;
use crate::assembly;
use crate::program::{Arithmetic, Program};

/// Everything between observation and Q values.
pub fn items(program: &Program) -> TokenStream {
    let scalar = program.scalar();
    let kind = number::kind(scalar);
    let duties = program.head.is_choice().then(|| {
        let duties = tables::values(program, "duties");
        quote! { static DUTIES: [#kind; ACTIONS] = #duties; }
    });
    let several = several::items(program);
    let curves = rust_curves(program);
    let network = match &program.network.arithmetic {
        Arithmetic::Real { fused, .. } => real(program, *fused),
        Arithmetic::Integer(code) => integer::items(program, code),
    };
    quote! {
        #duties
        #several
        #curves
        #network
    }
}

/// What the network hands on to the command.
pub struct Choice {
    /// What it is.
    pub about: &'static str,
    /// What it is for a measurement.
    pub about_apart: &'static str,
    /// Its type.
    pub kind: TokenStream,
    /// Its name, or the names of its parts.
    pub name: TokenStream,
    /// From `observation` to it.
    pub body: TokenStream,
    /// Statements of the command before all others.
    pub chosen: Vec<TokenStream>,
    /// The action index of each duty.
    pub indices: Vec<TokenStream>,
}

/// The greedy action and its duty, or the output of a continuous head.
pub fn choice(program: &Program) -> Choice {
    let kind = number::kind(program.scalar());
    if program.head.is_output() {
        let output = match &program.network.arithmetic {
            Arithmetic::Real { .. } => quote!(outputs[0]),
            Arithmetic::Integer(code) => integer::number(code, program.has_fpu, &quote!(outputs[0])),
        };
        return Choice {
            about: " Network: its output.",
            about_apart: " The network's output for a measurement, with a stack of its own.",
            kind,
            name: quote!(output),
            body: quote! {
                let outputs = network(observation);
                #output
            },
            chosen: Vec::new(),
            indices: vec![quote!(0)],
        };
    }
    if program.head.hands_on_all() {
        let body = match &program.network.arithmetic {
            Arithmetic::Real { .. } => quote!(network(observation)),
            Arithmetic::Integer(code) => {
                let each = program.head.curves().iter().enumerate().map(|(n, _)| {
                    let n = size(n);
                    integer::number(code, program.has_fpu, &quote!(outputs[#n]))
                });
                quote! {
                    let outputs = network(observation);
                    [#(#each),*]
                }
            }
        };
        return Choice {
            about: " Network: its outputs.",
            about_apart: " The network's outputs for a measurement, with a stack of its own.",
            kind: quote!([#kind; ACTIONS]),
            name: quote!(outputs),
            body,
            chosen: several::chosen(program),
            indices: several::indices(program),
        };
    }
    // what argmax compares: a value below all others, and the name of the selection
    let (lowest, greater) = match program.network.arithmetic {
        Arithmetic::Real { .. } => (quote!(#kind::MIN), quote!(select)),
        Arithmetic::Integer(_) => (quote!(i32::MIN), quote!(select_integer)),
    };
    Choice {
        about: " Network and argmax: index and duty of the greedy action.",
        about_apart: " The greedy action for a measurement, with a stack of its own.",
        kind: quote!((u32, #kind)),
        name: quote!((action_index, chosen)),
        body: argmax(
            &lowest,
            &greater,
            &quote!(network(observation)),
            &quote!(DUTIES),
            &quote!(&DUTIES),
        ),
        chosen: Vec::new(),
        indices: vec![quote!(action_index & 0_u32.wrapping_sub(trusted))],
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

/// Index and duty of the greatest of `outputs`; `duties` is the table, `lent` the same as an iterator takes it.
pub(super) fn argmax(
    lowest: &TokenStream,
    greater: &TokenStream,
    outputs: &TokenStream,
    duties: &TokenStream,
    lent: &TokenStream,
) -> TokenStream {
    quote! {
        let mut best = #lowest;
        let mut chosen = #duties[0];
        let mut action_index = 0_u32;
        let mut action = 0_u32;
        // the lowest index wins among equals, a NaN never does
        for (q, duty) in #outputs.iter().zip(#lent) {
            let above = flag(*q > best);
            let mask = 0_u32.wrapping_sub(above);
            best = #greater(above, *q, best);
            chosen = select(above, *duty, chosen);
            action_index = (action & mask) | (action_index & !mask);
            action = action.wrapping_add(1);
        }
        (action_index, chosen)
    }
}
