//! The functions of the emitted Rust as [`Emitted`].

use policy::DutyPath;

use super::execute::Walk;
use super::unit::Unit;
use crate::emitted::{
    Called, Emitted, Network, command_of, command_record, measurement_record, members_of, state_of, state_record,
    terms_of,
};
use crate::machine::{Kind, Number, Value, Wrong, number};
use crate::refusal::Refusal;
use crate::spec::{Command, Spec, State};
use crate::term::Term;

pub(crate) struct Rust<'a> {
    pub spec: Spec<'a>,
    pub unit: Unit,
}

impl<'a> Rust<'a> {
    fn refused(&self, message: Wrong) -> Refusal {
        Refusal::at(&self.unit.file, 0, message)
    }

    /// The record must have the members of the struct of that name.
    fn checked(&self, name: &str, value: Value) -> Result<Value, Refusal> {
        let members = self
            .unit
            .records
            .get(name)
            .map(|members| members.keys().cloned().collect());
        match members == Some(members_of(&value)) {
            true => Ok(value),
            false => Err(self.refused(format!("`{name}` has other members than the contract gives it"))),
        }
    }

    /// Calls a method on `state` with references to `others`: what it left, and what it gave.
    fn run(
        &self,
        method: &str,
        state: &State,
        others: Vec<Value>,
        numbers: Vec<Value>,
    ) -> Result<(Called, Value), Refusal> {
        let mut network = Network::new(self.spec);
        let mut walk = Walk::new(&self.unit, &mut network);
        let record = self.checked("Controller", state_record(self.spec, state))?;
        let place = walk.machine.put(record);
        let mut arguments = vec![Value::Place(place.clone())];
        for other in others {
            arguments.push(Value::Place(walk.machine.put(other)));
        }
        arguments.extend(numbers);
        let given = walk.call(&format!("Self::{method}"), arguments)?;
        let machine = walk.machine;
        let after = machine
            .read(&place)
            .and_then(|after| state_of(self.spec, &after, state));
        let called = Called {
            state: after.map_err(|message| self.refused(message))?,
            command: None,
            obligations: machine.obligations,
            observations: network.observations,
            outputs: network.outputs,
        };
        Ok((called, given))
    }

    fn measured(&self, measurement: &[Term]) -> Result<Value, Refusal> {
        self.checked("Measurement", measurement_record(self.spec, measurement))
    }

    fn commanded(&self, method: &str, state: &State, measurement: &[Term]) -> Result<Called, Refusal> {
        let (mut called, given) = self.run(method, state, vec![self.measured(measurement)?], Vec::new())?;
        let command = self.checked("Command", given)?;
        called.command = Some(command_of(self.spec, &command).map_err(|message| self.refused(message))?);
        Ok(called)
    }
}

impl Emitted for Rust<'_> {
    fn language(&self) -> &'static str {
        "Rust"
    }

    /// `network` gives them behind the last cut.
    fn to_cut(&self) -> Result<u32, Refusal> {
        Ok(0)
    }

    fn eval(&self, state: &State, measurement: &[Term]) -> Result<Called, Refusal> {
        self.commanded("eval", state, measurement)
    }

    fn commit(&self, state: &State, measurement: &[Term], command: &Command) -> Result<Called, Refusal> {
        let command = self.checked("Command", command_record(self.spec, command))?;
        Ok(self
            .run("commit", state, vec![self.measured(measurement)?, command], Vec::new())?
            .0)
    }

    fn step(&self, state: &State, measurement: &[Term]) -> Result<Called, Refusal> {
        self.commanded("step", state, measurement)
    }

    fn observe(&self, state: &State, measurement: &[Term]) -> Result<Vec<Term>, Refusal> {
        let (_, given) = self.run("observe", state, vec![self.measured(measurement)?], Vec::new())?;
        terms_of(&given).map_err(|message| self.refused(message))
    }

    fn init(&self, state: &State) -> Result<State, Refusal> {
        let mut network = Network::new(self.spec);
        let mut walk = Walk::new(&self.unit, &mut network);
        let given = walk.call("Self::new", Vec::new())?;
        let given = self.checked("Controller", given)?;
        state_of(self.spec, &given, state).map_err(|message| self.refused(message))
    }

    fn reset(&self, state: &State) -> Result<State, Refusal> {
        Ok(self.run("reset", state, Vec::new(), Vec::new())?.0.state)
    }

    fn set_mapping(&self, path: &DutyPath<'_>, state: &State, coefficients: &[Term]) -> Result<(State, Term), Refusal> {
        let kind = Kind::Float(self.spec.float.format);
        let numbers = coefficients
            .iter()
            .map(|term| Value::Number(Number { term: *term, kind }));
        let name = path.named("set_mapping");
        let (called, given) = self.run(&name, state, Vec::new(), numbers.collect())?;
        match number(&given) {
            Ok(Number {
                term,
                kind: Kind::Truth,
            }) => Ok((called.state, self.spec.terms.number(term, 32))),
            _ => Err(self.refused(format!("`{name}` gives no bool"))),
        }
    }

    fn helper(&self, name: &str, arguments: &[Number]) -> Option<Result<(Number, Vec<Term>), Refusal>> {
        if !self.unit.functions.contains_key(name) {
            return None;
        }
        let mut network = Network::new(self.spec);
        let mut walk = Walk::new(&self.unit, &mut network);
        let arguments = arguments.iter().map(|argument| Value::Number(*argument)).collect();
        let given = walk
            .call(name, arguments)
            .and_then(|value| number(&value).map_err(|message| self.refused(message)));
        Some(given.map(|value| (value, walk.machine.obligations)))
    }
}
