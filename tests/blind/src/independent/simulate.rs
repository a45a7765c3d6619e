//! Walks a board from edge to edge, and finds the state to which a duty settles.

use crate::independent::board::{Board, Load};
use crate::independent::circuit::{
    self, I_CABLE, I_L, I_POWER, I_R, I_SOURCE, N, Nodes, Path, State, Step, V_C, V_CABLE, V_CIN, V_SLOW,
};
use crate::independent::gates::{Cursor, Edges, edges};
use crate::rng::Rng;
use std::iter::once;

/// A period of the PWM: what is commanded and set in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period {
    pub duty: f64,
    pub load: Load,
    /// Share of the period after which `load` holds; before it the load of the period before.
    pub after: f64,
}

/// Signals along time, with two points at each edge.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trace {
    pub t: Vec<f64>,
    pub nodes: Vec<Nodes>,
}

/// Where a walk stands.
struct Walk<'a> {
    board: &'a Board,
    edges: &'a Edges,
    main: Cursor,
    second: Cursor,
    x: State,
    node: f64,
    /// Until when the second diode still conducts after a turn-on.
    recovering: f64,
    was: Path,
    warmth: f64,
    h: f64,
}

impl Walk<'_> {
    /// From `t` to `end` under one load.
    fn to(&mut self, mut t: f64, end: f64, load: &Load, trace: Option<&mut Trace>) {
        let mut trace = trace;
        let tiny = 1e-9 * self.h;
        while end - t > tiny {
            let (main, main_until) = self.main.at(&self.edges.main, t + tiny);
            let (second, second_until) = self.second.at(&self.edges.second, t + tiny);
            let path = self.path(main, second, t, main_until);
            let mut until = end.min(main_until).min(second_until);
            if path == Path::Diode && self.recovering > t {
                until = until.min(self.recovering);
            }
            let slope = self.x[I_L].max(0.0) / self.board.gates.node.max(f64::MIN_POSITIVE);
            if self.node > 0.0 && slope > 0.0 {
                until = until.min(t + self.node / slope);
            }
            let mut h = (until - t).min(self.h).max(tiny);
            let step = Step {
                board: self.board,
                path,
                // the ramp's value in the middle of the step
                node: if self.node > 0.0 {
                    (self.node - 0.5 * slope * h).max(0.0)
                } else {
                    0.0
                },
                load,
                warm: 1.0 + self.warmth,
            };
            if let Some(trace) = trace.as_deref_mut() {
                trace.t.push(t);
                trace.nodes.push(circuit::rates(&step, &self.x, t).1);
            }
            let mut next = circuit::advance(&step, &self.x, t, h);
            let mut stops = false;
            // a diode lets no current back: the step ends where it would
            let i = self.x[I_L];
            if matches!(path, Path::Diode | Path::Body) && i != 0.0 {
                // what it carries is the winding's current, of which a lossy core takes a part
                let [before, after] = [&self.x, &next].map(|x| circuit::rates(&step, x, t).1.i_l);
                if before * i <= 0.0 || after * i <= 0.0 {
                    let share = match before * i > 0.0 {
                        true => (before / (before - after)).clamp(1e-6, 1.0),
                        false => 1e-6,
                    };
                    if share < 1.0 {
                        h *= share;
                        next = circuit::advance(&step, &self.x, t, h);
                    }
                    stops = true;
                }
            }
            self.after(&next, h);
            t += h;
            if let Some(trace) = trace.as_deref_mut() {
                trace.t.push(t);
                trace.nodes.push(
                    circuit::rates(
                        &Step {
                            node: self.node,
                            ..step
                        },
                        &self.x,
                        t,
                    )
                    .1,
                );
            }
            if stops {
                // what the core still holds is lost at once
                self.x[I_L] = 0.0;
            }
        }
    }

    fn path(&mut self, main: bool, second: bool, t: f64, main_until: f64) -> Path {
        let (i, g) = (self.x[I_L], &self.board.gates);
        if main {
            let turning_on = self.was == Path::Diode;
            if turning_on && g.recovery > 0.0 && i > 0.0 && self.recovering <= t - 0.5 * self.board.t_sw() {
                self.recovering = (t + g.recovery).min(main_until);
            }
            if self.recovering > t {
                return Path::Diode;
            }
            (self.was, self.node) = (Path::Main, 0.0);
            return Path::Main;
        }
        if self.was == Path::Main && g.node > 0.0 && i > 0.0 {
            // from where the main switch held it to where the diode will
            let stage = &self.board.stage;
            self.node = self.board.source.v + stage.v_f + (stage.r_d - stage.r_main) * i;
        }
        let path = match (second, i) {
            (true, _) => Path::Second,
            (_, i) if i > 0.0 => Path::Diode,
            (_, i) if i < 0.0 => Path::Body,
            _ if self.starts() => Path::Diode,
            _ => Path::Rest,
        };
        // a switch pulls the node down at once
        if path == Path::Second {
            self.node = 0.0;
        }
        // a current that rests has given its diode time to recover
        self.was = if path == Path::Second { Path::Diode } else { path };
        path
    }

    /// The source of a boost pushes current through its diode by itself.
    fn starts(&self) -> bool {
        let idle = Load::default();
        let step = Step {
            board: self.board,
            path: Path::Diode,
            node: 0.0,
            load: &idle,
            warm: 1.0,
        };
        circuit::rates(&step, &self.x, 0.0).0[I_L] > 0.0
    }

    fn after(&mut self, next: &State, h: f64) {
        if self.node > 0.0 {
            self.node = (self.node - self.x[I_L].max(0.0) * h / self.board.gates.node).max(0.0);
        }
        let (rise, tau) = self.board.odd.heating;
        if rise > 0.0 {
            // warm at the current that the copper is made for
            let heat = (self.x[I_L] * self.board.stage.r_winding / (0.02 * self.board.source.v)).powi(2);
            self.warmth += h / tau * (rise * heat.min(4.0) - self.warmth);
        }
        self.x = *next;
    }
}

/// State where nothing swings, from mean values.
fn guess(board: &Board, duty: f64, load: &Load) -> State {
    let v = (board.source.v * board.ratio(duty.min(0.9))).max(1e-6);
    let sink = &board.sink;
    let power = sink.gain * load.p * v / v.max(sink.fold).powi(2);
    let drawn = v * (load.g * sink.resistor + sink.bleed) + sink.gain * load.i + power;
    let i_l = match board.topology {
        crate::independent::board::Topology::Buck => drawn,
        _ => drawn / (1.0 - duty.min(0.9)),
    };
    let mut x = [0.0; N];
    (x[I_L], x[V_C], x[V_SLOW]) = (i_l, v, v);
    x[V_CIN] = board.source.v;
    x[I_SOURCE] = drawn * v / board.source.v;
    if sink.cable.is_some() {
        (x[I_CABLE], x[V_CABLE]) = (drawn, v);
    }
    if sink.tau > 0.0 {
        x[I_POWER] = power;
    }
    if sink.inductive > 0.0 {
        x[I_R] = v * load.g * sink.resistor;
    }
    x
}

/// Steps in a period of a record; twice as many change a settled voltage by less than a millionth.
pub const STEPS: usize = 80;

/// The state at the start of a period to which duty and load settle: Newton's method on the map of one period.
pub fn settle(board: &Board, duty: f64, load: &Load) -> State {
    let mut x = guess(board, duty, load);
    let mut calm = board.clone();
    (calm.gates.jitter, calm.gates.lost, calm.gates.dither.0, calm.gates.late) = (0.0, 0.0, 0.0, 0);
    (calm.source.ripple.0, calm.source.hunting.0) = (0.0, 0.0);
    let duties = [duty; 4];
    let edges = edges(&calm, &duties, &mut Rng::new(0, &[]));
    let t_sw = calm.t_sw();
    // the third of equal periods has its neighbours' edges as in a long run
    let map = |x: &State| {
        let mut walk = start(&calm, &edges, t_sw, *x, STEPS);
        walk.to(t_sw, 2.0 * t_sw, load, None);
        walk.x
    };
    let scale = scales(board, &x);
    for _ in 0..40 {
        x = map(&x);
    }
    for _ in 0..12 {
        let fx = map(&x);
        let miss = (0..N).map(|n| ((fx[n] - x[n]) / scale[n]).abs()).fold(0.0, f64::max);
        if miss < 1e-10 {
            break;
        }
        let Some(step) = newton(&map, &x, &fx, &scale) else {
            break;
        };
        let mut next = x;
        for n in 0..N {
            next[n] += step[n];
        }
        next[V_C] = next[V_C].max(0.0);
        let better = map(&next);
        let left = (0..N)
            .map(|n| ((better[n] - next[n]) / scale[n]).abs())
            .fold(0.0, f64::max);
        // where Newton does not help, time does
        x = if left < miss {
            next
        } else {
            (0..60).fold(fx, |x, _| map(&x))
        };
    }
    x
}

fn scales(board: &Board, x: &State) -> State {
    let (v, i) = (board.source.v, x[I_L].abs().max(1e-3));
    let mut scale = [i; N];
    for n in [V_C, V_CIN, V_CABLE, V_SLOW] {
        scale[n] = v;
    }
    scale
}

/// The step that would make the map's fixed point, by differences; none where it is singular.
fn newton(map: &impl Fn(&State) -> State, x: &State, fx: &State, scale: &State) -> Option<State> {
    let mut matrix = vec![vec![0.0; N + 1]; N];
    for column in 0..N {
        let mut moved = *x;
        let h = 1e-6 * scale[column];
        moved[column] += h;
        let f = map(&moved);
        for row in 0..N {
            matrix[row][column] = f64::from(u8::from(row == column)) - (f[row] - fx[row]) / h;
        }
    }
    for row in 0..N {
        matrix[row][N] = fx[row] - x[row];
        // a state that this board does not have stays where it is
        if matrix[row][..N].iter().all(|value| value.abs() < 1e-12) {
            matrix[row][row] = 1.0;
        }
    }
    let solved = crate::independent::algebra::solve(&mut matrix)?;
    let mut step = [0.0; N];
    step.copy_from_slice(&solved);
    Some(step)
}

/// A walk from `t` on, with what conducted right before.
fn start<'a>(board: &'a Board, edges: &'a Edges, t: f64, x: State, steps: usize) -> Walk<'a> {
    let h = board.t_sw() / steps as f64;
    let held = |list: &[(f64, f64)]| list.iter().any(|(on, off)| *on < t - 1e-9 * h && t <= *off + 1e-9 * h);
    let was = match x[I_L] {
        _ if held(&edges.main) => Path::Main,
        // a switch in a diode's place conducts what that would
        i if held(&edges.second) || i > 0.0 => Path::Diode,
        i if i < 0.0 => Path::Body,
        _ => Path::Rest,
    };
    Walk {
        board,
        edges,
        main: Cursor::default(),
        second: Cursor::default(),
        x,
        node: 0.0,
        recovering: f64::NEG_INFINITY,
        was,
        warmth: 0.0,
        h,
    }
}

/// A run over `periods` that starts settled at the first of them; `random` draws what trembles.
pub fn run(board: &Board, periods: &[Period], steps: usize, random: &mut Rng) -> Trace {
    let Some(first) = periods.first() else {
        return Trace::default();
    };
    let t_sw = board.t_sw();
    // a pulse of the period before may reach into the first one
    let duties: Vec<f64> = once(first).chain(periods).map(|period| period.duty).collect();
    let edges = edges(board, &duties, random).earlier(t_sw);
    let x = settle(board, first.duty, &first.load);
    let mut walk = start(board, &edges, 0.0, x, steps);
    let mut trace = Trace::default();
    let mut before = first.load;
    for (k, period) in periods.iter().enumerate() {
        let (begin, end) = (k as f64 * t_sw, (k + 1) as f64 * t_sw);
        let change = begin + period.after * t_sw;
        if period.after > 0.0 && before != period.load {
            walk.to(begin, change, &before, Some(&mut trace));
            walk.to(change, end, &period.load, Some(&mut trace));
        } else {
            walk.to(begin, end, &period.load, Some(&mut trace));
        }
        before = period.load;
    }
    trace
}

/// Like [`run`], but the duty of each period is made by `law` from the nodes at `phase` of the period before.
pub fn closed(
    board: &Board,
    loads: &[Load],
    first: f64,
    phase: f64,
    mut law: impl FnMut(usize, &Nodes) -> f64,
) -> Vec<f64> {
    let t_sw = board.t_sw();
    let mut duties = vec![first];
    let mut x = settle(board, first, &loads[0]);
    for k in 0..loads.len().saturating_sub(1) {
        // the edges of three periods: what was before reaches into this one
        let near = [duties[k.saturating_sub(1)], duties[k], duties[k]];
        let edges = edges(board, &near, &mut Rng::new(0, &[]));
        let begin = t_sw;
        let mut walk = start(board, &edges, begin, x, STEPS);
        let mut trace = Trace::default();
        walk.to(begin, begin + t_sw, &loads[k], Some(&mut trace));
        x = walk.x;
        let at = trace
            .t
            .partition_point(|t| *t < begin + phase * t_sw)
            .min(trace.t.len() - 1);
        duties.push(law(k, &trace.nodes[at]));
    }
    duties
}
