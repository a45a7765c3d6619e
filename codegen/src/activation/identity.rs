//! No activation: the sum itself.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::text::{C, Text, c_shifted, rust_shifted};
use crate::program::{Cut, Sink, Store};

pub(super) struct Identity;

impl Text for Identity {
    fn c(&self, _c: &C<'_>, sum: &str) -> String {
        sum.to_owned()
    }

    fn c_integer(&self, _c: &C<'_>, sum: &str, cut: &Cut) -> String {
        c_shifted(sum, cut)
    }

    fn rust(&self, _scalar: Scalar) -> TokenStream {
        quote!(sum)
    }

    fn rust_integer(&self, store: &Store, cut: &Cut) -> TokenStream {
        let shifted = rust_shifted(cut);
        match (store.to, cut.shift) {
            // Q values are 32 bits wide, as their sums
            (Sink::Sums, _) => shifted,
            (_, 0) => quote!(sum as i16),
            _ => quote!((#shifted) as i16),
        }
    }

    fn single(&self, x: f32) -> f32 {
        x
    }

    fn double(&self, x: f64) -> f64 {
        x
    }

    fn integer(&self, sum: i32, cut: &Cut) -> i32 {
        sum >> cut.shift
    }
}
