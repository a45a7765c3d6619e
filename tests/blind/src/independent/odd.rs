//! Physics and instruments that no plant file states.

use crate::independent::board::Board;
use crate::independent::draw::Design;
use crate::independent::instruments::{CHANNELS, OddChannel};
use crate::independent::program::World;
use crate::rng::Rng;

/// Something that is on nobody's list.
#[derive(Debug, Clone, PartialEq)]
pub struct Oddity {
    pub id: &'static str,
    /// What it is, with its size.
    pub what: String,
    /// Listed causes that are the same thing by another name.
    pub same: &'static [&'static str],
    /// The one channel that shows it, where it is an instrument's.
    pub channel: Option<usize>,
}

/// Ids of the physics, in the order in which [`plant_physics`] knows them.
pub const PHYSICS: [&str; 15] = [
    "heating",
    "hysteresis",
    "absorption",
    "eddy_currents",
    "square_core_loss",
    "jitter",
    "half_rate_dither",
    "slow_dither",
    "lost_pulses",
    "node_capacitance",
    "recovery",
    "hunting_supply",
    "input_filter",
    "inductive_load",
    "uncompensated_probe",
];

/// What an oddity is, and listed causes that are the same.
type Words = (String, &'static [&'static str]);

/// Puts one of [`PHYSICS`] into a world, `size` times as large as usual.
pub fn plant_physics(id: &'static str, size: f64, design: &Design, world: &mut World, random: &mut Rng) -> Oddity {
    let x = size * random.uniform(0.7, 1.4);
    let board = &mut world.board;
    let words = materials(id, x, design, board, random)
        .or_else(|| switching(id, x, design, board, random))
        .or_else(|| surroundings(id, x, design, board, random));
    if let Some((what, same)) = words {
        return Oddity {
            id,
            what,
            same,
            channel: None,
        };
    }
    let run = 250.0 * board.t_sw();
    let channels = &mut world.instruments.channels;
    let channel = if channels[0].recorded { 0 } else { 1 };
    channels[channel].odd.creep = ((0.06 * x).min(0.5), run * 0.08);
    let what = format!("{} creeps: its probe is not compensated", CHANNELS[channel]);
    Oddity {
        id,
        what,
        same: &[],
        channel: Some(channel),
    }
}

/// Cores, dielectrics and copper.
fn materials(id: &str, x: f64, design: &Design, board: &mut Board, random: &mut Rng) -> Option<Words> {
    let run = 250.0 * board.t_sw();
    let t = board.t_sw();
    let v = board.source.v;
    match id {
        "heating" => {
            let tau = run * random.uniform(0.1, 0.4);
            board.stage.r_winding += 0.01 * design.r_load();
            board.odd.heating = (0.6 * x, tau);
            let what = format!("copper warms by {:.0} % within {:.3} ms", 60.0 * x, 1e3 * tau);
            // the winding is larger before it warms, and that is all there is where little current flows
            Some((what, &["dcr"]))
        }
        "hysteresis" => {
            board.odd.hysteresis = 0.03 * x * design.i_l();
            let what = format!(
                "magnetising current of {:.3} A with the sign of the voltage",
                board.odd.hysteresis
            );
            Some((what, &["core_loss"]))
        }
        "absorption" => {
            board.odd.absorption = ((0.3 * x).min(0.9), design.swing * t * random.uniform(0.5, 3.0));
            let what = format!(
                "{:.0} % of the capacitance behind a slow resistance",
                100.0 * board.odd.absorption.0
            );
            Some((what, &[]))
        }
        "eddy_currents" => {
            board.odd.eddy = ((0.25 * x).min(0.6), t * random.uniform(0.2, 2.0));
            let what = format!(
                "{:.0} % of the inductance shorted by eddy currents",
                100.0 * board.odd.eddy.0
            );
            Some((what, &[]))
        }
        "square_core_loss" => {
            board.odd.core_square = 0.03 * x * design.i_l() / (v * v);
            let what = "core loss that grows with the cube of the voltage".to_owned();
            Some((what, &["core_loss"]))
        }
        _ => None,
    }
}

/// Edges.
fn switching(id: &str, x: f64, design: &Design, board: &mut Board, random: &mut Rng) -> Option<Words> {
    let t = board.t_sw();
    let v = board.source.v;
    match id {
        "jitter" => {
            board.gates.jitter = 0.006 * x * t;
            let what = format!("edges tremble by {:.2} % of the period", 0.6 * x);
            Some((what, &[]))
        }
        "half_rate_dither" => {
            board.gates.dither = (0.02 * x, 2.0);
            let what = format!(
                "every other pulse longer by {:.1} %: a subharmonic of the current loop",
                4.0 * x
            );
            Some((what, &[]))
        }
        "slow_dither" => {
            board.gates.dither = (0.012 * x, libm::round(random.uniform(5.0, 40.0)));
            let what = format!("dither of {:.1} % over {} periods", 1.2 * x, board.gates.dither.1);
            Some((what, &[]))
        }
        "lost_pulses" => {
            board.gates.lost = 0.01 * x;
            let what = format!("{:.1} % of the pulses are lost", x);
            Some((what, &[]))
        }
        "node_capacitance" => {
            board.gates.node = 0.05 * x * design.i_l() * t / v;
            let what = format!(
                "{:.2e} F at the switch node: duty is gained at low current",
                board.gates.node
            );
            Some((what, &["node_capacitance", "turn_off_delay"]))
        }
        "recovery" => {
            board.gates.recovery = 0.02 * x * t;
            let what = format!("the diode recovers in {:.1} % of the period", 2.0 * x);
            Some((what, &["dead_time", "turn_on_delay"]))
        }
        _ => None,
    }
}

/// Supply and load.
fn surroundings(id: &str, x: f64, design: &Design, board: &mut Board, random: &mut Rng) -> Option<Words> {
    let run = 250.0 * board.t_sw();
    let t = board.t_sw();
    let v = board.source.v;
    match id {
        "hunting_supply" => {
            board.source.hunting = (0.01 * x * v, random.uniform(2.0, 9.0) / run);
            let what = format!("limit cycle of the supply's regulator, {:.2} V", board.source.hunting.0);
            Some((what, &["input_ripple"]))
        }
        "input_filter" => {
            let r = v * v / (design.v_out * design.i_out);
            let (z, swing) = (0.1 * r * x, t * random.uniform(1.0, 5.0) / std::f64::consts::PI);
            let source = &mut board.source;
            (source.r, source.l, source.c, source.esr) = (0.004 * r, z * swing, swing / z, 0.01 * r);
            let what = "input filter that swings with every step".to_owned();
            Some((what, &["source_impedance"]))
        }
        "inductive_load" => {
            board.sink.inductive = t * random.uniform(2.0, 12.0) * x;
            let what = format!("the resistor is wound: L/R of {:.2} us", 1e6 * board.sink.inductive);
            Some((what, &[]))
        }
        _ => None,
    }
}

/// Ids of what can be wrong with one channel.
pub const DISTURBANCES: [&str; 5] = ["pickup", "drift", "cubic", "creep", "backlash"];

/// Disturbs one channel; `span` is its usual value.
pub fn disturb(id: &'static str, size: f64, channel: usize, span: f64, world: &mut World, random: &mut Rng) -> Oddity {
    let run = 250.0 * world.board.t_sw();
    let x = size * random.uniform(0.7, 1.4);
    let odd = &mut world.instruments.channels[channel].odd;
    *odd = OddChannel {
        reference: span,
        ..OddChannel::default()
    };
    let what = match id {
        "pickup" => {
            odd.pickup = (0.012 * x * span, random.uniform(1.5, 12.0) / run, random.unit());
            format!("picks up {:.3} at {:.0} Hz", odd.pickup.0, odd.pickup.1)
        }
        "drift" => {
            odd.drift = 0.03 * x * span;
            format!("drifts by {:.3} within a record", odd.drift)
        }
        "cubic" => {
            odd.cubic = 0.04 * x * span;
            format!("is off by {:.3} at {span:.2}, growing with the cube", odd.cubic)
        }
        "creep" => {
            odd.creep = ((0.2 * x).min(0.8), 0.1 * run);
            format!("creeps: {:.0} % of a step come late", 100.0 * odd.creep.0)
        }
        _ => {
            odd.backlash = (0.12 * x).min(0.5);
            format!("sticks within {:.0} % of its span", 100.0 * odd.backlash)
        }
    };
    Oddity {
        id,
        what: format!("{} {what}", CHANNELS[channel]),
        same: &[],
        channel: Some(channel),
    }
}
