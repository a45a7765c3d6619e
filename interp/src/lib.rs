//! Reference interpreter of a policy, written from `docs/reference/numeric-contract.md` alone.
//!
//! It is the oracle against which generated code is compared bit by bit, so it shares nothing with the code generator:
//! no lowering, no templates. The modules follow the sections of the contract page:
//!
//! | section | module |
//! |---|---|
//! | 1 state | [`state`], `sound` |
//! | 2 sanitise | `sanitise` |
//! | 3, 4, 5 source, filters, observation | `feature`, `filter` |
//! | 6, 7 network, argmax | `network`; in integers `integer` |
//! | 7, 7b, 7c argmax, continuous head, gain schedule | `head` |
//! | 8 action, mapping | `mapping` |
//! | 9, 9b limits and status, several outputs | `limits`, `path`, [`status`] |
//! | 10 commit | [`controller`] |
//!
//! [`golden`] and [`decisions`] hold its answers against the trainer's.
//!
//! ```no_run
//! use interp::{Controller, Sample};
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let policy: policy::Policy = std::process::exit(0);
//! let mut controller = Controller::<f32>::new(&policy);
//! let trace = controller.step(&[Sample::Physical(99.5), Sample::Physical(10.0), Sample::Physical(9.8)])?;
//! println!("duty {} because of Q {}", trace.command.duty, trace.q_values);
//! # Ok(()) }
//! ```

mod activation;
pub mod controller;
mod curves;
pub mod decisions;
pub mod duties;
mod feature;
mod filter;
pub mod gains;
pub mod golden;
mod head;
mod integer;
mod limits;
mod mapping;
mod names;
mod network;
mod observer;
mod path;
mod real;
mod refusal;
mod sanitise;
mod several;
mod sound;
pub mod state;
pub mod status;
mod trace;
mod unproven;

pub use activation::activate;
pub use controller::Controller;
pub use network::argmax;
pub use real::Real;
pub use sanitise::{InputError, Sample};
pub use state::{Coefficients, Remembered, State};
pub use trace::{Command, Decision, FeatureTrace, LayerTrace, Trace};
