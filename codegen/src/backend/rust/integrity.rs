//! The integrity check: CRC-32 over all tables, whole or in slices beside control.
//!
//! ```text
//!  numbers of all tables, one after the other     |weights0 ....|bias0 .|weights1 ......|bias1 .|duties|
//!  a span                                                 from ┴───────────────┴ to
//! ```
//!
//! Each table is asked what of it lies in the span. The one invariant: the checksum goes on from slice to slice, so many small
//! slices give what one large one gives.

use policy::Scalar;
use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::tables;
use super::tokens::word;
use crate::program::{Element, Program};

/// Checksums, the type of a check, and where it stands among the tables.
pub fn items(program: &Program) -> TokenStream {
    let (tables, crc) = (tables::checked(program), word(program.crc));
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
                // not by index, which would be a way to a panic; the ends are in order, so nothing is ever left out
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

/// Checksum functions over the elements of tables, and the methods of `Span` that call them.
fn checksums(program: &Program) -> (TokenStream, TokenStream) {
    let mut elements = vec![Element::Float(Scalar::F32)];
    for table in program.checked_tables() {
        if !elements.contains(&table.element) {
            elements.push(table.element);
        }
    }
    let of_element = |element: Element| {
        let (checksum, method, kind) = (checksum(element), tables::method(element), tables::kind(element));
        let words = match element {
            Element::Float(Scalar::F32) => quote!(crc_word(crc, x.to_bits())),
            Element::Float(Scalar::F64) => {
                quote!(crc_word(crc_word(crc, x.to_bits() as u32), (x.to_bits() >> 32) as u32))
            }
            Element::Integer { bytes: 4 } | Element::Word => quote!(crc_word(crc, *x as u32)),
            Element::Integer { .. } => quote!(crc_word(crc, i32::from(*x) as u32)),
        };
        let function = quote! {
            // off the control path: once in flash, whatever it costs in time
            #[inline(never)]
            fn #checksum(crc: u32, numbers: &[#kind]) -> u32 {
                numbers.iter().fold(crc, |crc, x| #words)
            }
        };
        // of floats the self test asks for a checksum where no table has one
        let is_of_a_table = program.checked_tables().any(|table| table.element == element);
        let method = is_of_a_table.then(|| {
            quote! {
                fn #method(&mut self, table: &[#kind]) {
                    let part = self.part(table);
                    self.crc = #checksum(self.crc, part);
                }
            }
        });
        (function, method)
    };
    let (functions, methods): (Vec<_>, Vec<_>) = elements.into_iter().map(of_element).unzip();
    (quote!(#(#functions)*), quote!(#(#methods)*))
}

/// Function of the checksum over a table of this element.
pub fn checksum(element: Element) -> Ident {
    format_ident!("crc_{}", tables::method(element))
}
