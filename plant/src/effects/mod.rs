//! The list of the effects that the numbers of a converter bring: one file an effect.
//!
//! An effect's file says its meaning, its parameters with unit, allowed and typical range, the way of computing that it needs,
//! and the formula where it is one. How the circuit is put together from them stands in `crate::full`.
//!
//! A plant at its neutral values is the loss-free converter of the paper.

use crate::entry::Effect;

pub(crate) mod bleed;
pub(crate) mod cable;
pub(crate) mod core_loss;
pub(crate) mod cpl_bandwidth;
pub(crate) mod cpl_fold;
pub(crate) mod dcr;
pub(crate) mod dead_time;
pub(crate) mod derating;
pub(crate) mod diode;
pub(crate) mod duty_delay;
pub(crate) mod duty_offset;
pub(crate) mod duty_quantisation;
pub(crate) mod empirical;
pub(crate) mod esl;
pub(crate) mod esr;
pub(crate) mod heating;
pub(crate) mod input_ripple;
pub(crate) mod load_setting;
pub(crate) mod minimum_on_time;
pub(crate) mod node_capacitance;
pub(crate) mod saturation;
pub(crate) mod sensor_delay;
pub(crate) mod sensor_gain;
pub(crate) mod sensor_low_pass;
pub(crate) mod sensor_noise;
pub(crate) mod sensor_offset;
pub(crate) mod sensor_quantisation;
pub(crate) mod source_impedance;
pub(crate) mod switch_delay;
pub(crate) mod switch_resistance;

/// All effects, in the order in which power flows.
pub(crate) const ALL: &[&Effect] = &[
    &dcr::EFFECT,
    &heating::EFFECT,
    &saturation::EFFECT,
    &core_loss::EFFECT,
    &esr::EFFECT,
    &esl::EFFECT,
    &derating::EFFECT,
    &switch_resistance::EFFECT,
    &diode::EFFECT,
    &dead_time::EFFECT,
    &switch_delay::EFFECT,
    &node_capacitance::EFFECT,
    &source_impedance::EFFECT,
    &input_ripple::EFFECT,
    &bleed::EFFECT,
    &cpl_bandwidth::EFFECT,
    &cpl_fold::EFFECT,
    &load_setting::EFFECT,
    &cable::EFFECT,
    &empirical::EFFECT,
    &duty_delay::EFFECT,
    &duty_offset::EFFECT,
    &duty_quantisation::EFFECT,
    &minimum_on_time::EFFECT,
    &sensor_gain::EFFECT,
    &sensor_offset::EFFECT,
    &sensor_low_pass::EFFECT,
    &sensor_delay::EFFECT,
    &sensor_noise::EFFECT,
    &sensor_quantisation::EFFECT,
];
