//! Kernels in Rust: naked functions, and what takes the place of the portable forms where they are built in.

use std::collections::BTreeSet;

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::integer::{Kernel, Store};
use super::real::RealKernel;
use crate::backend::rust::kernels::{FORMS, Form};
use crate::backend::rust::tokens::size;
use crate::program::Program;

/// The forms of a block in assembly or, in other builds, `portable` ones.
pub fn real(kernels: &BTreeSet<RealKernel>, program: &Program, portable: &[TokenStream]) -> TokenStream {
    let visible = quote!(pub(super));
    // eabihf says that the FPU is there; `arm` alone does not
    let is_assembly = quote!(all(target_arch = "arm", target_abi = "eabihf", policyc_assembly));
    let processor = processor(program);
    let functions = kernels.iter().map(|kernel| function(*kernel, &processor));
    let forms = FORMS.map(|form| assembled(form, kernels, &visible)).into_iter();
    let assembly = functions.chain(slots(&visible)).chain(forms);
    // a module, because on an item `allow` does not reach the item's own condition
    quote! {
        #[allow(unexpected_cfgs)]
        mod loops {
            use super::*;
            #(#[cfg(not(#is_assembly))] #portable)*
            #(#[cfg(#is_assembly)] #assembly)*
        }
        use loops::*;
    }
}

/// First line of a naked function: it is assembled without the features that rustc's flags give to all others.
fn processor(program: &Program) -> String {
    program
        .processor
        .map_or_else(String::new, |name| format!(".cpu {name}"))
}

fn slots(visible: &TokenStream) -> [TokenStream; 4] {
    [
        quote!(
            /// What an activation is kept in: loops in assembly fill what nobody has cleared.
            #visible type Slot = core::mem::MaybeUninit<f32>;
        ),
        quote!(
            #visible const EMPTY: Slot = core::mem::MaybeUninit::uninit();
        ),
        quote! {
            /// Slots that a layer has written, all of them.
            #[inline(always)]
            #visible fn filled<const N: usize>(slots: &[Slot; N]) -> &[f32; N] {
                // SAFETY: the same layout; every layer writes all of its outputs
                unsafe { &*slots.as_ptr().cast() }
            }
        },
        quote! {
            #[inline(always)]
            #[allow(dead_code)]
            #visible fn activate<const N: usize>(slots: &mut [Slot; N], activation: impl Fn(f32) -> f32) {
                let values = filled(slots).map(activation);
                *slots = values.map(Slot::new);
            }
        },
    ]
}

/// A form that takes the kernel of its size, if there is one.
fn assembled(form: Form, kernels: &BTreeSet<RealKernel>, visible: &TokenStream) -> TokenStream {
    let (bias, otherwise) = match form {
        Form::Plain => (quote!(bias.as_ptr()), quote!(block(weights, bias, x).map(Slot::new))),
        Form::Rectified => (
            quote!(bias.as_ptr()),
            quote!(block(weights, bias, x).map(|sum| Slot::new(relu(sum)))),
        ),
        Form::Added => (quote!(out.cast_const()), quote!(block(weights, out, x))),
    };
    // a kernel with the ReLU in it serves no other form
    let is_of_form = |kernel: &&RealKernel| kernel.relu == (form == Form::Rectified);
    let arms = kernels.iter().filter(is_of_form).map(|kernel| {
        let (name, inputs, height) = (name(*kernel), size(kernel.inputs), size(kernel.height));
        quote! {
            (#inputs, #height) => {
                let out = out.as_mut_ptr().cast::<f32>();
                // SAFETY: reads INPUTS * ROWS weights, ROWS biases and INPUTS inputs, then writes ROWS sums
                unsafe { #name(weights.as_ptr().cast(), #bias, x.as_ptr(), out) }
            }
        }
    });
    let body = quote! {
        match (INPUTS, ROWS) {
            #(#arms)*
            _ => *out = #otherwise,
        }
    };
    form.function(&quote!(f32), visible, &body)
}

fn name(kernel: RealKernel) -> Ident {
    let relu = if kernel.relu { "_relu" } else { "" };
    format_ident!("kernel_{}_{}{relu}", kernel.inputs, kernel.height)
}

/// A naked function `(weights, bias, x, out)`: no frame, and once in the binary however often a loop over blocks is unrolled.
fn function(kernel: RealKernel, processor: &str) -> TokenStream {
    // the pointers to weights and biases are done with when the halves are needed
    let operand = |name: &str| {
        let register = match name {
            "w" | "low" => "r0",
            "bias" | "high" => "r1",
            "input" => "r2",
            "out" => "r3",
            _ => "r12",
        };
        register.to_owned()
    };
    // braces of a register list are doubled: single ones are operands
    let text = kernel.text(&operand, &|list| format!("{{{{{list}}}}}"));
    let (name, turns) = (name(kernel), format!("movw r12, #{}", kernel.turns()));
    quote! {
        /// `--cfg policyc_assembly` takes the sums in assembly: products and sums apart, the same bits.
        #[unsafe(naked)]
        unsafe extern "C" fn #name(weights: *const f32, bias: *const f32, x: *const f32, out: *mut f32) {
            // the callee saves s16 to s31 (AAPCS with VFP registers)
            core::arch::naked_asm!(#processor, "vpush {{s16-s27}}", #turns, #(#text,)* "vpop {{s16-s27}}", "bx lr")
        }
    }
}

/// All integer blocks of a height as a naked function of that name, for ARM cores with `SMLAD` if the build asks for it.
pub fn integer(kernel: &Kernel, name: &Ident, program: &Program, weight: &TokenStream) -> TokenStream {
    // braces of a register list are doubled: single ones are operands
    let text = kernel.text(&|registers| format!("{{{{{registers}}}}}"));
    let sink = match (kernel.sums, kernel.store) {
        (Some(_), _) | (None, Store::Word) => quote!(i32),
        (None, _) => quote!(i16),
    };
    let next = kernel.sums.map(|_| quote!(, next: *const #weight));
    let processor = processor(program);
    quote! {
        /// `--cfg policyc_assembly` takes the loops in assembly (Armv7E-M and Armv8-M with DSP); the bits are the same.
        #[cfg(all(target_arch = "arm", policyc_assembly))]
        #[unsafe(naked)]
        unsafe extern "C" fn #name(x: *const i16, y: *mut #sink, weights: *const #weight, bias: *const i32 #next) {
            core::arch::naked_asm!(#processor, #(#text),*)
        }
    }
}
