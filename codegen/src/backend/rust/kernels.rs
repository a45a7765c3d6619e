//! The sums of a block in floats.

use policy::{Activation, Scalar};
use proc_macro2::TokenStream;
use quote::quote;

use super::tokens::ident;
use crate::activation::text_of;

/// The sums of a block as a function; `accumulate` is the statement that adds `weight * x` to `sum`.
pub fn block(kind: &TokenStream, accumulate: &TokenStream) -> TokenStream {
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
    }
}

/// Types and functions that the layers are made of, generic over the sizes of a block.
pub fn portable(kind: &TokenStream, visible: &TokenStream) -> Vec<TokenStream> {
    let forms = FORMS.map(|form| form.portable(kind, visible)).into_iter();
    slots(kind, visible).into_iter().chain(forms).collect()
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

/// What is made of the sums of a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Stored.
    Plain,
    /// Stored behind a ReLU.
    Rectified,
    /// Stored where they started from.
    Added,
}

pub const FORMS: [Form; 3] = [Form::Plain, Form::Rectified, Form::Added];

impl Form {
    pub fn function(self, kind: &TokenStream, visible: &TokenStream, body: &TokenStream) -> TokenStream {
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
}

/// Statement that puts the outputs of a block into `out`, an expression of a mutable reference to slots.
pub fn store(scalar: Scalar, activation: Activation, arguments: &TokenStream, out: &TokenStream) -> TokenStream {
    if activation.is_identity() {
        return quote!(plain(#arguments, #out););
    }
    if activation.is_rectifier() {
        return quote!(rectified(#arguments, #out););
    }
    let activated = text_of(activation).rust(scalar);
    // a pass of its own over the block, because assembly ends with the sums
    quote! { plain(#arguments, #out); activate(#out, |sum| #activated); }
}
