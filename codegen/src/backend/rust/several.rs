//! Several duties from one network: what argmax chooses for each.

use proc_macro2::{Ident, TokenStream};
use quote::quote;

use super::tokens::{ident, size};
use super::{number, tables};
use crate::program::{HeadPart, Program};

/// The duties of a choice, as a static.
fn table(index: usize) -> Ident {
    ident(&HeadPart::table(index).to_uppercase())
}

/// Tables of duties, and argmax over some of the outputs; nothing where there is one duty.
pub fn items(program: &Program) -> TokenStream {
    let kind = number::kind(program.scalar());
    let choices = || {
        program
            .head
            .parts()
            .iter()
            .enumerate()
            .filter(|(_, part)| part.is_choice())
    };
    if choices().next().is_none() {
        return TokenStream::new();
    }
    let statics = choices().map(|(index, part)| {
        let (name, length) = (table(index), size(part.duties.len()));
        let duties = tables::values(program, &HeadPart::table(index));
        quote! { static #name: [#kind; #length] = #duties; }
    });
    let argmax = super::network::argmax(
        &quote!(#kind::MIN),
        &quote!(select),
        &quote!(outputs),
        &quote!(duties),
        &quote!(duties),
    );
    quote! {
        #(#statics)*
        /// Index and duty of the greedy action among some outputs.
        #[inline(always)]
        fn greedy<const N: usize>(outputs: [#kind; N], duties: &[#kind; N]) -> (u32, #kind) {
            #argmax
        }
    }
}

/// What argmax chooses for each duty that is a choice.
pub fn chosen(program: &Program) -> Vec<TokenStream> {
    let parts = program.head.parts().iter().enumerate();
    let statement = |(output, part): (usize, &HeadPart)| {
        let [index, chosen] = ["index", "chosen"].map(|stem| ident(&format!("{stem}{output}")));
        let (table, columns) = (table(output), part.column..part.column + part.duties.len());
        let columns = columns.map(size);
        quote! { let (#index, #chosen) = greedy([#(outputs[#columns]),*], &#table); }
    };
    parts.filter(|(_, part)| part.is_choice()).map(statement).collect()
}

/// The action index of each duty; of a gain schedule the one of its duty.
pub fn indices(program: &Program) -> Vec<TokenStream> {
    let index = |output: usize| match program.head.parts().get(output) {
        Some(part) if part.is_choice() => {
            let index = ident(&format!("index{output}"));
            quote!(#index & 0_u32.wrapping_sub(trusted))
        }
        _ => quote!(0),
    };
    (0..program.outputs.len()).map(index).collect()
}
