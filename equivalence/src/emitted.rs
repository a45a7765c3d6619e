//! The emitted controller as something that can be called with terms, whatever its language.

use std::collections::BTreeMap;

use policy::{DutyPath, Head};

use crate::machine::{I32, Kind, Number, Place, U32, Value, Wrong, number};
use crate::refusal::Refusal;
use crate::spec::{Command, Spec, State};
use crate::term::Term;

/// What a call left behind.
pub(crate) struct Called {
    pub state: State,
    pub command: Option<Command>,
    /// Observations that went into the network, one a run of it.
    pub observations: Vec<Vec<Term>>,
    /// What the network answered: Q values, or in integer formats the outputs of the last layer.
    pub outputs: Vec<Term>,
    /// What has to hold so that the call is defined.
    pub obligations: Vec<Term>,
}

/// The functions of a controller that firmware calls.
pub(crate) trait Emitted {
    /// `C` or `Rust`.
    fn language(&self) -> &'static str;
    /// Bits of the network's outputs that are still to be shifted out; 0 in formats that are no integers.
    fn to_cut(&self) -> Result<u32, Refusal>;
    fn eval(&self, state: &State, measurement: &[Term]) -> Result<Called, Refusal>;
    fn commit(&self, state: &State, measurement: &[Term], command: &Command) -> Result<Called, Refusal>;
    fn step(&self, state: &State, measurement: &[Term]) -> Result<Called, Refusal>;
    fn observe(&self, state: &State, measurement: &[Term]) -> Result<Vec<Term>, Refusal>;
    fn init(&self, state: &State) -> Result<State, Refusal>;
    fn reset(&self, state: &State) -> Result<State, Refusal>;
    /// That of one output: the state behind it, and 1 or 0 of 32 bits.
    fn set_mapping(&self, path: &DutyPath<'_>, state: &State, coefficients: &[Term]) -> Result<(State, Term), Refusal>;
    /// A helper by its name without prefix, if the code has one: numbers in, a number out, and what has to hold.
    fn helper(&self, name: &str, arguments: &[Number]) -> Option<Result<(Number, Vec<Term>), Refusal>>;
}

/// Runs of the network: what went in, and inputs of the goal for what comes out.
pub(crate) struct Network<'a> {
    pub spec: Spec<'a>,
    pub observations: Vec<Vec<Term>>,
    pub outputs: Vec<Term>,
    /// Answers every output with this number in the place of an input.
    pub fixed: Option<u64>,
}

impl<'a> Network<'a> {
    pub(crate) fn new(spec: Spec<'a>) -> Self {
        Network {
            spec,
            observations: Vec::new(),
            outputs: Vec::new(),
            fixed: None,
        }
    }

    /// One number a column, anew for every run: a second run could see another observation.
    pub(crate) fn answer(&mut self) -> Vec<Value> {
        let run = self.observations.len();
        let start = match self.spec.policy.numeric_format.is_integer() {
            true => ("output", I32),
            false => ("q", Kind::Float(self.spec.float.format)),
        };
        let actions = 0..self.spec.policy.outputs();
        let terms = actions.map(|n| match self.fixed {
            Some(value) => self.spec.terms.bits(value, start.1.width()),
            None => self
                .spec
                .terms
                .input(&format!("{}_{run}_{n}", start.0), start.1.width()),
        });
        self.outputs = terms.collect();
        let numbers = self.outputs.iter().map(|term| Number {
            term: *term,
            kind: start.1,
        });
        numbers.map(Value::Number).collect()
    }
}

fn value(term: Term, kind: Kind) -> Value {
    Value::Number(Number { term, kind })
}

/// Names of the coefficients of a mapping; the last in the four-term form alone.
const COEFFICIENTS: [&str; 4] = ["a", "b", "c", "r"];

/// The state as a record; both languages call the parts alike.
pub(crate) fn state_record(spec: Spec<'_>, state: &State) -> Value {
    let float = |term: &Term| value(*term, Kind::Float(spec.float.format));
    let list = |terms: Vec<&Term>| Value::List(terms.into_iter().map(float).collect());
    let mut members = BTreeMap::from([
        ("held".to_owned(), list(state.held.iter().collect())),
        ("bad_count".to_owned(), value(state.bad_count, U32)),
        ("primed".to_owned(), value(state.primed, U32)),
    ]);
    let memory: Vec<&Term> = state.memory().collect();
    if !memory.is_empty() {
        members.insert("memory".to_owned(), list(memory));
    }
    let word = Kind::Integer {
        bits: spec.float.width(),
        signed: false,
    };
    for (path, own) in spec.policy.paths().iter().zip(&state.outputs) {
        let mut add = |stem: &str, value| members.insert(path.named(stem), value);
        add("previous_duty", float(&own.previous_duty));
        add("previous_command", float(&own.previous_command));
        own.soft_cap.iter().for_each(|cap| {
            add("soft_cap", float(cap));
        });
        for (name, coefficient) in COEFFICIENTS.into_iter().zip(&own.coefficients) {
            add(&format!("mapping_{name}"), float(coefficient));
        }
        own.check.iter().for_each(|check| {
            add("mapping_check", value(*check, word));
        });
    }
    Value::Record(members)
}

/// The record back as a state of the form of `like`.
pub(crate) fn state_of(spec: Spec<'_>, value: &Value, like: &State) -> Result<State, Wrong> {
    let Value::Record(members) = value else {
        return Err("a state that is no record".into());
    };
    let member = |name: &str| members.get(name).ok_or_else(|| format!("the state has no `{name}`"));
    let term = |name: &str| Ok::<Term, Wrong>(number(member(name)?)?.term);
    let mut words = match members.get("memory") {
        Some(memory) => terms_of(memory)?.into_iter(),
        None => Vec::new().into_iter(),
    };
    let mut state = like.clone();
    state.held = terms_of(member("held")?)?;
    for word in state.memory_mut() {
        *word = words.next().ok_or("too few words of memory")?;
    }
    for (path, own) in spec.policy.paths().iter().zip(&mut state.outputs) {
        let term = |stem: &str| term(&path.named(stem));
        own.previous_duty = term("previous_duty")?;
        own.previous_command = term("previous_command")?;
        own.soft_cap = own.soft_cap.map(|_| term("soft_cap")).transpose()?;
        for (name, coefficient) in COEFFICIENTS.into_iter().zip(&mut own.coefficients) {
            *coefficient = term(&format!("mapping_{name}"))?;
        }
        own.check = own.check.map(|_| term("mapping_check")).transpose()?;
    }
    state.bad_count = term("bad_count")?;
    state.primed = term("primed")?;
    Ok(state)
}

/// The numbers of a list.
pub(crate) fn terms_of(value: &Value) -> Result<Vec<Term>, Wrong> {
    match value {
        Value::List(elements) => elements.iter().map(|element| Ok(number(element)?.term)).collect(),
        _ => Err("an array is needed here".into()),
    }
}

pub(crate) fn measurement_record(spec: Spec<'_>, measurement: &[Term]) -> Value {
    let signals = spec.policy.signals.iter().zip(measurement);
    let members = signals.map(|(signal, term)| {
        let kind = match signal.adc {
            Some(_) => I32,
            None => Kind::Float(spec.float.format),
        };
        (signal.name.clone(), value(*term, kind))
    });
    Value::Record(members.collect())
}

/// Whether a command holds arrays: with several outputs it does.
fn has_arrays(spec: Spec<'_>) -> bool {
    matches!(spec.policy.head, Head::Several(_))
}

pub(crate) fn command_record(spec: Spec<'_>, command: &Command) -> Value {
    let float = Kind::Float(spec.float.format);
    let of = |terms: &[Term], kind| match (has_arrays(spec), terms) {
        (false, [one]) => value(*one, kind),
        _ => Value::List(terms.iter().map(|term| value(*term, kind)).collect()),
    };
    Value::Record(BTreeMap::from([
        ("duty".to_owned(), of(&command.duty, float)),
        ("duty_sim".to_owned(), of(&command.duty_sim, float)),
        ("action_index".to_owned(), of(&command.action_index, U32)),
        ("status".to_owned(), value(command.status, U32)),
    ]))
}

pub(crate) fn command_of(spec: Spec<'_>, value: &Value) -> Result<Command, Wrong> {
    let Value::Record(members) = value else {
        return Err("a command that is no record".into());
    };
    let member = |name: &str| members.get(name).ok_or_else(|| format!("the command has no `{name}`"));
    let count = spec.policy.paths().len();
    let each = |name: &str| {
        let terms = match has_arrays(spec) {
            true => terms_of(member(name)?)?,
            false => vec![number(member(name)?)?.term],
        };
        match terms.len() == count {
            true => Ok::<Vec<Term>, Wrong>(terms),
            false => Err(format!(
                "`{name}` of the command has {} places for {count} outputs",
                terms.len()
            )),
        }
    };
    Ok(Command {
        duty: each("duty")?,
        duty_sim: each("duty_sim")?,
        action_index: each("action_index")?,
        status: number(member("status")?)?.term,
    })
}

/// Names of a record's members, sorted.
pub(crate) fn members_of(value: &Value) -> Vec<String> {
    match value {
        Value::Record(members) => members.keys().cloned().collect(),
        _ => Vec::new(),
    }
}

/// The address of the first element behind `place`.
pub(crate) fn list_behind(place: &Value) -> Result<Place, Wrong> {
    match place {
        Value::Place(place) => {
            let mut list = place.clone();
            match list.steps.pop() {
                Some(crate::machine::Step::Element(0)) => Ok(list),
                _ => Err("an array that does not begin where it should".into()),
            }
        }
        _ => Err("an array is needed here".into()),
    }
}
