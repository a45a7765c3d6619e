//! The functions of the emitted C as [`Emitted`].

use policy::DutyPath;

use super::execute::{Outside, Walk};
use super::unit::Unit;
use crate::Reading;
use crate::emitted::{
    Called, Emitted, Network, command_of, command_record, list_behind, measurement_record, members_of, state_of,
    state_record, terms_of,
};
use crate::machine::{Kind, Machine, Number, Place, U32, Value, Wrong, number};
use crate::refusal::Refusal;
use crate::spec::{Command, Spec, State};
use crate::term::Term;

pub(crate) struct C<'a> {
    pub spec: Spec<'a>,
    pub unit: Unit,
    pub reading: Reading,
}

/// Where a call finds its arguments.
struct Places {
    state: Place,
    measured: Place,
    command: Place,
}

impl Outside for (&str, &mut Network<'_>) {
    fn is(&self, name: &str) -> bool {
        let integer = self.1.spec.policy.numeric_format.is_integer();
        let rest = name.strip_prefix(self.0);
        match rest {
            Some("_q_values") => !integer,
            Some("_quantise" | "_network") => integer,
            _ => false,
        }
    }

    fn call(&mut self, name: &str, arguments: &[Value], machine: &mut Machine<'_>) -> Result<(), Wrong> {
        let network = &mut *self.1;
        let first = arguments.first().ok_or("a call of the network without arguments")?;
        if !name.ends_with("_network") {
            let observation = machine.read(&list_behind(first)?)?;
            network.observations.push(terms_of(&observation)?);
        }
        let to = match (name.ends_with("_q_values"), first) {
            (true, _) => list_behind(arguments.get(1).ok_or("no place for the Q values")?)?,
            (false, Value::Place(values)) if name.ends_with("_network") => values.clone().member("q"),
            _ => return Ok(()),
        };
        let Value::List(places) = machine.read(&to)? else {
            return Err("Q values go into an array".into());
        };
        let answers = network.answer();
        match places.len() == answers.len() {
            true => machine.write(&to, Value::List(answers)),
            false => Err(format!("{} places for {} Q values", places.len(), answers.len())),
        }
    }
}

impl<'a> C<'a> {
    fn named(&self, function: &str) -> String {
        format!("{}_{function}", self.spec.policy.name)
    }

    fn refused(&self, message: Wrong) -> Refusal {
        Refusal::at(&self.unit.file, 0, message)
    }

    /// Puts state, measurement and command where `C` keeps them; the members must be those that the record has in the code.
    fn places(
        &self,
        walk: &mut Walk<'a, '_>,
        state: &State,
        measurement: &[Term],
        command: Option<&Command>,
    ) -> Result<Places, Refusal> {
        let state = state_record(self.spec, state);
        let measured = measurement_record(self.spec, measurement);
        let mut place = |kind: &str, value: Option<Value>| {
            let place = walk.blank(&self.named(kind))?;
            let Some(value) = value else { return Ok(place) };
            let blank = walk.machine.read(&place).map_err(|message| self.refused(message))?;
            if members_of(&blank) != members_of(&value) {
                return Err(self.refused(format!(
                    "`{}` has other members than the contract gives it",
                    self.named(kind)
                )));
            }
            walk.machine
                .write(&place, value)
                .map_err(|message| self.refused(message))?;
            Ok(place)
        };
        Ok(Places {
            measured: place("measurement", (!measurement.is_empty()).then_some(measured))?,
            state: place("state", Some(state))?,
            command: place("command", command.map(|command| command_record(self.spec, command)))?,
        })
    }

    fn run(
        &self,
        function: &str,
        state: &State,
        measurement: &[Term],
        command: Option<&Command>,
        arguments: impl FnOnce(&Places) -> Vec<Value>,
        answers: bool,
    ) -> Result<(Called, Option<Value>), Refusal> {
        let mut network = Network::new(self.spec);
        let mut outside = (self.spec.policy.name.as_str(), &mut network);
        let mut walk = Walk::new(&self.unit, self.spec.float, &mut outside);
        let places = self.places(&mut walk, state, measurement, command)?;
        let arguments = arguments(&places);
        let returned = walk.call(&self.named(function), arguments)?;
        let machine = walk.machine;
        let refused = |message| self.refused(message);
        let after = machine.read(&places.state).map_err(refused)?;
        let command = match answers {
            true => {
                let command = machine.read(&places.command).map_err(refused)?;
                Some(command_of(self.spec, &command).map_err(refused)?)
            }
            false => None,
        };
        let called = Called {
            state: state_of(self.spec, &after, state).map_err(refused)?,
            command,
            obligations: machine.obligations,
            observations: network.observations,
            outputs: network.outputs,
        };
        Ok((called, returned))
    }
}

impl C<'_> {
    /// The Q value that `q_values` gives where every output of the network is `output`, which is a known number then.
    fn q_value(&self, output: u64) -> Result<Option<u64>, Refusal> {
        let mut network = Network::new(self.spec);
        network.fixed = Some(output);
        let mut outside = (self.spec.policy.name.as_str(), &mut network);
        let mut walk = Walk::new(&self.unit, self.spec.float, &mut outside);
        let zero = Value::Number(Number {
            term: self.spec.float.constant(0.0),
            kind: Kind::Float(self.spec.float.format),
        });
        let mut list = |value: Value, length: usize| walk.machine.put(Value::List(vec![value; length]));
        let observation = list(zero, self.spec.policy.features.len()).element(0);
        let q = list(Value::Unset(None), self.spec.policy.outputs()).element(0);
        let arguments = [&observation, &q].map(|place| Value::Place(place.clone()));
        walk.call(&self.named("q_values"), arguments.to_vec())?;
        let first = walk.machine.read(&q).and_then(|value| number(&value));
        let first = first.map_err(|message| self.refused(message))?;
        Ok(self.spec.terms.known(first.term))
    }
}

fn all(places: &Places) -> Vec<Value> {
    [&places.state, &places.measured, &places.command]
        .map(|place| Value::Place(place.clone()))
        .to_vec()
}

fn state_alone(places: &Places) -> Vec<Value> {
    vec![Value::Place(places.state.clone())]
}

impl Emitted for C<'_> {
    fn language(&self) -> &'static str {
        match self.reading {
            Reading::Compiler => "C",
            Reading::FramaC => "Eva",
        }
    }

    /// Whether the last layer or its caller makes the last cut depends on the target: `q_values` says it.
    fn to_cut(&self) -> Result<u32, Refusal> {
        /// More bits than any cut takes (section 6b: 32 bits to 25), and exact as a binary32 number.
        const OUTPUT: u64 = 1 << 22;
        let Some(scales) = policy::scales::of(self.spec.policy) else {
            return Ok(0);
        };
        let last = scales
            .layers
            .last()
            .and_then(|layer| Some((layer.shift, *layer.outputs.first()?)));
        let (shift, exponent) = last.ok_or_else(|| self.refused("a network without layers".into()))?;
        let said = self.q_value(OUTPUT)?;
        let is = |output: u64| {
            let value = output as f64 * policy::scales::power_of_two(-exponent);
            said == self.spec.terms.known(self.spec.float.constant(value))
        };
        match (is(OUTPUT), is(OUTPUT >> shift)) {
            (true, _) => Ok(0),
            (false, true) => Ok(shift),
            (false, false) => {
                Err(self.refused("`q_values` gives something else than outputs of the exponent of section 6b".into()))
            }
        }
    }

    fn eval(&self, state: &State, measurement: &[Term]) -> Result<Called, Refusal> {
        Ok(self.run("eval", state, measurement, None, all, true)?.0)
    }

    fn commit(&self, state: &State, measurement: &[Term], command: &Command) -> Result<Called, Refusal> {
        Ok(self.run("commit", state, measurement, Some(command), all, false)?.0)
    }

    fn step(&self, state: &State, measurement: &[Term]) -> Result<Called, Refusal> {
        Ok(self.run("step", state, measurement, None, all, true)?.0)
    }

    fn observe(&self, state: &State, measurement: &[Term]) -> Result<Vec<Term>, Refusal> {
        let mut network = Network::new(self.spec);
        let mut outside = (self.spec.policy.name.as_str(), &mut network);
        let mut walk = Walk::new(&self.unit, self.spec.float, &mut outside);
        let places = self.places(&mut walk, state, measurement, None)?;
        let observation = Value::List(vec![Value::Unset(None); self.spec.policy.features.len()]);
        let to = walk.machine.put(observation);
        let arguments = [&places.state, &places.measured].map(|place| Value::Place(place.clone()));
        let arguments = arguments.into_iter().chain([Value::Place(to.clone().element(0))]);
        walk.call(&self.named("observe"), arguments.collect())?;
        let read = walk.machine.read(&to).and_then(|list| terms_of(&list));
        read.map_err(|message| self.refused(message))
    }

    fn init(&self, state: &State) -> Result<State, Refusal> {
        Ok(self.run("init", state, &[], None, state_alone, false)?.0.state)
    }

    fn reset(&self, state: &State) -> Result<State, Refusal> {
        Ok(self.run("reset", state, &[], None, state_alone, false)?.0.state)
    }

    fn set_mapping(&self, path: &DutyPath<'_>, state: &State, coefficients: &[Term]) -> Result<(State, Term), Refusal> {
        let kind = Kind::Float(self.spec.float.format);
        let arguments = |places: &Places| {
            let numbers = coefficients
                .iter()
                .map(|term| Value::Number(Number { term: *term, kind }));
            state_alone(places).into_iter().chain(numbers).collect()
        };
        let name = path.named("set_mapping");
        let (called, returned) = self.run(&name, state, &[], None, arguments, false)?;
        match returned {
            Some(Value::Number(Number { term, kind: U32 })) => Ok((called.state, term)),
            _ => Err(self.refused(format!("`{name}` gives no uint32_t"))),
        }
    }

    fn helper(&self, name: &str, arguments: &[Number]) -> Option<Result<(Number, Vec<Term>), Refusal>> {
        let name = self.named(name);
        if !self.unit.has_function(&name) {
            return None;
        }
        let mut network = Network::new(self.spec);
        let mut outside = (self.spec.policy.name.as_str(), &mut network);
        let mut walk = Walk::new(&self.unit, self.spec.float, &mut outside);
        let arguments = arguments.iter().map(|argument| Value::Number(*argument)).collect();
        let returned = walk.call(&name, arguments).and_then(|value| {
            let value = value.ok_or_else(|| "no value".into()).and_then(|value| number(&value));
            value.map_err(|message| self.refused(format!("`{name}`: {message}")))
        });
        Some(returned.map(|value| (value, walk.machine.obligations)))
    }
}
