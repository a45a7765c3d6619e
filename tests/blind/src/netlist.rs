//! The circuit as an ngspice netlist, drawn from the schematic.
//!
//! The diode is ngspice's own exponential one (emission coefficient 0.5) in series with a voltage and a resistance chosen so
//! that its curve meets `v_f + r_d i` in the middle of the range of currents; the switch is a conductance with finite edges;
//! saturation and derating are integrators in flux and charge form.

use std::fmt::Write;

use crate::bench::{Bench, T_SW};
use crate::experiment::{Load, Record};
use crate::rng::Rng;

/// Step of the output, s.
pub const T_FINE: f64 = 1e-6;
/// Rise and fall time of a gate, s; the switch conducts from the start of the rise to the end of the fall.
const RISE: f64 = 2e-9;
/// Duration of a load step, s.
const LOAD_RISE: f64 = 100e-9;
/// Diode: 0.5 kT/q.
const SLOPE: f64 = 0.5 * 0.025_865;
/// Diode: saturation current, A.
const I_S: f64 = 1e-9;
/// Current at which diode and line touch, A.
const I_TOUCH: f64 = 4.0;

/// The netlist of a record with its analysis; `random` feeds jitter and missing pulses. Writes its signals to `out.txt`.
#[must_use]
pub fn netlist(bench: &Bench, record: &Record, random: &mut Rng) -> String {
    let mut n = "* buck converter\n".to_owned();
    let first = record.load[0];
    let v = bench.circuit.v_in * record.duty[0];
    let i = first.current + v * first.conductance + first.power / v;
    match record.closed {
        true => control(&mut n, bench),
        false => gates(&mut n, bench, record, random),
    }
    stage(&mut n, bench, record.lead, v, i);
    set_loads(&mut n, bench, record);
    load(&mut n, bench, &record.load[0], v);
    let end = (record.lead + record.duty.len() + 1) as f64 * T_SW;
    let signals = "v(out) i(vil) i(vout) v(nin) v(hold)";
    // edges that no source announces are found by short steps only
    let (longest, method) = match record.closed {
        // trapezoids turn off up to 4 us late here
        true => (0.2 * T_FINE, "method=gear "),
        false => (T_FINE, ""),
    };
    let _ = write!(
        n,
        ".options {method}reltol=1e-4 abstol=1e-9 vntol=1e-6 chgtol=1e-16\n.save {signals}\n\
         .tran {T_FINE:e} {end:e} 0 {longest:e} uic\n.control\nrun\nlinearize {signals}\nset wr_singlescale\n\
         set numdgt=12\nwrdata out.txt {signals}\nquit\n.endc\n.end\n"
    );
    n
}

/// Names of the sensors' low-passes in [`under_control`].
pub const SHOWN: [&str; 3] = ["lpv", "lpi", "lpo"];

/// The circuit for a controller outside: its gate is the external source `gu`, its load is set by `pw`, `cc` and `gg`. It
/// starts at `v` V and `i` A; [`SHOWN`] hold what the sensors have of output voltage, inductor and load current.
#[must_use]
pub fn under_control(bench: &Bench, v: f64, i: f64, first: &Load) -> String {
    let mut n = "* buck converter\n".to_owned();
    for name in ["gu", "gl", "pw", "cc", "gg"] {
        let _ = writeln!(n, "V{name} {name} 0 external");
    }
    n.push_str("Eg g 0 gu 0 1\n");
    stage(&mut n, bench, 0, v, i);
    load(&mut n, bench, first, v);
    let i_o = first.current + v * first.conductance + first.power / v;
    let tau = bench.sensors.low_pass.max(1e-9);
    for (name, signal, start) in [
        (SHOWN[0], "V(out)", v),
        (SHOWN[1], "I(Vil)", i),
        (SHOWN[2], "I(Vout)", i_o),
    ] {
        let _ = writeln!(n, "B{name} {name}0 0 V={signal}\nR{name} {name}0 {name} 1");
        let _ = writeln!(n, "C{name} {name} 0 {tau:e} ic={start}");
    }
    let _ = write!(
        n,
        ".options reltol=1e-4 abstol=1e-9 vntol=1e-6 chgtol=1e-16\n.save v(out) i(vil) i(vout) v(nin) {}\n\
         .tran {T_FINE:e} 10 0 {T_FINE:e} uic\n.end\n",
        SHOWN.map(|name| format!("v({name})")).join(" ")
    );
    n
}

/// Source, switches and filter.
fn stage(n: &mut String, bench: &Bench, lead: usize, v: f64, i: f64) {
    source(n, bench);
    leg(n, bench);
    inductor(n, bench, i, lead);
    capacitor(n, bench, v);
}

/// Corners of a piecewise linear source, continued over lines.
fn pwl(n: &mut String, name: &str, corners: &[(f64, f64)]) {
    let _ = write!(n, "V{name} {name} 0 PWL(");
    let mut last = f64::NEG_INFINITY;
    for (time, level) in corners {
        // ngspice wants rising times; corners that coincide would be a jump
        let time = time.max(last + 1e-12);
        last = time;
        let _ = write!(n, "\n+ {time:.12e} {level}");
    }
    n.push_str(")\n");
}

/// When the switch conducts in a period, s from its start; nothing if the pulse is lost, which happens with the probability
/// `missing`.
pub fn pulse(bench: &Bench, duty: f64, load: &Load, missing: f64, random: &mut Rng) -> Option<[f64; 2]> {
    let m = &bench.modulator;
    let duty = match m.duty_lsb > 0.0 {
        true => (duty / m.duty_lsb).round() * m.duty_lsb,
        false => duty,
    };
    let amperes = load.current + 100.0 * load.conductance + load.power / 100.0;
    let jitter = m.jitter_per_ampere * amperes;
    let (early, tail, lost) = (random.normal(), random.normal(), random.unit());
    let (middle, half) = (0.5 * T_SW, 0.5 * duty * T_SW);
    let on = middle - half + m.dead_time + m.turn_on_delay + jitter * early;
    (lost >= missing).then_some([on, middle + half + jitter * tail])
}

fn gates(n: &mut String, bench: &Bench, record: &Record, random: &mut Rng) {
    let m = &bench.modulator;
    let mut corners = vec![(0.0, 0.0)];
    for period in 0..record.lead + record.duty.len() {
        let row = period.saturating_sub(record.lead);
        let delayed = row.saturating_sub(m.duty_delay as usize);
        let lost = if period >= record.lead { m.missing } else { 0.0 };
        let Some([on, off]) = pulse(bench, record.duty[delayed], &record.load[row], lost, random) else {
            continue;
        };
        let start = period as f64 * T_SW;
        let (on, off) = (start + on, start + off);
        if off > on + 2.0 * RISE {
            corners.extend([(on, 0.0), (on + RISE, 1.0), (off - RISE, 1.0), (off, 0.0)]);
        }
    }
    pwl(n, "g", &corners);
    n.push_str("Vhold hold 0 0\n");
}

/// A controller of the measured voltage: proportional and integral, with the capacitor's current against the negative
/// resistance of constant power. Sampled and held at the start of the period, compared with a triangle.
fn control(n: &mut String, bench: &Bench) {
    let s = &bench.sensors;
    let half = 0.5 * T_SW;
    let _ = writeln!(n, "Be e 0 V=100-({}*V(out)+{})", s.v_gain, s.v_offset);
    let _ = writeln!(n, "Bint 0 int I=3*V(e)\nCint int 0 1 ic=0.5");
    let _ = writeln!(
        n,
        "Bcm cm 0 V=min(max(V(int)+0.0015*V(e)-0.03*(I(Vil)-I(Vout)),0.1),0.9)"
    );
    let _ = writeln!(n, "Vck ck 0 PULSE(0 1 {:e} 10n 10n 1u {T_SW:e})", T_SW - 1.1e-6);
    let _ = writeln!(n, "Bsh cm hold I=(V(cm)-V(hold))*V(ck)/100\nChold hold 0 1n ic=0.5");
    let _ = writeln!(n, "Vtr tr 0 PULSE(1 0 0 {half:e} {half:e} 1p {T_SW:e})");
    let _ = writeln!(
        n,
        "Bg0 g0 0 V=0.5+0.5*tanh((V(hold)-V(tr))*2e4)\nRg g0 g 10\nCg g 0 100p"
    );
}

fn source(n: &mut String, bench: &Bench) {
    let c = &bench.circuit;
    let (ripple, frequency) = (c.odd.line_ripple, c.odd.line_frequency.max(1.0));
    let _ = writeln!(n, "Vs s0 0 SIN({} {ripple} {frequency})", c.v_in);
    let _ = writeln!(n, "Rs s0 nin {:e}", c.source_resistance.max(1e-4));
}

fn leg(n: &mut String, bench: &Bench) {
    let c = &bench.circuit;
    // the exponential's share of voltage and slope at the touching point
    let drop = SLOPE * libm::log(I_TOUCH / I_S) - SLOPE;
    let (v, r) = (c.v_f - drop, (c.r_d - SLOPE / I_TOUCH).max(1e-4));
    let _ = writeln!(n, ".model DX D(IS={I_S:e} N=0.5 RS={r:e})");
    let _ = writeln!(n, "Bu nin sw I=V(nin,sw)*(V(g)/{:e}+1e-9)", c.r_ds_on);
    let _ = writeln!(n, "Vd 0 d1 {v}\nDl d1 sw DX");
    if c.odd.switch_node_capacitance > 0.0 {
        let _ = writeln!(n, "Csw sw 0 {:e}", c.odd.switch_node_capacitance);
    }
}

fn inductor(n: &mut String, bench: &Bench, i: f64, lead: usize) {
    let c = &bench.circuit;
    let inductance = c.inductance * (1.0 - c.odd.eddy_share);
    if c.saturation > 0.0 {
        let x = format!("(V(fl)/{})", c.i_sat);
        let value = format!("{inductance:e}*(1-{}*{x}*{x}/(1+{x}*{x}))", c.saturation);
        let _ = writeln!(n, "Cfl fl 0 1 ic={i}\nBfl 0 fl I=V(sw,x1)/({value})");
        let _ = writeln!(n, "Bil sw x1 I=V(fl)");
    } else {
        let _ = writeln!(n, "L1 sw x1 {inductance:e} ic={i}");
    }
    if c.odd.eddy_share > 0.0 {
        let rest = c.inductance * c.odd.eddy_share;
        let _ = writeln!(n, "L2 x1 x2 {rest:e} ic={i}\nRe x1 x2 {:e}", c.odd.eddy_resistance);
    } else {
        let _ = writeln!(n, "Vl2 x1 x2 0");
    }
    if c.odd.hysteresis_current > 0.0 {
        let _ = writeln!(n, "Bhy sw x2 I={}*tanh(V(sw,x2)/5)", c.odd.hysteresis_current);
    }
    let _ = writeln!(n, "Vil x2 x3 0");
    if c.odd.drift_resistance > 0.0 {
        let lead = lead as f64 * T_SW;
        let _ = writeln!(
            n,
            "Vdr dr 0 EXP(0 {} {lead:e} {:e} 1e3 1)",
            c.odd.drift_resistance, c.odd.drift_time
        );
        let _ = writeln!(n, "Bdr x3 out V=I(Vil)*({}+V(dr))", c.dcr);
    } else {
        let _ = writeln!(n, "Rl x3 out {:e}", c.dcr);
    }
}

fn capacitor(n: &mut String, bench: &Bench, v: f64) {
    let c = &bench.circuit;
    let _ = writeln!(n, "Rc out c1 {:e}", c.esr.max(1e-4));
    if c.esl > 0.0 {
        let _ = writeln!(n, "Lc c1 c2 {:e} ic=0\nRlc c1 c2 5\nCsn out 0 100p ic={v}", c.esl);
    } else {
        let _ = writeln!(n, "Vcj c1 c2 0");
    }
    if c.derating > 0.0 {
        let x = format!("(V(vc)/{})", c.v_half);
        let value = format!("{:e}*(1-{}*{x}*{x}/(1+{x}*{x}))", c.capacitance, c.derating);
        let _ = writeln!(n, "Vci c2 c3 0\nBc3 c3 0 V=V(vc)");
        let _ = writeln!(n, "Cvc vc 0 1 ic={v}\nBvc 0 vc I=I(Vci)/({value})");
    } else {
        let _ = writeln!(n, "C1 c2 0 {:e} ic={v}", c.capacitance);
    }
    if c.odd.absorption > 0.0 {
        let slow = c.capacitance * c.odd.absorption;
        let _ = writeln!(
            n,
            "Rda c2 da {:e}\nCda da 0 {slow:e} ic={v}",
            c.odd.absorption_resistance
        );
    }
}

/// What the load draws when it is set: power W, current A, conductance S (the levels of `pw`, `cc` and `gg`).
#[must_use]
pub fn drawn(bench: &Bench, load: &Load) -> [f64; 3] {
    let gain = bench.circuit.load_gain;
    [gain * load.power, gain * load.current, load.conductance]
}

fn set_loads(n: &mut String, bench: &Bench, record: &Record) {
    for (index, name) in ["pw", "cc", "gg"].into_iter().enumerate() {
        let level = |load: &Load| drawn(bench, load)[index];
        let mut corners = vec![(0.0, level(&record.load[0]))];
        for (row, pair) in record.load.windows(2).enumerate() {
            let (before, after) = (level(&pair[0]), level(&pair[1]));
            if before != after {
                let start = (record.lead + row + 1) as f64 * T_SW;
                // what is sampled at a step is what was true before it
                let time = if record.closed { start + LOAD_RISE } else { start };
                corners.extend([(time - LOAD_RISE, before), (time, after)]);
            }
        }
        pwl(n, name, &corners);
    }
}

fn load(n: &mut String, bench: &Bench, first: &Load, v: f64) {
    let c = &bench.circuit;
    let _ = writeln!(n, "Vout out ld0 0");
    if c.odd.cable_inductance > 0.0 {
        let _ = writeln!(n, "Rcab ld0 ld1 0.02\nLcab ld1 ld {:e}", c.odd.cable_inductance);
        let _ = writeln!(n, "Ccab ld 0 {:e} ic={v}", c.odd.cable_capacitance);
    } else {
        let _ = writeln!(n, "Vcab ld0 ld 0");
    }
    let power = first.power * c.load_gain / v;
    let _ = writeln!(n, "Bg ld 0 I=V(gg)*V(ld)\nBcc ld 0 I=V(cc)");
    let _ = writeln!(
        n,
        "Bp0 p0 0 V=V(pw)*V(ld)/(max(V(ld),{f})*max(V(ld),{f}))\nRp p0 ip 1\nCp ip 0 {:e} ic={power}\nBp ld 0 I=V(ip)",
        c.cpl_time_constant,
        f = c.v_fold
    );
}
