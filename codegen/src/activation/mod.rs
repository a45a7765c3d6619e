//! What an activation is in generated code: one file a kind, with its text in C and Rust, in floats and in integers.
//!
//! ```text
//!  Store { activation, cut }  ─► text_of ─► dyn Text ─► c, c_integer          an expression over the name of a sum
//!                                                       rust, rust_integer
//!                                                       ..._helper            the functions that the expressions call
//!                                                       single, double        the same on the host: known answers
//! ```
//!
//! What is true of an activation (bounded, homogeneous, a rectifier) stands in [`policy::activation`]; who decides by such a fact
//! asks there. The one invariant: no file but the one of a kind knows the kind by its name, and `text_of` is the only list, so
//! the compiler asks for a new kind here.

mod identity;
mod leaky_relu;
mod number;
mod relu;
mod sigmoid;
mod softsign;
mod tanh;
mod text;

use policy::Activation;
use proc_macro2::TokenStream;

use crate::program::{Network, Program};

pub(crate) use number::Number;
pub(crate) use text::rust_cut;
pub use text::{C, Rust, Text};

/// The text of an activation.
#[must_use]
pub fn text_of(activation: Activation) -> Box<dyn Text> {
    match activation {
        Activation::Relu => Box::new(relu::Relu),
        Activation::Tanh => Box::new(sigmoid::Curve(tanh::Tanh)),
        Activation::Softsign => Box::new(sigmoid::Curve(softsign::Softsign)),
        Activation::LeakyRelu { slope } => Box::new(leaky_relu::LeakyRelu { slope }),
        Activation::Identity => Box::new(identity::Identity),
    }
}

/// One of each kind, in the order of their functions in a file: straight lines first, then curves, which are longer.
fn kinds() -> impl Iterator<Item = Activation> {
    let of = |is_curve: bool| {
        Activation::EACH
            .iter()
            .filter(move |kind| kind.limit().is_some() == is_curve)
    };
    of(false).chain(of(true)).copied()
}

/// The kinds of a network, in that order.
pub(crate) fn used(network: &Network) -> impl Iterator<Item = Activation> {
    // by its word: two slopes of a leaky ReLU share one function
    kinds().filter(|kind| network.activates(|activation| activation.word() == kind.word()))
}

/// The kinds of a network and of the head behind it, in that order.
pub(crate) fn used_by(program: &Program) -> impl Iterator<Item = Activation> {
    let of_head = |kind: &Activation| program.head.curve().is_some_and(|curve| curve.word() == kind.word());
    let of_network = |kind: &Activation| program.network.activates(|activation| activation.word() == kind.word());
    kinds().filter(move |kind| of_network(kind) || of_head(kind))
}

/// Functions for floats that every Rust file has, whether it calls them or not: those of straight lines.
pub(crate) fn rust_lines(rust: &Rust) -> TokenStream {
    kinds()
        .filter(|kind| kind.limit().is_none())
        .map(|kind| text_of(kind).rust_helper(rust))
        .collect()
}

/// The same of integers.
pub(crate) fn rust_integer_lines() -> TokenStream {
    kinds()
        .filter(|kind| kind.limit().is_none())
        .map(|kind| text_of(kind).rust_integer_helper())
        .collect()
}

/// Functions in Rust of the curves that the network and its head have.
pub(crate) fn rust_curves(program: &Program) -> TokenStream {
    used_by(program)
        .filter(|kind| kind.limit().is_some())
        .map(|kind| text_of(kind).rust_helper(&Rust::of(program)))
        .collect()
}
