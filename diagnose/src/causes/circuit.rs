//! What the circuit itself has wrong: switch, inductor, output capacitor.

use super::knob::{Knob, Reach};
use super::list::{EDGE, OHMS, form, knob, scaled, searched};
use super::{Cause, Kind, Search};

pub(super) const DCR: Cause = Cause {
    id: "dcr",
    kind: Kind::Part,
    forms: &[
        form("resistance of the winding", &[knob("dcr", &["inductor.dcr"], OHMS)]),
        // settled points stand long enough to warm it
        form("resistance of the winding as it warms", &[WARMS]),
        form(
            "resistance of the winding, cold and as it warms",
            &[knob("dcr", &["inductor.dcr"], OHMS), WARMS],
        ),
    ],
};

/// As far as the resistance itself, at the usual current.
const WARMS: Knob = knob("heating", &["inductor.heating"], Reach::RiseOfResistance(0.5, 0.005));

pub(super) const R_DS_ON: Cause = Cause {
    id: "r_ds_on",
    kind: Kind::Part,
    forms: &[
        form(
            "on-resistance of the switch",
            &[knob("r_ds_on", &["switch.r_ds_on"], OHMS)],
        ),
        // heat and the gate's voltage do the same to both
        form(
            "on-resistance of both switches, in proportion",
            &[scaled("r_ds_on", &["switch.r_ds_on", "switch.r_ds_on_low"], OHMS)],
        ),
    ],
};

pub(super) const DIODE: Cause = Cause {
    id: "diode",
    kind: Kind::Part,
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
};

pub(super) const DEAD_TIME: Cause = Cause {
    id: "dead_time",
    kind: Kind::Part,
    forms: &[form("dead time", &[knob("dead_time", &["switch.dead_time"], EDGE)])],
};

pub(super) const TURN_ON_DELAY: Cause = Cause {
    id: "turn_on_delay",
    kind: Kind::Part,
    forms: &[form(
        "turn-on delay of the switch",
        &[knob("turn_on_delay", &["switch.turn_on_delay"], EDGE)],
    )],
};

pub(super) const TURN_OFF_DELAY: Cause = Cause {
    id: "turn_off_delay",
    kind: Kind::Part,
    forms: &[form(
        "turn-off delay of the switch",
        &[knob("turn_off_delay", &["switch.turn_off_delay"], EDGE)],
    )],
};

pub(super) const NODE_CAPACITANCE: Cause = Cause {
    id: "node_capacitance",
    kind: Kind::Part,
    forms: &[form(
        "capacitance at the switching node",
        &[knob(
            "node_capacitance",
            &["switch.node_capacitance"],
            // the usual current takes a fifth of the period to carry the node through the output's voltage; the step is that of `EDGE`
            Reach::Capacitance(0.0, 0.2, 0.002),
        )],
    )],
};

pub(super) const ESR: Cause = Cause {
    id: "esr",
    kind: Kind::Part,
    forms: &[form(
        "series resistance of the output capacitor",
        &[knob("esr", &["capacitor.esr"], OHMS)],
    )],
};

pub(super) const ESL: Cause = Cause {
    id: "esl",
    kind: Kind::Part,
    forms: &[form(
        "series inductance of the output capacitor",
        // the output jumps by esl / L of the switched voltage: a nanohenry is much beside a third of a microhenry. No capacitor with its
        // leads has half of the inductor's; 100 uH is the plant's bound
        &[knob("esl", &["capacitor.esl"], Reach::BesideInductor(0.5, 1e-4, 1e-4))],
    )],
};

// where the filter rings another part is another frequency, and from its own a fit ends at a beat of the two: from 0.36, 0.44, 0.54, 0.66,
// 0.8, 1.24 and 1.5 of it as well, which are as far apart as a fit reaches. Ceramics lose more than half at their rated voltage
const OTHER_PART: Search = Search::OwnOr(&[&[-32.0], &[-28.0], &[-23.0], &[-17.0], &[-10.0], &[12.0], &[25.0]]);

pub(super) const L_WRONG: Cause = Cause {
    id: "l_wrong",
    kind: Kind::Part,
    forms: &[searched(
        "inductance",
        &[knob(
            "inductance",
            &["converter.inductance"],
            // beyond a third or three times it is another part; the step is a fifth of a usual tolerance (10 %)
            Reach::Own(0.3, 3.0, 0.02),
        )],
        OTHER_PART,
    )],
};

pub(super) const C_WRONG: Cause = Cause {
    id: "c_wrong",
    kind: Kind::Part,
    forms: &[searched(
        "capacitance",
        &[knob(
            "capacitance",
            &["converter.capacitance"],
            Reach::Own(0.3, 3.0, 0.02),
        )],
        OTHER_PART,
    )],
};

pub(super) const L_SATURATION: Cause = Cause {
    id: "l_saturation",
    kind: Kind::Part,
    forms: &[
        searched(
            "inductance that falls with current",
            &[
                // the bound is the plant's; it bends from below the usual current to far above, where it is a smaller L
                knob("saturation", &["inductor.saturation"], Reach::Share(0.0, 0.99, 0.1)),
                knob("i_sat", &["inductor.i_sat"], Reach::Current(0.5, 5.0, 0.1)),
            ],
            Search::From(&[&[0.3, 6.0], &[0.3, 12.0], &[0.3, 25.0], &[4.0, 12.0]]),
        ),
        // the law of data sheets, whose exponent is twice the steepness; it loses all, and half of it about where the inductor is rated
        searched(
            "inductance that falls with current as that of a powder core",
            &[
                knob("saturation", &["inductor.saturation"], Reach::Share(0.0, 0.99, 0.1)),
                knob("i_sat", &["inductor.i_sat"], Reach::Current(0.5, 5.0, 0.1)),
                // beyond what powders have, so that a core between them and ferrite ends inside
                knob("steepness", &["inductor.steepness"], Reach::Plain(0.5, 4.0, 0.1)),
            ],
            Search::From(&[&[9.5, 15.0, 8.0], &[9.5, 25.0, 8.0], &[9.5, 12.0, 14.0]]),
        )
        .of_a_course(),
        searched(
            "inductance that falls steeply with current",
            &[
                // a steep core that loses more swings for ever where its current stops, and no settled point of it comes to rest
                knob("saturation", &["inductor.saturation"], Reach::Share(0.0, 0.95, 0.1)),
                knob("i_sat", &["inductor.i_sat"], Reach::Current(0.3, 8.0, 0.1)),
                knob("steepness", &["inductor.steepness"], Reach::Plain(0.5, 32.0, 0.5)),
            ],
            Search::Knee,
        ),
    ],
};

pub(super) const C_DERATING: Cause = Cause {
    id: "c_derating",
    kind: Kind::Part,
    forms: &[
        searched(
            "capacitance that falls with voltage",
            &[
                knob("derating", &["capacitor.derating"], Reach::Share(0.0, 1.0, 0.1)),
                knob("v_half", &["capacitor.v_half"], Reach::Voltage(0.2, 5.0, 0.1)),
            ],
            // at the output's voltage the last four leave .76, .63, .48 and .30, as far apart as those of another part
            Search::From(&[
                &[0.3, 6.0],
                &[0.3, 12.0],
                &[0.3, 25.0],
                &[4.0, 12.0],
                &[9.0, 12.0],
                &[9.5, 9.0],
                &[9.5, 6.0],
            ]),
        ),
        // a label has a tolerance, and a model may hold what was measured at the output's voltage; a curve so flat that it imitates another
        // capacitance is left to that cause. A film beside a ceramic of the blind cases lost a quarter, and fits of four ceramics ended at a half of the
        // output's voltage: at a fifth none of them does
        searched(
            "capacitance that falls with voltage from another one at none",
            &[
                knob("derating", &["capacitor.derating"], Reach::Share(0.15, 1.0, 0.1)),
                knob("v_half", &["capacitor.v_half"], Reach::Voltage(0.2, 2.0, 0.1)),
                knob("capacitance", &["converter.capacitance"], Reach::Own(0.3, 3.0, 0.02)),
            ],
            // in all they leave .42, .64, .84, 1 and 1.15 of the model's at the output's voltage, twice with a slope as steep as ceramics have
            Search::From(&[
                &[9.0, 9.0, 42.0],
                &[4.0, 12.0, 42.0],
                &[9.0, 9.0, 84.0],
                &[9.0, 9.0, 100.0],
                &[4.0, 12.0, 75.0],
            ]),
        ),
    ],
};

pub(super) const CORE_LOSS: Cause = Cause {
    id: "core_loss",
    kind: Kind::Part,
    forms: &[
        searched(
            "conductance across the inductance",
            &[knob(
                "core_conductance",
                &["inductor.core_conductance"],
                // half of the load's power: more than any core takes that a bench goes on with
                Reach::LossAcross(0.5, 0.0015),
            )],
            // at none the response of a current that rests has a corner. A convention: a twentieth of what is tried
            Search::OwnOr(&[&[15.0]]),
        ),
        searched(
            "core loss that grows with another power of the voltage",
            &[
                // at the source's voltage, which may be several times what stands across the inductance: with a high power more than it takes
                knob(
                    "core_conductance",
                    &["inductor.core_conductance"],
                    Reach::LossAcross(2.0, 0.0015),
                ),
                knob(
                    "core_exponent",
                    &["inductor.core_exponent"],
                    Reach::Plain(1.0, 4.0, 0.1),
                ),
            ],
            Search::From(&[&[20.0, 15.0], &[40.0, 30.0]]),
        ),
    ],
};
