//! The items of the emitted Rust by their names.

use std::collections::BTreeMap;

use syn::spanned::Spanned;
use syn::{Expr, Fields, FnArg, ImplItem, Item, ItemStruct, Pat, ReturnType, Signature, Type};

use crate::machine::{I32, Kind, U32, U64, Wrong};
use crate::refusal::Refusal;

/// A function or method: parameters without the receiver, and its block.
pub(crate) struct Function {
    pub has_self: bool,
    pub parameters: Vec<(Pat, Type)>,
    pub result: Option<Type>,
    pub body: syn::Block,
}

pub(crate) struct Unit {
    pub file: String,
    pub functions: BTreeMap<String, Function>,
    /// Constants and statics: type and value.
    pub constants: BTreeMap<String, (Type, Expr)>,
    /// Members of each record, with their types.
    pub records: BTreeMap<String, BTreeMap<String, Type>>,
}

impl Unit {
    pub(crate) fn read(file: &str, text: &str) -> Result<Self, Refusal> {
        let parsed = syn::parse_file(&without_comments(text))
            .map_err(|error| Refusal::at(file, error.span().start().line, format!("no Rust: {error}")))?;
        let mut unit = Unit {
            file: file.to_owned(),
            functions: BTreeMap::new(),
            constants: BTreeMap::new(),
            records: BTreeMap::new(),
        };
        for item in parsed.items {
            unit.item("", item);
        }
        Ok(unit)
    }

    /// Names inside of a module or of `Controller` are written as they are called: `status::HELD`, `Self::new`.
    fn item(&mut self, prefix: &str, item: Item) {
        let named = |ident: &syn::Ident| format!("{prefix}{ident}");
        match item {
            Item::Fn(function) => {
                let name = named(&function.sig.ident);
                self.functions.insert(name, function_of(function.sig, *function.block));
            }
            Item::Const(item) => {
                self.constants.insert(named(&item.ident), (*item.ty, *item.expr));
            }
            Item::Static(item) => {
                self.constants.insert(named(&item.ident), (*item.ty, *item.expr));
            }
            Item::Struct(item) => self.record(item),
            Item::Mod(module) => {
                let inner = format!("{}::", named(&module.ident));
                for item in module.content.into_iter().flat_map(|(_, items)| items) {
                    self.item(&inner, item);
                }
            }
            // what implements a trait is called under the trait's name, which no step does
            Item::Impl(item) if is_controller(&item.self_ty) && item.trait_.is_none() => {
                for item in item.items {
                    if let ImplItem::Fn(function) = item {
                        let name = format!("Self::{}", function.sig.ident);
                        self.functions.insert(name, function_of(function.sig, function.block));
                    }
                }
            }
            _ => {}
        }
    }

    fn record(&mut self, item: ItemStruct) {
        let Fields::Named(fields) = item.fields else { return };
        let named = fields
            .named
            .into_iter()
            .filter_map(|field| Some((field.ident.as_ref()?.to_string(), field.ty)));
        self.records.insert(item.ident.to_string(), named.collect());
    }
}

/// Attributes of the emitted code that say nothing about what it computes.
const SILENT: [&str; 3] = ["#[inline(always)]", "#[inline]", "#[allow(dead_code)]"];

/// Lines that are comments or say how to compile become empty, so that all others keep their numbers. A comment of documentation is an
/// attribute to a parser, and one of those costs as much as a statement.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let is_silent = line.trim_start().starts_with("//") || SILENT.contains(&line.trim());
        // such a line may stand inside of a text or of another comment: as long as it does not end it, nothing around it changes
        let ends_none = !["\"", "/*", "*/"].iter().any(|end| line.contains(end));
        out.push_str(if is_silent && ends_none {
            &line[line.trim_end_matches(['\r', '\n']).len()..]
        } else {
            line
        });
    }
    out
}

fn is_controller(of: &Type) -> bool {
    matches!(of, Type::Path(path) if path.path.is_ident("Controller"))
}

fn function_of(signature: Signature, body: syn::Block) -> Function {
    let has_self = signature.receiver().is_some();
    let typed = signature.inputs.into_iter().filter_map(|input| match input {
        FnArg::Typed(typed) => Some((*typed.pat, *typed.ty)),
        FnArg::Receiver(_) => None,
    });
    Function {
        has_self,
        parameters: typed.collect(),
        result: match signature.output {
            ReturnType::Type(_, of) => Some(*of),
            ReturnType::Default => None,
        },
        body,
    }
}

/// The scalar of a type, or of what it holds: an array and a reference give a literal inside of them its type.
pub(crate) fn kind_of(of: &Type) -> Option<Kind> {
    match of {
        Type::Array(array) => kind_of(&array.elem),
        Type::Reference(reference) => kind_of(&reference.elem),
        Type::Slice(slice) => kind_of(&slice.elem),
        Type::Paren(inner) => kind_of(&inner.elem),
        Type::Path(path) => scalar(&path.path.get_ident()?.to_string()),
        _ => None,
    }
}

/// The scalar of that name. An index is a number of 64 bits here: no step computes with one.
pub(crate) fn scalar(name: &str) -> Option<Kind> {
    Some(match name {
        "f32" => Kind::Float(policy::Scalar::F32),
        "f64" => Kind::Float(policy::Scalar::F64),
        "u32" => U32,
        "i32" => I32,
        "u64" | "usize" => U64,
        "i64" => Kind::Integer { bits: 64, signed: true },
        "i16" => Kind::Integer { bits: 16, signed: true },
        "u16" => Kind::Integer {
            bits: 16,
            signed: false,
        },
        "bool" => Kind::Truth,
        _ => return None,
    })
}

/// Segments of a path, joined.
pub(crate) fn joined(path: &syn::Path) -> String {
    let segments = path.segments.iter().map(|segment| segment.ident.to_string());
    segments.collect::<Vec<_>>().join("::")
}

/// `what` with its line.
pub(crate) fn at(node: &impl Spanned, what: impl Into<Wrong>) -> (usize, Wrong) {
    (node.span().start().line, what.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_comment_becomes_an_empty_line() {
        let text = "/// what f does\n    // how\r\nfn f() {} // here\n//";
        assert_eq!(without_comments(text), "\n\r\nfn f() {} // here\n");
    }

    #[test]
    fn a_line_that_could_end_a_text_or_a_comment_stays() {
        for text in ["\"\n// \" + f()\n", "/*\n// */ f()\n", "/*\n// /* */\n*/\n"] {
            assert_eq!(without_comments(text), text);
        }
    }
}
