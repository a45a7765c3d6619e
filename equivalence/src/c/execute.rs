//! Walks through the emitted C with terms in the place of numbers.

use std::collections::BTreeMap;

use super::syntax::{Expr, Statement, Type, What};
use super::unit::Unit;
use crate::float::Float;
use crate::machine::{Binary, Kind, Machine, Place, Value, Wrong, number};
use crate::refusal::Refusal;
use crate::term::Term;

/// Calls that end at a function which is not walked into.
pub(crate) trait Outside {
    /// Whether `name` is such a function.
    fn is(&self, name: &str) -> bool;
    /// What the call writes; arguments as evaluated.
    fn call(&mut self, name: &str, arguments: &[Value], machine: &mut Machine<'_>) -> Result<(), Wrong>;
}

/// More turns than any loop of a step has: the longest goes over all memories, 64 features of 8 filters of 256 words at most.
pub(super) const MOST_TURNS: usize = 1 << 18;
/// Deeper than any call of a step.
const MOST_CALLS: usize = 32;

type Names = BTreeMap<String, (Place, Type)>;

pub(crate) struct Walk<'a, 'u> {
    pub(super) unit: &'u Unit,
    pub machine: Machine<'a>,
    pub(super) tables: BTreeMap<String, Place>,
    pub(super) outside: &'u mut dyn Outside,
    pub(super) names: Names,
    pub(super) depth: usize,
    pub(super) line: usize,
}

impl<'a, 'u> Walk<'a, 'u> {
    pub(crate) fn new(unit: &'u Unit, float: Float<'a>, outside: &'u mut dyn Outside) -> Self {
        Walk {
            unit,
            machine: Machine::new(float),
            tables: BTreeMap::new(),
            outside,
            names: BTreeMap::new(),
            depth: 0,
            line: 0,
        }
    }

    /// Calls a function of the unit.
    pub(crate) fn call(&mut self, name: &str, arguments: Vec<Value>) -> Result<Option<Value>, Refusal> {
        self.enter(name, arguments)
            .map_err(|message| Refusal::at(&self.unit.file, self.line, message))
    }

    /// A variable of that type which holds nothing yet.
    pub(crate) fn blank(&mut self, name: &str) -> Result<Place, Refusal> {
        let kind = Type {
            name: name.to_owned(),
            pointer: false,
        };
        let value = self
            .empty(&kind, None)
            .map_err(|message| Refusal::at(&self.unit.file, 0, message))?;
        Ok(self.machine.put(value))
    }

    pub(super) fn enter(&mut self, name: &str, arguments: Vec<Value>) -> Result<Option<Value>, Wrong> {
        let function = self.unit.function(name).map_err(|(line, message)| {
            self.line = line;
            message
        })?;
        if self.depth >= MOST_CALLS {
            return Err("calls nested too deeply".into());
        }
        if function.parameters.len() != arguments.len() {
            return Err(format!("`{name}` with {} arguments", arguments.len()));
        }
        let mut names = Names::new();
        for ((kind, parameter), argument) in function.parameters.iter().zip(arguments) {
            let value = self.as_type(kind, argument)?;
            let place = self.machine.put(value);
            names.insert(parameter.clone(), (place, kind.clone()));
        }
        let outer = std::mem::replace(&mut self.names, names);
        self.depth += 1;
        let returned = self.statements(&function.body)?;
        self.depth -= 1;
        self.names = outer;
        match returned {
            Some(Some(value)) => Ok(Some(self.as_type(&function.result, value)?)),
            _ => Ok(None),
        }
    }

    /// Stops at a return: its value, if it has one.
    fn statements(&mut self, statements: &[Statement]) -> Result<Option<Option<Value>>, Wrong> {
        // most blocks declare nothing, and bodies of loops are walked turn by turn
        let declares = statements
            .iter()
            .any(|statement| matches!(statement.what, What::Declare { .. } | What::For { .. }));
        let names = declares.then(|| self.names.clone());
        let mut returned = None;
        for statement in statements {
            self.line = statement.line;
            returned = self.statement(&statement.what)?;
            if returned.is_some() {
                break;
            }
        }
        if let Some(names) = names {
            self.names = names;
        }
        Ok(returned)
    }

    fn statement(&mut self, what: &What) -> Result<Option<Option<Value>>, Wrong> {
        match what {
            What::Declare {
                kind,
                name,
                length,
                first,
            } => {
                let value = match first {
                    Some(first) => {
                        let value = self.value(first)?;
                        self.as_type(kind, value)?
                    }
                    None => self.empty(kind, length.as_ref())?,
                };
                let place = self.machine.put(value);
                self.names.insert(name.clone(), (place, kind.clone()));
            }
            What::Assign(target, op, value) => self.assign(target, *op, value)?,
            What::Evaluate(expr) => {
                self.effect(expr)?;
            }
            What::For {
                start,
                condition,
                step,
                body,
            } => return self.turns(start, condition, step, body),
            What::If(condition, yes, no) => return self.branch(condition, yes, no),
            What::Return(value) => {
                let value = value.as_ref().map(|value| self.value(value)).transpose()?;
                return Ok(Some(value));
            }
            What::Block(statements) => return self.statements(statements),
            What::Barrier => {}
        }
        Ok(None)
    }

    fn assign(&mut self, target: &Expr, op: Option<Binary>, value: &Expr) -> Result<(), Wrong> {
        let mut new = self.value(value)?;
        let place = self.place(target)?;
        let (old, kind) = {
            let old = self.machine.look(&place)?;
            let kind = match &*old {
                Value::Number(old) => Some(old.kind),
                Value::Unset(kind) => *kind,
                _ => None,
            };
            (op.map(|_| number(&old)), kind)
        };
        if let (Some(op), Some(old)) = (op, old) {
            let result = self.binary(op, old?, number(&new)?)?;
            new = Value::Number(result);
        }
        if let (Some(kind), Value::Number(value)) = (kind, &new) {
            new = Value::Number(self.implicitly(*value, kind)?);
        }
        self.machine.write(&place, new)
    }

    fn turns(
        &mut self,
        start: &Statement,
        condition: &Expr,
        step: &Statement,
        body: &[Statement],
    ) -> Result<Option<Option<Value>>, Wrong> {
        self.statement(&start.what)?;
        for _ in 0..MOST_TURNS {
            let goes_on = self.condition(condition)?;
            match self.machine.terms.known(goes_on) {
                Some(0) => return Ok(None),
                Some(_) => {}
                None => return Err("a loop whose length depends on the data".into()),
            }
            if let Some(returned) = self.statements(body)? {
                return Ok(Some(returned));
            }
            self.statement(&step.what)?;
        }
        Err(format!("a loop of more than {MOST_TURNS} turns"))
    }

    fn branch(
        &mut self,
        condition: &Expr,
        yes: &[Statement],
        no: &[Statement],
    ) -> Result<Option<Option<Value>>, Wrong> {
        let condition = self.condition(condition)?;
        match self.machine.terms.known(condition) {
            Some(0) => return self.statements(no),
            Some(_) => return self.statements(yes),
            None => {}
        }
        let before = self.machine.clone();
        let yes = self.statements(yes)?;
        let after_yes = std::mem::replace(&mut self.machine, before);
        let no = self.statements(no)?;
        if yes.is_some() || no.is_some() {
            return Err("a return that depends on the data".into());
        }
        let after_no = std::mem::replace(&mut self.machine, after_yes);
        self.machine.merge(condition, after_no)?;
        Ok(None)
    }

    /// Whether `expr` is not 0.
    pub(super) fn condition(&mut self, expr: &Expr) -> Result<Term, Wrong> {
        let value = self.number(expr)?;
        let zero = self.machine.integer(0, value.kind);
        match value.kind {
            Kind::Integer { .. } => Ok(self.machine.terms.not(self.machine.terms.equal(value.term, zero.term))),
            _ => Err("a condition that is no integer".into()),
        }
    }

    /// A call, or `(void)x`.
    pub(super) fn effect(&mut self, expr: &Expr) -> Result<Option<Value>, Wrong> {
        match expr {
            Expr::Cast(kind, inner) if kind.name == "void" => match &**inner {
                Expr::Call(..) => self.effect(inner),
                _ => Ok(None),
            },
            Expr::Call(name, arguments) if name == "__builtin_memcpy" => {
                let [to, from, Expr::SizeOf] = arguments.as_slice() else {
                    return Err("a copy of another form".into());
                };
                let (to, from) = (self.value(to)?, self.value(from)?);
                self.copy(&to, &from)?;
                Ok(None)
            }
            Expr::Call(name, arguments) => {
                let mut values = Vec::new();
                for argument in arguments {
                    values.push(self.value(argument)?);
                }
                if self.outside.is(name) {
                    self.outside.call(name, &values, &mut self.machine)?;
                    return Ok(None);
                }
                let line = self.line;
                let returned = self.enter(name, values)?;
                self.line = line;
                Ok(returned)
            }
            _ => Err("a statement without an effect".into()),
        }
    }

    fn copy(&mut self, to: &Value, from: &Value) -> Result<(), Wrong> {
        let (Value::Place(to), Value::Place(from)) = (to, from) else {
            return Err("a copy between values".into());
        };
        let bits = number(&self.machine.read(from)?)?;
        let kind = match self.machine.read(to)? {
            Value::Unset(Some(kind)) => kind,
            other => number(&other)?.kind,
        };
        let copied = self.machine.reinterpret(bits, kind)?;
        self.machine.write(to, Value::Number(copied))
    }
}
