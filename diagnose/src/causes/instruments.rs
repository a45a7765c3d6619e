//! Sensors and the instants at which they are read.

use super::knob::Reach;
use super::list::{AGE, FILTER, GAIN, form, knob, lag, searched};
use super::{Cause, Kind, Search};

// a load current between its steps does not change: a filter that is short against what is left of the period behind a step shows
// nothing, and so no slope; and the ripple of an inductor current turns round where the filter passes a part of the period. A period
// shows both
const SLOW: Search = Search::OwnOr(&[&[10.0]]);
const SLOW_APART: Search = Search::OwnOr(&[&[10.0, 10.0], &[0.0, 10.0]]);
// as far as a sample in the middle of a period reaches behind a step at its start, and into the period before
const OLD: Search = Search::OwnOr(&[&[35.0], &[65.0]]);

pub(super) const SENSOR_LOW_PASS: Cause = Cause {
    id: "sensor_low_pass",
    kind: Kind::Instrument,
    forms: &[
        searched(
            "low-pass of the sensors",
            &[lag(
                "time_constant",
                &[
                    "sensors.v_out.low_pass",
                    "sensors.i_l.low_pass",
                    "sensors.i_out.low_pass",
                ],
                FILTER,
            )],
            SLOW,
        ),
        searched(
            "low-pass of the voltage sensor",
            &[lag("time_constant_v", &["sensors.v_out.low_pass"], FILTER)],
            SLOW,
        ),
        searched(
            "low-pass of the inductor current sensor",
            &[lag("time_constant_i", &["sensors.i_l.low_pass"], FILTER)],
            SLOW,
        ),
        searched(
            "low-pass of the load current sensor",
            &[lag("time_constant_o", &["sensors.i_out.low_pass"], FILTER)],
            SLOW,
        ),
        searched(
            "low-pass of both current sensors",
            &[lag(
                "time_constant_i",
                &["sensors.i_l.low_pass", "sensors.i_out.low_pass"],
                FILTER,
            )],
            SLOW,
        ),
        searched(
            "low-pass of the sensors of output voltage and inductor current",
            &[lag(
                "time_constant",
                &["sensors.v_out.low_pass", "sensors.i_l.low_pass"],
                FILTER,
            )],
            SLOW,
        ),
        searched(
            "low-pass of the sensors of output voltage and load current",
            &[lag(
                "time_constant",
                &["sensors.v_out.low_pass", "sensors.i_out.low_pass"],
                FILTER,
            )],
            SLOW,
        ),
        searched(
            "low-pass of the voltage sensor, and another one of the current sensors",
            &[
                lag("time_constant_v", &["sensors.v_out.low_pass"], FILTER),
                lag(
                    "time_constant_i",
                    &["sensors.i_l.low_pass", "sensors.i_out.low_pass"],
                    FILTER,
                ),
            ],
            SLOW_APART,
        ),
    ],
};

pub(super) const SENSOR_DELAY: Cause = Cause {
    id: "sensor_delay",
    kind: Kind::Instrument,
    // of all sensors together it is the sampling instant; of one, an instrument or an isolated converter of its own
    forms: &[
        searched(
            "delay of the voltage sensor",
            &[knob("delay_v", &["sensors.v_out.delay"], AGE)],
            OLD,
        ),
        searched(
            "delay of the inductor current sensor",
            &[knob("delay_i", &["sensors.i_l.delay"], AGE)],
            OLD,
        ),
        searched(
            "delay of the load current sensor",
            &[knob("delay_o", &["sensors.i_out.delay"], AGE)],
            OLD,
        ),
        searched(
            "delay of both current sensors",
            &[knob("delay_i", &["sensors.i_l.delay", "sensors.i_out.delay"], AGE)],
            OLD,
        ),
    ],
};

pub(super) const SAMPLING_DELAY: Cause = Cause {
    id: "sampling_delay",
    kind: Kind::Setting,
    forms: &[searched(
        "sampling instant",
        // below two periods: from there on it is rows that are shifted
        &[knob("delay", &[], Reach::Time(-1.9, 1.9, 0.02))],
        // half a period apart over all that is tried: the response bends where the instant passes an edge
        Search::From(&[
            &[0.0],
            &[-12.0],
            &[12.0],
            &[-35.0],
            &[35.0],
            &[-60.0],
            &[60.0],
            &[-85.0],
            &[85.0],
        ]),
    )],
};

pub(super) const V_GAIN: Cause = Cause {
    id: "v_gain",
    kind: Kind::Instrument,
    forms: &[
        form(
            "gain of the output voltage sensor",
            &[knob("gain", &["sensors.v_out.gain"], GAIN)],
        ),
        // converters of one reference
        form(
            "gain of the sensors of output and input voltage",
            &[knob("gain", &["sensors.v_out.gain", "sensors.v_in.gain"], GAIN)],
        ),
    ],
};

pub(super) const V_OFFSET: Cause = Cause {
    id: "v_offset",
    kind: Kind::Instrument,
    forms: &[form(
        "offset of the output voltage sensor",
        &[knob(
            "offset",
            &["sensors.v_out.offset"],
            // 30 V of 100, twenty times what is hidden: a reference or a range that is wrong altogether
            Reach::Voltage(-0.3, 0.3, 0.002),
        )],
    )],
};

pub(super) const I_GAIN: Cause = Cause {
    id: "i_gain",
    kind: Kind::Instrument,
    forms: &[
        form(
            "gain of the inductor current sensor",
            &[knob("gain", &["sensors.i_l.gain"], GAIN)],
        ),
        form(
            "gain of the load current sensor",
            &[knob("gain_o", &["sensors.i_out.gain"], GAIN)],
        ),
        form(
            "gain of both current sensors",
            &[knob("gain", &["sensors.i_l.gain", "sensors.i_out.gain"], GAIN)],
        ),
        form(
            "gain of each current sensor",
            &[
                knob("gain", &["sensors.i_l.gain"], GAIN),
                knob("gain_o", &["sensors.i_out.gain"], GAIN),
            ],
        ),
    ],
};

pub(super) const I_OFFSET: Cause = Cause {
    id: "i_offset",
    kind: Kind::Instrument,
    forms: &[
        form(
            "offset of the inductor current sensor",
            &[knob(
                "offset",
                &["sensors.i_l.offset"],
                // the usual current itself, more than ten times what is hidden; as of the other two forms
                Reach::Current(-1.0, 1.0, 0.005),
            )],
        ),
        form(
            "offset of the load current sensor",
            &[knob(
                "offset_o",
                &["sensors.i_out.offset"],
                Reach::Current(-1.0, 1.0, 0.005),
            )],
        ),
        form(
            "offset of both current sensors",
            &[knob(
                "offset",
                &["sensors.i_l.offset", "sensors.i_out.offset"],
                Reach::Current(-1.0, 1.0, 0.005),
            )],
        ),
        form(
            "offset of each current sensor",
            &[
                knob("offset", &["sensors.i_l.offset"], Reach::Current(-1.0, 1.0, 0.005)),
                knob("offset_o", &["sensors.i_out.offset"], Reach::Current(-1.0, 1.0, 0.005)),
            ],
        ),
    ],
};

pub(super) const V_IN_GAIN: Cause = Cause {
    id: "v_in_gain",
    kind: Kind::Instrument,
    forms: &[form(
        "gain of the input voltage sensor",
        &[knob("gain", &["sensors.v_in.gain"], GAIN)],
    )],
};
