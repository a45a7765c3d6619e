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

mod curve;
mod formula;
mod formulas;
mod identity;
mod leaky_relu;
mod limit;
mod number;
mod relu;
mod softsign;
mod tanh;
mod text;

use policy::Activation;
use proc_macro2::TokenStream;

use self::curve::{Curve, Function};
use crate::program::{Network, Program};

pub(crate) use number::Number;
pub(crate) use text::rust_cut;
pub use text::{C, Needs, Rust, Text};

/// The text of an activation.
#[must_use]
pub fn text_of(activation: Activation) -> Box<dyn Text> {
    match activation {
        Activation::Relu => Box::new(relu::Relu),
        Activation::LeakyRelu { slope } => Box::new(leaky_relu::LeakyRelu { slope }),
        Activation::Identity => Box::new(identity::Identity),
        Activation::Tanh => of(activation, tanh::Tanh),
        Activation::Softsign => of(activation, softsign::Softsign),
        Activation::Sigmoid => of(activation, formulas::sigmoid()),
        Activation::HardSigmoid => of(activation, formulas::hard_sigmoid()),
        Activation::Elu => of(activation, formulas::elu()),
        Activation::Softplus => of(activation, formulas::softplus()),
        Activation::Silu => of(activation, formulas::silu()),
        Activation::Gelu => of(activation, formulas::gelu()),
        Activation::GeluTanh => of(activation, formulas::gelu_tanh()),
        Activation::HardSwish => of(activation, formulas::hard_swish()),
    }
}

fn of(activation: Activation, function: impl Function + 'static) -> Box<dyn Text> {
    Box::new(Curve { function, activation })
}

/// One of each kind, in the order of their functions in a file: straight lines first, then curves, which are longer.
fn kinds() -> impl Iterator<Item = Activation> {
    let of = |is_curve: bool| {
        Activation::EACH
            .iter()
            .filter(move |kind| kind.curve().is_some() == is_curve)
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
    let heads = || program.head.curves().iter().flatten();
    let of_head = move |kind: &Activation| heads().any(|curve| curve.word() == kind.word());
    let of_network = |kind: &Activation| program.network.activates(|activation| activation.word() == kind.word());
    kinds().filter(move |kind| of_network(kind) || of_head(kind))
}

/// Functions for floats that every Rust file has, whether it calls them or not: those of straight lines.
pub(crate) fn rust_lines(rust: &Rust) -> TokenStream {
    kinds()
        .filter(|kind| kind.curve().is_none())
        .map(|kind| text_of(kind).rust_helper(rust))
        .collect()
}

/// The same of integers.
pub(crate) fn rust_integer_lines() -> TokenStream {
    kinds()
        .filter(|kind| kind.curve().is_none())
        .map(|kind| text_of(kind).rust_integer_helper())
        .collect()
}

/// The curves of a network and its head, and what they rest on.
fn curves(program: &Program) -> (Vec<Activation>, Needs) {
    let curves: Vec<Activation> = used_by(program).filter(|kind| kind.curve().is_some()).collect();
    let needs = curves.iter().map(|kind| text_of(*kind).needs());
    let needs = needs.fold(Needs::default(), Needs::and);
    (curves, needs)
}

/// The curves, the tanh first if one rests on it.
fn with_tanh(curves: Vec<Activation>, needs: Needs) -> impl Iterator<Item = Activation> {
    let needed = (needs.tanh && !curves.contains(&Activation::Tanh)).then_some(Activation::Tanh);
    needed.into_iter().chain(curves)
}

/// Functions in C of the activations in floats. A network of integers calls those alone that take its sums as numbers.
pub(crate) fn c_functions(program: &Program, c: &C<'_>) -> Vec<String> {
    let (curves, needs) = curves(program);
    let is_line = |kind: &Activation| kind.curve().is_none() && program.network.integer().is_none();
    let mut lines: Vec<Activation> = used_by(program).filter(is_line).collect();
    if needs.relu && !lines.contains(&Activation::Relu) {
        lines.insert(0, Activation::Relu);
    }
    let helper = |kind: Activation| text_of(kind).c_helper(c);
    let mut text: Vec<String> = lines.into_iter().flat_map(helper).collect();
    text.extend(needs.absolute.then(|| limit::c_absolute(c)));
    text.extend(needs.limit.then(|| limit::c_limit(c)));
    text.extend(with_tanh(curves, needs).flat_map(helper));
    text
}

/// Functions in Rust of the curves that the network and its head have.
pub(crate) fn rust_curves(program: &Program) -> TokenStream {
    let rust = Rust::of(program);
    let (curves, needs) = curves(program);
    let absolute = needs.absolute.then(|| limit::rust_absolute(&rust));
    let limited = needs.limit.then(|| limit::rust_limit(&rust));
    let curves: TokenStream = with_tanh(curves, needs)
        .map(|kind| text_of(kind).rust_helper(&rust))
        .collect();
    quote::quote!(#absolute #limited #curves)
}
