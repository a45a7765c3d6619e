//! ngspice as a converter under control.
//!
//! [`circuit`] writes netlists from the circuit diagram, not from the plant's code. [`SpiceConverter`] runs one of them in
//! ngspice's shared library, control period by control period: a [`closed_loop::Environment`] like the plant, from a
//! simulator that shares no code with it. Debian's `libngspice0-dev` and a C compiler are needed.

pub mod circuit;
mod converter;
mod gates;
pub mod host;

pub use converter::SpiceConverter;
pub use host::INSTALL;
