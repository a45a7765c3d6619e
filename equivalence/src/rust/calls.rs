//! Calls of the emitted Rust: its own functions, the few of `core` that a step uses, and iterators as lists of references.

use syn::{Expr, ExprCall, ExprMethodCall};

use super::execute::{Fault, Walk};
use super::unit::{at, joined, kind_of, scalar};
use crate::emitted::terms_of;
use crate::machine::{Binary, Kind, Number, U32, Value, Wrong};

/// Deeper than any call of a step.
const MOST_CALLS: usize = 32;

impl Walk<'_, '_> {
    /// Calls a function of the file.
    pub(super) fn enter(&mut self, name: &str, arguments: Vec<Value>) -> Result<Value, Fault> {
        let unit = self.unit;
        let function = unit.functions.get(name);
        let function = function.ok_or_else(|| (0, format!("the function `{name}` is not there")))?;
        // the place of a fault: to find a line costs more than most calls
        let refused = |message: &str| at(&function.body, message);
        if self.depth >= MOST_CALLS {
            return Err(refused("calls nested too deeply"));
        }
        let mut arguments = arguments.into_iter();
        let outer = std::mem::take(&mut self.names);
        if function.has_self {
            let receiver = arguments.next().ok_or_else(|| refused("a method without a receiver"))?;
            let receiver = self.machine.put(receiver);
            self.names.insert("self".into(), receiver);
        }
        if function.parameters.len() != arguments.len() {
            return Err(refused(&format!("`{name}` with another number of arguments")));
        }
        for ((pattern, of), argument) in function.parameters.iter().zip(arguments) {
            if let (Some(kind), Value::Number(number)) = (kind_of(of), &argument)
                && number.kind != kind
            {
                return Err(refused(&format!("`{name}` with an argument of another type")));
            }
            self.bind(pattern, argument)?;
        }
        self.depth += 1;
        let value = self.block(&function.body, function.result.as_ref().and_then(kind_of))?;
        self.depth -= 1;
        self.names = outer;
        Ok(value)
    }

    pub(super) fn called(&mut self, call: &ExprCall) -> Result<Value, Fault> {
        let Expr::Path(path) = &*call.func else {
            return Err(at(call, "a call of something that has no name"));
        };
        let name = joined(&path.path);
        let only = call.args.first().filter(|_| call.args.len() == 1);
        match (name.as_str(), only) {
            // a value that the optimiser must not look through is still that value
            ("core::hint::black_box", Some(value)) => self.value(value, None),
            ("f32::from_bits" | "f64::from_bits", Some(bits)) => {
                let kind = name
                    .split("::")
                    .next()
                    .and_then(scalar)
                    .ok_or_else(|| at(call, "a type"))?;
                let bits = self.number(bits, None)?;
                let number = self
                    .machine
                    .reinterpret(bits, kind)
                    .map_err(|message| at(call, message))?;
                Ok(Value::Number(number))
            }
            ("u32::from" | "u64::from", Some(value)) => {
                let kind = name
                    .split("::")
                    .next()
                    .and_then(scalar)
                    .ok_or_else(|| at(call, "a type"))?;
                let value = self.number(value, None)?;
                let number = self.machine.convert(value, kind).map_err(|message| at(call, message))?;
                Ok(Value::Number(number))
            }
            ("network", Some(observation)) => {
                let observation = self.place(observation)?;
                self.run_network(observation).map_err(|message| at(call, message))
            }
            _ => {
                let arguments = self.arguments(&name, call.args.iter())?;
                self.entered(call, &name, arguments)
            }
        }
    }

    fn run_network(&mut self, observation: crate::machine::Place) -> Result<Value, Wrong> {
        let observation = self.dereferenced(observation)?;
        let observation = terms_of(&*self.machine.look(&observation)?)?;
        self.network.observations.push(observation);
        Ok(Value::List(self.network.answer()))
    }

    /// A fault without a line gets that of the call.
    fn entered(
        &mut self,
        call: &impl syn::spanned::Spanned,
        name: &str,
        arguments: Vec<Value>,
    ) -> Result<Value, Fault> {
        self.enter(name, arguments).map_err(|fault| match fault {
            (0, message) => at(call, message),
            fault => fault,
        })
    }

    /// Arguments, their literals of the types of the parameters.
    fn arguments<'e>(&mut self, name: &str, arguments: impl Iterator<Item = &'e Expr>) -> Result<Vec<Value>, Fault> {
        let function = self.unit.functions.get(name);
        let parameters = function.map_or(&[][..], |function| &function.parameters);
        let hints: Vec<Option<Kind>> = parameters.iter().map(|(_, of)| kind_of(of)).collect();
        let mut values = Vec::new();
        for (n, argument) in arguments.enumerate() {
            values.push(self.value(argument, hints.get(n).copied().flatten())?);
        }
        Ok(values)
    }

    pub(super) fn method(&mut self, call: &ExprMethodCall, hint: Option<Kind>) -> Result<Value, Fault> {
        let name = call.method.to_string();
        let own = format!("Self::{name}");
        let is_self = matches!(&*call.receiver, Expr::Path(path) if path.path.is_ident("self"));
        if is_self && self.unit.functions.contains_key(&own) {
            let receiver = self.place(&call.receiver)?;
            let receiver = self.dereferenced(receiver).map_err(|message| at(call, message))?;
            let mut arguments = vec![Value::Place(receiver)];
            arguments.extend(self.arguments(&own, call.args.iter())?);
            return self.entered(call, &own, arguments);
        }
        let arguments: Vec<&Expr> = call.args.iter().collect();
        match (name.as_str(), arguments.as_slice()) {
            ("wrapping_add" | "wrapping_sub" | "wrapping_mul", [other]) => {
                let x = self.number(&call.receiver, hint)?;
                let y = self.number(other, Some(x.kind))?;
                let op = match name.as_str() {
                    "wrapping_add" => Binary::Add,
                    "wrapping_sub" => Binary::Sub,
                    _ => Binary::Mul,
                };
                let result = self.machine.binary(op, x, y).map_err(|message| at(call, message))?;
                Ok(Value::Number(result))
            }
            ("max" | "min", [other]) => {
                let x = self.number(&call.receiver, hint)?;
                let y = self.number(other, Some(x.kind))?;
                let (Kind::Integer { .. }, true) = (x.kind, x.kind == y.kind) else {
                    return Err(at(call, "`max` or `min` of something else than two integers"));
                };
                let less = self
                    .machine
                    .binary(Binary::Less, x, y)
                    .map_err(|message| at(call, message))?;
                let (if_less, else_) = if name == "max" { (y, x) } else { (x, y) };
                let term = self.machine.terms.choose(less.term, if_less.term, else_.term);
                Ok(Value::Number(Number { term, kind: x.kind }))
            }
            ("to_bits", []) => {
                let x = self.number(&call.receiver, None)?;
                let kind = match x.kind {
                    Kind::Float(policy::Scalar::F32) => U32,
                    Kind::Float(policy::Scalar::F64) => crate::machine::U64,
                    _ => return Err(at(call, "bits of something that is no number")),
                };
                let bits = self.machine.reinterpret(x, kind).map_err(|message| at(call, message))?;
                Ok(Value::Number(bits))
            }
            _ => self.over_items(call, &name, &arguments),
        }
    }

    /// Iterators: every adapter gives the list of what it would give.
    fn over_items(&mut self, call: &ExprMethodCall, name: &str, arguments: &[&Expr]) -> Result<Value, Fault> {
        let wrong = |message: Wrong| at(call, message);
        let receiver = match name {
            "iter" | "iter_mut" => Value::Place(self.place(&call.receiver)?),
            _ => self.value(&call.receiver, None)?,
        };
        let mut items = self.items(receiver).map_err(wrong)?;
        match (name, arguments) {
            ("iter" | "iter_mut", []) => {}
            ("skip", [count]) => {
                let count = self.length(count)?.min(items.len());
                items.drain(..count);
            }
            ("take", [count]) => items.truncate(self.length(count)?),
            ("rev", []) => items.reverse(),
            ("zip", [other]) => {
                let other = self.value(other, None)?;
                let other = self.items(other).map_err(wrong)?;
                let both = items.into_iter().zip(other);
                items = both.map(|(x, y)| Value::List(vec![x, y])).collect();
            }
            ("fold", [first, Expr::Closure(closure)]) => return self.fold(items, first, closure),
            _ => return Err(at(call, format!("the method `{name}`"))),
        }
        Ok(Value::List(items))
    }

    fn fold(&mut self, items: Vec<Value>, first: &Expr, closure: &syn::ExprClosure) -> Result<Value, Fault> {
        let (Some(sum), Some(item), 2) = (closure.inputs.first(), closure.inputs.last(), closure.inputs.len()) else {
            return Err(at(closure, "a fold of another form"));
        };
        let mut so_far = None;
        for value in items {
            let names = self.names.clone();
            // the first value is a literal of the type that the closure gives, which is not known before it has run
            let before = match so_far {
                Some(value) => value,
                None => self.value(first, Some(self.word()))?,
            };
            self.bind(sum, before)?;
            self.bind(item, value)?;
            so_far = Some(self.value(&closure.body, None)?);
            self.names = names;
        }
        match so_far {
            Some(value) => Ok(value),
            None => self.value(first, Some(self.word())),
        }
    }

    /// The unsigned integer as wide as a number of the format.
    fn word(&self) -> Kind {
        Kind::Integer {
            bits: self.machine.float.width(),
            signed: false,
        }
    }

    /// What a loop over `value` visits: references to the elements of an array, the items of an iterator as they are.
    pub(super) fn items(&self, value: Value) -> Result<Vec<Value>, Wrong> {
        match value {
            Value::List(items) => Ok(items),
            Value::Place(place) => {
                let place = self.dereferenced(place)?;
                match &*self.machine.look(&place)? {
                    // references already: what `line_sum` gets is an iterator
                    Value::List(items) if items.iter().any(|item| matches!(item, Value::Place(_))) => Ok(items.clone()),
                    Value::List(items) => Ok((0..items.len())
                        .map(|n| Value::Place(place.clone().element(n)))
                        .collect()),
                    _ => Err("a loop over something that is no array".into()),
                }
            }
            _ => Err("a loop over a number".into()),
        }
    }
}
