//! Duty ratio mapping: acquire settled points of a real converter, fit the mapping, judge it.
//!
//! ```text
//! Table::open(file) -> Table            settled points, strictly read
//! fit(&table)       -> Report           coefficients, errors in volts, what the table cannot say
//! DutyRatioMap::to_toml()               the drm.toml of a policy
//! ```
//!
//! The mapping is that of Cui et al. (arXiv 2110.10490): a duty that the policy chose for the loss-free simulation,
//! `d_sim = v_out / v_in`, becomes `d_real = a d_sim + b i_out + c`, found by partial least squares; the four-term form adds
//! the product `r i_out d_sim` that the losses bring about ([`formula`]).

pub mod acquire;
mod dcm;
mod fit;
pub mod formula;
pub mod judge;
mod mapping;
mod pictures;
pub mod pls;
mod table;

pub use dcm::Conduction;
pub use fit::*;
pub use mapping::{DutyRatioMap, simulation_toml};
pub use pictures::page;
pub use table::{Point, Table, TableOptions};
