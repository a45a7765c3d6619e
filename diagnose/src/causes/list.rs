//! The list of causes: what each moves, how far, and from where it is fitted. How to add one: docs/recipes/cause.md.

use super::knob::{Knob, Reach};
use super::{Cause, Form, Search, circuit, instruments, surroundings};

pub(super) const fn knob(name: &'static str, keys: &'static [&'static str], reach: Reach) -> Knob {
    Knob {
        name,
        keys,
        in_proportion: false,
        reach,
        cuts_off: false,
        resistor: None,
        is_lag: false,
    }
}

/// A step of the duty that cuts off.
pub(super) const fn cutting(name: &'static str, keys: &'static [&'static str], reach: Reach) -> Knob {
    Knob {
        cuts_off: true,
        ..knob(name, keys, reach)
    }
}

/// Several numbers that keep their ratios.
pub(super) const fn scaled(name: &'static str, keys: &'static [&'static str], reach: Reach) -> Knob {
    Knob {
        in_proportion: true,
        ..knob(name, keys, reach)
    }
}

/// The factor of one resistor of the load.
pub(super) const fn resistor(name: &'static str, number: usize) -> Knob {
    Knob {
        resistor: Some(number),
        ..knob(name, &[], GAIN)
    }
}

pub(super) const fn lag(name: &'static str, keys: &'static [&'static str], reach: Reach) -> Knob {
    Knob {
        name,
        is_lag: true,
        ..knob(name, keys, reach)
    }
}

/// A form that is fitted from the model's own values.
pub(super) const fn form(words: &'static str, knobs: &'static [Knob]) -> Form {
    searched(words, knobs, Search::Own)
}

pub(super) const fn searched(words: &'static str, knobs: &'static [Knob], search: Search) -> Form {
    Form {
        words,
        knobs,
        search,
        is_of_a_course: false,
    }
}

// in units of the converter's own size: absolute bounds would suit one converter only (docs/recipes/cause.md)
// bounds hold what blind cases hide (tests/blind/src/effects.rs, at 100 V and 5 A), mostly several times: a value at
// its bound then says that the cause is another. A step is twenty times what two simulators of one circuit differ by
// (`super::TINY`); half or twice all steps, and 0.7 or twice all bounds, find the same in the tests of naming, ties and
// loggers
//
// half of the load's resistance would take a third of the voltage; the step is 0.1 ohm of 20, the least that is hidden
pub(super) const OHMS: Reach = Reach::Resistance(0.5, 0.005);
// 20 us at 10 kHz, seven times the longest dead time hidden; the step is four times `problem::duty_accuracy` there
pub(super) const EDGE: Reach = Reach::Time(0.0, 0.2, 0.002);
// as far as the sampling instant may be off, and its step
pub(super) const AGE: Reach = Reach::Time(0.0, 1.9, 0.02);
// from a factor of two on a probe is set wrong, which the reader names (`record::suspicion`)
pub(super) const GAIN: Reach = Reach::Plain(0.5, 1.5, 0.01);
// 0.5 ms at 10 kHz, 2.5 times the slowest hidden
pub(super) const FILTER: Reach = Reach::Time(0.0, 5.0, 0.1);

/// All causes, each with its forms.
pub static CAUSES: &[Cause] = &[
    circuit::DCR,
    circuit::R_DS_ON,
    circuit::DIODE,
    circuit::DEAD_TIME,
    circuit::TURN_ON_DELAY,
    circuit::TURN_OFF_DELAY,
    circuit::NODE_CAPACITANCE,
    circuit::ESR,
    circuit::ESL,
    circuit::L_WRONG,
    circuit::C_WRONG,
    circuit::L_SATURATION,
    circuit::C_DERATING,
    surroundings::SOURCE_IMPEDANCE,
    surroundings::CABLE,
    surroundings::V_IN_WRONG,
    instruments::SENSOR_LOW_PASS,
    instruments::SENSOR_DELAY,
    instruments::SAMPLING_DELAY,
    instruments::V_GAIN,
    instruments::V_OFFSET,
    instruments::I_GAIN,
    instruments::I_OFFSET,
    surroundings::DUTY_DELAY,
    surroundings::DUTY_OFFSET,
    surroundings::DUTY_QUANTISATION,
    surroundings::CPL_BANDWIDTH,
    surroundings::CPL_FOLD,
    surroundings::LOAD_GAIN,
    surroundings::BLEED,
    circuit::CORE_LOSS,
    surroundings::INPUT_RIPPLE,
    instruments::V_IN_GAIN,
];
