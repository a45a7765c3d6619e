//! The circuit of a case as an ngspice netlist, written from the circuit diagram, not from the plant's code.

use std::fmt::Write;

use plant::{Parameters, Rectifier};

use crate::cases::Case;

/// Rise and fall time of a gate, s. The switch conducts from the first percent of it, so a falling gate ends in time and a
/// rising one starts in time.
const EDGE: f64 = 0.5e-9;
/// Duration of a load step, around its instant, s; faster ones ngspice does not follow into an inductance.
const LOAD_EDGE: f64 = 100e-9;
/// Drop of the ideal diode at a few amperes, V; taken off `v_f`.
const DIODE_DROP: f64 = 0.05 * 0.025_86 * 14.9;

/// The columns that are written after the time.
pub const COLUMNS: &str = "v(out) i(vil) i(vout) v(nin) v(lp)";

/// The netlist; its result goes to `data`.
pub fn netlist(case: &Case, data: &str) -> String {
    let p = &case.parameters;
    let mut n = format!("* {}\n.model DI D(IS=1e-6 N=0.05 RS=1e-4)\n", case.name);
    gates(&mut n, case);
    source(&mut n, p, case.i_l * case.v_out / p.converter.v_in);
    leg(&mut n, p);
    inductor(&mut n, p, case.i_l);
    capacitor(&mut n, case);
    load(&mut n, case);
    let tau = p.sensors.v_out.low_pass.max(1e-12);
    let _ = writeln!(
        n,
        "Blp lp0 0 V=V(out)\nRlp lp0 lp 1k\nClp lp 0 {:e} ic={}",
        tau / 1e3,
        case.v_out
    );
    let end = case.duties.len() as f64 * p.t_sw();
    let _ = writeln!(n, ".options reltol=1e-5 abstol=1e-9 vntol=1e-7 chgtol=1e-16");
    let _ = writeln!(
        n,
        ".tran 100n {end:e} 0 100n uic\n.control\nset wr_singlescale\nset numdgt=10\nrun"
    );
    let _ = writeln!(n, "wrdata {data} {COLUMNS}\nquit\n.endc\n.end");
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

fn source(n: &mut String, p: &Parameters, i_in: f64) {
    let s = &p.source;
    let v_in = p.converter.v_in;
    let _ = writeln!(
        n,
        "Vs s0 0 SIN({v_in} {} {} 0 0 {})",
        s.ripple,
        s.ripple_frequency.max(1e-3),
        s.ripple_phase * 360.0
    );
    let _ = writeln!(n, "Rs s0 s1 {:e}", s.resistance.max(1e-6));
    match s.inductance > 0.0 {
        true => writeln!(n, "Ls s1 nin {:e} ic={i_in}", s.inductance),
        false => writeln!(n, "Vsj s1 nin 0"),
    }
    .unwrap_or_default();
    if s.c_in > 0.0 {
        let v = v_in - s.resistance * i_in;
        let _ = writeln!(n, "Rci nin ci {:e}\nCi ci 0 {:e} ic={v}", s.esr_in.max(1e-6), s.c_in);
    }
}

fn leg(n: &mut String, p: &Parameters) {
    let s = &p.switch;
    let diode = |n: &mut String, name: &str, from: &str, to: &str| {
        let (v, r) = (s.v_f - DIODE_DROP, (s.r_d - 1e-4).max(1e-5));
        let _ = writeln!(
            n,
            "D{name} {from} {name}1 DI\nV{name} {name}1 {name}2 {v}\nR{name} {name}2 {to} {r:e}"
        );
    };
    let _ = writeln!(n, "Bu nin sw I=V(nin,sw)*(V(gu)/{:e}+1e-9)", s.r_ds_on);
    diode(n, "dl", "0", "sw");
    diode(n, "du", "sw", "nin");
    if p.converter.rectifier == Rectifier::Synchronous {
        let _ = writeln!(n, "Bl sw 0 I=V(sw)*(V(gl)/{:e}+1e-9)", s.r_ds_on_low);
    }
}

fn inductor(n: &mut String, p: &Parameters, i_l: f64) {
    let (l, i) = (p.converter.inductance, &p.inductor);
    if i.saturation > 0.0 {
        let x = format!("(V(fl)/{})", i.i_sat);
        let value = format!("{l:e}*(1-{}*{x}*{x}/(1+{x}*{x}))", i.saturation);
        let _ = writeln!(
            n,
            "Cfl fl 0 1 ic={i_l}\nBfl 0 fl I=V(sw,x1)/({value})\nBil sw x1 I=V(fl)"
        );
    } else {
        let _ = writeln!(n, "L1 sw x1 {l:e} ic={i_l}");
    }
    if i.core_conductance > 0.0 {
        let _ = writeln!(n, "Rcore sw x1 {:e}", 1.0 / i.core_conductance);
    }
    let _ = writeln!(n, "Vil x1 x2 0\nRl x2 out {:e}", i.dcr.max(1e-6));
}

fn capacitor(n: &mut String, case: &Case) {
    let (p, v_out) = (&case.parameters, case.v_out);
    let (c, k) = (p.converter.capacitance, &p.capacitor);
    // with the load gains at 1, as where there is an ESR or ESL
    let set = &case.loads.0;
    let i_c = case.i_l - p.load.bleed * v_out - set.conductance * v_out - set.current - set.power / v_out;
    let v_c = v_out - k.esr * i_c;
    let _ = writeln!(n, "Rc out c1 {:e}", k.esr.max(1e-6));
    match k.esl > 0.0 {
        true => writeln!(
            n,
            "Lc c1 c2 {:e} ic={i_c}\nRlc c1 c2 5\nCsn out 0 100p ic={v_out}",
            k.esl
        ),
        false => writeln!(n, "Vcj c1 c2 0"),
    }
    .unwrap_or_default();
    if k.derating > 0.0 {
        let x = format!("(V(vc)/{})", k.v_half);
        let value = format!("{c:e}*(1-{}*{x}*{x}/(1+{x}*{x}))", k.derating);
        let _ = writeln!(
            n,
            "Vci c2 c3 0\nBc3 c3 0 V=V(vc)\nCvc vc 0 1 ic={v_c}\nBvc 0 vc I=I(Vci)/({value})"
        );
    } else {
        let _ = writeln!(n, "C1 c2 0 {c:e} ic={v_c}");
    }
}

fn load(n: &mut String, case: &Case) {
    let (p, (before, after)) = (&case.parameters, case.loads);
    let t = case.step_time() - 0.5 * LOAD_EDGE;
    let b = &p.load;
    let _ = writeln!(n, "Vout out ld0 0");
    let g = before.conductance * b.resistor_gain + b.bleed;
    let current = before.power * b.setting_gain / case.v_out;
    if p.cable.inductance > 0.0 {
        let i = g * case.v_out + before.current * b.setting_gain + current;
        let c = &p.cable;
        let _ = writeln!(
            n,
            "Rcab ld0 ld1 {:e}\nLcab ld1 ld {:e} ic={i}",
            c.resistance.max(1e-6),
            c.inductance
        );
        let _ = writeln!(n, "Ccab ld 0 {:e} ic={}", c.capacitance, case.v_out);
    } else {
        let _ = writeln!(n, "Vcab ld0 ld 0");
    }
    steps(
        n,
        "pw",
        before.power * b.setting_gain,
        &[(t, after.power * b.setting_gain)],
        LOAD_EDGE,
    );
    steps(
        n,
        "cc",
        before.current * b.setting_gain,
        &[(t, after.current * b.setting_gain)],
        LOAD_EDGE,
    );
    steps(
        n,
        "gg",
        g,
        &[(t, after.conductance * b.resistor_gain + b.bleed)],
        LOAD_EDGE,
    );
    let _ = writeln!(n, "Bg ld 0 I=V(gg)*V(ld)\nBcc ld 0 I=V(cc)");
    if b.cpl_time_constant > 0.0 {
        let _ = writeln!(n, "Bp0 p0 0 V=V(pw)/max(V(ld),{})", b.v_fold);
        let _ = writeln!(
            n,
            "Rp p0 ip 1\nCp ip 0 {:e} ic={current}\nBp ld 0 I=V(ip)",
            b.cpl_time_constant
        );
    } else {
        let _ = writeln!(n, "Bp ld 0 I=V(pw)/max(V(ld),{})", b.v_fold);
    }
}
