//! Kirchhoff's laws between two edges: which path carries the inductor's current, what the nodes show, how the states move.
//!
//! ```text
//!   v_s --R--L--+---- v_in        main path:    buck  v_in -> L -> v_out     boost  v_in -> L -> 0
//!              Cin                second path:  buck  0    -> L -> v_out     boost  v_in -> L -> v_out
//!               |                 buck-boost:   v_in -> L -> 0, then 0 -> L -> v_out
//! ```

use crate::independent::board::{Board, Load, Topology};

/// Number of states.
pub const N: usize = 10;
/// States, in the order of the constants below.
pub type State = [f64; N];

pub const I_L: usize = 0;
pub const V_C: usize = 1;
pub const I_SOURCE: usize = 2;
pub const V_CIN: usize = 3;
pub const I_CABLE: usize = 4;
pub const V_CABLE: usize = 5;
pub const I_POWER: usize = 6;
pub const I_R: usize = 7;
pub const V_SLOW: usize = 8;
pub const I_EDDY: usize = 9;

/// What carries the inductor's current.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Path {
    /// The main switch.
    Main,
    /// The second switch, in either direction.
    Second,
    /// The second diode, forward.
    Diode,
    /// The diode of the main switch, backward.
    Body,
    /// Nothing.
    Rest,
}

/// What can be measured at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Nodes {
    pub v_out: f64,
    pub i_l: f64,
    pub i_out: f64,
    pub v_in: f64,
    pub v_sw: f64,
    pub i_in: f64,
}

/// Everything that holds while a step lasts.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    pub board: &'a Board,
    pub path: Path,
    /// Voltage that the node has left to fall after a turn-off.
    pub node: f64,
    pub load: &'a Load,
    /// Factor of all resistances that warm up.
    pub warm: f64,
}

/// Shares of input and output voltage across the inductor: main path, second path.
fn legs(topology: Topology) -> [(f64, f64); 2] {
    match topology {
        Topology::Buck => [(1.0, 1.0), (0.0, 1.0)],
        Topology::Boost => [(1.0, 0.0), (1.0, 1.0)],
        Topology::BuckBoost => [(1.0, 0.0), (0.0, 1.0)],
    }
}

/// Current of what is set at voltage `v`, without the conductance and without the states.
fn set_current(step: &Step, v: f64, power_state: f64) -> f64 {
    let (sink, load) = (&step.board.sink, step.load);
    // an electronic load needs some voltage before it draws its current
    let awake = (v / (0.02 * step.board.source.v)).clamp(0.0, 1.0);
    let power = match sink.tau > 0.0 {
        true => power_state,
        false => power_current(step, v),
    };
    sink.gain * load.i * awake + power
}

fn power_current(step: &Step, v: f64) -> f64 {
    let held = v.max(step.board.sink.fold).max(1e-3 * step.board.source.v);
    step.board.sink.gain * step.load.p * v.max(0.0) / (held * held)
}

/// Conductance that acts at once.
fn conductance(step: &Step) -> f64 {
    let sink = &step.board.sink;
    let resistor = if sink.inductive > 0.0 {
        0.0
    } else {
        step.load.g * sink.resistor
    };
    resistor + sink.bleed
}

/// The output node: its voltage for a current that the leg feeds in.
fn output(step: &Step, x: &State, feed: f64) -> f64 {
    let (board, esr) = (step.board, step.board.stage.esr);
    let (share, tau) = board.odd.absorption;
    let slow = if share > 0.0 { share * board.stage.c / tau } else { 0.0 };
    if board.sink.cable.is_some() {
        return (x[V_C] + esr * (feed - x[I_CABLE] + slow * x[V_SLOW])) / (1.0 + esr * slow);
    }
    let g = conductance(step) + slow;
    let mut v = x[V_C];
    // constant power at once depends on the voltage itself; the resistance is small, three rounds are exact to 1e-9
    for _ in 0..if step.load.p > 0.0 && board.sink.tau == 0.0 {
        3
    } else {
        1
    } {
        let fixed = set_current(step, v, x[I_POWER]) + x[I_R] - slow * x[V_SLOW];
        v = (x[V_C] + esr * (feed - fixed)) / (1.0 + esr * g);
    }
    v
}

/// The input node for a drawn current, and the current that feeds it.
fn input(step: &Step, x: &State, drawn: f64, t: f64) -> (f64, f64) {
    let s = &step.board.source;
    let v = s.volts(t);
    if s.c == 0.0 {
        return (v - s.r * drawn, drawn);
    }
    if s.l > 0.0 {
        return (x[V_CIN] + s.esr * (x[I_SOURCE] - drawn), x[I_SOURCE]);
    }
    let r = s.r.max(1e-6);
    let v_in = (x[V_CIN] + s.esr * (v / r - drawn)) / (1.0 + s.esr / r);
    (v_in, (v - v_in) / r)
}

/// Rates of the states, and what the nodes show.
pub fn rates(step: &Step, x: &State, t: f64) -> (State, Nodes) {
    let (board, stage) = (step.board, &step.board.stage);
    let [main, second] = legs(board.topology);
    let (k_in, k_out) = match step.path {
        Path::Main | Path::Body => main,
        Path::Second | Path::Diode => second,
        Path::Rest => (0.0, 0.0),
    };
    let (r_path, drop) = match step.path {
        Path::Main => (stage.r_main * step.warm, 0.0),
        Path::Second => (stage.r_second * step.warm, 0.0),
        Path::Diode => (stage.r_d, stage.v_f),
        Path::Body => (stage.r_d, -stage.v_f),
        Path::Rest => (0.0, 0.0),
    };
    let r = r_path + stage.r_winding * step.warm;
    let resting = step.path == Path::Rest;
    let across = |i: f64, v_in: f64, v_out: f64| k_in * v_in - k_out * v_out - drop + step.node - r * i;

    // the core's loss current follows the voltage across the winding, which follows the current: two rounds settle it
    let (mut i, mut v_l) = (x[I_L], 0.0);
    let (mut v_in, mut v_out, mut fed) = (0.0, 0.0, 0.0);
    let lossy = stage.core > 0.0 || board.odd.core_square > 0.0 || board.odd.hysteresis > 0.0;
    for _ in 0..if lossy { 2 } else { 1 } {
        (v_in, fed) = input(step, x, k_in * i, t);
        v_out = output(step, x, k_out * i);
        v_l = if resting { 0.0 } else { across(i, v_in, v_out) };
        if stage.esl > 0.0 && !resting {
            // the ripple's slope in the capacitor's own inductance
            let k = stage.esl / stage.l;
            let raised = (v_out + k * (v_l + k_out * v_out)) / (1.0 + k * k_out);
            v_out = raised.max(0.0);
            v_l = across(i, v_in, v_out);
        }
        let sign = if v_l.abs() < 1e-9 { 0.0 } else { v_l.signum() };
        let loss = stage.core * v_l + board.odd.core_square * v_l * v_l.abs() + board.odd.hysteresis * sign;
        i = x[I_L] + if lossy && !resting { loss } else { 0.0 };
    }

    let mut d = [0.0; N];
    let l = stage.l * stage.l_fall.map_or(1.0, |fall| fall.left(x[I_L]));
    let (eddy, tau) = board.odd.eddy;
    if resting {
        d[I_L] = 0.0;
        d[I_EDDY] = if eddy > 0.0 { -x[I_EDDY] / tau } else { 0.0 };
    } else if eddy > 0.0 {
        // the shorted part's voltage is that of its resistance
        let v_short = eddy * l / tau * (i - x[I_EDDY]);
        d[I_EDDY] = (i - x[I_EDDY]) / tau;
        d[I_L] = (v_l - v_short) / ((1.0 - eddy) * l);
    } else {
        d[I_L] = v_l / l;
    }
    let i_out = load_rates(step, x, v_out, &mut d);
    let feed = k_out * i;
    let (share, tau) = board.odd.absorption;
    let mut into = feed - i_out;
    if share > 0.0 {
        d[V_SLOW] = (v_out - x[V_SLOW]) / tau;
        into -= share * stage.c * d[V_SLOW];
    }
    d[V_C] = into / (stage.c * stage.c_fall.map_or(1.0, |fall| fall.left(x[V_C])));
    if board.source.c > 0.0 {
        d[V_CIN] = (fed - k_in * i) / board.source.c;
        if board.source.l > 0.0 {
            d[I_SOURCE] = (board.source.volts(t) - board.source.r * x[I_SOURCE] - v_in) / board.source.l;
        }
    }
    let nodes = Nodes {
        v_out,
        i_l: i,
        i_out,
        v_in,
        v_sw: switch_node(step, i, v_in, v_out, r_path, drop),
        i_in: fed,
    };
    (d, nodes)
}

/// Rates of the load's states; returns what leaves the output node into it.
fn load_rates(step: &Step, x: &State, v_out: f64, d: &mut State) -> f64 {
    let sink = &step.board.sink;
    let v = if sink.cable.is_some() { x[V_CABLE] } else { v_out };
    if sink.tau > 0.0 {
        d[I_POWER] = (power_current(step, v) - x[I_POWER]) / sink.tau;
    }
    if sink.inductive > 0.0 {
        d[I_R] = (v * step.load.g * sink.resistor - x[I_R]) / sink.inductive;
    }
    let drawn = conductance(step) * v + set_current(step, v, x[I_POWER]) + x[I_R];
    let Some(cable) = sink.cable else {
        return drawn;
    };
    d[I_CABLE] = (v_out - x[V_CABLE] - cable.r * x[I_CABLE]) / cable.l;
    d[V_CABLE] = (x[I_CABLE] - drawn) / cable.c;
    x[I_CABLE]
}

/// The node that the leg drives: towards ground in a boost, towards the source in the others.
fn switch_node(step: &Step, i: f64, v_in: f64, v_out: f64, r_path: f64, drop: f64) -> f64 {
    let towards = match (step.board.topology, step.path) {
        (_, Path::Rest) => {
            return match step.board.topology {
                Topology::Buck => v_out,
                Topology::Boost => v_in,
                Topology::BuckBoost => 0.0,
            };
        }
        (Topology::Buck, Path::Main | Path::Body) => v_in,
        (Topology::Buck, _) => 0.0,
        (Topology::Boost, Path::Main | Path::Body) => 0.0,
        (Topology::Boost, _) => return v_out + drop + r_path * i,
        (Topology::BuckBoost, Path::Main | Path::Body) => v_in,
        (Topology::BuckBoost, _) => -v_out,
    };
    match step.board.topology {
        Topology::Boost => towards + drop + r_path * i,
        _ => towards - drop - r_path * i + step.node,
    }
}

/// One step of Runge and Kutta's fourth order.
pub fn advance(step: &Step, x: &State, t: f64, h: f64) -> State {
    let along = |k: &State, share: f64| {
        let mut y = *x;
        for (y, k) in y.iter_mut().zip(k) {
            *y += share * h * k;
        }
        y
    };
    let k1 = rates(step, x, t).0;
    let k2 = rates(step, &along(&k1, 0.5), t + 0.5 * h).0;
    let k3 = rates(step, &along(&k2, 0.5), t + 0.5 * h).0;
    let k4 = rates(step, &along(&k3, 1.0), t + h).0;
    let mut y = *x;
    for n in 0..N {
        y[n] += h / 6.0 * (k1[n] + 2.0 * k2[n] + 2.0 * k3[n] + k4[n]);
    }
    y
}
