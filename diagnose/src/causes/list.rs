//! The list of causes: what each moves, how far, and from where it is fitted. How to add one: docs/recipes/cause.md.

use super::knob::{Knob, Reach};
use super::{Cause, Form, Search};

const fn knob(name: &'static str, keys: &'static [&'static str], reach: Reach) -> Knob {
    Knob {
        name,
        keys,
        reach,
        is_lag: false,
    }
}

const fn lag(name: &'static str, keys: &'static [&'static str], reach: Reach) -> Knob {
    Knob {
        name,
        keys,
        reach,
        is_lag: true,
    }
}

/// A form that is fitted from the model's own values.
const fn form(words: &'static str, knobs: &'static [Knob]) -> Form {
    searched(words, knobs, Search::Own)
}

const fn searched(words: &'static str, knobs: &'static [Knob], search: Search) -> Form {
    Form { words, knobs, search }
}

// in units of the converter's own size: absolute bounds would suit one converter only (docs/recipes/cause.md)
// bounds hold what blind cases hide (tests/blind/src/effects.rs, at 100 V and 5 A), mostly several times: a value at
// its bound then says that the cause is another. A step is twenty times what two simulators of one circuit differ by
// (`super::TINY`); half or twice all steps, and 0.7 or twice all bounds, find the same in the tests of naming, ties and
// loggers
//
// half of the load's resistance would take a third of the voltage; the step is 0.1 ohm of 20, the least that is hidden
const OHMS: Reach = Reach::Resistance(0.5, 0.005);
// 20 us at 10 kHz, seven times the longest dead time hidden; the step is four times `problem::duty_accuracy` there
const EDGE: Reach = Reach::Time(0.0, 0.2, 0.002);
// from a factor of two on a probe is set wrong, which the reader names (`record::suspicion`)
const GAIN: Reach = Reach::Plain(0.5, 1.5, 0.01);
// 0.5 ms at 10 kHz, 2.5 times the slowest hidden
const FILTER: Reach = Reach::Time(0.0, 5.0, 0.1);

/// All causes, each with its forms.
pub static CAUSES: &[Cause] = &[
    Cause {
        id: "dcr",
        forms: &[form(
            "resistance of the winding",
            &[knob("dcr", &["inductor.dcr"], OHMS)],
        )],
    },
    Cause {
        id: "r_ds_on",
        forms: &[form(
            "on-resistance of the switch",
            &[knob("r_ds_on", &["switch.r_ds_on"], OHMS)],
        )],
    },
    Cause {
        id: "diode",
        forms: &[
            form(
                "forward voltage of the diode",
                // 20 V at 200 V: no diode drops a tenth of the source
                &[knob("v_f", &["switch.v_f"], Reach::Source(0.0, 0.1, 0.002))],
            ),
            form(
                "differential resistance of the diode",
                &[knob("r_d", &["switch.r_d"], OHMS)],
            ),
            form(
                "forward voltage and differential resistance of the diode",
                &[
                    knob("v_f", &["switch.v_f"], Reach::Source(0.0, 0.1, 0.002)),
                    knob("r_d", &["switch.r_d"], OHMS),
                ],
            ),
        ],
    },
    Cause {
        id: "dead_time",
        forms: &[form("dead time", &[knob("dead_time", &["switch.dead_time"], EDGE)])],
    },
    Cause {
        id: "turn_on_delay",
        forms: &[form(
            "turn-on delay of the switch",
            &[knob("turn_on_delay", &["switch.turn_on_delay"], EDGE)],
        )],
    },
    Cause {
        id: "turn_off_delay",
        forms: &[form(
            "turn-off delay of the switch",
            &[knob("turn_off_delay", &["switch.turn_off_delay"], EDGE)],
        )],
    },
    Cause {
        id: "esr",
        forms: &[form(
            "series resistance of the output capacitor",
            &[knob("esr", &["capacitor.esr"], OHMS)],
        )],
    },
    Cause {
        id: "esl",
        forms: &[form(
            "series inductance of the output capacitor",
            // the plant's bound, and the upper end of its typical range: no share of the converter's size
            &[knob("esl", &["capacitor.esl"], Reach::Plain(0.0, 1e-5, 2e-7))],
        )],
    },
    Cause {
        id: "l_wrong",
        forms: &[form(
            "inductance",
            &[knob(
                "inductance",
                &["converter.inductance"],
                // beyond a third or three times it is another part; the step is a fifth of a usual tolerance (10 %)
                Reach::Own(0.3, 3.0, 0.02),
            )],
        )],
    },
    Cause {
        id: "c_wrong",
        forms: &[form(
            "capacitance",
            &[knob(
                "capacitance",
                &["converter.capacitance"],
                Reach::Own(0.3, 3.0, 0.02),
            )],
        )],
    },
    Cause {
        id: "l_saturation",
        forms: &[searched(
            "inductance that falls with current",
            &[
                // the bound is the plant's; it bends from below the usual current to far above, where it is a smaller L
                knob("saturation", &["inductor.saturation"], Reach::Plain(0.0, 0.95, 0.1)),
                knob("i_sat", &["inductor.i_sat"], Reach::Current(0.5, 5.0, 0.1)),
            ],
            Search::From(&[&[0.3, 6.0], &[0.3, 12.0], &[0.3, 25.0], &[4.0, 12.0]]),
        )],
    },
    Cause {
        id: "c_derating",
        forms: &[searched(
            "capacitance that falls with voltage",
            &[
                // as of the inductance
                knob("derating", &["capacitor.derating"], Reach::Plain(0.0, 0.95, 0.1)),
                knob("v_half", &["capacitor.v_half"], Reach::Voltage(0.5, 5.0, 0.1)),
            ],
            Search::From(&[&[0.3, 6.0], &[0.3, 12.0], &[0.3, 25.0], &[4.0, 12.0]]),
        )],
    },
    Cause {
        id: "source_impedance",
        forms: &[
            form(
                "resistance of the source",
                &[knob("resistance", &["source.resistance"], OHMS)],
            ),
            searched(
                "resistance of the source before an input capacitor",
                &[
                    // bounds keep their time constant above NO_LAG periods
                    knob(
                        "resistance",
                        &["source.resistance"],
                        Reach::ResistanceFrom(0.002, 0.5, 0.005),
                    ),
                    knob("c_in", &["source.c_in"], Reach::Capacitance(10.0, 1e6, 20.0)),
                ],
                Search::From(&[&[4.0, 1.0], &[4.0, 20.0]]),
            ),
        ],
    },
    Cause {
        id: "v_in_wrong",
        forms: &[form(
            "source voltage",
            // beyond 30 % a supply is set to another value on purpose; what is hidden ends at 4 %
            &[knob("v_in", &["converter.v_in"], Reach::Own(0.7, 1.3, 0.005))],
        )],
    },
    Cause {
        id: "sensor_low_pass",
        forms: &[
            form(
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
            ),
            form(
                "low-pass of the voltage sensor",
                &[lag("time_constant_v", &["sensors.v_out.low_pass"], FILTER)],
            ),
            form(
                "low-pass of the inductor current sensor",
                &[lag("time_constant_i", &["sensors.i_l.low_pass"], FILTER)],
            ),
        ],
    },
    Cause {
        id: "sampling_delay",
        forms: &[searched(
            "sampling instant",
            // below two periods: from there on it is rows that are shifted
            &[knob("delay", &[], Reach::Time(-1.9, 1.9, 0.02))],
            // a quarter of a period to either side, and 0.7 later: the response bends where the instant passes an edge
            Search::From(&[&[0.0], &[-12.0], &[12.0], &[35.0]]),
        )],
    },
    Cause {
        id: "v_gain",
        forms: &[form(
            "gain of the output voltage sensor",
            &[knob("gain", &["sensors.v_out.gain"], GAIN)],
        )],
    },
    Cause {
        id: "v_offset",
        forms: &[form(
            "offset of the output voltage sensor",
            &[knob(
                "offset",
                &["sensors.v_out.offset"],
                // 30 V of 100, twenty times what is hidden: a reference or a range that is wrong altogether
                Reach::Voltage(-0.3, 0.3, 0.002),
            )],
        )],
    },
    Cause {
        id: "i_gain",
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
        ],
    },
    Cause {
        id: "i_offset",
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
        ],
    },
    Cause {
        id: "duty_delay",
        forms: &[searched(
            "whole periods the duty waits",
            // the plant's bound; the scan ends at four, twice the most that is hidden and usual
            &[knob("periods", &["pwm.duty_delay"], Reach::Plain(0.0, 8.0, 1.0))],
            // whole periods: in between nothing changes smoothly
            Search::Scan(&[0.0, 1.0, 2.0, 3.0, 4.0]),
        )],
    },
    Cause {
        id: "duty_quantisation",
        forms: &[searched(
            "step of the duty",
            &[knob("duty_lsb", &["pwm.duty_lsb"], Reach::Plain(0.0, 0.1, 1.0))],
            Search::Counter,
        )],
    },
    Cause {
        id: "cpl_bandwidth",
        forms: &[form(
            "time constant of the constant-power regulation",
            &[lag(
                "time_constant",
                &["load.cpl_time_constant"],
                // 5 ms at 10 kHz, three times the slowest hidden; slower, constant power is a constant current
                Reach::Time(0.0, 50.0, 0.5),
            )],
        )],
    },
    Cause {
        id: "cpl_fold",
        forms: &[searched(
            "voltage below which constant power becomes a resistor",
            // a fold above the held voltage turns constant power into a resistor for good: half as much again is enough
            &[knob("v_fold", &["load.v_fold"], Reach::Voltage(0.01, 1.5, 0.01))],
            // denser towards the held voltage: a fold below all voltages of a record does nothing and has no slope
            Search::From(&[&[55.0], &[70.0], &[80.0], &[86.0], &[91.0], &[96.0], &[101.0]]),
        )],
    },
    Cause {
        id: "load_gain",
        forms: &[
            form(
                "drawn over set current and power",
                &[knob("gain", &["load.setting_gain"], GAIN)],
            ),
            form(
                "real over set conductance",
                &[knob("resistor_gain", &["load.resistor_gain"], GAIN)],
            ),
            form(
                "drawn over set load",
                &[knob("gain", &["load.setting_gain", "load.resistor_gain"], GAIN)],
            ),
        ],
    },
    Cause {
        id: "bleed",
        forms: &[form(
            "conductance that is always there",
            // nearly a third of the load: what draws more is a second load
            &[knob("bleed", &["load.bleed"], Reach::Conductance(0.3, 0.003))],
        )],
    },
    Cause {
        id: "core_loss",
        forms: &[form(
            "conductance across the inductance",
            &[knob(
                "core_conductance",
                &["inductor.core_conductance"],
                // a loss of a tenth of the load's power; no core is that bad
                Reach::Conductance(0.1, 0.001),
            )],
        )],
    },
    Cause {
        id: "input_ripple",
        forms: &[searched(
            "line harmonic on the source",
            &[
                // 40 V at 200 V, seven times what is hidden; the frequencies are those of mains, whatever the converter
                knob("ripple", &["source.ripple"], Reach::Source(0.0, 0.2, 0.002)),
                knob(
                    "frequency",
                    &["source.ripple_frequency"],
                    Reach::Plain(10.0, 2000.0, 2.0),
                ),
                knob("phase", &["source.ripple_phase"], Reach::Plain(-1.0, 1.0, 0.02)),
            ],
            Search::Line,
        )],
    },
    Cause {
        id: "v_in_gain",
        forms: &[form(
            "gain of the input voltage sensor",
            &[knob("gain", &["sensors.v_in.gain"], GAIN)],
        )],
    },
];
