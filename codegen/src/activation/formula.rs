//! A curve as a list of operations, each rounded once: one list, of which C, Rust and the value on the host are three readings.

use policy::Scalar;
use proc_macro2::TokenStream;
use quote::quote;

use super::curve::Function;
use super::limit;
use super::number::Number;
use super::tanh::Tanh;
use super::text::{C, Needs, Rust};
use crate::backend::rust::number;
use crate::backend::rust::tokens::ident;
use crate::program::Literal;

/// What an operation is done to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    /// The argument.
    X,
    /// The line of this number.
    Line(usize),
    /// A constant, rounded to the format.
    Number(f64),
}

/// One operation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Step {
    Add(Value, Value),
    Sub(Value, Value),
    Mul(Value, Value),
    Div(Value, Value),
    Neg(Value),
    Relu(Value),
    Absolute(Value),
    Tanh(Value),
    /// To plus and minus the constant.
    Limit(Value, f64),
}

/// A function of one number; the last line is its value.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Formula {
    name: &'static str,
    about: &'static str,
    lines: Vec<(String, Step)>,
}

impl Formula {
    pub fn new(name: &'static str, about: &'static str) -> Self {
        Self {
            name,
            about,
            lines: Vec::new(),
        }
    }

    /// Adds a line of this name.
    pub fn line(&mut self, name: impl Into<String>, step: Step) -> Value {
        self.lines.push((name.into(), step));
        Value::Line(self.lines.len() - 1)
    }

    /// Adds the polynomial of these terms in z, lowest power first, by Horner's rule.
    pub fn polynomial(&mut self, terms: &[f64], z: Value) -> Value {
        let mut sum = Value::Number(terms.last().copied().unwrap_or_default());
        for (power, term) in terms.iter().enumerate().rev().skip(1) {
            let product = self.line(format!("m{power}"), Step::Mul(sum, z));
            sum = self.line(format!("p{power}"), Step::Add(product, Value::Number(*term)));
        }
        sum
    }

    fn c_value(&self, c: &C<'_>, value: Value) -> String {
        match value {
            Value::X => "x".to_owned(),
            Value::Line(line) => self.lines[line].0.clone(),
            Value::Number(number) => (c.literal)(c.scalar, number),
        }
    }

    fn c_step(&self, c: &C<'_>, step: Step) -> String {
        let value = |value| self.c_value(c, value);
        match step {
            Step::Add(a, b) => format!("{} + {}", value(a), value(b)),
            Step::Sub(a, b) => format!("{} - {}", value(a), value(b)),
            Step::Mul(a, b) => format!("{} * {}", value(a), value(b)),
            Step::Div(a, b) => format!("{} / {}", value(a), value(b)),
            Step::Neg(a) => format!("-{}", value(a)),
            Step::Relu(a) => format!("{}_relu({})", c.n, value(a)),
            Step::Absolute(a) => format!("{}_absolute({})", c.n, value(a)),
            Step::Tanh(a) => format!("{}_tanh({})", c.n, value(a)),
            Step::Limit(a, end) => format!("{}_limit({}, {})", c.n, value(a), limit::c_bits(c.scalar, end)),
        }
    }

    fn rust_value(&self, scalar: Scalar, value: Value) -> TokenStream {
        match value {
            Value::X => quote!(x),
            Value::Line(line) => {
                let name = ident(&self.lines[line].0);
                quote!(#name)
            }
            Value::Number(value) => number::number(scalar, Literal::nearest(scalar, value)),
        }
    }

    fn rust_step(&self, scalar: Scalar, step: Step) -> TokenStream {
        let value = |value| self.rust_value(scalar, value);
        let two = |a, b| (value(a), value(b));
        match step {
            Step::Add(a, b) => {
                let (a, b) = two(a, b);
                quote!(#a + #b)
            }
            Step::Sub(a, b) => {
                let (a, b) = two(a, b);
                quote!(#a - #b)
            }
            Step::Mul(a, b) => {
                let (a, b) = two(a, b);
                quote!(#a * #b)
            }
            Step::Div(a, b) => {
                let (a, b) = two(a, b);
                quote!(#a / #b)
            }
            Step::Neg(a) => {
                let a = value(a);
                quote!(-#a)
            }
            Step::Relu(a) => call("relu", &value(a)),
            Step::Absolute(a) => call("absolute", &value(a)),
            Step::Tanh(a) => call("tanh", &value(a)),
            Step::Limit(a, end) => {
                let bits = limit::rust_bits(scalar, end);
                let a = value(a);
                quote!(limit(#a, #bits))
            }
        }
    }
}

fn call(function: &str, argument: &TokenStream) -> TokenStream {
    let function = ident(function);
    quote!(#function(#argument))
}

impl Function for Formula {
    fn name(&self) -> &'static str {
        self.name
    }

    fn needs(&self) -> Needs {
        let steps = || self.lines.iter().map(|(_, step)| step);
        let tanh = steps().any(|step| matches!(step, Step::Tanh(_)));
        Needs {
            relu: steps().any(|step| matches!(step, Step::Relu(_))),
            absolute: steps().any(|step| matches!(step, Step::Absolute(_))),
            limit: tanh || steps().any(|step| matches!(step, Step::Limit(..))),
            tanh,
        }
    }

    fn c(&self, c: &C<'_>) -> Vec<String> {
        let head = format!(
            "
/* {} */
static {number} {}_{}({number} x)
{{",
            self.about,
            c.n,
            self.name,
            number = c.number
        );
        let last = self.lines.len().saturating_sub(1);
        let line = |(index, (name, step)): (usize, &(String, Step))| {
            let step = self.c_step(c, *step);
            match index == last {
                true => format!("    return {step};"),
                false => format!("    const {} {name} = {step};", c.number),
            }
        };
        let lines = self.lines.iter().enumerate().map(line);
        std::iter::once(head).chain(lines).chain(["}".to_owned()]).collect()
    }

    fn rust(&self, rust: &Rust) -> TokenStream {
        let kind = number::kind(rust.scalar);
        let name = ident(self.name);
        let about = format!(" {}", self.about);
        let last = self.lines.len().saturating_sub(1);
        let lines = self.lines.iter().enumerate().map(|(index, (name, step))| {
            let step = self.rust_step(rust.scalar, *step);
            let name = ident(name);
            match index == last {
                true => step,
                false => quote!(let #name = #step;),
            }
        });
        quote! {
            #[doc = #about]
            #[inline(always)]
            fn #name(x: #kind) -> #kind {
                #(#lines)*
            }
        }
    }

    fn value<T: Number>(&self, x: T) -> T {
        let mut values: Vec<T> = Vec::with_capacity(self.lines.len());
        for (_, step) in &self.lines {
            let of = |value: Value| match value {
                Value::X => x,
                Value::Line(line) => values[line],
                Value::Number(number) => T::nearest(number),
            };
            let zero = T::nearest(0.0);
            let value = match *step {
                Step::Add(a, b) => of(a) + of(b),
                Step::Sub(a, b) => of(a) - of(b),
                Step::Mul(a, b) => of(a) * of(b),
                Step::Div(a, b) => of(a) / of(b),
                Step::Neg(a) => -of(a),
                Step::Relu(a) if of(a) > zero => of(a),
                Step::Relu(_) => zero,
                Step::Absolute(a) => T::nearest(of(a).wide().abs()),
                Step::Tanh(a) => Tanh.value(of(a)),
                Step::Limit(a, end) => {
                    let end = T::nearest(end).wide();
                    T::nearest(of(a).wide().clamp(-end, end))
                }
            };
            values.push(value);
        }
        values.last().copied().unwrap_or(x)
    }
}
