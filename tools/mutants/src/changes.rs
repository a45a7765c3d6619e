//! What code may become: other operators, numbers and answers.

use syn::{Lit, Type};

/// What an operator may become.
pub fn others(operator: &str) -> &'static [&'static str] {
    match operator {
        "+" => &["-", "*"],
        "-" => &["+", "/"],
        "*" => &["+", "/"],
        "/" => &["*", "%"],
        "%" => &["/", "+"],
        "&&" => &["||"],
        "||" => &["&&"],
        "&" => &["|", "^"],
        "|" => &["&", "^"],
        "^" => &["|", "&"],
        "<<" => &[">>"],
        ">>" => &["<<"],
        "==" => &["!="],
        "!=" => &["=="],
        "<" => &["<=", ">", "=="],
        "<=" => &["<", ">"],
        ">" => &[">=", "<", "=="],
        ">=" => &[">", "<"],
        "+=" => &["-=", "*="],
        "-=" => &["+=", "/="],
        "*=" => &["+=", "/="],
        "/=" => &["*=", "%="],
        "%=" => &["/=", "+="],
        "&=" => &["|=", "^="],
        "|=" => &["&=", "^="],
        "^=" => &["|=", "&="],
        "<<=" => &[">>="],
        ">>=" => &["<<="],
        _ => &[],
    }
}

/// Numbers beside a literal.
pub fn near(literal: &Lit) -> Vec<String> {
    match literal {
        Lit::Int(number) => {
            let value = number.base10_parse::<u128>().unwrap_or(u128::MAX);
            let near = [value.checked_add(1), value.checked_sub(1)];
            let near = near.into_iter().flatten().filter(|_| value < u128::MAX);
            near.map(|near| format!("{near}{}", number.suffix())).collect()
        }
        Lit::Float(number) => {
            let value = number.base10_parse::<f64>().unwrap_or(f64::NAN);
            let near = [value + 1.0, value - 1.0].into_iter().filter(|near| near.is_finite());
            near.map(|near| format!("{near:?}{}", number.suffix())).collect()
        }
        _ => Vec::new(),
    }
}

/// What a function of this type may return instead.
pub fn values(kind: &Type) -> Vec<String> {
    let listed = |values: &[&str]| values.iter().map(|value| (*value).to_owned()).collect();
    match kind {
        Type::Reference(reference) if is_named(&reference.elem, "str") => listed(&["\"\"", "\"xyzzy\""]),
        Type::Reference(_) | Type::ImplTrait(_) | Type::Never(_) => Vec::new(),
        Type::Path(path) => {
            let Some(last) = path.path.segments.last() else {
                return Vec::new();
            };
            let first = match &last.arguments {
                syn::PathArguments::AngleBracketed(list) => list.args.first(),
                _ => None,
            };
            match last.ident.to_string().as_str() {
                "bool" => listed(&["true", "false"]),
                "f32" | "f64" => listed(&["0.0", "1.0"]),
                "u8" | "u16" | "u32" | "u64" | "usize" | "i8" | "i16" | "i32" | "i64" | "i128" | "u128" => {
                    listed(&["0", "1"])
                }
                "String" => listed(&["String::new()"]),
                "Vec" => listed(&["Vec::new()"]),
                "Option" => listed(&["None"]),
                "Result" => match first {
                    Some(syn::GenericArgument::Type(inner)) => {
                        values(inner).iter().map(|value| format!("Ok({value})")).collect()
                    }
                    _ => listed(&["Ok(Default::default())"]),
                },
                _ => listed(&["Default::default()"]),
            }
        }
        Type::Tuple(tuple) if tuple.elems.is_empty() => listed(&["()"]),
        _ => listed(&["Default::default()"]),
    }
}

fn is_named(kind: &Type, name: &str) -> bool {
    matches!(kind, Type::Path(path) if path.path.is_ident(name))
}
