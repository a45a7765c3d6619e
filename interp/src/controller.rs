//! The controller: `eval`, `commit` and what lies between (contract sections 1 and 10).

use std::sync::Arc;

use ndarray::{Array1, ArrayView1};
use policy::Policy;

use crate::feature::{Feature, Inputs};
use crate::head::{Base, Head};
use crate::limits::Limits;
use crate::mapping::Mapping;
use crate::names::state_names;
use crate::network::Network;
use crate::observer::{Measured, Observer};
use crate::real::Real;
use crate::sanitise::{InputError, Sample, Signal};
use crate::sound::Sound;
use crate::state::{Coefficients, State};
use crate::status;
use crate::trace::{Command, FeatureTrace, Trace};

/// A policy at work, in the number format `T`.
#[derive(Debug, Clone)]
pub struct Controller<T> {
    // what never changes is shared between clones: a thousand of them side by side would not fit into a cache
    signals: Arc<[Signal<T>]>,
    observers: Arc<[Observer<T>]>,
    features: Arc<[Feature<T>]>,
    network: Arc<Network<T>>,
    head: Arc<Head<T>>,
    pub(crate) mapping: Option<Mapping<T>>,
    limits: Limits<T>,
    initial_duty: T,
    fallback: T,
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
        let mapping = policy.mapping.as_ref().map(Mapping::new);
        let limits = Limits::new(&policy.limits);
        let initial_duty = T::nearest(policy.limits.initial_duty);
        let state = State {
            held: signals.iter().map(Signal::nearest_to_zero).collect(),
            memory: vec![T::ZERO; words],
            previous_duty: initial_duty,
            previous_command: initial_duty,
            soft_cap: limits.soft_start.map(|soft| soft.from),
            mapping: mapping.as_ref().map(|mapping| mapping.initial),
            mapping_check: mapping.as_ref().map(|mapping| mapping.initial.check_word()),
            bad_count: 0,
            primed: 0,
        };
        Self {
            state_names: state_names(policy, &features, &state).into(),
            signals: signals.into(),
            observers: observers.into(),
            features: features.into(),
            network: Network::new(policy).into(),
            head: Head::new(policy).into(),
            mapping,
            limits,
            initial_duty,
            fallback: T::nearest(policy.fallback.duty),
            hold: policy.fallback.hold,
            sound: Sound::new(policy).into(),
            state,
        }
    }

    /// The state of `new`, except that the mapping coefficients in use are kept.
    pub fn reset(&mut self) {
        self.state = State {
            held: self.signals.iter().map(Signal::nearest_to_zero).collect(),
            memory: vec![T::ZERO; self.state.memory.len()],
            previous_duty: self.initial_duty,
            previous_command: self.initial_duty,
            soft_cap: self.limits.soft_start.map(|soft| soft.from),
            mapping: self.state.mapping,
            // not computed anew: a damaged coefficient would pass for a good one
            mapping_check: self.state.mapping_check,
            bad_count: 0,
            primed: 0,
        };
    }

    /// Outputs of the network.
    pub(crate) fn outputs(&self) -> usize {
        self.head.outputs()
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
        let scheduled = self.head.scheduled(trace.base, &trace.factors, trace.q_values.view());
        (trace.action_index, trace.duty_sim) = match scheduled {
            Some(duty) => (0, duty),
            None => {
                let (index, chosen) = self.head.decide(trace.q_values.view());
                (index, self.head.duty(trace.base, chosen))
            }
        };
        self.act(trace);
        Ok(())
    }

    /// Advances the state by one step with the command that was applied (section 10).
    ///
    /// The sanitised signals and filter values are recomputed from state and samples; only `duty` and `duty_sim` are
    /// taken from the command.
    pub fn commit(&mut self, samples: &[Sample], command: &Command<T>) -> Result<(), InputError> {
        let mut trace = self.blank_trace();
        self.sense(samples, &mut trace)?;
        self.absorb(&trace, command);
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
        self.absorb(trace, &trace.command);
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
        let chosen = self.head.choose(action_index);
        (trace.action_index, trace.duty_sim) = match chosen {
            Some((index, chosen)) => (index, self.head.duty(trace.base, chosen)),
            None => (0, self.initial_duty),
        };
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
        self.absorb(trace, &trace.command);
    }

    /// Puts back a state that [`Controller::state`] gave; `false` and no change if it is of another shape.
    pub fn restore(&mut self, state: &State<T>) -> bool {
        let fits = state.held.len() == self.state.held.len()
            && state.memory.len() == self.state.memory.len()
            && state.soft_cap.is_some() == self.state.soft_cap.is_some()
            && state.mapping.map(|m| m.r.is_some()) == self.state.mapping.map(|m| m.r.is_some())
            && state.mapping_check.is_some() == self.state.mapping_check.is_some();
        if fits {
            self.state.clone_from(state);
        }
        fits
    }

    /// Outputs of the network for an observation: Q values, one per action, or the output of a continuous head (section 6). Values need not lie within the observation's bounds.
    pub fn q_values(&self, observation: &ArrayView1<'_, T>) -> Result<Array1<T>, InputError> {
        let expected = self.features.len();
        if observation.len() != expected {
            return Err(InputError::ObservationLength {
                expected,
                found: observation.len(),
            });
        }
        let mut layers = self.network.blank();
        self.network.run(observation.view(), &mut layers);
        Ok(layers.pop().map(|last| last.post_activation).unwrap_or_default())
    }

    /// Action index and duty before the mapping of a network's outputs (sections 7 and 7b), as many as there are; of a residual
    /// head the offset, since its law needs a measurement. `None` of a gain schedule too, whose duty needs one: [`Self::gains`].
    pub fn decide(&self, outputs: &ArrayView1<'_, T>) -> Option<(u32, T)> {
        let decides = outputs.len() == self.head.outputs() && !matches!(*self.head, Head::Schedule(_));
        decides.then(|| self.head.decide(*outputs))
    }

    /// The gains that a gain schedule makes of a network's outputs (section 7c), as many as there are; `None` of any other head.
    pub fn gains(&self, outputs: &ArrayView1<'_, T>) -> Option<Vec<T>> {
        match &*self.head {
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
        let new = Coefficients { a, b, c, r };
        let accepted = self.mapping.as_ref().is_some_and(|mapping| mapping.accepts(new));
        if accepted {
            self.state.mapping = Some(new);
            self.state.mapping_check = Some(new.check_word());
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
            factors: vec![T::ZERO; self.head.factor_count()],
            q_values: Array1::from_elem(self.head.outputs(), T::ZERO),
            action_index: 0,
            duty_sim: T::ZERO,
            mapped: T::ZERO,
            slewed: T::ZERO,
            soft_started: T::ZERO,
            limited: T::ZERO,
            computed_status: 0,
            command: Command::default(),
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

        let measured = Measured {
            signals: &trace.signals,
            valid: &trace.valid,
            primed: trace.primed,
            previous_command: state.previous_command,
        };
        for (observer, estimates) in self.observers.iter().zip(&mut trace.estimates) {
            *estimates = observer.estimates(measured, &state.memory);
        }
        let inputs = Inputs {
            signals: &trace.signals,
            estimates: &trace.estimates,
            previous_duty: state.previous_duty,
            previous_command: state.previous_command,
        };
        trace.base = self.head.base(inputs);
        for (feature, feature_trace) in self.features.iter().zip(&mut trace.features) {
            feature.filter(inputs, &state.memory, trace.primed, feature_trace);
        }
        self.head.factors(inputs, &trace.features, &mut trace.factors);
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

    /// Sections 8 and 9, from the chosen duty to the command.
    fn act(&self, trace: &mut Trace<T>) {
        let state = &self.state;
        let d = trace.duty_sim;
        let mut bits = if trace.features.iter().any(|feature| feature.clipped) {
            status::CLIPPED
        } else {
            0
        };
        let mut t = d;
        if let (Some(mapping), Some(coefficients)) = (&self.mapping, state.mapping) {
            let i = trace.signals[mapping.load_current];
            t = Mapping::apply(coefficients, d, i);
            bits |= if mapping.outside(d, i) {
                status::MAPPING_RANGE
            } else {
                0
            };
        }
        let limited = self.limits.apply(t, state.previous_command, state.soft_cap);
        bits |= limited.status;

        trace.mapped = t;
        trace.slewed = limited.slewed;
        trace.soft_started = limited.soft_started;
        trace.limited = limited.limited;
        trace.computed_status = bits;
        let action_index = trace.action_index;
        // what cannot come out of a sound state is no reason to command it
        let is_number = self.limits.contains(limited.limited);
        trace.command = if trace.usable && is_number {
            let held = if trace.all_valid { 0 } else { status::HELD };
            let primes = if trace.primed { 0 } else { status::PRIMED };
            Command {
                duty: limited.limited,
                duty_sim: d,
                action_index,
                status: bits | held | primes,
            }
        } else {
            Command {
                duty: self.fallback,
                duty_sim: self.fallback,
                action_index: if trace.sound && is_number { action_index } else { 0 },
                status: status::FALLBACK | if trace.sound && is_number { 0 } else { status::STATE },
            }
        };
    }

    /// Section 10.
    fn absorb(&mut self, trace: &Trace<T>, command: &Command<T>) {
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
        state.previous_duty = command.duty_sim;
        state.previous_command = command.duty;
        if let (Some(soft), Some(cap)) = (self.limits.soft_start, state.soft_cap) {
            state.soft_cap = Some(self.limits.next_cap(soft, cap, trace.usable));
        }
        state.bad_count = if trace.sound { trace.bad_count } else { 0 }; // it may be the damaged word
        state.primed = if trace.sound { u32::from(trace.usable) } else { 2 }; // 2: seen until init or reset
    }
}
