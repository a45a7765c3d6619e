//! Deterministic random numbers: the same seed gives the same bits on every machine and in every version.
//!
//! Two generators, because streams that exist must stay as they are: [`SplitMix`] draws traces and policies of tests,
//! [`Xoshiro`] draws what a training and the noise of a sensor take. [`Random`] says what is drawn from the bits of either.
//! Only integers and exact products of powers of two are used, and no function of a C library.

mod draw;
mod split_mix;
mod xoshiro;

pub use draw::Random;
pub use split_mix::SplitMix;
pub use xoshiro::Xoshiro;
