//! What a numeric format does to a policy, with proof: sound bounds of |Q in the format - real Q|, and sets of states in
//! which the greedy action cannot change.
//!
//! *Real* is the network of the policy file in exact arithmetic. The bounds are affine forms (zonotopes) with outward
//! rounding, carried beside each other for the real values and for the error of the format: [`form`](self), `network`,
//! `propagate` in the source. How to read the result: `docs/reference/certificate.md`.
//!
//! ```no_run
//! # let policy: policy::Policy = std::process::exit(0);
//! let certifier = certify::Certifier::new(&policy);
//! println!("|Q - real Q| <= {}", certifier.box_bound().largest);
//! ```

mod actor;
mod certificate;
mod cover;
mod domain;
mod form;
mod law;
mod measured;
mod network;
mod neurons;
#[cfg(feature = "page")]
pub mod page;
mod past;
mod propagate;
mod slice;

use policy::{Head, Interval, Policy};
use serde::Serialize;

pub use certificate::{Certificate, Effort, Golden, Neighbourhood};
pub use cover::{Map, Share, Slice, StateBound};
pub use domain::{AffineCopy, Cell, Coordinate, Domain, Memory};
pub use measured::{Measured, QValues};
pub use neurons::Neurons;

use network::Network;
use propagate::Enclosure;

/// Bounds of a policy's numeric format.
#[derive(Debug, Clone, PartialEq)]
pub struct Certifier {
    network: Network,
    observations: Domain,
    /// Where it makes no choice bounds are of the duty.
    head: Head,
}

/// Proven bound of |Q in the format - real Q|, or of a head without a choice of |duty in the format - real duty|.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bound {
    /// Of the largest.
    pub largest: f64,
    /// Per action; one of a head without a choice.
    pub per_action: Vec<f64>,
}

impl Bound {
    fn of(per_action: Vec<f64>) -> Self {
        Self {
            largest: per_action.iter().copied().fold(0.0, f64::max),
            per_action,
        }
    }
}

impl Certifier {
    /// For the numeric format that the policy has.
    #[must_use]
    pub fn new(policy: &Policy) -> Self {
        Self {
            network: Network::new(policy),
            observations: Domain::observations(policy),
            head: policy.head.clone(),
        }
    }

    /// Bound over every observation of the clamped box, the features independent of each other.
    #[must_use]
    pub fn box_bound(&self) -> Bound {
        let whole = self.observations.whole();
        self.bound_over(&self.observations, &whole)
    }

    /// Bound over a cell of a domain.
    #[must_use]
    pub fn bound_over(&self, domain: &Domain, cell: &[Interval]) -> Bound {
        let enclosure = self.enclose(domain, cell);
        let outputs = 0..enclosure.real.len();
        Bound::of(match &self.head {
            Head::Choice(_) | Head::Residual(_) => outputs.map(|action| enclosure.error_bound(action)).collect(),
            Head::Continuous(head) => vec![actor::duty_bound(head, enclosure.q_value(0), enclosure.error_bound(0))],
            Head::Schedule(head) => {
                let outputs: Vec<_> = outputs
                    .map(|output| (enclosure.q_value(output), enclosure.error_bound(output)))
                    .collect();
                vec![law::duty_bound(head, &outputs)]
            }
            // what each output has: of a choice its Q values, of an actor its duty
            Head::Several(all) => all
                .iter()
                .flat_map(|output| match &output.head {
                    Head::Continuous(head) => {
                        let at = output.column;
                        vec![actor::duty_bound(
                            head,
                            enclosure.q_value(at),
                            enclosure.error_bound(at),
                        )]
                    }
                    own => {
                        let columns = output.column..output.column + own.outputs();
                        columns.map(|column| enclosure.error_bound(column)).collect()
                    }
                })
                .collect(),
        })
    }

    /// Enclosures of the real Q values over a cell of a domain.
    #[must_use]
    pub fn q_values_over(&self, domain: &Domain, cell: &[Interval]) -> Vec<Interval> {
        let enclosure = self.enclose(domain, cell);
        (0..enclosure.real.len())
            .map(|action| enclosure.q_value(action))
            .collect()
    }

    /// The greedy action of a cell, if it is proven to be the same everywhere in it, in real arithmetic and in the format.
    #[must_use]
    pub fn decided(&self, domain: &Domain, cell: &[Interval]) -> Option<usize> {
        let enclosure = self.enclose(domain, cell);
        let action = enclosure.candidate();
        enclosure.decides(action).then_some(action)
    }

    /// The domain of all observations of the clamped box.
    #[must_use]
    pub fn observations(&self) -> &Domain {
        &self.observations
    }

    fn enclose(&self, domain: &Domain, cell: &[Interval]) -> Enclosure {
        propagate::run(&self.network, domain.form(cell))
    }
}
