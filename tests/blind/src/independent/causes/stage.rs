//! Causes of the power stage, its gates and its source.

use super::List;
use crate::independent::board::{Fall, Knee, Topology};
use crate::independent::draw::Design;

pub fn losses(design: &Design, list: &mut List) {
    let stage = design.world.board.stage.clone();
    let factor = if design.world.board.topology == Topology::Buck {
        1.0
    } else {
        (1.0 - design.duty).powi(2)
    };
    let r = design.r_load() * factor;
    let more = |nominal: f64| (nominal + 0.01 * r, nominal + 0.06 * r);
    list.one(
        ("dcr", "winding"),
        ("dcr", "ohm", stage.r_winding),
        more(stage.r_winding),
        |w, x| {
            w.board.stage.r_winding = x;
        },
    );
    list.one(
        ("r_ds_on", "main switch"),
        ("r_ds_on", "ohm", stage.r_main),
        more(stage.r_main),
        |w, x| {
            w.board.stage.r_main = x;
        },
    );
    if stage.synchronous {
        let nominal = stage.r_main;
        let ratio = stage.r_second / stage.r_main;
        list.one(
            ("r_ds_on", "both switches"),
            ("r_ds_on", "ohm", nominal),
            more(nominal),
            move |w, x| {
                w.board.stage.r_main = x;
                w.board.stage.r_second = x * ratio;
            },
        );
    } else {
        let v = (
            stage.v_f + 0.01 * design.v_out,
            stage.v_f + (0.04 * design.v_out).min(1.5),
        );
        if v.1 > v.0 {
            list.one(("diode", "forward voltage"), ("v_f", "V", stage.v_f), v, |w, x| {
                w.board.stage.v_f = x
            });
        }
        list.one(
            ("diode", "resistance"),
            ("r_d", "ohm", stage.r_d),
            more(stage.r_d),
            |w, x| w.board.stage.r_d = x,
        );
    }
    list.one(
        ("core_loss", "core"),
        ("core", "S", 0.0),
        (0.005 / r, 0.04 / r),
        |w, x| w.board.stage.core = x,
    );
}

pub fn edges(design: &Design, list: &mut List) {
    let gates = &design.world.board.gates;
    let t = design.world.board.t_sw();
    let span = (gates.dead + 0.01 * t, gates.dead + 0.05 * t);
    list.one(
        ("dead_time", "between the switches"),
        ("dead_time", "s", gates.dead),
        span,
        |w, x| w.board.gates.dead = x,
    );
    list.one(
        ("turn_on_delay", "driver"),
        ("turn_on_delay", "s", 0.0),
        (0.01 * t, 0.05 * t),
        |w, x| w.board.gates.rise = x,
    )
    .within(0.0, 0.3 * t);
    // a leg whose upper switch is still on when the dead time is over shorts its source: no bench records that twice
    let (span, most) = match design.world.board.stage.synchronous {
        true => ((0.4 * gates.dead, 0.9 * gates.dead), gates.dead),
        false => ((0.01 * t, 0.05 * t), 0.3 * t),
    };
    list.one(
        ("turn_off_delay", "driver"),
        ("turn_off_delay", "s", 0.0),
        span,
        |w, x| {
            w.board.gates.fall = x;
        },
    )
    .within(0.0, most);
}

pub fn storage(design: &Design, list: &mut List) {
    let board = &design.world.board;
    let stage = board.stage.clone();
    let ripple = 1.0 / (8.0 * stage.c * board.gates.f_sw);
    list.one(
        ("esr", "output capacitor"),
        ("esr", "ohm", stage.esr),
        (stage.esr + 0.7 * ripple, stage.esr + 3.0 * ripple),
        |w, x| {
            w.board.stage.esr = x;
        },
    );
    if board.topology == Topology::Buck {
        let l = stage.l;
        list.one(
            ("esl", "output capacitor"),
            ("esl", "H", 0.0),
            (0.002 * l, 0.02 * l),
            |w, x| w.board.stage.esl = x,
        )
        .within(0.0, 0.1 * l);
    }
    let (c, l) = (stage.c, stage.l);
    list.one(
        ("c_wrong", "aged or of another kind"),
        ("capacitance", "F", c),
        (0.1 * c, 0.4 * c),
        |w, x| w.board.stage.c = x,
    )
    .signed()
    .within(0.1 * c, 4.0 * c);
    list.one(
        ("l_wrong", "of another lot"),
        ("inductance", "H", l),
        (0.06 * l, 0.3 * l),
        |w, x| w.board.stage.l = x,
    )
    .signed()
    .within(0.1 * l, 4.0 * l);
    for (wiring, knee) in [("ceramic", Knee::Gauss), ("film and ceramic", Knee::Power(2))] {
        let v = design.v_out;
        list.one(
            ("c_derating", wiring),
            ("derating", "1", 0.0),
            (0.25, 0.6),
            move |w, x| {
                w.board.stage.c_fall = Some(Fall { share: x, at: v, knee });
            },
        )
        .within(0.0, 0.9)
        .and(("v_half", "V", v), (0.5 * v, 1.3 * v), |w, x| {
            if let Some(fall) = &mut w.board.stage.c_fall {
                fall.at = x;
            }
        });
    }
    for (wiring, knee) in [
        ("ferrite", Knee::Power(4)),
        ("powder", Knee::Tanh),
        ("powder, soft", Knee::Power(2)),
    ] {
        let i = design.i_l();
        list.one(
            ("l_saturation", wiring),
            ("saturation", "1", 0.0),
            (0.25, 0.6),
            move |w, x| {
                w.board.stage.l_fall = Some(Fall { share: x, at: i, knee });
            },
        )
        .within(0.0, 0.9)
        .and(("i_sat", "A", i), (0.6 * i, 1.4 * i), |w, x| {
            if let Some(fall) = &mut w.board.stage.l_fall {
                fall.at = x;
            }
        });
    }
}

pub fn source(design: &Design, list: &mut List) {
    let board = &design.world.board;
    let (v, f) = (board.source.v, board.gates.f_sw);
    list.one(
        ("v_in_wrong", "supply"),
        ("v_in", "V", v),
        (0.01 * v, 0.08 * v),
        |w, x| w.board.source.v = x,
    )
    .signed();
    let r = v * v / (design.v_out * design.i_out);
    list.one(
        ("source_impedance", "leads"),
        ("resistance", "ohm", 0.0),
        (0.008 * r, 0.05 * r),
        |w, x| w.board.source.r = x,
    );
    // an input filter that swings between a fifth and a twentieth of the switching frequency
    let z = 0.1 * r;
    let swing = 10.0 / (2.0 * std::f64::consts::PI * f);
    list.one(
        ("source_impedance", "leads and input filter"),
        ("resistance", "ohm", 0.0),
        (0.008 * r, 0.05 * r),
        move |w, x| {
            let source = &mut w.board.source;
            (source.r, source.esr) = (x, 0.02 * r);
        },
    )
    .and(("inductance", "H", 0.0), (0.5 * z * swing, 1.5 * z * swing), |w, x| {
        w.board.source.l = x
    })
    .and(("c_in", "F", 0.0), (0.5 * swing / z, 1.5 * swing / z), |w, x| {
        w.board.source.c = x
    })
    .needs(false, false, true);
    list.one(
        ("input_ripple", "rectified mains"),
        ("ripple", "V", 0.0),
        (0.004 * v, 0.02 * v),
        |w, x| {
            w.board.source.ripple.0 = x;
        },
    )
    .and(
        ("ripple_frequency", "Hz", 100.0),
        ((f / 250.0).max(100.0), (f / 80.0).max(360.0)),
        |w, x| {
            w.board.source.ripple.1 = x;
        },
    )
    .and(("ripple_phase", "1", 0.0), (0.0, 1.0), |w, x| {
        w.board.source.ripple.2 = x
    })
    .within(-2.0, 2.0)
    .needs(false, false, true);
}
