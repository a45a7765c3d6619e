//! Blind cases: data in which a simulator that shares no code with ours hides an effect, and the scoring of a diagnosis that
//! has to find it. See docs/reference/blind-cases.md.

pub mod bench;
pub mod case;
pub mod control;
pub mod effects;
pub mod experiment;
pub mod independent;
pub mod netlist;
pub mod ngspice;
pub mod plan;
pub mod rivals;
pub mod rng;
pub mod score;
pub mod sensing;
