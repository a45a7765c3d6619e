//! The integrity check: CRC-32 over all tables, whole or in slices beside control.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::network::held;
use super::{ident, integer, streamed, word};

use crate::program::{LayerCode, NetworkCode, Program};

/// Checksums, the type of a check, and where it stands among the tables.
pub fn items(program: &Program) -> TokenStream {
    let (tables, crc) = (tables(program), word(program.crc));
    let slice = quote! {
        let from = if self.position < Self::LENGTH { self.position } else { 0 };
        let to = from.saturating_add(count).min(Self::LENGTH);
        let mut span = Span { from, to, first: 0, crc: if from == 0 { u32::MAX } else { self.crc } };
        #tables
        self.position = to;
        self.crc = span.crc;
        if to < Self::LENGTH { None } else { Some(!span.crc == #crc) }
    };
    let check = check(program, &TokenStream::new(), &slice);
    let (checksums, methods) = checksums(program);
    quote! {
        /// CRC-32 (IEEE 802.3) of words taken little-endian, whatever the byte order of the machine.
        #[inline(always)]
        fn crc_word(mut crc: u32, word: u32) -> u32 {
            crc ^= word;
            for _ in 0..8 {
                crc = (crc >> 4) ^ CRC_STEPS[(crc & 15) as usize];
            }
            crc
        }
        #checksums
        #check
        /// Positions `from` to `to` among all numbers; the next table starts at `first`.
        struct Span {
            from: u32,
            to: u32,
            first: u32,
            crc: u32,
        }
        impl Span {
            /// What of the next table lies in the span.
            fn part<'a, T>(&mut self, table: &'a [T]) -> &'a [T] {
                let length = table.len() as u32;
                let place = |position: u32| position.saturating_sub(self.first).min(length) as usize;
                let part = place(self.from)..place(self.to);
                self.first = self.first.saturating_add(length);
                table.get(part).unwrap_or_default()
            }
            #methods
        }
    }
}

/// The type of a check; `slice` is the body of its method.
pub fn check(program: &Program, layout: &TokenStream, slice: &TokenStream) -> TokenStream {
    let length = word(program.table_numbers() as u32);
    quote! {
        /// An integrity check in slices, beside control.
        #[derive(Clone, Copy, Debug, Default)]
        #layout
        pub struct IntegrityCheck {
            position: u32,
            crc: u32,
        }
        impl IntegrityCheck {
            /// Numbers in all tables.
            pub const LENGTH: u32 = #length;
            /// Nothing checked so far.
            #[must_use]
            pub const fn new() -> Self {
                Self { position: 0, crc: 0 }
            }
            /// Checks the next `count` numbers of the tables. Behind the last of them: whether all are as generated; then the
            /// next call starts again.
            #[must_use]
            pub fn slice(&mut self, count: u32) -> Option<bool> {
                #slice
            }
        }
    }
}

/// Checksum functions over the types of tables, and the methods of `Span` that call them.
fn checksums(program: &Program) -> (TokenStream, TokenStream) {
    let one = |name: &str, kind: TokenStream, words: TokenStream| {
        let (checksum, method) = (ident(&format!("crc_{name}")), ident(name));
        (
            quote! {
                #[inline(never)]
                fn #checksum(crc: u32, numbers: &[#kind]) -> u32 {
                    numbers.iter().fold(crc, |crc, x| #words)
                }
            },
            quote! {
                fn #method(&mut self, table: &[#kind]) {
                    let part = self.part(table);
                    self.crc = #checksum(self.crc, part);
                }
            },
        )
    };
    let mut all = vec![one("floats", quote!(f32), quote!(crc_word(crc, x.to_bits())))];
    if program.scalar() == Scalar::F64 {
        let words = quote!(crc_word(crc_word(crc, x.to_bits() as u32), (x.to_bits() >> 32) as u32));
        all.push(one("numbers", quote!(f64), words));
    }
    if let NetworkCode::Integer(network) = &program.network {
        all.push(one(
            "weights",
            integer::weight(network),
            quote!(crc_word(crc, i32::from(*x) as u32)),
        ));
        all.push(one("biases", quote!(i32), quote!(crc_word(crc, *x as u32))));
    }
    let (functions, methods): (Vec<_>, Vec<_>) = all.into_iter().unzip();
    (quote!(#(#functions)*), quote!(#(#methods)*))
}

/// Function of the checksum over numbers.
pub fn checksum(scalar: Scalar) -> TokenStream {
    match scalar {
        Scalar::F32 => quote!(crc_floats),
        Scalar::F64 => quote!(crc_numbers),
    }
}

/// Method of `Span` that takes a table of numbers.
pub fn numbers(scalar: Scalar) -> TokenStream {
    match scalar {
        Scalar::F32 => quote!(floats),
        Scalar::F64 => quote!(numbers),
    }
}

/// A table of arrays in arrays as one slice. `black_box`: the memory is read, the compiler does not answer in its place.
pub fn flat(table: &TokenStream, depth: usize) -> TokenStream {
    let flattened = (0..depth).map(|_| quote!(.as_flattened()));
    quote!(core::hint::black_box(&#table)#(#flattened)*)
}

/// Every table in the order of [`Program::table_words`].
fn tables(program: &Program) -> TokenStream {
    let network = match &program.network {
        NetworkCode::Real { scalar, layers, .. } => {
            let layers = layers
                .iter()
                .enumerate()
                .map(|(index, layer)| match layer.is_streamed() {
                    true => streamed::integrity(*scalar, index, layer),
                    false => layer_tables(*scalar, index, layer),
                });
            quote!(#(#layers)*)
        }
        NetworkCode::Integer(network) => integer::integrity(network),
    };
    let (numbers, duties) = (numbers(program.scalar()), flat(&quote!(DUTIES), 0));
    quote! { #network span.#numbers(#duties); }
}

fn layer_tables(scalar: Scalar, index: usize, layer: &LayerCode) -> TokenStream {
    let numbers = numbers(scalar);
    let name = |kind: &str| ident(&format!("{kind}{index}"));
    let (weights, bias) = (name("WEIGHTS"), name("BIAS"));
    let (weights, bias) = (flat(&held(layer, &weights), 2), flat(&quote!(#bias), 1));
    if layer.tail_rows() == 0 {
        return quote! { span.floats(#weights); span.#numbers(#bias); };
    }
    let (tail_weights, tail_bias) = (name("TAIL_WEIGHTS"), name("TAIL_BIAS"));
    let (tail_weights, tail_bias) = (flat(&held(layer, &tail_weights), 1), flat(&quote!(#tail_bias), 0));
    quote! {
        span.floats(#weights);
        span.floats(#tail_weights);
        span.#numbers(#bias);
        span.#numbers(#tail_bias);
    }
}
