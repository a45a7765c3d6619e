//! An FMU as a converter: periods to communication steps, loads to inputs, outputs to samples.
//!
//! ```text
//!  duty ─► Surroundings (modulator) ─┐                     ┌─► outputs ─► Surroundings (sensors) ─► Sample
//!  load ─► Surroundings (load box) ──┼─► inputs ─► steps ──┤
//!  v_in ─────────────────────────────┘      ▲              └─► v_out of the latest step: what a held load draws
//! ```
//!
//! Invariant: an instance is a function of [`State`]. A copy, a checkpoint, and an instance that others have used repeat the orders.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use closed_loop::outside::Outside;
use closed_loop::{Error, LoadPath, Start};
use plant::{Parameters, Sample, Signals, Surroundings};
use toml_input::Message;

use crate::instance::Instance;
use crate::model::Model;
use crate::run::Run;
use crate::state::{Order, State};
use crate::wiring::untold;

/// Numbers the converters of this process, so that an instance knows whose it is.
static NEXT: AtomicU64 = AtomicU64::new(1);

/// A converter that an FMU computes.
#[derive(Debug)]
pub struct FmuConverter {
    model: Arc<Model>,
    own: u64,
    instance: Option<Instance>,
    state: Option<State>,
    failure: Option<Error>,
}

impl FmuConverter {
    pub(crate) fn new(model: Arc<Model>) -> Self {
        Self {
            model,
            own: NEXT.fetch_add(1, Ordering::Relaxed),
            instance: None,
            state: None,
            failure: None,
        }
    }

    fn fault(&self, message: Message) -> Error {
        let file = std::path::Path::new(&self.model.shown);
        toml_input::Fault::in_file(file, message).into()
    }

    /// Does something with the instance in the state of this converter.
    fn with<T>(&mut self, act: impl FnOnce(&mut Run<'_>) -> Result<T, Message>) -> Result<T, Message> {
        let not_started = || Message::new("the converter has not been started");
        let state = self.state.as_mut().ok_or_else(not_started)?;
        let model = &self.model;
        let Some(only) = &model.only else {
            let instance = match &mut self.instance {
                Some(instance) => instance,
                empty => empty.insert(repeated(model, None, state)?),
            };
            return act(&mut Run { model, instance, state });
        };
        let mut only = only
            .lock()
            .map_err(|_| Message::new("another thread has broken off with the FMU's instance"))?;
        let instance = match only.take() {
            Some((instance, owner)) if owner == self.own => instance,
            other => repeated(model, other.map(|(instance, _)| instance), state)?,
        };
        let (instance, _) = only.insert((instance, self.own));
        act(&mut Run { model, instance, state })
    }

    /// Whether the FMU is told of every number that is another than the file's.
    fn told(&self, parameters: &Parameters) -> Result<(), Message> {
        let wiring = &self.model.wiring;
        for parameter in plant::parameters() {
            if parameter.get(parameters) == parameter.get(&self.model.nominal) || Surroundings::has(parameter.key) {
                continue;
            }
            let is_source = parameter.key == "converter.v_in" && wiring.source.is_some();
            if !is_source && !wiring.parameters.iter().any(|(told, _)| told.key == parameter.key) {
                return Err(untold(parameter.key));
            }
        }
        Ok(())
    }

    fn begin(&mut self, parameters: &Parameters, start: &Start<'_>) -> Result<Sample, Error> {
        self.told(parameters).map_err(|message| self.fault(message))?;
        self.state = Some(State {
            parameters: parameters.clone(),
            initial: [start.v_out, start.i_l],
            surroundings: Surroundings::new(parameters)?,
            v_in: parameters.converter.v_in,
            periods: 0,
            signals: Signals {
                v_out: start.v_out,
                i_l: start.i_l,
                ..Signals::default()
            },
            held: [None; 6],
            orders: Vec::new(),
        });
        self.afresh()
            .and_then(|()| self.with(|run| run.first(&start.load)))
            .map_err(|message| self.fault(message))
    }

    /// The instance at its start: reset, or a new one in the place of one that cannot be.
    fn afresh(&mut self) -> Result<(), Message> {
        let Some(state) = &self.state else { return Ok(()) };
        if self.model.only.is_some() {
            // another number, and `with` takes the instance over
            self.own = NEXT.fetch_add(1, Ordering::Relaxed);
            return Ok(());
        }
        self.instance = Some(repeated(&self.model, self.instance.take(), state)?);
        Ok(())
    }
}

/// An instance in this state; `used` is one that may be reset.
fn repeated(model: &Arc<Model>, used: Option<Instance>, state: &State) -> Result<Instance, Message> {
    let reset = used.and_then(|mut instance| instance.reset().then_some(instance));
    let mut instance = match reset {
        Some(instance) => instance,
        None => Instance::new(&model.binary)?,
    };
    let wiring = &model.wiring;
    for (port, value) in &wiring.start {
        instance.set(port, *value, 0.0)?;
    }
    for (parameter, port) in &wiring.parameters {
        instance.set(port, parameter.get(&state.parameters), 0.0)?;
    }
    for (port, value) in wiring.initial.iter().zip(state.initial) {
        if let Some(port) = port {
            instance.set(port, value, 0.0)?;
        }
    }
    instance.initialise()?;
    for order in &state.orders {
        match *order {
            Order::Set(input, value) => {
                let time = state.periods as f64 / state.parameters.converter.f_sw;
                model
                    .input(input)
                    .map_or(Ok(()), |port| instance.set(port, value, time))?;
            }
            Order::Start => instance.start()?,
            Order::Step(time, step) => instance.step(time, step)?,
        }
    }
    Ok(instance)
}

impl Clone for FmuConverter {
    fn clone(&self) -> Self {
        Self {
            // an instance cannot be copied by every FMU: the copy repeats the orders in its own when it is first used
            state: self.state.clone(),
            failure: self.failure.clone(),
            ..Self::new(Arc::clone(&self.model))
        }
    }
}

impl Outside for FmuConverter {
    fn copy(&self) -> Box<dyn Outside> {
        Box::new(self.clone())
    }

    fn name(&self) -> String {
        self.model.shown.clone()
    }

    fn identity(&self) -> Vec<u8> {
        self.model.identity.clone()
    }

    fn is_only_one(&self) -> bool {
        self.model.only.is_some()
    }

    fn notes(&self) -> Vec<String> {
        self.model.notes()
    }

    fn restart(&mut self, parameters: &Parameters, start: &Start<'_>) -> Result<Sample, Error> {
        self.failure = None;
        self.begin(parameters, start)
    }

    fn step(&mut self, duty: f64, load: &LoadPath) -> Sample {
        let lost = Sample {
            v_out: f64::NAN,
            ..Sample::default()
        };
        if self.failure.is_some() {
            return lost;
        }
        match self.with(|run| run.period(duty, load)) {
            Ok(sample) => sample,
            Err(message) => {
                self.failure = Some(self.fault(message));
                lost
            }
        }
    }

    fn failure(&self) -> Option<Error> {
        self.failure.clone()
    }

    fn set_source(&mut self, v_in: f64) -> Result<(), Error> {
        if self.model.wiring.source.is_none() {
            let message = Message::new("the FMU is not told of its source while it runs");
            return Err(self.fault(message.hint("v_in = \"NAME\" in [fmu.inputs] of the plant's file")));
        }
        self.with(|run| run.source(v_in)).map_err(|message| self.fault(message))
    }

    fn save(&self) -> Result<Vec<u8>, Error> {
        let bytes = serde_json::to_vec(&self.state);
        bytes.map_err(|error| Message::new(format!("cannot write the run of the FMU down: {error}")).into())
    }

    fn load(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let state = serde_json::from_slice(bytes)
            .map_err(|error| Message::new("the run of an FMU in it is of another version").found(error.to_string()))?;
        // the next step repeats the run in an instance that has no other owner
        *self = Self {
            state,
            ..Self::new(Arc::clone(&self.model))
        };
        Ok(())
    }
}
