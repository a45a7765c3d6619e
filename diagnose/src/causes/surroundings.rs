//! Source, modulator and load.

use super::knob::{Knob, Reach};
use super::list::{GAIN, OHMS, cutting, form, knob, lag, resistor, searched};
use super::{Cause, Cut, Kind, Search};

// as far and in steps as large as other resistances
const SOURCE_OHMS: Reach = Reach::SourceResistance(0.0, 0.5, 0.005);

pub(super) const SOURCE_IMPEDANCE: Cause = Cause {
    id: "source_impedance",
    kind: Kind::Part,
    forms: &[
        form(
            "resistance of the source",
            &[knob("resistance", &["source.resistance"], SOURCE_OHMS)],
        ),
        searched(
            "resistance of the source before an input capacitor",
            &[
                // bounds keep their time constant above NO_LAG periods
                knob(
                    "resistance",
                    &["source.resistance"],
                    Reach::SourceResistance(0.002, 0.5, 0.005),
                ),
                knob("c_in", &["source.c_in"], Reach::Capacitance(10.0, 1e6, 20.0)),
            ],
            Search::From(&[&[4.0, 1.0], &[4.0, 20.0]]),
        ),
        searched(
            "resistance of the source before an input capacitor that has one, too",
            &[
                // a capacitor that loses the output voltage within a period is none; with it the lowest resistance is NO_LAG periods
                knob(
                    "resistance",
                    &["source.resistance"],
                    Reach::SourceResistance(0.01, 0.5, 0.005),
                ),
                knob("c_in", &["source.c_in"], Reach::Capacitance(1.0, 1e4, 2.0)),
                knob("esr_in", &["source.esr_in"], SOURCE_OHMS),
            ],
            Search::From(&[&[4.0, 3.0, 1.0], &[4.0, 20.0, 1.0]]),
        )
        .of_a_course(),
        searched(
            "resistance and inductance of the source before an input capacitor",
            &[
                knob("resistance", &["source.resistance"], SOURCE_OHMS),
                // a filter that swings within a few periods to some hundreds; the lower ends keep the integrator's steps long enough
                knob(
                    "inductance",
                    &["source.inductance"],
                    Reach::Inductance(2e-3, 100.0, 0.02),
                ),
                knob("c_in", &["source.c_in"], Reach::Capacitance(0.05, 1e4, 0.5)),
                knob("esr_in", &["source.esr_in"], SOURCE_OHMS),
            ],
            Search::Swing,
        ),
    ],
};

pub(super) const CABLE: Cause = Cause {
    id: "cable",
    kind: Kind::Part,
    forms: &[searched(
        "cable to the load, and the capacitor at its end",
        &[
            // 1 uH at 20 ohm and 10 kHz, a metre of wire, to what would be an inductor; the lower end keeps the integrator's steps
            // long enough
            knob("inductance", &["cable.inductance"], Reach::Inductance(5e-4, 0.5, 5e-4)),
            knob("resistance", &["cable.resistance"], OHMS),
            // 1 uF at 20 ohm and 10 kHz, ceramics, to the electrolytic capacitors of an inverter
            knob("capacitance", &["cable.capacitance"], Reach::Capacitance(0.2, 1e3, 0.5)),
        ],
        Search::From(&[&[2.0, 1.0, 4.0], &[10.0, 4.0, 40.0]]),
    )],
};

pub(super) const V_IN_WRONG: Cause = Cause {
    id: "v_in_wrong",
    kind: Kind::Setting,
    forms: &[form(
        "source voltage",
        // beyond 30 % a supply is set to another value on purpose; what is hidden ends at 4 %
        &[knob("v_in", &["converter.v_in"], Reach::Own(0.7, 1.3, 0.005))],
    )],
};

pub(super) const DUTY_DELAY: Cause = Cause {
    id: "duty_delay",
    kind: Kind::Setting,
    forms: &[searched(
        "whole periods the duty waits",
        // the plant's bound; the scan ends at four, twice the most that is hidden and usual
        &[knob("periods", &["pwm.duty_delay"], Reach::Plain(0.0, 8.0, 1.0))],
        // whole periods: in between nothing changes smoothly
        Search::Scan(&[0.0, 1.0, 2.0, 3.0, 4.0]),
    )],
};

pub(super) const DUTY_OFFSET: Cause = Cause {
    id: "duty_offset",
    kind: Kind::Setting,
    forms: &[form(
        "offset of the duty at both edges",
        // as far as late edges reach, in either direction
        &[knob(
            "duty_offset",
            &["pwm.duty_offset"],
            Reach::Plain(-0.2, 0.2, 0.002),
        )],
    )],
};

pub(super) const DUTY_QUANTISATION: Cause = Cause {
    id: "duty_quantisation",
    kind: Kind::Setting,
    forms: &[
        searched(
            "step of the duty",
            &[knob("duty_lsb", &["pwm.duty_lsb"], Reach::Plain(0.0, 0.1, 1.0))],
            Search::Counter(Cut::Nearest),
        ),
        searched(
            "step of the duty, which is cut off",
            &[cutting("duty_lsb", &["pwm.duty_lsb"], Reach::Plain(0.0, 0.1, 1.0))],
            Search::Counter(Cut::Below),
        ),
    ],
};

pub(super) const CPL_BANDWIDTH: Cause = Cause {
    id: "cpl_bandwidth",
    kind: Kind::Setting,
    forms: &[form(
        "time constant of the constant-power regulation",
        &[lag(
            "time_constant",
            &["load.cpl_time_constant"],
            // 20 ms at 10 kHz, 0.2 ms at 1 MHz; slower, constant power is a constant current
            Reach::Time(0.0, 200.0, 0.5),
        )],
    )],
};

pub(super) const CPL_FOLD: Cause = Cause {
    id: "cpl_fold",
    kind: Kind::Setting,
    forms: &[searched(
        "voltage below which constant power becomes a resistor",
        // a fold above the held voltage turns constant power into a resistor for good: half as much again is enough
        &[knob("v_fold", &["load.v_fold"], Reach::Voltage(0.01, 1.5, 0.01))],
        // denser towards the held voltage: a fold below all voltages of a record does nothing and has no slope
        Search::From(&[&[55.0], &[70.0], &[80.0], &[86.0], &[91.0], &[96.0], &[101.0]]),
    )],
};

/// Records that step between so many resistors have the form with so many ([`crate::resistors`]).
const EACH: &[Knob] = &[
    resistor("resistor_1", 0),
    resistor("resistor_2", 1),
    resistor("resistor_3", 2),
    resistor("resistor_4", 3),
];
const EACH_OF_3: &[Knob] = EACH.split_at(3).0;
const EACH_OF_2: &[Knob] = EACH.split_at(2).0;

pub(super) const LOAD_GAIN: Cause = Cause {
    id: "load_gain",
    kind: Kind::Setting,
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
        form("real over set conductance of each resistor", EACH_OF_2),
        form("real over set conductance of each resistor", EACH_OF_3),
        form("real over set conductance of each resistor", EACH),
    ],
};

pub(super) const BLEED: Cause = Cause {
    id: "bleed",
    kind: Kind::Setting,
    forms: &[form(
        "conductance that is always there",
        // nearly a third of the load: what draws more is a second load
        &[knob("bleed", &["load.bleed"], Reach::Conductance(0.3, 0.003))],
    )],
};

pub(super) const INPUT_RIPPLE: Cause = Cause {
    id: "input_ripple",
    kind: Kind::Setting,
    forms: &[searched(
        "line harmonic on the source",
        &[
            // 40 V at 200 V, seven times what is hidden
            knob("ripple", &["source.ripple"], Reach::Source(0.0, 0.2, 0.002)),
            knob(
                "frequency",
                &["source.ripple_frequency"],
                // of mains, whatever the converter, or of a converter before this one. Near the filter's own frequency its swings behind steps
                // would pass for a line; a boost's filter swings at down to half of a buck's with its parts
                Reach::BelowFilter(10.0, 2000.0, 0.5, 2.0),
            ),
            knob("phase", &["source.ripple_phase"], Reach::Plain(-1.0, 1.0, 0.02)),
        ],
        Search::Line,
    )],
};
