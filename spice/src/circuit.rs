//! A converter as an ngspice netlist, written from the circuit diagram, not from the plant's code.

use std::fmt::Write;

use plant::{Carrier, Load, Parameters, Rectifier, Topology};

/// Drop of the ideal diode at a few amperes, V; taken off `v_f`.
// N V_T ln(i / IS) of the model `DI`: 14.9 is ln(3 A / 1 uA)
const DIODE_DROP: f64 = 0.05 * 0.025_86 * 14.9;

/// What a run reads: output voltage, inductor current, load current, input voltage, low-passed output voltage.
#[must_use]
pub fn columns(p: &Parameters) -> &'static str {
    match p.converter.topology {
        Topology::Buck | Topology::Boost => "v(out) i(vil) i(vout) v(nin) v(lp)",
        Topology::BuckBoost => "v(out) i(vil) i(vout) v(nin,out) v(lp)",
    }
}

/// The node to which the source returns. The inverting converter's output lies below it: its netlist counts voltages from
/// that output, which is node 0, so that `out`, the return, is at the magnitude.
fn common(p: &Parameters) -> &'static str {
    match p.converter.topology {
        Topology::Buck | Topology::Boost => "0",
        Topology::BuckBoost => "out",
    }
}

/// The duty at which a converter without losses holds `v_out`, from the balance of volts and seconds at its inductor.
#[must_use]
pub fn hold(p: &Parameters, v_out: f64) -> f64 {
    let v_in = p.converter.v_in;
    match p.converter.topology {
        Topology::Buck => v_out / v_in,
        Topology::Boost => (v_out - v_in) / v_out,
        Topology::BuckBoost => v_out / (v_out + v_in),
    }
}

/// Sources that a run sets: gates (1 is on), power (W), current (A) and conductance (S) of the load. Each is a voltage source
/// `V<name>` between the node `<name>` and ground.
pub const SOURCES: [&str; 5] = ["gu", "gl", "pw", "cc", "gg"];

/// A converter at its start.
#[derive(Debug, Clone, Copy)]
pub struct Circuit<'a> {
    /// What it is made of.
    pub parameters: &'a Parameters,
    /// Output voltage, V.
    pub v_out: f64,
    /// Inductor current, A.
    pub i_l: f64,
    /// Load set at the start; its currents are the initial ones of cable and regulation.
    pub load: &'a Load,
}

/// The netlist without its [`SOURCES`] and analysis.
#[must_use]
pub fn netlist(circuit: &Circuit<'_>) -> String {
    let p = circuit.parameters;
    let mut n = "* converter\n.model DI D(IS=1e-6 N=0.05 RS=1e-4)\n".to_owned();
    let share = match p.converter.topology {
        Topology::Buck | Topology::BuckBoost => hold(p, circuit.v_out),
        Topology::Boost => 1.0,
    };
    source(&mut n, p, circuit.i_l * share);
    leg(&mut n, circuit);
    inductor(&mut n, p, circuit.i_l);
    capacitor(&mut n, circuit);
    load(&mut n, circuit);
    // tighter than ngspice's own (1e-3, 1e-14): with those, and with a tenth of these, mean and ripple of a buck move
    // by less than 1e-6 V. Without a low-pass 1 ps, far below any step
    let tau = p.sensors.v_out.low_pass.max(1e-12);
    let _ = writeln!(
        n,
        "Blp lp0 0 V=V(out)\nRlp lp0 lp 1k\nClp lp 0 {:e} ic={}\n\
         .options reltol=1e-5 abstol=1e-9 vntol=1e-7 chgtol=1e-16",
        tau / 1e3,
        circuit.v_out
    );
    n
}

/// What the load draws when `load` is set: power W, current A, conductance S (the levels of `pw`, `cc`, `gg`).
#[must_use]
pub fn drawn(p: &Parameters, load: &Load) -> [f64; 3] {
    let b = &p.load;
    [
        load.power * b.setting_gain,
        load.current * b.setting_gain,
        load.conductance * b.resistor_gain + b.bleed,
    ]
}

fn source(n: &mut String, p: &Parameters, i_in: f64) {
    let s = &p.source;
    let (v_in, common) = (p.converter.v_in, common(p));
    let _ = writeln!(
        n,
        "Vs s0 {common} SIN({v_in} {} {} 0 0 {})",
        s.ripple,
        s.ripple_frequency.max(1e-3),
        s.ripple_phase * 360.0
    );
    // here and below: ngspice takes 0 ohm for 1e-3, a millivolt an ampere
    let _ = writeln!(n, "Rs s0 s1 {:e}", s.resistance.max(1e-6));
    match s.inductance > 0.0 {
        true => writeln!(n, "Ls s1 nin {:e} ic={i_in}", s.inductance),
        false => writeln!(n, "Vsj s1 nin 0"),
    }
    .unwrap_or_default();
    if s.c_in > 0.0 {
        let v = v_in - s.resistance * i_in;
        let _ = writeln!(
            n,
            "Rci nin ci {:e}\nCi ci {common} {:e} ic={v}",
            s.esr_in.max(1e-6),
            s.c_in
        );
    }
}

fn leg(n: &mut String, circuit: &Circuit<'_>) {
    let p = circuit.parameters;
    let s = &p.switch;
    let diode = |n: &mut String, name: &str, from: &str, to: &str| {
        // the model has its own RS of 1e-4
        let (v, r) = (s.v_f - DIODE_DROP, (s.r_d - 1e-4).max(1e-5));
        let _ = writeln!(
            n,
            "D{name} {from} {name}1 DI\nV{name} {name}1 {name}2 {v}\nR{name} {name}2 {to} {r:e}"
        );
    };
    // without it the node hangs in the air while the current rests, and the step of the transient shrinks to nothing
    let _ = writeln!(n, "Rsw sw 0 3e6");
    if p.converter.topology == Topology::Boost && p.source.c_in > 0.0 {
        // the inductor drives its current into this node, and ngspice finds no first step without a capacitance there
        let _ = writeln!(n, "Csw sw 0 10p");
    }
    if s.node_capacitance > 0.0 {
        // at the side of the rectifier: what carries before the first edge
        let v = if p.converter.topology == Topology::Boost {
            circuit.v_out
        } else {
            0.0
        };
        let _ = writeln!(n, "Cnode sw 0 {:e} ic={v}", s.node_capacitance);
    }
    // the switch from its drain to its source, and the diode from anode to cathode
    let (main, rectifier) = match p.converter.topology {
        Topology::Buck | Topology::BuckBoost => (("nin", "sw"), ("0", "sw")),
        Topology::Boost => (("sw", "0"), ("sw", "out")),
    };
    // 1e-9 S off, 0.2 uA at 200 V: 1e-12 and 1e-6 give the same 1e-6 V
    let (drain, foot) = main;
    let r_on = s.r_ds_on.max(1e-4);
    let _ = writeln!(n, "Bu {drain} {foot} I=V({drain},{foot})*(V(gu)/{r_on:e}+1e-9)");
    diode(n, "dl", rectifier.0, rectifier.1);
    // in a synchronous leg too: without the upper body diode its voltage comes out 22 % high at light load
    diode(n, "du", foot, drain);
    if p.converter.rectifier == Rectifier::Synchronous {
        let ((anode, cathode), r_on) = (rectifier, s.r_ds_on_low.max(1e-4));
        let _ = writeln!(n, "Bl {cathode} {anode} I=V({cathode},{anode})*(V(gl)/{r_on:e}+1e-9)");
    }
}

fn inductor(n: &mut String, p: &Parameters, i_l: f64) {
    let (l, i) = (p.converter.inductance, &p.inductor);
    let (from, to) = match p.converter.topology {
        // the return of an inverting converter is its node `out`
        Topology::Buck | Topology::BuckBoost => ("sw", "out"),
        Topology::Boost => ("nin", "sw"),
    };
    if i.saturation > 0.0 {
        let x = format!("(V(fl)/{})", i.i_sat);
        let (whole, rest) = (i.steepness.floor(), i.steepness.fract());
        let y = match i.steepness {
            1.0 => format!("{x}*{x}"),
            // the power itself: the plant's line between quarters of the exponent is within a hundredth of it
            s if s < 1.0 => format!("abs({x})^{:e}", 2.0 * s),
            _ => format!("(({x}*{x})^{whole}*(1+{rest}*({x}*{x}-1)))"),
        };
        let value = format!("{l:e}*(1-{}*{y}/(1+{y}))", i.saturation);
        let _ = writeln!(
            n,
            // an integrator whose voltage is the current: the inductance may then follow it as an expression
            "Cfl fl 0 1 ic={i_l}\nBfl 0 fl I=V({from},x1)/({value})\nBil {from} x1 I=V(fl)"
        );
    } else {
        let _ = writeln!(n, "L1 {from} x1 {l:e} ic={i_l}");
    }
    if i.core_conductance > 0.0 && i.core_exponent != 2.0 {
        let (g, v_in, more) = (i.core_conductance, p.converter.v_in, i.core_exponent - 2.0);
        let _ = writeln!(
            n,
            // a slope without bound at no voltage ends with "timestep too small"
            "Bcore {from} x1 I={g:e}*V({from},x1)*max(abs(V({from},x1))/{v_in:e},0.001)^{more:e}"
        );
    } else if i.core_conductance > 0.0 {
        let _ = writeln!(n, "Rcore {from} x1 {:e}", 1.0 / i.core_conductance);
    }
    let _ = writeln!(n, "Vil x1 x2 0\nRl x2 {to} {:e}", i.dcr.max(1e-6));
}

fn capacitor(n: &mut String, circuit: &Circuit<'_>) {
    let (p, v_out) = (circuit.parameters, circuit.v_out);
    let (c, k) = (p.converter.capacitance, &p.capacitor);
    // with the load gains at 1, as where there is an ESR or ESL
    let set = circuit.load;
    let i_c = received(circuit) - p.load.bleed * v_out - set.conductance * v_out - set.current - set.power / v_out;
    let v_c = v_out - k.esr * i_c;
    let _ = writeln!(n, "Rc out c1 {:e}", k.esr.max(1e-6));
    match k.esl > 0.0 {
        // parts of no converter, both for the solver. Constant power behind an inductance ends with "timestep too
        // small" unless 5 ohm, below its v^2 / P (10 ohm at 1 kW, 100 V), carry the difference: 0.5 does as well,
        // 50 does not. 100 pF, and 10 pF as 10 nF, change mean and ripple by 1e-5 V at most
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
            // an integrator again: ngspice 39 fails on a capacitor given by an expression of its charge
            "Vci c2 c3 0\nBc3 c3 0 V=V(vc)\nCvc vc 0 1 ic={v_c}\nBvc 0 vc I=I(Vci)/({value})"
        );
    } else {
        let _ = writeln!(n, "C1 c2 0 {c:e} ic={v_c}");
    }
}

/// What the output receives of the inductor's current at the start, A.
fn received(circuit: &Circuit<'_>) -> f64 {
    let p = circuit.parameters;
    let (on, phase) = (hold(p, circuit.v_out), p.pwm.sampling_phase);
    // just before the start of a period is the end of the one before
    let phase = if phase > 0.0 { phase } else { 1.0 };
    let conducts = match p.pwm.carrier {
        Carrier::Trailing => phase <= on,
        Carrier::Leading => phase > 1.0 - on,
        Carrier::Centre => (phase - 0.5).abs() <= 0.5 * on,
    };
    match p.converter.topology {
        Topology::Boost | Topology::BuckBoost if conducts => 0.0,
        _ => circuit.i_l,
    }
}

fn load(n: &mut String, circuit: &Circuit<'_>) {
    let (p, v_out) = (circuit.parameters, circuit.v_out);
    let b = &p.load;
    let _ = writeln!(n, "Vout out ld0 0");
    let [power, current, conductance] = drawn(p, circuit.load);
    if p.cable.inductance > 0.0 {
        let i = conductance * v_out + current + power / v_out;
        let c = &p.cable;
        let _ = writeln!(
            n,
            "Rcab ld0 ld1 {:e}\nLcab ld1 ld {:e} ic={i}",
            c.resistance.max(1e-6),
            c.inductance
        );
        let _ = writeln!(n, "Ccab ld 0 {:e} ic={v_out}", c.capacitance);
    } else {
        let _ = writeln!(n, "Vcab ld0 ld 0");
    }
    let _ = writeln!(n, "Bg ld 0 I=V(gg)*V(ld)\nBcc ld 0 I=V(cc)");
    // a resistor v_fold^2 / P below v_fold
    let current = format!("V(pw)*V(ld)/max(V(ld),{0})^2", b.v_fold);
    if b.cpl_time_constant > 0.0 {
        let _ = writeln!(n, "Bp0 p0 0 V={current}");
        let _ = writeln!(
            n,
            "Rp p0 ip 1\nCp ip 0 {:e} ic={}\nBp ld 0 I=V(ip)",
            b.cpl_time_constant,
            power * v_out / v_out.max(b.v_fold).powi(2)
        );
    } else {
        let _ = writeln!(n, "Bp ld 0 I={current}");
    }
}
