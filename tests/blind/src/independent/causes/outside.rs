//! Causes of sensors, command and load.

use super::List;
use crate::independent::board::Cable;
use crate::independent::draw::Design;
use crate::independent::instruments::{I_L, I_OUT, V_IN, V_OUT};
use crate::independent::program::World;

pub fn sensors(design: &Design, list: &mut List) {
    let channels = &design.world.instruments.channels;
    let (v, i, i_l) = (design.v_out, design.i_out, design.i_l());
    let gain = |index: usize| move |w: &mut World, x: f64| w.instruments.channels[index].gain = x;
    if channels[V_OUT].recorded {
        list.one(
            ("v_gain", "divider of v_out"),
            ("gain", "1", 1.0),
            (0.005, 0.04),
            gain(V_OUT),
        )
        .signed();
        list.one(
            ("v_offset", "amplifier of v_out"),
            ("offset", "V", 0.0),
            (0.004 * v, 0.025 * v),
            |w, x| {
                w.instruments.channels[V_OUT].offset = x;
            },
        )
        .signed();
    }
    if channels[I_L].recorded {
        list.one(("i_gain", "probe of i_l"), ("gain", "1", 1.0), (0.01, 0.06), gain(I_L))
            .signed();
        list.one(
            ("i_offset", "probe of i_l"),
            ("offset", "A", 0.0),
            (0.01 * i_l, 0.08 * i_l),
            |w, x| {
                w.instruments.channels[I_L].offset = x;
            },
        )
        .signed();
    }
    if channels[I_OUT].recorded {
        list.one(
            ("i_gain", "shunt of i_out"),
            ("gain", "1", 1.0),
            (0.01, 0.06),
            gain(I_OUT),
        )
        .signed();
        list.one(
            ("i_offset", "shunt of i_out"),
            ("offset", "A", 0.0),
            (0.01 * i, 0.08 * i),
            |w, x| {
                w.instruments.channels[I_OUT].offset = x;
            },
        )
        .signed();
    }
    shared(design, list);
}

/// What two channels have in common, and the input voltage.
fn shared(design: &Design, list: &mut List) {
    let channels = &design.world.instruments.channels;
    let gain = |index: usize| move |w: &mut World, x: f64| w.instruments.channels[index].gain = x;
    if channels[I_L].recorded && channels[I_OUT].recorded {
        list.one(
            ("i_gain", "one amplifier for both currents"),
            ("gain", "1", 1.0),
            (0.01, 0.06),
            |w, x| {
                (w.instruments.channels[I_L].gain, w.instruments.channels[I_OUT].gain) = (x, x);
            },
        )
        .signed();
    }
    if channels[V_IN].recorded {
        list.one(
            ("v_in_gain", "divider of v_in"),
            ("gain", "1", 1.0),
            (0.005, 0.04),
            gain(V_IN),
        )
        .signed();
    }
    if channels[V_IN].recorded && channels[V_OUT].recorded {
        list.one(
            ("v_gain", "one reference for both voltages"),
            ("gain", "1", 1.0),
            (0.005, 0.04),
            |w, x| {
                (w.instruments.channels[V_OUT].gain, w.instruments.channels[V_IN].gain) = (x, x);
            },
        )
        .signed();
    }
}

pub fn timing_of_sensors(design: &Design, list: &mut List) {
    let channels = &design.world.instruments.channels;
    let t = design.world.board.t_sw();
    let rows: [(&'static str, Vec<usize>); 3] = [
        ("of v_out", vec![V_OUT]),
        ("of i_l", vec![I_L]),
        ("of all channels", vec![V_OUT, I_L, I_OUT, V_IN]),
    ];
    for (wiring, which) in rows {
        if which.len() == 1 && !channels[which[0]].recorded {
            continue;
        }
        let taken: Vec<f64> = channels.iter().map(|channel| channel.low_pass).collect();
        let chosen = which.clone();
        list.one(
            ("sensor_low_pass", wiring),
            ("added", "s", 0.0),
            (0.3 * t, 2.5 * t),
            move |w, x| {
                for index in &chosen {
                    w.instruments.channels[*index].low_pass = taken[*index] + x;
                }
            },
        )
        .needs(false, false, true);
        list.one(
            ("sensor_delay", wiring),
            ("delay", "s", 0.0),
            (0.1 * t, 1.5 * t),
            move |w, x| {
                for index in &which {
                    w.instruments.channels[*index].delay = x;
                }
            },
        )
        .needs(false, false, true);
    }
    list.one(
        ("sampling_delay", "trigger of the converter"),
        ("late", "s", 0.0),
        (0.04 * t, 0.3 * t),
        |w, x| {
            w.instruments.late = x;
        },
    )
    .signed()
    .within(-t, t)
    .needs(false, false, true);
}

pub fn command(list: &mut List) {
    list.one(
        ("duty_offset", "modulator"),
        ("offset", "1", 0.0),
        (0.006, 0.03),
        |w, x| w.board.gates.offset = x,
    )
    .signed()
    .within(-0.1, 0.1);
    list.one(
        ("duty_delay", "one period"),
        ("periods", "1", 0.0),
        (1.0, 1.0),
        |w, x| {
            w.board.gates.late = libm::round(x).max(0.0) as usize;
        },
    )
    .needs(false, false, true);
    list.one(
        ("duty_quantisation", "counter"),
        ("lsb", "1", 0.0),
        (1.0 / 160.0, 1.0 / 50.0),
        |w, x| w.board.gates.lsb = x,
    );
}

pub fn sink(design: &Design, list: &mut List) {
    let sink = &design.world.board.sink;
    let (v, i, t) = (design.v_out, design.i_out, design.world.board.t_sw());
    list.one(
        ("cpl_bandwidth", "electronic load"),
        ("time_constant", "s", sink.tau),
        (3.0 * sink.tau, 12.0 * sink.tau),
        |w, x| {
            w.board.sink.tau = x;
        },
    )
    .within(0.3 * t, 300.0 * t)
    .needs(true, true, true);
    list.one(
        ("cpl_fold", "electronic load"),
        ("v_fold", "V", sink.fold),
        (0.85 * v, 1.1 * v),
        |w, x| w.board.sink.fold = x,
    )
    .needs(true, true, false);
    list.one(
        ("load_gain", "electronic load"),
        ("gain", "1", 1.0),
        (0.015, 0.08),
        |w, x| w.board.sink.gain = x,
    )
    .signed()
    .needs(false, true, false);
    list.one(
        ("load_gain", "load and resistor"),
        ("gain", "1", 1.0),
        (0.015, 0.08),
        |w, x| {
            (w.board.sink.gain, w.board.sink.resistor) = (x, x);
        },
    )
    .signed();
    list.one(
        ("bleed", "discharge resistor"),
        ("conductance", "S", 0.0),
        (0.01 * i / v, 0.06 * i / v),
        |w, x| {
            w.board.sink.bleed = x;
        },
    );
    // swings at a third to a tenth of the switching frequency
    let z = 0.05 * v / i;
    list.one(
        ("cable", "leads and the load's capacitor"),
        ("inductance", "H", 0.0),
        (0.3 * z * t, 1.0 * z * t),
        move |w, x| {
            w.board.sink.cable = Some(Cable {
                l: x,
                r: 0.1 * z,
                c: 0.3 * t / z,
            });
        },
    )
    .and(("capacitance", "F", 0.0), (0.2 * t / z, 1.0 * t / z), |w, x| {
        if let Some(cable) = &mut w.board.sink.cable {
            cable.c = x;
        }
    })
    .and(("resistance", "ohm", 0.0), (0.05 * z, 0.3 * z), |w, x| {
        if let Some(cable) = &mut w.board.sink.cable {
            cable.r = x;
        }
    })
    .needs(false, false, true);
}
