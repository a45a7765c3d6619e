//! The stages of the macro: parse the call, load the policy, lower it, wrap the items.

use std::path::{Path, PathBuf};

use policy::{Faults, Policy, ReadOptions};
use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;
use syn::parse::{Parse, ParseStream};
use syn::{LitStr, Token, Visibility};

use codegen::Language;
use codegen::backend::rust::{DEFAULT_TYPE, items};
use codegen::lower::STATUS;
use targets::TargetSpec;

/// `[visibility] [Type =] "path" [, target = "name"]`
struct Call {
    visibility: Visibility,
    type_name: Option<Ident>,
    path: LitStr,
    /// Whose processor the loops are cut for; the bits are the same for all.
    target: &'static TargetSpec,
}

/// What the call takes, said wherever it does not begin like that.
const PATH: &str = "expected the path of a policy in quotes, as seen from the folder of Cargo.toml: \
                    include_policy!(\"policy/policy.toml\")";
const EQUALS: &str = "expected `=` between the name of the controller's type and the path: \
                      include_policy!(Regulator = \"policy/policy.toml\")";
const END: &str = "expected nothing more after the path in quotes than a target: \
                   include_policy!(\"policy/policy.toml\", target = \"cortex-m4f\")";

impl Parse for Call {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let visibility = input.parse()?;
        let type_name = if input.peek(syn::Ident) {
            let name: Ident = input.parse()?;
            if input.peek(LitStr) {
                return Err(input.error(EQUALS));
            }
            // a name that no `=` follows is the path itself, without quotes
            let equals = input.parse::<Token![=]>();
            equals.map_err(|_| syn::Error::new(name.span(), PATH))?;
            if let Some(objection) = objection(&name.to_string()) {
                return Err(syn::Error::new(name.span(), objection));
            }
            Some(name)
        } else {
            None
        };
        let path = input.parse().map_err(|error| syn::Error::new(error.span(), PATH))?;
        let comma = input.parse::<Option<Token![,]>>()?;
        let target = match comma.is_some() && input.peek(syn::Ident) {
            true => target(input)?,
            false => targets::host(),
        };
        if !input.is_empty() {
            return Err(input.error(END));
        }
        Ok(Self {
            visibility,
            type_name,
            path,
            target,
        })
    }
}

/// `target = "name" [,]`
fn target(input: ParseStream<'_>) -> syn::Result<&'static TargetSpec> {
    let key: Ident = input.parse()?;
    if key != "target" {
        return Err(syn::Error::new(key.span(), END));
    }
    input
        .parse::<Token![=]>()
        .map_err(|error| syn::Error::new(error.span(), END))?;
    let name: LitStr = input.parse().map_err(|error| syn::Error::new(error.span(), END))?;
    input.parse::<Option<Token![,]>>()?;
    targets::find_or_part(&name.value()).ok_or_else(|| {
        let hint = targets::of_part(&name.value()).map_or_else(String::new, |core| format!("; did you mean `{core}`?"));
        let names = targets::names().join(", ");
        syn::Error::new(name.span(), format!("no such target: expected one of {names}{hint}"))
    })
}

/// Why a name cannot be that of the controller's type; `None` if it can. The module holds other types and uses others.
fn objection(name: &str) -> Option<&'static str> {
    // types of the module, and those of the prelude that its code names: one of ours in their place would not build
    const TAKEN: [&str; 12] = [
        "Measurement",
        "Command",
        "Front",
        "Option",
        "Result",
        "Ok",
        "Err",
        "Some",
        "None",
        "Clone",
        "Copy",
        "Default",
    ];
    if TAKEN.contains(&name) {
        Some("the module uses this name itself: choose another for the controller's type")
    } else if !name.starts_with(|c: char| c.is_ascii_uppercase()) {
        Some("the name of the controller's type begins with an upper-case letter")
    } else {
        None
    }
}

/// The whole macro.
pub fn expand(input: TokenStream) -> TokenStream {
    let call: Call = match syn::parse2(input) {
        Ok(call) => call,
        Err(error) => return error.to_compile_error(),
    };
    let Some(root) = std::env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from) else {
        return error_at(
            &call,
            "CARGO_MANIFEST_DIR is not set: include_policy! needs to run under cargo",
        );
    };
    match load(&root, &call.path.value()) {
        Ok(policy) => controller(&call, &root, &policy),
        Err(faults) => rejected(&call, &root, &faults),
    }
}

fn load(root: &Path, path: &str) -> Result<Policy, Faults> {
    let options = ReadOptions {
        several_outputs: true,
        ..ReadOptions::within(root)
    };
    let policy = policy::check(policy::read(&root.join(path), &options)?)?;
    match interp::golden::refusal(&policy) {
        None => Ok(policy),
        Some(message) => Err(Faults::refusing(&policy, message)),
    }
}

fn controller(call: &Call, root: &Path, policy: &Policy) -> TokenStream {
    // no files, no manifest: the macro is built without templates, and rustc takes tokens
    let program = codegen::lower(policy, call.target, Language::Rust);
    let type_name = call
        .type_name
        .as_ref()
        .map_or_else(|| DEFAULT_TYPE.to_owned(), Ident::to_string);
    let items = items(&program, &type_name);
    let tracked = track(root, &policy.files);
    module(call, &policy.name, &quote!(#tracked #items))
}

/// One error, and a stand-in for the module so that uses of it are no further errors.
fn rejected(call: &Call, root: &Path, faults: &Faults) -> TokenStream {
    // paths are shown as the user wrote them, relative to the crate
    let prefix = format!("{}{}", root.display(), std::path::MAIN_SEPARATOR);
    let text = faults.to_string().replace(&prefix, "");
    // rustc puts its own `error: ` before the first; a rejected policy is expanded anew in every build, so none of
    // its files, which may be missing or huge, needs to be tracked
    let error = error_at(call, text.strip_prefix("error: ").unwrap_or(&text).trim_end());
    let stand_in = faults.skeleton.name.as_ref().map(|name| {
        let fields = faults.skeleton.signals.iter().map(|(name, adc)| {
            let name = Ident::new(name, Span::call_site());
            if *adc {
                quote!(pub #name: i32)
            } else {
                quote!(pub #name: f32)
            }
        });
        let type_name = call
            .type_name
            .clone()
            .unwrap_or_else(|| Ident::new(DEFAULT_TYPE, Span::call_site()));
        module(call, name, &stand_in(&type_name, faults, &quote!(#(#fields),*)))
    });
    quote! { #error #stand_in }
}

fn module(call: &Call, name: &str, items: &TokenStream) -> TokenStream {
    let visibility = &call.visibility;
    let name = Ident::new(name, Span::call_site());
    let doc = format!(" Controller generated from `{}`.", call.path.value());
    quote! {
        #[doc = #doc]
        #[allow(clippy::all, clippy::pedantic, clippy::nursery, clippy::indexing_slicing, clippy::arithmetic_side_effects)]
        #[allow(dead_code, unreachable_pub)]
        #[forbid(unsafe_code)]
        #visibility mod #name { #items }
    }
}

/// Makes rustc rebuild the crate when one of the files changes.
fn track(root: &Path, files: &[PathBuf]) -> TokenStream {
    let paths = files
        .iter()
        // reading refuses files outside of the crate, so each has a path from its root
        .filter_map(|file| file.strip_prefix(root).ok()?.to_str())
        .map(|path| format!("/{path}"));
    quote! { #(const _: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), #paths));)* }
}

fn error_at(call: &Call, message: &str) -> TokenStream {
    syn::Error::new(call.path.span(), message).to_compile_error()
}

/// Length of those arrays of the stand-in that the faulty contract does not tell: no index that firmware writes lies
/// beyond it.
const STAND_IN_LENGTH: usize = 1024;

/// The interface of a controller without behaviour.
fn stand_in(type_name: &Ident, faults: &Faults, fields: &TokenStream) -> TokenStream {
    // firmware asserts these: a second error would look for the fault where it is not
    let counts = [
        ("SIGNALS", Some(faults.skeleton.signals.len())),
        ("FEATURES", faults.skeleton.features),
        ("ACTIONS", faults.skeleton.actions),
        ("STATE_WORDS", None),
    ];
    let lengths = counts.map(|(_, length)| length.map_or(STAND_IN_LENGTH, |n| n.clamp(1, STAND_IN_LENGTH)));
    let counts = counts.map(|(name, _)| Ident::new(name, Span::call_site()));
    let bits = STATUS.iter().map(|bit| {
        let (name, number) = (Ident::new(bit.name, Span::call_site()), bit.number);
        quote!(pub const #name: u32 = 1 << #number;)
    });
    let (duty, index) = match faults.skeleton.outputs.is_empty() {
        true => (quote!(f32), quote!(u32)),
        false => (quote!([f32; OUTPUTS]), quote!([u32; OUTPUTS])),
    };
    let (no_duty, no_index) = match faults.skeleton.outputs.is_empty() {
        true => (quote!(0.0), quote!(0)),
        false => (quote!([0.0; OUTPUTS]), quote!([0; OUTPUTS])),
    };
    let places = places(&faults.skeleton.outputs);
    quote! {
        #(pub const #counts: usize = #lengths;)*
        #places
        pub const SAMPLE_PERIOD: f64 = 1.0;
        pub mod status { #(#bits)* }
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Measurement { #fields }
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Command { pub duty: #duty, pub duty_sim: #duty, pub action_index: #index, pub status: u32 }
        #[derive(Clone, Default)]
        pub struct #type_name;
        impl #type_name {
            pub const fn new() -> Self { Self }
            pub fn reset(&mut self) {}
            pub fn eval(&self, _: &Measurement) -> Command { Self::NOTHING }
            pub fn commit(&mut self, _: &Measurement, _: &Command) {}
            pub fn step(&mut self, _: &Measurement) -> Command { Self::NOTHING }
            pub fn observe(&self, _: &Measurement) -> [f32; FEATURES] { [0.0; FEATURES] }
            pub fn q_values(_: &[f32; FEATURES]) -> [f32; ACTIONS] { [0.0; ACTIONS] }
            pub fn state_words(&self) -> [u32; STATE_WORDS] { [0; STATE_WORDS] }
            pub fn self_test() -> Result<(), u32> { Err(0) }
            pub fn integrity() -> bool { false }
            const NOTHING: Command = Command { duty: #no_duty, duty_sim: #no_duty, action_index: #no_index, status: 0 };
        }
    }
}

/// The number of several duties and the place of each whose name is known; nothing where there is one.
fn places(outputs: &[Option<String>]) -> TokenStream {
    if outputs.is_empty() {
        return TokenStream::new();
    }
    let each = outputs.iter().enumerate().filter_map(|(index, name)| {
        let name = name.as_ref()?.to_uppercase();
        let constant = Ident::new(&format!("OUTPUT_{name}"), Span::call_site());
        Some(quote!(pub const #constant: usize = #index;))
    });
    let count = outputs.len();
    quote! {
        pub const OUTPUTS: usize = #count;
        #(#each)*
    }
}
