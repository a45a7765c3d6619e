//! Capacitance at the switching node: of both switches or of switch and diode, of the winding, of a snubber.
//!
//! Where a switch opens, the current of the inductor has to carry the node to the other side. Node and inductor swing meanwhile: with `u` the voltage at
//! the inductance, `a` before and `-b` on the other side, and `j` the current that leaves,
//! `u = a cos wt - j Z sin wt`, `Z = sqrt(L / C)`, `w = 1 / sqrt(L C)`, until `u = -b`. A switch that closes ends what is left of the ramp at once: in a
//! synchronous leg whose current is small, at the end of the dead time.
//!
//! ```text
//! node ‾‾‾‾‾‾\                 ‾‾‾‾‾‾‾\
//!             \                        \_
//!              \_______                  |______     the second switch ends it
//!       |-----|                 |---|
//!       C dv / |i|              dead time
//! ```
//!
//! Over the ramp the inductance has the mean of `u`, so that the current ends where it does along the swing. What the node takes the output does not get,
//! and the source gives it. The ringing of node and inductor while a diode blocks is left out.

use serde::{Deserialize, Serialize};

use crate::effects::{dead_time, switch_delay};
use crate::entry::{Effect, Way, number};
use crate::gates::Gate;
use crate::parameters::{Parameters, Rectifier};

/// Catalogue entry.
pub const EFFECT: Effect = Effect {
    name: "node_capacitance",
    meaning: "the inductor's current has to carry the switching node from one side to the other; not in the averaged model",
    needs: Way::Walk,
    parameters: &[number!(
        switch.node_capacitance,
        "F",
        // from GaN at 5 V to IGBT modules with their snubbers
        "capacitance at the switching node",
        (0.0, 1e-5),
        (5e-11, 1e-8),
        0.0
    )],
};

/// What the node does, of one converter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Node {
    /// sqrt(L C), s; 0 without a capacitance.
    swing: f64,
    /// sqrt(L / C), ohm.
    z: f64,
    inductance: f64,
    /// How long the legs of a synchronous converter are both open, s; [`FOR_EVER`] behind a diode.
    open: f64,
}

/// A time that never ends and that a checkpoint can hold: JSON has no infinity.
const FOR_EVER: f64 = f64::MAX;

/// What it remembers of its latest edge.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(crate) struct Edge {
    /// Where the node lies since that switch has opened: nowhere, behind its ramp.
    side: Gate,
    /// How long both legs are still open, s.
    open: f64,
    /// The ramp that runs.
    ramp: Option<Ramp>,
}

/// The way of the node from one side to the other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Ramp {
    /// The switch that has opened.
    pub from: Gate,
    /// What is left of it, s.
    pub rest: f64,
    /// Mean voltage at the inductance, V.
    pub v_l: f64,
}

impl Node {
    pub fn new(p: &Parameters) -> Self {
        let (on, off) = switch_delay::edges(p);
        let (l, c) = (p.converter.inductance, p.switch.node_capacitance);
        Node {
            swing: libm::sqrt(l * c),
            z: libm::sqrt(l / c),
            inductance: l,
            open: match p.converter.rectifier {
                Rectifier::Diode => FOR_EVER,
                Rectifier::Synchronous => (dead_time::hold_back(p) + on - off).max(0.0),
            },
        }
    }

    /// Whether there is any.
    #[inline(always)]
    pub fn is_there(&self) -> bool {
        self.swing > 0.0
    }

    /// What it remembers at a sampling instant up to which the main switch was on, or the other half of the leg.
    pub fn behind(&self, is_on: bool) -> Edge {
        if !self.is_there() {
            return Edge::default();
        }
        let is_diode = self.open == FOR_EVER;
        Edge {
            side: match is_on {
                true => Gate::Main,
                false if is_diode => Gate::Neither,
                false => Gate::Second,
            },
            open: self.open,
            ramp: None,
        }
    }

    /// The ramp that the current `i` A makes, if any, at the beginning of an interval in which the gates say `gate`. `v_l` gives the voltage at the
    /// inductance, V, with the node at its side and at the other.
    pub fn ramp(&self, edge: &mut Edge, gate: Gate, i: f64, v_l: impl FnOnce(Gate) -> [f64; 2]) -> Option<Ramp> {
        if gate != Gate::Neither {
            *edge = Edge {
                side: gate,
                open: self.open,
                ramp: None,
            };
            return None;
        }
        // a current of the other sign is carried by the body diode until it has come to 0
        let leaves = match edge.side {
            Gate::Main => i >= 0.0,
            Gate::Second => i <= 0.0,
            Gate::Neither => false,
        };
        if edge.ramp.is_none() && leaves {
            let from = std::mem::replace(&mut edge.side, Gate::Neither);
            edge.ramp = self.begun(from, i, v_l(from), edge.open);
        }
        edge.ramp
    }

    fn begun(&self, from: Gate, i: f64, [before, after]: [f64; 2], open: f64) -> Option<Ramp> {
        let sign = if from == Gate::Main { 1.0 } else { -1.0 };
        let (a, b, j) = (sign * before, -sign * after, sign * i);
        let size = libm::hypot(a, j * self.z);
        let begins = libm::atan2(j * self.z, a);
        // a current that is too small turns round before the node has arrived
        let ends = match b < size {
            true => libm::acos(-b / size),
            false => std::f64::consts::PI,
        };
        let rest = (self.swing * (ends - begins)).min(open);
        let angle = rest / self.swing;
        let end = j * libm::cos(angle) + a / self.z * libm::sin(angle);
        (rest > 0.0).then(|| Ramp {
            from,
            rest,
            v_l: sign * self.inductance * (end - j) / rest,
        })
    }
}

impl Edge {
    /// So many seconds of it are over.
    pub fn pass(&mut self, used: f64) {
        self.open -= used;
        self.ramp = self.ramp.and_then(|ramp| {
            let rest = ramp.rest - used;
            (rest > 0.0).then_some(Ramp { rest, ..ramp })
        });
    }
}

#[cfg(test)]
mod tests {
    use super::{Edge, Node};
    use crate::gates::Gate;
    use crate::{Load, Parameters, Plant, Rectifier};

    /// 1 nF behind 1 H: 100 V at 2 A take 50 ns, and the current stays as it is.
    fn node(open: f64) -> Node {
        let mut p = Parameters::paper_model();
        (p.converter.inductance, p.switch.node_capacitance) = (1.0, 1e-9);
        Node { open, ..Node::new(&p) }
    }

    /// The side at which the node is, how long, and the mean voltage at the inductance; 60 V above and 40 V below.
    fn ramp(node: &Node, edge: &mut Edge, gate: Gate, i: f64) -> Option<(Gate, f64, f64)> {
        let sides = |from| match from {
            Gate::Main => [60.0, -40.0],
            _ => [-40.0, 60.0],
        };
        let ramp = node.ramp(edge, gate, i, sides)?;
        Some((ramp.from, ramp.rest, ramp.v_l))
    }

    #[test]
    fn the_current_carries_the_node_as_far_as_the_second_switch_lets_it() {
        let begun = |open: f64, gate: Gate, i: f64| {
            let (node, mut edge) = (node(open), Edge::default());
            assert_eq!(ramp(&node, &mut edge, gate, i), None);
            ramp(&node, &mut edge, Gate::Neither, i).unwrap()
        };
        let is = |(gate, rest, v_l): (Gate, f64, f64), wanted: (Gate, f64, f64)| {
            assert!(gate == wanted.0 && (rest - wanted.1).abs() < 1e-4 * wanted.1, "{rest}");
            assert!((v_l - wanted.2).abs() < 1e-2, "{v_l}");
        };
        is(begun(super::FOR_EVER, Gate::Main, 2.0), (Gate::Main, 50e-9, 10.0));
        is(begun(super::FOR_EVER, Gate::Second, -2.0), (Gate::Second, 50e-9, 10.0));
        // after 20 of 50 ns the node has fallen by 40 V
        is(begun(20e-9, Gate::Main, 2.0), (Gate::Main, 20e-9, 40.0));
        // no current: the node waits for the second switch
        is(begun(20e-9, Gate::Main, 0.0), (Gate::Main, 20e-9, 60.0));
    }

    #[test]
    fn a_body_diode_carries_a_current_of_the_other_sign_first() {
        let (node, mut edge) = (node(1e-6), Edge::default());
        assert_eq!(ramp(&node, &mut edge, Gate::Neither, 2.0), None);
        assert_eq!(ramp(&node, &mut edge, Gate::Second, 2.0), None);
        assert_eq!(ramp(&node, &mut edge, Gate::Neither, 2.0), None);
        edge.pass(0.9e-6);
        let (from, rest, _) = ramp(&node, &mut edge, Gate::Neither, 0.0).unwrap();
        assert!(from == Gate::Second && (rest - 0.1e-6).abs() < 1e-12, "{rest}");
        // an interval may be cut anywhere
        edge.pass(0.04e-6);
        let (_, rest, _) = ramp(&node, &mut edge, Gate::Neither, 1.0).unwrap();
        assert!((rest - 0.06e-6).abs() < 1e-12, "{rest}");
        edge.pass(rest);
        assert_eq!(ramp(&node, &mut edge, Gate::Neither, -1.0), None);
    }

    /// Mean output of a 12 V buck of 100 kHz at a duty of one half, V.
    fn output(capacitance: f64, dead_time: f64, load: f64) -> f64 {
        let mut p = Parameters::paper_model();
        (p.converter.v_in, p.converter.f_sw) = (12.0, 100e3);
        (p.converter.inductance, p.converter.capacitance) = (1e-3, 100e-6);
        (p.switch.node_capacitance, p.switch.dead_time) = (capacitance, dead_time);
        p.converter.rectifier = match dead_time > 0.0 {
            true => Rectifier::Synchronous,
            false => Rectifier::Diode,
        };
        let mut plant = Plant::new(&p).unwrap();
        plant.reset_at(6.0, load, &Load::current(load));
        let (sample, rests) = plant.rest(0.5, &Load::current(load));
        assert!(rests);
        0.5 * (sample.v_min + sample.v_max)
    }

    #[test]
    fn the_output_rises_by_half_of_the_charge_over_the_current() {
        // C V^2 f / (2 i): 5 nF, 12 V, 100 kHz, at the crest of .5 A
        let load = 0.5 - 0.5 * 6.0 * 0.5 / (1e-3 * 100e3);
        let rise = output(5e-9, 0.0, load) - output(0.0, 0.0, load);
        assert!((rise - 5e-9 * 144.0 * 1e5 / (2.0 * 0.5)).abs() < 1e-3, "{rise}");
        // in a synchronous leg the dead time cuts it off: at the crest of .075 A the ramp takes .8 us, of which .2 us are left
        let [whole, cut] = [2e-6, 0.2e-6].map(|dead| output(5e-9, dead, 0.06) - output(0.0, dead, 0.06));
        assert!((cut - 12.0 * 1e5 * (0.2e-6 - 0.04e-12 / 1.6e-6)).abs() < 0.01, "{cut}");
        assert!(whole > 2.0 * cut, "{whole} {cut}");
    }
}
