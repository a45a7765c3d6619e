//! A case as a netlist: the circuit with its gates and its load step as given waveforms.

use std::fmt::Write;

use plant::Rectifier;
use spice::circuit::{self, Circuit};

use crate::cases::Case;

/// Rise and fall time of a gate, s. The switch conducts from the first percent of it, so a falling gate ends in time and a
/// rising one starts in time.
const EDGE: f64 = 0.5e-9;
/// Duration of a load step, around its instant, s; faster ones ngspice does not follow into an inductance.
const LOAD_EDGE: f64 = 100e-9;

/// The netlist; its result goes to `data`.
pub fn netlist(case: &Case, data: &str) -> String {
    let p = &case.parameters;
    let (before, after) = &case.loads;
    let mut n = circuit::netlist(&Circuit {
        parameters: p,
        v_out: case.v_out,
        i_l: case.i_l,
        load: before,
    });
    gates(&mut n, case);
    let t = case.step_time() - 0.5 * LOAD_EDGE;
    let levels = circuit::drawn(p, before).into_iter().zip(circuit::drawn(p, after));
    for (name, (before, after)) in ["pw", "cc", "gg"].into_iter().zip(levels) {
        steps(&mut n, name, before, &[(t, after)], LOAD_EDGE);
    }
    let end = case.duties.len() as f64 * p.t_sw();
    // the trapezoidal rule is late by (omega h)^2 / 12 of the phase: of the ring of a cable, and 4 A after the load step, 2 mA with
    // 100 ns
    let longest = if p.cable.inductance > 0.0 { "50n" } else { "100n" };
    let _ = writeln!(
        n,
        ".tran {longest} {end:e} 0 {longest} uic\n.control\nset wr_singlescale\nset numdgt=10\nrun"
    );
    let _ = writeln!(n, "wrdata {data} {}\nquit\n.endc\n.end", circuit::columns(p));
    n
}

/// A PWL source `name` between its node of that name and ground, from (time, level) edges in order.
fn steps(n: &mut String, name: &str, first: f64, edges: &[(f64, f64)], rise: f64) {
    let _ = write!(n, "V{name} {name} 0 PWL(0 {first}");
    let mut level = first;
    for &(t, next) in edges {
        if next == level {
            continue;
        }
        let start = t.max(1e-12);
        let _ = write!(n, "\n+ {start:e} {level} {:e} {next}", start + rise);
        level = next;
    }
    n.push_str(")\n");
}

fn gates(n: &mut String, case: &Case) {
    let (p, t) = (&case.parameters, case.parameters.t_sw());
    let s = &p.switch;
    let late = s.dead_time + s.turn_on_delay;
    let (mut upper, mut lower) = (Vec::new(), Vec::new());
    for (start, duty) in case.pulses() {
        let on = duty * t;
        let from = match p.pwm.carrier {
            plant::Carrier::Trailing => start,
            plant::Carrier::Leading => start + t - on,
            plant::Carrier::Centre => start + 0.5 * (t - on),
        };
        if duty > 0.0 {
            upper.extend([(from + late, 1.0), (from + on + s.turn_off_delay - EDGE, 0.0)]);
            lower.extend([(from + s.turn_off_delay - EDGE, 0.0), (from + on + late, 1.0)]);
        }
    }
    let initial = |edges: &mut Vec<(f64, f64)>, before: f64| {
        let past = edges.iter().filter(|&&(t, _)| t < 0.0);
        let level = past.map(|&(_, level)| level).fold(before, |_, level| level);
        edges.retain(|&(t, _)| t >= 0.0);
        level
    };
    let level = initial(&mut upper, 0.0);
    steps(n, "gu", level, &upper, EDGE);
    if p.converter.rectifier == Rectifier::Synchronous {
        let level = initial(&mut lower, 1.0);
        steps(n, "gl", level, &lower, EDGE);
    }
}
