//! What is proved of the generated code, for every input and not for samples.
//!
//! ```text
//! Policy ─► codegen ─► C ──────────┐
//!    │                             ├─► Frama-C Eva ─► claims ─┐
//!    └────► driver from the contract                          ├─► Report ─► proof.json, page
//!    ├────► specification, C and Rust as terms ─► SMT solver ─┤
//!    └────► conversion of integers, every binary32 number ────┘
//! ```
//!
//! A [`Prover`] answers with [`Claim`]s: a sentence, how it came out, and with what. [`run`] asks one after the other. What a claim
//! rests on is in `docs/reference/prove.md`.

mod answer;
mod claim;
pub mod eva;
mod exhaustive;
pub mod page;
mod program;
pub mod smt;

pub use answer::Answer;
pub use claim::{Claim, Verdict};
pub use eva::Eva;
pub use exhaustive::Exhaustive;
pub use program::{Stop, Stopped};
pub use smt::Smt;

use policy::Policy;
use targets::TargetSpec;

/// What is proved about.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    /// The policy in the numeric format that is generated.
    pub policy: &'a Policy,
    /// What it is generated for.
    pub target: &'static TargetSpec,
}

/// What comes next, and how far the prover at hand is with the policy at hand.
#[derive(Debug, Clone, Copy)]
pub struct Next<'a> {
    /// For people.
    pub what: &'a str,
    /// Pieces that are done, or begun where they run side by side.
    pub done: usize,
    /// Pieces that there are; 0 where it is not known yet.
    pub all: usize,
}

impl<'a> Next<'a> {
    /// Of work whose pieces are not known yet.
    #[must_use]
    pub const fn first(what: &'a str) -> Self {
        Self { what, done: 0, all: 0 }
    }
}

/// How a run is watched.
pub struct Watch<'a> {
    /// Is told what comes next.
    pub say: &'a (dyn Fn(Next<'_>) + Sync),
    /// Ends the run when set.
    pub stop: &'a Stop,
}

/// Something that proves claims about generated code.
pub trait Prover {
    /// Its claims about the code of a policy; those that it cannot try for want of a program are [`Verdict::NotRun`].
    ///
    /// # Errors
    /// If the run was stopped.
    fn prove(&self, task: Task<'_>, watch: &Watch<'_>) -> Result<Vec<Claim>, Stopped>;
}

/// The provers of this crate, in the order in which they run.
#[must_use]
pub fn provers(exhaustive: bool) -> Vec<Box<dyn Prover>> {
    vec![Box::new(Smt), Box::new(Eva), Box::new(Exhaustive { asked: exhaustive })]
}

/// Asks every prover about the policy in every format.
///
/// # Errors
/// If the run was stopped.
pub fn run(tasks: &[Task<'_>], provers: &[Box<dyn Prover>], watch: &Watch<'_>) -> Result<Vec<Claim>, Stopped> {
    let mut claims = Vec::new();
    for task in tasks {
        for prover in provers {
            claims.extend(prover.prove(*task, watch)?);
        }
    }
    Ok(claims)
}
