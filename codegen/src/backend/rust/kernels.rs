//! The sums of a block in binary32, in ARM assembly if the build asks for it.

use std::collections::BTreeSet;

use policy::Scalar;
use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::{ident, number, size};
use crate::backend::assembly::RealKernel;
use crate::program::{ActivationCode, LayerCode, Program};

/// Types and functions that the layers are made of, generic over the sizes of a block.
///
/// `accumulate` is the statement that adds `weight * x` to `sum`.
pub fn items(program: &Program, layers: &[LayerCode], accumulate: &TokenStream) -> TokenStream {
    let kind = number::kind(program.scalar());
    let sizes = sizes(layers);
    let portable = |visible: &TokenStream| {
        let forms = FORMS.map(|form| form.portable(&kind, visible)).into_iter();
        slots(&kind, visible).into_iter().chain(forms)
    };
    let items = if sizes.is_empty() {
        portable(&TokenStream::new()).collect()
    } else {
        let visible = quote!(pub(super));
        let is_assembly = quote!(all(target_arch = "arm", target_abi = "eabihf", policyc_assembly));
        let kernels = sizes.iter().map(|size| kernel(*size, &processor(program)));
        let forms = FORMS.map(|form| form.assembly(&sizes, &visible)).into_iter();
        let assembly = kernels.chain(slots_in_assembly(&visible)).chain(forms);
        let portable = portable(&visible);
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
    };
    quote! {
        /// Sums of one block of outputs: from the bias, inputs in index order, every operation rounded.
        #[inline(always)]
        #[allow(dead_code)]
        fn block<const INPUTS: usize, const ROWS: usize>(
            weights: &[[f32; ROWS]; INPUTS],
            bias: &[#kind; ROWS],
            x: &[#kind; INPUTS],
        ) -> [#kind; ROWS] {
            let mut sums = *bias;
            for (column, x) in weights.iter().zip(x) {
                for (sum, weight) in sums.iter_mut().zip(column) {
                    #accumulate
                }
            }
            sums
        }
        #items
    }
}

/// What the activations of a layer are kept in.
fn slots(kind: &TokenStream, visible: &TokenStream) -> [TokenStream; 4] {
    [
        quote!(
            /// What an activation is kept in.
            #visible type Slot = #kind;
        ),
        quote!(
            #visible const EMPTY: Slot = 0.0;
        ),
        quote! {
            #[inline(always)]
            #visible fn filled<const N: usize>(slots: &[Slot; N]) -> &[#kind; N] {
                slots
            }
        },
        quote! {
            #[inline(always)]
            #[allow(dead_code)]
            #visible fn activate<const N: usize>(slots: &mut [Slot; N], activation: impl Fn(#kind) -> #kind) {
                for slot in slots {
                    *slot = activation(*slot);
                }
            }
        },
    ]
}

fn slots_in_assembly(visible: &TokenStream) -> [TokenStream; 4] {
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

/// What is made of the sums of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// Stored.
    Plain,
    /// Stored behind a ReLU.
    Rectified,
    /// Stored where they started from.
    Added,
}

const FORMS: [Form; 3] = [Form::Plain, Form::Rectified, Form::Added];

impl Form {
    fn function(self, kind: &TokenStream, visible: &TokenStream, body: &TokenStream) -> TokenStream {
        let stored = quote!(bias: &[#kind; ROWS], x: &[#kind; INPUTS], out: &mut [Slot; ROWS]);
        let (doc, name, parameters) = match self {
            Form::Plain => (" Sums of a block.", "plain", stored),
            Form::Rectified => (" Sums of a block behind a ReLU.", "rectified", stored),
            Form::Added => (
                " Sums of a block that go on from `out`.",
                "added",
                quote!(x: &[#kind; INPUTS], out: &mut [#kind; ROWS]),
            ),
        };
        let name = ident(name);
        quote! {
            #[doc = #doc]
            #[inline(always)]
            #[allow(dead_code)]
            #visible fn #name<const INPUTS: usize, const ROWS: usize>(weights: &[[f32; ROWS]; INPUTS], #parameters) {
                #body
            }
        }
    }

    fn portable(self, kind: &TokenStream, visible: &TokenStream) -> TokenStream {
        let body = match self {
            Form::Plain => quote!(*out = block(weights, bias, x);),
            Form::Rectified => quote! {
                for (out, sum) in out.iter_mut().zip(block(weights, bias, x)) {
                    *out = relu(sum);
                }
            },
            Form::Added => quote!(*out = block(weights, out, x);),
        };
        self.function(kind, visible, &body)
    }

    fn assembly(self, sizes: &BTreeSet<Size>, visible: &TokenStream) -> TokenStream {
        let (bias, otherwise) = match self {
            Form::Plain => (quote!(bias.as_ptr()), quote!(block(weights, bias, x).map(Slot::new))),
            Form::Rectified => (
                quote!(bias.as_ptr()),
                quote!(block(weights, bias, x).map(|sum| Slot::new(relu(sum)))),
            ),
            Form::Added => (quote!(out.cast_const()), quote!(block(weights, out, x))),
        };
        let is_of_form = |size: &&Size| size.relu == (self == Form::Rectified);
        let arms = sizes.iter().filter(is_of_form).map(|of| {
            let (name, inputs, height) = (of.name(), size(of.inputs), size(of.height));
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
        self.function(&quote!(f32), visible, &body)
    }
}

/// Inputs, outputs, and whether negative outputs are cleared, of all blocks that have a kernel.
fn sizes(layers: &[LayerCode]) -> BTreeSet<Size> {
    let mut sizes = BTreeSet::new();
    for layer in layers.iter().filter(|layer| RealKernel::is_for(layer)) {
        let heights = [layer.block_rows, layer.tail_rows()];
        let inputs = [layer.chunk, layer.inputs % layer.chunk];
        for height in heights.into_iter().filter(|height| *height > 0) {
            let relu = layer.activation == ActivationCode::Relu;
            let inputs = inputs.into_iter().filter(|inputs| *inputs > 0);
            sizes.extend(inputs.map(|inputs| Size { inputs, height, relu }));
        }
    }
    sizes
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Size {
    inputs: usize,
    height: usize,
    relu: bool,
}

impl Size {
    fn name(self) -> Ident {
        let relu = if self.relu { "_relu" } else { "" };
        format_ident!("kernel_{}_{}{relu}", self.inputs, self.height)
    }
}

/// A naked function `(weights, bias, x, out)`: no frame, and once in the binary however often a loop over blocks is unrolled.
fn kernel(size: Size, processor: &str) -> TokenStream {
    let Size { inputs, height, relu } = size;
    let kernel = RealKernel { inputs, height, relu };
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
    let (name, turns) = (size.name(), format!("movw r12, #{}", kernel.turns()));
    quote! {
        /// `--cfg policyc_assembly` takes the sums in assembly: products and sums apart, the same bits.
        #[unsafe(naked)]
        unsafe extern "C" fn #name(weights: *const f32, bias: *const f32, x: *const f32, out: *mut f32) {
            core::arch::naked_asm!(#processor, "vpush {{s16-s27}}", #turns, #(#text,)* "vpop {{s16-s27}}", "bx lr")
        }
    }
}

/// First line of a naked function: it is assembled without the features that rustc's flags give to all others.
pub fn processor(program: &Program) -> String {
    program
        .processor
        .map_or_else(String::new, |name| format!(".cpu {name}"))
}

/// Statement that puts the outputs of a block into `out`, an expression of a mutable reference to slots.
pub fn store(scalar: Scalar, activation: ActivationCode, arguments: &TokenStream, out: &TokenStream) -> TokenStream {
    match activation {
        ActivationCode::Identity => quote!(plain(#arguments, #out);),
        ActivationCode::Relu => quote!(rectified(#arguments, #out);),
        _ => {
            let activated = super::network::activation(scalar, activation);
            quote! { plain(#arguments, #out); activate(#out, |sum| #activated); }
        }
    }
}
