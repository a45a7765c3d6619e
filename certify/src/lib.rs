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
mod part;
mod past;
mod propagate;
mod slice;
#[cfg(feature = "page")]
mod summary;

use policy::{Interval, Policy};
use serde::Serialize;

pub use certificate::{Certificate, Effort, Golden, Neighbourhood, Statement};
pub use cover::{Map, Share, Slice, StateBound};
pub use domain::{AffineCopy, Cell, Coordinate, Domain, Memory};
pub use measured::{Measured, QValues};
pub use neurons::Neurons;

use network::Network;
use part::Part;
use propagate::Enclosure;

/// Bounds of a policy's numeric format.
#[derive(Debug, Clone, PartialEq)]
pub struct Certifier {
    network: Network,
    observations: Domain,
    /// What is decided from which columns: a bound is of Q values where it makes a choice, and else of the duty.
    parts: Vec<Part>,
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
            parts: Part::all(policy),
        }
    }

    /// Bound over every observation of the clamped box, the features independent of each other; of a contract with several
    /// outputs those of all, one after the other.
    #[must_use]
    pub fn box_bound(&self) -> Bound {
        Bound::of(
            self.box_bounds()
                .into_iter()
                .flat_map(|bound| bound.per_action)
                .collect(),
        )
    }

    /// [`Certifier::box_bound`] of each output.
    #[must_use]
    pub fn box_bounds(&self) -> Vec<Bound> {
        self.bounds_over(&self.observations, &self.observations.whole())
    }

    /// Bounds over a cell of a domain, one for each output, all from one pass over the network.
    #[must_use]
    pub fn bounds_over(&self, domain: &Domain, cell: &[Interval]) -> Vec<Bound> {
        let enclosure = self.enclose(domain, cell);
        self.parts.iter().map(|part| part.bound(&enclosure)).collect()
    }

    /// Enclosures of the real Q values over a cell of a domain.
    #[must_use]
    pub fn q_values_over(&self, domain: &Domain, cell: &[Interval]) -> Vec<Interval> {
        let enclosure = self.enclose(domain, cell);
        (0..enclosure.real.len())
            .map(|action| enclosure.q_value(action))
            .collect()
    }

    /// The greedy action of each output over a cell, if it is proven to be the same everywhere in it, in real arithmetic and in the
    /// format; `None` of an output that makes no choice.
    #[must_use]
    pub fn decided(&self, domain: &Domain, cell: &[Interval]) -> Vec<Option<usize>> {
        let enclosure = self.enclose(domain, cell);
        self.parts.iter().map(|part| part.decided(&enclosure)).collect()
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
