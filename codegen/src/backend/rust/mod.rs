//! `no_std` Rust without unsafe code, from `quote`: tokens for the macro, formatted text for the command line.

#[cfg(all(feature = "c", feature = "rust-text"))]
pub mod bindings;
mod command;
mod controller;
mod guard;
mod integer;
mod integer_loops;
mod integrity;
pub(crate) mod kernels;
mod loops;
mod mapping;
mod network;
pub(crate) mod number;
mod several;
mod statements;
mod tables;
pub(crate) mod tokens;

use proc_macro2::{Literal, TokenStream};
use quote::quote;

use crate::lower::STATUS;
use crate::program::{Head, Program};
use tokens::{ident, size, word};

/// Name of the controller type unless the user gives one.
pub const DEFAULT_TYPE: &str = "Controller";

/// The controller as text, one file `<name>.rs` without inner attributes: usable as a module or by `include!`.
///
/// # Errors
/// Only for a fault in the compiler itself.
#[cfg(feature = "rust-text")]
pub fn emit(program: &Program) -> Result<crate::files::GeneratedFiles, crate::files::CodegenError> {
    let title = format!("Controller {}", program.name);
    let banner = crate::backend::banner(program, &title, program.provenance.rust_flags);
    file(format!("{}.rs", program.name), &banner, items(program, DEFAULT_TYPE))
}

/// One file: the banner, then the items.
#[cfg(feature = "rust-text")]
fn file(
    path: String,
    banner: &[String],
    items: TokenStream,
) -> Result<crate::files::GeneratedFiles, crate::files::CodegenError> {
    let file = syn::parse2(items).map_err(|error| crate::files::CodegenError::Rust(error.to_string()))?;
    // in front of the text: a comment is no token
    let mut text: String = banner.iter().map(|line| format!("// {line}\n")).collect();
    text.push('\n');
    text.push_str(&prettyplease::unparse(&file));
    let files = std::iter::once((path, text)).collect();
    Ok(crate::files::GeneratedFiles { files })
}

/// All items of a controller; `type_name` must be an identifier.
#[must_use]
pub fn items(program: &Program, type_name: &str) -> TokenStream {
    let constants = constants(program);
    let crc_steps = tables::values(program, "crc_steps");
    let types = types(program, &TokenStream::new());
    let helpers = statements::helpers(program);
    let network = network::items(program);
    let integrity = integrity::items(program);
    let controller = controller::items(program, &ident(type_name));
    quote! {
        #constants
        static CRC_STEPS: [u32; 16] = #crc_steps;
        #types
        #helpers
        #network
        #integrity
        #controller
    }
}

fn constants(program: &Program) -> TokenStream {
    let signals = size(program.signals.len());
    let features = size(program.feature_count());
    let actions = size(program.head.outputs());
    let counted = match program.head.is_choice() {
        true => " Number of actions.",
        false => " Outputs of the network.",
    };
    let state_words = size(program.state_words());
    let period = Literal::f64_unsuffixed(program.sample_period);
    let places = program.has_several().then(|| places(program));
    let bits = STATUS.iter().map(|bit| {
        let (name, value) = (ident(bit.name), word(1 << bit.number));
        let meaning = format!(" {}", bit.meaning);
        quote! { #[doc = #meaning] pub const #name: u32 = #value; }
    });
    quote! {
        /// Number of measured signals.
        pub const SIGNALS: usize = #signals;
        /// Length of the observation.
        pub const FEATURES: usize = #features;
        #[doc = #counted]
        pub const ACTIONS: usize = #actions;
        #places
        /// Length of the state in words.
        pub const STATE_WORDS: usize = #state_words;
        /// Control period in seconds.
        pub const SAMPLE_PERIOD: f64 = #period;
        /// Bits of [`Command::status`].
        pub mod status { #(#bits)* }
    }
}

/// The number of duties and the place of each in the arrays of a command.
fn places(program: &Program) -> TokenStream {
    let count = size(program.outputs.len());
    let names = program.outputs.iter().filter_map(|output| output.name.as_ref());
    let each = names.enumerate().map(|(index, name)| {
        let (constant, index) = (ident(&format!("OUTPUT_{}", name.to_uppercase())), size(index));
        let about = format!(" Place of `{name}` in the arrays of a [`Command`].");
        quote! { #[doc = #about] pub const #constant: usize = #index; }
    });
    quote! {
        /// Number of duties.
        pub const OUTPUTS: usize = #count;
        #(#each)*
    }
}

/// `layout` is an attribute for both types, or nothing.
fn types(program: &Program, layout: &TokenStream) -> TokenStream {
    let scalar = program.scalar();
    let number = number::kind(scalar);
    let fields = program.signals.iter().map(|signal| {
        let name = ident(&signal.name);
        let kind = if signal.is_code { quote!(i32) } else { number.clone() };
        let doc = format!(" {}", signal.meaning(scalar));
        quote! { #[doc = #doc] pub #name: #kind }
    });
    let [duty_sim, action_index] = match &program.head {
        Head::Output { .. } => [
            " Duty of the actor, before the mapping.",
            " Always 0: the head is continuous.",
        ],
        Head::Gains { .. } => [
            " Duty of the law, before the mapping.",
            " Always 0: the network gives gains.",
        ],
        Head::Choice(_) | Head::Several { .. } => {
            [" Duty of the chosen action, before the mapping.", " Greedy action."]
        }
    };
    let (duties, indices) = match program.has_several() {
        true => (quote!([#number; OUTPUTS]), quote!([u32; OUTPUTS])),
        false => (number.clone(), quote!(u32)),
    };
    quote! {
        /// One sample of every signal.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #layout
        pub struct Measurement { #(#fields),* }
        /// What the controller answers.
        #[derive(Debug, Clone, Copy, PartialEq)]
        #layout
        pub struct Command {
            /// Commanded duty, 0..1: mapped and limited.
            pub duty: #duties,
            #[doc = #duty_sim]
            pub duty_sim: #duties,
            #[doc = #action_index]
            pub action_index: #indices,
            /// Bits of [`status`].
            pub status: u32,
        }
    }
}
