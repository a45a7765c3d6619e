//! Rust declarations of the C core, with the controller type of the Rust backend in front of them.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::tokens::{ident, size};
use super::{DEFAULT_TYPE, constants, types};
use super::{integrity, number};
use crate::program::{MappingCode, OutputCode, Program};

/// `<name>_ffi.rs`: `Measurement`, `Command`, `status` and `Controller` as in the Rust backend's file, over the C core.
///
/// # Errors
/// Only for a fault in the compiler itself.
pub fn emit(program: &Program) -> Result<crate::files::GeneratedFiles, crate::files::CodegenError> {
    let title = format!("Controller {} in C, from Rust", program.name);
    let banner = crate::backend::banner(program, &title, program.provenance.c_flags);
    super::file(format!("{}_ffi.rs", program.name), &banner, items(program))
}

fn items(program: &Program) -> TokenStream {
    let constants = constants(program);
    let types = types(program, &quote!(#[repr(C)]));
    let name = ident(DEFAULT_TYPE);
    let State {
        fields,
        zero,
        words,
        as_words,
    } = state(program);
    let (declared_mapping, set_mapping) = mappings(program);
    let core = core(program, &declared_mapping);
    let check = integrity::check(
        program,
        &quote!(#[repr(C)]),
        &quote! {
            match unsafe { c::integrity_slice(self, count) } {
                0 => None,
                state => Some(state == 1),
            }
        },
    );
    let methods = methods(program, &set_mapping);
    let nothing = nothing(program);
    quote! {
        #constants
        #types
        #[doc = #words]
        #[derive(Clone)]
        #[repr(C)]
        pub struct #name { #fields }
        #core
        #check
        // Every call hands over references or arrays of the lengths in the C header, which the C core reads and writes
        // within these lengths and does not keep.
        impl #name {
            #nothing
            /// Start-up state.
            #[must_use]
            pub fn new() -> Self {
                let mut new = Self { #zero };
                unsafe { c::init(&mut new) };
                new
            }
            /// Start-up state, but coefficients set at run time stay.
            pub fn reset(&mut self) {
                unsafe { c::reset(self) }
            }
            /// The state, word by word in the order of the numeric contract.
            #[must_use]
            pub fn state_words(&self) -> [u32; STATE_WORDS] {
                #as_words
            }
            #methods
        }
        impl Default for #name {
            fn default() -> Self {
                Self::new()
            }
        }
    }
}

/// The declarations of the C core; each is called as in its header, less the name of the policy.
fn core(program: &Program, set_mapping: &TokenStream) -> TokenStream {
    let (name, number) = (ident(DEFAULT_TYPE), number::kind(program.scalar()));
    let function = |name: &str, signature: TokenStream| {
        let (symbol, name) = (format!("{}_{name}", program.name), ident(name));
        quote! {
            #[link_name = #symbol]
            pub fn #name #signature;
        }
    };
    let control = [
        function("init", quote!((state: *mut #name))),
        function("reset", quote!((state: *mut #name))),
        function(
            "eval",
            quote!((state: *const #name, measured: *const Measurement, command: *mut Command)),
        ),
        function(
            "commit",
            quote!((state: *mut #name, measured: *const Measurement, command: *const Command)),
        ),
        function(
            "step",
            quote!((state: *mut #name, measured: *const Measurement, command: *mut Command)),
        ),
        function(
            "observe",
            quote!((state: *const #name, measured: *const Measurement, observation: *mut #number)),
        ),
        function("q_values", quote!((observation: *const #number, q: *mut #number))),
    ];
    let checks = [
        function("self_test", quote!(() -> u32)),
        function("integrity", quote!(() -> u32)),
        function(
            "integrity_slice",
            quote!((check: *mut IntegrityCheck, count: u32) -> u32),
        ),
    ];
    quote! {
        mod c {
            use super::{Command, IntegrityCheck, Measurement, #name};
            unsafe extern "C" {
                #(#control)*
                #set_mapping
                #(#checks)*
            }
        }
    }
}

/// What a controller does, each by one call of the C core.
fn methods(program: &Program, set_mapping: &TokenStream) -> TokenStream {
    let number = number::kind(program.scalar());
    quote! {
        /// Command for this measurement; changes nothing.
        #[must_use]
        pub fn eval(&self, measured: &Measurement) -> Command {
            let mut command = Self::NOTHING;
            unsafe { c::eval(self, measured, &mut command) };
            command
        }
        /// Advances the filters by one sample period, with the command that `eval` gave for this measurement.
        pub fn commit(&mut self, measured: &Measurement, command: &Command) {
            unsafe { c::commit(self, measured, command) }
        }
        /// `eval` and `commit`.
        pub fn step(&mut self, measured: &Measurement) -> Command {
            let mut command = Self::NOTHING;
            unsafe { c::step(self, measured, &mut command) };
            command
        }
        /// Observation for this measurement; changes nothing.
        #[must_use]
        pub fn observe(&self, measured: &Measurement) -> [#number; FEATURES] {
            let mut observation = [0.0; FEATURES];
            unsafe { c::observe(self, measured, observation.as_mut_ptr()) };
            observation
        }
        /// Q values of an observation.
        #[must_use]
        pub fn q_values(observation: &[#number; FEATURES]) -> [#number; ACTIONS] {
            let mut q = [0.0; ACTIONS];
            unsafe { c::q_values(observation.as_ptr(), q.as_mut_ptr()) };
            q
        }
        #set_mapping
        /// Known answers: the number of the first failing vector if the arithmetic of this build is not the policy's.
        pub fn self_test() -> Result<(), u32> {
            match unsafe { c::self_test() } {
                0 => Ok(()),
                vector => Err(vector),
            }
        }
        /// CRC-32 over the tables: whether they are as generated.
        #[must_use]
        pub fn integrity() -> bool {
            unsafe { c::integrity() == 1 }
        }
    }
}

/// The C core's state in Rust.
struct State {
    fields: TokenStream,
    zero: TokenStream,
    words: &'static str,
    as_words: TokenStream,
}

/// Words, or numbers of two words and then the two counters: as C lays them out, without a gap.
fn state(program: &Program) -> State {
    // the two counters come last
    let numbers = size((program.state_words() - 2) / 2);
    match program.scalar() {
        Scalar::F32 => State {
            fields: quote!(words: [u32; STATE_WORDS]),
            zero: quote!(words: [0; STATE_WORDS]),
            words: " One controller: the C core's state, one 32-bit word per member. Several instances are independent.",
            as_words: quote!(self.words),
        },
        Scalar::F64 => State {
            fields: quote!(numbers: [f64; #numbers], counters: [u32; 2]),
            zero: quote!(numbers: [0.0; #numbers], counters: [0; 2]),
            words: " One controller: the C core's state, numbers and counters. Several instances are independent.",
            as_words: {
                let numbers = number::all_words(Scalar::F64, &quote!(self.numbers));
                quote! {
                    let mut words = [0; STATE_WORDS];
                    for (word, value) in words.iter_mut().zip(#numbers.chain(self.counters)) {
                        *word = value;
                    }
                    words
                }
            },
        },
    }
}

/// What a command holds before the C core has written it.
fn nothing(program: &Program) -> TokenStream {
    let (duty, index) = match program.has_several() {
        true => (quote!([0.0; OUTPUTS]), quote!([0; OUTPUTS])),
        false => (quote!(0.0), quote!(0)),
    };
    quote! {
        const NOTHING: Command = Command { duty: #duty, duty_sim: #duty, action_index: #index, status: 0 };
    }
}

/// Declarations and methods that set coefficients, one for each mapping.
fn mappings(program: &Program) -> (TokenStream, TokenStream) {
    let both = program
        .outputs
        .iter()
        .filter_map(|output| Some(set_mapping(program, output, output.mapping.as_ref()?)));
    let (declarations, methods): (Vec<_>, Vec<_>) = both.unzip();
    (quote!(#(#declarations)*), quote!(#(#methods)*))
}

fn set_mapping(program: &Program, output: &OutputCode, mapping: &MappingCode) -> (TokenStream, TokenStream) {
    let function = output.named("set_mapping");
    let symbol = format!("{}_{function}", program.name);
    let (function, name) = (ident(&function), ident(DEFAULT_TYPE));
    let number = number::kind(program.scalar());
    let names: Vec<_> = mapping
        .coefficients
        .iter()
        .map(|(name, ..)| ident(name.name()))
        .collect();
    let declaration = quote! {
        #[link_name = #symbol]
        pub fn #function(state: *mut #name, #(#names: #number),*) -> u32;
    };
    let about = super::mapping::about(output);
    let method = quote! {
        #(#[doc = #about])*
        #[must_use]
        pub fn #function(&mut self, #(#names: #number),*) -> bool {
            unsafe { c::#function(self, #(#names),*) == 1 }
        }
    };
    (declaration, method)
}
