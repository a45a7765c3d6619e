//! `no_std` Rust without unsafe code, from `quote`: tokens for the macro, formatted text for the command line.

#[cfg(all(feature = "c", feature = "rust-text"))]
pub mod bindings;
mod controller;
mod integer;
mod kernels;
mod network;
mod statements;
mod streamed;

use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::quote;

use crate::lower::STATUS;
use crate::program::Program;

/// Name of the controller type unless the user gives one.
pub const DEFAULT_TYPE: &str = "Controller";

/// The Rust backend as text, one file `<name>.rs` without inner attributes: usable as a module or by `include!`.
#[cfg(feature = "rust-text")]
pub struct RustText;

#[cfg(feature = "rust-text")]
impl crate::Backend for RustText {
    fn emit(&self, program: &Program) -> Result<crate::GeneratedFiles, crate::CodegenError> {
        let title = format!("Controller {}", program.name);
        let banner = crate::backend::banner(program, &title, program.provenance.rust_flags);
        file(format!("{}.rs", program.name), &banner, items(program, DEFAULT_TYPE))
    }
}

/// One file: the banner, then the items.
#[cfg(feature = "rust-text")]
fn file(path: String, banner: &[String], items: TokenStream) -> Result<crate::GeneratedFiles, crate::CodegenError> {
    let file = syn::parse2(items).map_err(|error| crate::CodegenError::Rust(error.to_string()))?;
    let mut text: String = banner.iter().map(|line| format!("// {line}\n")).collect();
    text.push('\n');
    text.push_str(&prettyplease::unparse(&file));
    let files = std::iter::once((path, text)).collect();
    Ok(crate::GeneratedFiles { files })
}

/// All items of a controller; `type_name` must be an identifier.
#[must_use]
pub fn items(program: &Program, type_name: &str) -> TokenStream {
    let constants = constants(program);
    let crc_steps = crate::crc::nibble_table().map(word);
    let types = types(program, &TokenStream::new());
    let helpers = statements::helpers(program);
    let network = network::items(program);
    let controller = controller::items(program, &ident(type_name));
    quote! {
        #constants
        static CRC_STEPS: [u32; 16] = [#(#crc_steps),*];
        #types
        #helpers
        #network
        #controller
    }
}

fn ident(name: &str) -> Ident {
    Ident::new(name, Span::call_site())
}

/// A float literal without suffix; the context gives the type.
fn float(value: f32) -> TokenStream {
    let magnitude = Literal::f32_unsuffixed(value.abs());
    if value.is_sign_negative() {
        quote!(-#magnitude)
    } else {
        quote!(#magnitude)
    }
}

fn size(value: usize) -> Literal {
    Literal::usize_unsuffixed(value)
}

fn word(value: u32) -> Literal {
    Literal::u32_unsuffixed(value)
}

fn constants(program: &Program) -> TokenStream {
    let signals = size(program.signals.len());
    let features = size(program.feature_count());
    let actions = size(program.duties.len());
    let state_words = size(program.state_words());
    let period = Literal::f64_unsuffixed(program.sample_period);
    let bits = STATUS.iter().map(|(name, bit)| {
        let (name, value) = (ident(name), word(1 << bit));
        let meaning = status_meaning(*bit);
        quote! { #[doc = #meaning] pub const #name: u32 = #value; }
    });
    quote! {
        /// Number of measured signals.
        pub const SIGNALS: usize = #signals;
        /// Length of the observation.
        pub const FEATURES: usize = #features;
        /// Number of actions.
        pub const ACTIONS: usize = #actions;
        /// Length of the state in words.
        pub const STATE_WORDS: usize = #state_words;
        /// Control period in seconds.
        pub const SAMPLE_PERIOD: f64 = #period;
        /// Bits of [`Command::status`].
        pub mod status { #(#bits)* }
    }
}

fn status_meaning(bit: u32) -> &'static str {
    match bit {
        0 => " Held samples bridge an invalid measurement.",
        1 => " No usable measurement: the fallback duty is commanded.",
        2 => " This step primed the filters.",
        3 => " An observation was clipped.",
        4 => " Outside the mapping's validity range.",
        5 => " The slew limit was active.",
        6 => " The soft start was active.",
        _ => " A duty limit was active.",
    }
}

/// `layout` is an attribute for both types, or nothing.
fn types(program: &Program, layout: &TokenStream) -> TokenStream {
    let fields = program.signals.iter().map(|signal| {
        let name = ident(&signal.name);
        let (low, high) = (signal.range.0.value(), signal.range.1.value());
        let kind = if signal.is_code { quote!(i32) } else { quote!(f32) };
        let code = if signal.is_code { "ADC code; " } else { "" };
        let doc = format!(" {code}plausible {low:?} to {high:?} {}", signal.unit);
        let doc = doc.trim_end();
        quote! { #[doc = #doc] pub #name: #kind }
    });
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
            pub duty: f32,
            /// Duty of the chosen action, before the mapping.
            pub duty_sim: f32,
            /// Greedy action.
            pub action_index: u32,
            /// Bits of [`status`].
            pub status: u32,
        }
    }
}
