//! The controller: `eval`, `commit` and what lies between (contract sections 1 and 10).

use std::sync::Arc;

use ndarray::{Array1, ArrayView1};
use policy::Policy;

use crate::feature::{Feature, Inputs};
use crate::head::{Base, Head};
use crate::names::state_names;
use crate::network::Network;
use crate::observer::{Measured, Observer};
use crate::path::{self, Path};
use crate::real::Real;
use crate::sanitise::{InputError, Sample, Signal};
use crate::sound::Sound;
use crate::state::{Coefficients, Remembered, State};
use crate::trace::{Command, Decision, FeatureTrace, LayerTrace, Trace};

/// A policy at work, in the number format `T`.
#[derive(Debug, Clone)]
pub struct Controller<T> {
    // what never changes is shared between clones: a thousand of them side by side would not fit into a cache
    signals: Arc<[Signal<T>]>,
    observers: Arc<[Observer<T>]>,
    features: Arc<[Feature<T>]>,
    network: Arc<Network<T>>,
    /// At least one; of several outputs each.
    pub(crate) paths: Arc<[Path<T>]>,
    /// K: bad steps bridged.
    hold: u32,
    pub(crate) sound: Arc<Sound<T>>,
    state_names: Arc<[String]>,
    state: State<T>,
}

impl<T: Real> Controller<T> {
    /// Rounds the policy's constants to the format and initialises the state (section 1).
    pub fn new(policy: &Policy) -> Self {
        let mut words = 0;
        let observers = policy.observers.iter().map(|observer| {
            let start = words;
            words += observer.words();
            Observer::new(observer, policy.sample_period, start)
        });
        let observers: Vec<Observer<T>> = observers.collect();
        let features: Vec<Feature<T>> = policy
            .features
            .iter()
            .map(|feature| {
                let feature = Feature::new(feature, policy.sample_period, words);
                words += feature.words();
                feature
            })
            .collect();
        let signals: Vec<Signal<T>> = policy.signals.iter().map(Signal::new).collect();
        let paths: Vec<Path<T>> = policy.paths().iter().map(Path::new).collect();
        let state = start(&signals, words, &paths, |_| None);
        Self {
            state_names: state_names(policy, &features, &state).into(),
            signals: signals.into(),
            observers: observers.into(),
            features: features.into(),
            network: Network::new(policy).into(),
            paths: paths.into(),
            hold: policy.fallback.hold,
            sound: Sound::new(policy).into(),
            state,
        }
    }

    /// The state of `new`, except that the mapping coefficients in use are kept.
    pub fn reset(&mut self) {
        let kept = |index| Some(self.state.output(index));
        self.state = start(&self.signals, self.state.memory.len(), &self.paths, kept);
    }

    /// Outputs of the network.
    pub(crate) fn outputs(&self) -> usize {
        self.paths.iter().map(|path| path.head.outputs()).sum()
    }

    /// What the outputs mean where there is one duty; of several those of the first.
    fn head(&self) -> &Head<T> {
        // a policy has at least one output, and `paths` one for each
        &self.paths[0].head
    }

    /// What the controller remembers.
    pub fn state(&self) -> &State<T> {
        &self.state
    }

    /// The state as 32-bit words in the order of section 1; see [`State::words`].
    pub fn state_words(&self) -> Vec<u32> {
        self.state.words()
    }

    /// One name per number or counter of the state, in the order of section 1: `held.v_out`, `e_del.0.delay[0]`, `primed`, ...
    pub fn state_names(&self) -> &[String] {
        &self.state_names
    }

    /// Everything of one step without a change of state. One sample per signal, in the policy's order.
    pub fn eval(&self, samples: &[Sample]) -> Result<Trace<T>, InputError> {
        let mut trace = self.blank_trace();
        self.eval_into(samples, &mut trace)?;
        Ok(trace)
    }

    /// [`Controller::eval`] into a trace made by [`Controller::blank_trace`] of the same policy: allocates nothing.
    pub fn eval_into(&self, samples: &[Sample], trace: &mut Trace<T>) -> Result<(), InputError> {
        self.sense(samples, trace)?;
        self.observe_into(trace);
        self.network.run(trace.observation.view(), &mut trace.layers);
        if let Some(last) = trace.layers.last() {
            trace.q_values.assign(&last.post_activation);
        }
        for (index, path) in self.paths.iter().enumerate() {
            let mut decision = trace.decision(index);
            (decision.action_index, decision.duty_sim) = path.decided(trace);
            trace.set_decision(index, decision);
        }
        self.act(trace);
        Ok(())
    }

    /// Advances the state by one step with the command that was applied (section 10).
    ///
    /// The sanitised signals and filter values are recomputed from state and samples; only `duty` and `duty_sim` are
    /// taken from the command.
    pub fn commit(&mut self, samples: &[Sample], command: &Command<T>) -> Result<(), InputError> {
        self.commit_all(samples, std::slice::from_ref(command))
    }

    /// [`Controller::commit`] with a command for each of several outputs, in their order.
    pub fn commit_all(&mut self, samples: &[Sample], commands: &[Command<T>]) -> Result<(), InputError> {
        let (expected, found) = (self.paths.len(), commands.len());
        if expected != found {
            return Err(InputError::CommandCount { expected, found });
        }
        let mut trace = self.blank_trace();
        self.sense(samples, &mut trace)?;
        self.absorb(&trace, commands.iter().copied());
        Ok(())
    }

    /// `eval`, then `commit` with its command.
    pub fn step(&mut self, samples: &[Sample]) -> Result<Trace<T>, InputError> {
        let mut trace = self.blank_trace();
        self.step_into(samples, &mut trace)?;
        Ok(trace)
    }

    /// [`Controller::step`] into a trace made by [`Controller::blank_trace`] of the same policy: allocates nothing.
    pub fn step_into(&mut self, samples: &[Sample], trace: &mut Trace<T>) -> Result<(), InputError> {
        self.eval_into(samples, trace)?;
        self.absorb(trace, trace.commands());
        Ok(())
    }

    /// The observation that the network would see, one value per feature (sections 2 to 5).
    pub fn observe(&self, samples: &[Sample]) -> Result<Array1<T>, InputError> {
        let mut trace = self.blank_trace();
        self.sense(samples, &mut trace)?;
        self.observe_into(&mut trace);
        Ok(trace.observation)
    }

    /// Sections 2 to 5 into a trace made by [`Controller::blank_trace`]: everything that the network would see, without
    /// running it. For a trainer, whose network is its own; allocates nothing.
    pub fn sense_into(&self, samples: &[Sample], trace: &mut Trace<T>) -> Result<(), InputError> {
        self.sense(samples, trace)?;
        self.observe_into(trace);
        Ok(())
    }

    /// Sections 8 and 9 for an action chosen elsewhere, behind [`Controller::sense_into`]: fills in the command. An index
    /// beyond the last action counts as the last. A head without a choice has no actions to choose from: the initial duty is
    /// commanded.
    pub fn choose(&self, trace: &mut Trace<T>, action_index: u32) {
        self.choose_of(trace, 0, action_index);
    }

    /// [`Controller::choose`] for the output of that index; what was decided for the others stays.
    pub fn choose_of(&self, trace: &mut Trace<T>, output: usize, action_index: u32) {
        let Some(path) = self.paths.get(output) else { return };
        let mut decision = trace.decision(output);
        (decision.action_index, decision.duty_sim) = match path.head.choose(action_index) {
            Some((index, chosen)) => (index, path.head.duty(trace.base, chosen)),
            None => (0, path.initial_duty),
        };
        trace.set_decision(output, decision);
        self.act(trace);
    }

    /// Sections 8 and 9 for a duty before the mapping that was found elsewhere, behind [`Controller::sense_into`]: what a
    /// continuous head is trained with.
    pub fn give(&self, trace: &mut Trace<T>, duty_sim: T) {
        (trace.action_index, trace.duty_sim) = (0, duty_sim);
        self.act(trace);
    }

    /// [`Controller::commit`] of a trace of this very step, with its command; allocates nothing.
    pub fn commit_trace(&mut self, trace: &Trace<T>) {
        self.absorb(trace, trace.commands());
    }

    /// Puts back a state that [`Controller::state`] gave; `false` and no change if it is of another shape.
    pub fn restore(&mut self, state: &State<T>) -> bool {
        let fits = state.held.len() == self.state.held.len()
            && state.memory.len() == self.state.memory.len()
            && state.others.len() == self.state.others.len()
            && (0..state.outputs()).all(|index| state.output(index).is_like(&self.state.output(index)));
        if fits {
            self.state.clone_from(state);
        }
        fits
    }

    /// Outputs of the network for an observation: Q values, one per action, or the output of a continuous head (section 6). Values need not lie within the observation's bounds.
    pub fn q_values(&self, observation: &ArrayView1<'_, T>) -> Result<Array1<T>, InputError> {
        let mut layers = self.layers(observation)?;
        Ok(layers.pop().map(|last| last.post_activation).unwrap_or_default())
    }

    /// Every layer of the network for an observation, first to last (section 6). Values need not lie within the observation's bounds.
    ///
    /// # Errors
    /// If the observation is of another length.
    pub fn layers(&self, observation: &ArrayView1<'_, T>) -> Result<Vec<LayerTrace<T>>, InputError> {
        let expected = self.features.len();
        if observation.len() != expected {
            return Err(InputError::ObservationLength {
                expected,
                found: observation.len(),
            });
        }
        let mut layers = self.network.blank();
        self.network.run(observation.view(), &mut layers);
        Ok(layers)
    }

    /// Action index and duty before the mapping of a network's outputs (sections 7 and 7b), as many as there are; of a residual
    /// head the offset, since its law needs a measurement. `None` of several outputs, and of a gain schedule too, whose duty needs one: [`Self::gains`].
    pub fn decide(&self, outputs: &ArrayView1<'_, T>) -> Option<(u32, T)> {
        let is_one = self.paths.len() == 1 && outputs.len() == self.head().outputs();
        let decides = is_one && !matches!(self.head(), Head::Schedule(_));
        decides.then(|| self.head().decide(*outputs))
    }

    /// [`Controller::decide`] of each of several outputs from its columns, in their order; `None` where there is one.
    pub fn decide_each(&self, outputs: &ArrayView1<'_, T>) -> Option<Vec<(u32, T)>> {
        let are_several = self.paths.len() > 1 && outputs.len() == self.outputs();
        are_several.then(|| self.paths.iter().map(|path| path.decide(outputs)).collect())
    }

    /// The gains that a gain schedule makes of a network's outputs (section 7c), as many as there are; `None` of any other head.
    pub fn gains(&self, outputs: &ArrayView1<'_, T>) -> Option<Vec<T>> {
        match self.head() {
            Head::Schedule(head) if head.gains().len() == outputs.len() => {
                let both = head.gains().iter().zip(outputs);
                Some(both.map(|(gain, output)| gain.of(*output)).collect())
            }
            _ => None,
        }
    }

    /// Replaces the mapping coefficients if the contract allows them (section 8); `false` and no change otherwise,
    /// also without a mapping or with `r` against the mapping's form.
    pub fn set_mapping(&mut self, a: T, b: T, c: T, r: Option<T>) -> bool {
        self.set_mapping_of(0, Coefficients { a, b, c, r })
    }

    /// [`Controller::set_mapping`] of the output of that index.
    pub fn set_mapping_of(&mut self, output: usize, new: Coefficients<T>) -> bool {
        let mapping = self.paths.get(output).and_then(|path| path.mapping.as_ref());
        let accepted = mapping.is_some_and(|mapping| mapping.accepts(new));
        if accepted {
            let own = self.state.output(output);
            let (mapping, mapping_check) = (Some(new), Some(new.check_word()));
            let own = Remembered {
                mapping,
                mapping_check,
                ..own
            };
            self.state.set_output(output, own);
        }
        accepted
    }

    /// A trace of the right shape with all values 0.
    pub fn blank_trace(&self) -> Trace<T> {
        let signals = self.signals.len();
        Trace {
            measured: vec![T::ZERO; signals],
            valid: vec![false; signals],
            signals: vec![T::ZERO; signals],
            all_valid: false,
            bad_count: 0,
            expired: false,
            usable: false,
            sound: false,
            primed: false,
            estimates: vec![[T::ZERO; 4]; self.observers.len()],
            features: self
                .features
                .iter()
                .map(|feature| FeatureTrace {
                    filtered: vec![T::ZERO; feature.filters.len()],
                    ..FeatureTrace::default()
                })
                .collect(),
            observation: Array1::from_elem(self.features.len(), T::ZERO),
            layers: self.network.blank(),
            base: Base::default(),
            factors: vec![T::ZERO; self.head().factor_count()],
            q_values: Array1::from_elem(self.outputs(), T::ZERO),
            action_index: 0,
            duty_sim: T::ZERO,
            mapped: T::ZERO,
            slewed: T::ZERO,
            soft_started: T::ZERO,
            limited: T::ZERO,
            computed_status: 0,
            command: Command::default(),
            others: vec![Decision::default(); self.paths.len() - 1],
        }
    }

    /// Sections 2 to 4: sanitised signals, usability, filter values.
    fn sense(&self, samples: &[Sample], trace: &mut Trace<T>) -> Result<(), InputError> {
        let expected = self.signals.len();
        if samples.len() != expected {
            return Err(InputError::SampleCount {
                expected,
                found: samples.len(),
            });
        }
        let state = &self.state;
        trace.all_valid = true;
        for (index, (signal, &sample)) in self.signals.iter().zip(samples).enumerate() {
            let x = signal.physical(index, sample)?;
            let valid = signal.plausible(x);
            trace.measured[index] = x;
            trace.valid[index] = valid;
            trace.signals[index] = if valid { x } else { state.held[index] };
            trace.all_valid &= valid;
        }
        trace.bad_count = if trace.all_valid {
            0
        } else if state.bad_count <= self.hold {
            state.bad_count + 1
        } else {
            state.bad_count
        };
        trace.expired = trace.bad_count > self.hold;
        trace.primed = state.primed & 1 == 1; // 2 is the mark of a damaged state
        trace.sound = self.sound.holds(state);
        trace.usable = trace.sound && (trace.all_valid || (trace.primed && !trace.expired));

        for (observer, estimates) in self.observers.iter().zip(&mut trace.estimates) {
            let measured = Measured {
                signals: &trace.signals,
                valid: &trace.valid,
                primed: trace.primed,
                previous_command: state.output(observer.output).previous_command,
            };
            *estimates = observer.estimates(measured, &state.memory);
        }
        let inputs = Inputs {
            signals: &trace.signals,
            estimates: &trace.estimates,
            previous_duty: state.previous_duty,
            previous_command: state.previous_command,
            others: &state.others,
        };
        trace.base = self.head().base(inputs);
        for (feature, feature_trace) in self.features.iter().zip(&mut trace.features) {
            feature.filter(inputs, &state.memory, trace.primed, feature_trace);
        }
        self.head().factors(inputs, &trace.features, &mut trace.factors);
        Ok(())
    }

    /// Section 5.
    fn observe_into(&self, trace: &mut Trace<T>) {
        for ((feature, feature_trace), o) in self
            .features
            .iter()
            .zip(&mut trace.features)
            .zip(&mut trace.observation)
        {
            feature.observe(feature_trace);
            *o = feature_trace.observation;
        }
    }

    /// Sections 8, 9 and 9b, from the chosen duties to the commands.
    fn act(&self, trace: &mut Trace<T>) {
        path::act(&self.paths, |index| self.state.output(index), trace);
    }

    /// Section 10.
    fn absorb(&mut self, trace: &Trace<T>, commands: impl Iterator<Item = Command<T>>) {
        let state = &mut self.state;
        state.held.copy_from_slice(&trace.signals);
        for (observer, estimates) in self.observers.iter().zip(&trace.estimates) {
            observer.push(&mut state.memory, &trace.signals, *estimates);
        }
        for (feature, feature_trace) in self.features.iter().zip(&trace.features) {
            feature.push(&mut state.memory, trace.primed, feature_trace);
        }
        if !trace.sound {
            state.memory.fill(T::ZERO);
        }
        for ((index, path), command) in self.paths.iter().enumerate().zip(commands) {
            state.set_output(index, path.next(state.output(index), &command, trace.usable));
        }
        state.bad_count = if trace.sound { trace.bad_count } else { 0 }; // it may be the damaged word
        state.primed = if trace.sound { u32::from(trace.usable) } else { 2 }; // 2: seen until init or reset
    }
}

/// The state of section 1 before the first step; `kept` are the coefficients of each output that a reset keeps.
fn start<T: Real>(
    signals: &[Signal<T>],
    words: usize,
    paths: &[Path<T>],
    kept: impl Fn(usize) -> Option<Remembered<T>>,
) -> State<T> {
    let mut outputs = paths.iter().enumerate().map(|(index, path)| path.start(kept(index)));
    let first = outputs.next();
    let initial = paths.first().map_or(T::ZERO, |path| path.initial_duty);
    State {
        held: signals.iter().map(Signal::nearest_to_zero).collect(),
        memory: vec![T::ZERO; words],
        previous_duty: initial,
        previous_command: initial,
        soft_cap: first.and_then(|first| first.soft_cap),
        mapping: first.and_then(|first| first.mapping),
        mapping_check: first.and_then(|first| first.mapping_check),
        others: outputs.collect(),
        bad_count: 0,
        primed: 0,
    }
}
