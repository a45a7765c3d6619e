//! How a policy is judged: its controller in closed loop on the plant and on its spread.
//!
//! ```text
//!  plant ───────┬─► places ─► load steps at their instants ─► findings ─► score of a place ─► mean, met by all
//!  [[spread]] ──┘
//! ```

use std::sync::Arc;

use plant::{Load, Sample};
use policy::Policy;

use crate::contract::Contract;
use crate::faults::Error;
use crate::learner::greedy;
use crate::network::Network;
use crate::quick::{Quick, Scratch};
use crate::score::{Score, Scoring};
use crate::settings::{Requirement, Settings};
use crate::trainer::Trainer;
use crate::verdict::{Verdict, verdicts};
use closed_loop::Agent;
use closed_loop::environment::{Environment, Start, Varied};
use closed_loop::scenario::{Finding, survey_all};

/// A converter on which policies are judged.
#[derive(Debug, Clone)]
pub struct Place<'a, E> {
    /// What is other than in the plant's file, in words; empty where nothing is.
    pub name: String,
    /// The converter.
    pub converter: Varied<E>,
    /// What a good policy does on it.
    pub specification: &'a [Requirement],
}

/// How a policy did at one place.
#[derive(Debug, Clone)]
pub struct Judged {
    /// As [`Place::name`].
    pub place: String,
    /// Against the specification of the place.
    pub score: Score,
    /// Load step by load step.
    pub findings: Vec<Finding>,
    /// Limit by limit.
    pub verdicts: Vec<Verdict>,
}

/// The plant as its file says, and those of the spread.
fn places<'a, E: Environment>(settings: &'a Settings, nominal: &E) -> Vec<Place<'a, E>> {
    let general = &settings.specification;
    let place = |name, numbers, specification| Place {
        name,
        converter: Varied::new(nominal, numbers),
        specification,
    };
    let others = settings.spread.iter().map(|spread| {
        let numbers = spread.numbers(|key| nominal.parameter(key));
        let own = if spread.limits.is_empty() {
            general
        } else {
            &spread.limits
        };
        place(spread.name(), numbers, own.as_slice())
    });
    std::iter::once(place(String::new(), Vec::new(), general.as_slice()))
        .chain(others)
        .collect()
}

/// The evaluation of a policy, the plant as its file says first; the limits are as they are, without the margin of the
/// selection, which only makes the choice stricter than the verdict.
///
/// # Errors
/// If the policy measures something that the plant does not have, or a converter of the spread cannot be started.
pub(crate) fn evaluate<E: Environment>(
    settings: &Settings,
    nominal: &E,
    policy: &Policy,
) -> Result<Vec<Judged>, Error> {
    with_controller(settings, nominal, &of_policy(policy)?)
}

fn with_controller<E: Environment>(
    settings: &Settings,
    nominal: &E,
    controller: &(impl FnMut(&Sample) -> f64 + Clone),
) -> Result<Vec<Judged>, Error> {
    let task = &settings.evaluation;
    let judged = |place: Place<'_, E>| {
        let v_ref = settings.reward.v_ref;
        let findings = survey_all(&place.converter, controller, v_ref, task, &task.all_instants())?;
        Ok(Judged {
            score: Scoring::new(&task.load_steps, place.specification, 1.0).score(&findings),
            verdicts: verdicts(&place.name, place.specification, &task.load_steps, &findings),
            place: place.name,
            findings,
        })
    };
    places(settings, nominal).into_iter().map(judged).collect()
}

impl<E: Environment> Trainer<E> {
    /// The plant as its file says, and those of the spread.
    pub(crate) fn places(&self) -> Vec<Place<'_, E>> {
        places(&self.settings, &self.nominal)
    }

    /// Starts each converter of the spread once, so that numbers that make none are told before the training.
    pub(crate) fn try_out_spread(&self) -> Result<(), Error> {
        for mut place in self.places().into_iter().skip(1) {
            place.converter.restart(&Start {
                v_out: 0.0,
                i_l: 0.0,
                load: Load::default(),
                seed: 0,
                varied: &[],
            })?;
        }
        Ok(())
    }

    /// [`evaluate`] of a network of this training.
    pub(crate) fn evaluate(&self, network: &Network) -> Result<Vec<Judged>, Error> {
        // the interpreter's bits; with it as controller a third of a short training was its evaluation
        let controller = quick_controller(&self.contract, network)?;
        with_controller(&self.settings, &self.nominal, &controller)
    }
}

/// A network at work in the controller of its contract, for [`closed_loop::scenario`]: the whole interpreter.
///
/// # Errors
/// If the contract measures something that the plant does not have.
pub fn controller(contract: &Contract, network: &Network) -> Result<impl FnMut(&Sample) -> f64 + Clone + use<>, Error> {
    of_policy(&contract.with(network))
}

fn of_policy(policy: &Policy) -> Result<impl FnMut(&Sample) -> f64 + Clone + use<>, Error> {
    let mut agent = Agent::<f32>::new(policy)?;
    // the signals fit the contract since `Agent::new`; a NaN would end the run as a divergence
    Ok(move |sample: &Sample| agent.step(&sample.measured).unwrap_or(f64::NAN))
}

/// The same to the bit, three times as fast: the contract's controller around the trainer's network.
///
/// # Errors
/// As [`controller`].
pub fn quick_controller(
    contract: &Contract,
    network: &Network,
) -> Result<impl FnMut(&Sample) -> f64 + Clone + use<>, Error> {
    let mut agent = Agent::<f32>::new(&contract.policy)?;
    // shared: every run of a look goes on from a copy of its lead's controller
    let network = Arc::new(Quick::new(network));
    let mut scratch = Scratch::default();
    Ok(move |sample: &Sample| {
        if agent.sense(&sample.measured).is_err() {
            return f64::NAN;
        }
        let q_values = network.q_values(agent.observation(), &mut scratch);
        agent.act(greedy(q_values) as u32)
    })
}

/// Of all places together.
pub(crate) fn overall(judged: &[Judged]) -> Score {
    Score {
        met: judged.iter().all(|one| one.score.met),
        cost: judged.iter().map(|one| one.score.cost / judged.len() as f64).sum(),
    }
}
