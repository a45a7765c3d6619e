//! A converter as somebody might have built it, and what is done with it at the bench.

use std::f64::consts::PI;

use crate::independent::board::{Board, Carrier, Gates, Load, Odd, Sink, Source, Stage, Topology};
use crate::independent::instruments::{Channel, I_L, I_OUT, Instruments, V_IN, V_OUT};
use crate::independent::program::World;
use crate::rng::Rng;

/// A converter as its builder believes it to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    pub world: World,
    /// Nominal duty, and what comes out of it.
    pub duty: f64,
    pub v_out: f64,
    pub i_out: f64,
    /// Switching periods in a swing of the output filter.
    pub swing: f64,
    /// Load resistance over the filter's characteristic one.
    pub quality: f64,
    /// Whether the plant file says how large the noise is.
    pub noise_stated: bool,
}

impl Design {
    pub fn r_load(&self) -> f64 {
        self.v_out / self.i_out
    }

    /// Mean current of the inductor at the nominal point.
    pub fn i_l(&self) -> f64 {
        match self.world.board.topology {
            Topology::Buck => self.i_out,
            _ => self.i_out / (1.0 - self.duty),
        }
    }
}

/// Draws one of a topology.
pub fn design(topology: Topology, random: &mut Rng) -> Design {
    let f_sw = 1e3 * libm::round(random.log_uniform(20.0, 1000.0));
    let (v_in, duty, v_out, i_out) = ratings(topology, random);
    let i_l = if topology == Topology::Buck {
        i_out
    } else {
        i_out / (1.0 - duty)
    };
    let synchronous = v_out < 4.0 || random.chance(0.5);
    let share = if !synchronous && random.chance(0.25) {
        random.uniform(1.2, 3.0)
    } else {
        random.uniform(0.15, 0.6)
    };
    let volts = if topology == Topology::Buck {
        v_out * (1.0 - duty)
    } else {
        v_in * duty
    };
    let l = round(volts / (f_sw * share * i_l), 2);
    let factor = if topology == Topology::Buck {
        1.0
    } else {
        (1.0 - duty).powi(2)
    };
    let swing = random.uniform(10.0, 30.0);
    let mut c = factor * (swing / (2.0 * PI * f_sw)).powi(2) / l;
    if topology != Topology::Buck {
        c = c.max(i_out * duty / (0.05 * v_out * f_sw));
    }
    c = round(c, 2);
    let stage = stage(topology, (l, c, synchronous), (v_out, i_out, duty, f_sw), random);
    let board = Board {
        topology,
        stage,
        gates: gates(f_sw, synchronous, random),
        source: Source {
            v: v_in,
            r: 0.0,
            l: 0.0,
            c: 0.0,
            esr: 0.0,
            ripple: (0.0, 100.0, 0.0),
            hunting: (0.0, 100.0),
        },
        sink: Sink {
            gain: 1.0,
            resistor: 1.0,
            bleed: 0.0,
            tau: round(random.uniform(0.5, 5.0) / f_sw, 2),
            fold: round(random.uniform(0.1, 0.3) * v_out, 2),
            inductive: 0.0,
            cable: None,
        },
        odd: Odd::default(),
    };
    let swing = 2.0 * PI * (l * c / factor).sqrt() * f_sw;
    let instruments = instruments(&board, v_out, (i_l, i_out), random);
    let quality = v_out / i_out * (c * factor / l).sqrt();
    Design {
        world: World { board, instruments },
        duty,
        v_out,
        i_out,
        swing,
        quality,
        noise_stated: random.chance(0.8),
    }
}

/// Voltages, duty and current.
fn ratings(topology: Topology, random: &mut Rng) -> (f64, f64, f64, f64) {
    let (v_in, duty, v_out) = loop {
        let v_in = round(random.log_uniform(3.3, 400.0), 2);
        let duty = match topology {
            Topology::Buck => random.uniform(0.15, 0.8),
            _ => random.uniform(0.2, 0.65),
        };
        let v_out = v_in * ratio(topology, duty);
        if (1.0..=400.0).contains(&v_out) {
            break (v_in, duty, v_out);
        }
    };
    loop {
        let i = random.log_uniform(0.5, 20.0);
        // below 50 mohm and beyond 2 kW other circuits are built
        if v_out / i > 0.1 && v_out * i < 2000.0 {
            break (v_in, duty, v_out, i);
        }
    }
}

fn ratio(topology: Topology, duty: f64) -> f64 {
    match topology {
        Topology::Buck => duty,
        Topology::Boost => 1.0 / (1.0 - duty),
        Topology::BuckBoost => duty / (1.0 - duty),
    }
}

/// Devices with losses of a few percent of the rated power.
fn stage(
    topology: Topology,
    (l, c, synchronous): (f64, f64, bool),
    (v_out, i_out, duty, f_sw): (f64, f64, f64, f64),
    random: &mut Rng,
) -> Stage {
    let factor = if topology == Topology::Buck {
        1.0
    } else {
        (1.0 - duty).powi(2)
    };
    let r = v_out / i_out * factor;
    let (low, high) = match (synchronous, v_out < 60.0) {
        (true, _) => (0.6, 1.0),
        (false, true) => (0.3, 0.6),
        (false, false) => (0.7, 1.3),
    };
    let esr = (random.uniform(0.1, 1.0) / (8.0 * c * f_sw)).min(0.02 * v_out / i_out);
    Stage {
        l,
        l_fall: None,
        r_winding: round(random.uniform(0.003, 0.02) * r, 2),
        core: 0.0,
        c,
        c_fall: None,
        esr: round(esr, 2),
        esl: 0.0,
        r_main: round(random.uniform(0.003, 0.02) * r, 2),
        r_second: if synchronous {
            round(random.uniform(0.003, 0.015) * r, 2)
        } else {
            0.0
        },
        v_f: round(random.uniform(low, high), 2),
        r_d: round(random.uniform(0.001, 0.006) * r, 2),
        synchronous,
    }
}

fn gates(f_sw: f64, synchronous: bool, random: &mut Rng) -> Gates {
    let carrier = [Carrier::Trailing, Carrier::Leading, Carrier::Centre][random.below(3)];
    Gates {
        f_sw,
        carrier,
        dead: if synchronous {
            round(random.uniform(0.003, 0.02) / f_sw, 2)
        } else {
            0.0
        },
        rise: 0.0,
        fall: 0.0,
        recovery: 0.0,
        node: 0.0,
        offset: 0.0,
        lsb: 0.0,
        late: 0,
        jitter: 0.0,
        dither: (0.0, 2.0),
        lost: 0.0,
    }
}

fn instruments(board: &Board, v_out: f64, (i_l, i_out): (f64, f64), random: &mut Rng) -> Instruments {
    let t_sw = board.t_sw();
    let ripple_share = random.uniform(0.002, 0.008);
    let mut channels = [
        Channel::ideal(round(random.log_uniform(2e-4, 2e-3) * v_out, 1)),
        Channel::ideal(round(ripple_share * i_l, 1)),
        Channel::ideal(round(ripple_share * i_out, 1)),
        Channel::ideal(round(random.log_uniform(2e-4, 1e-3) * board.source.v, 1)),
        Channel::ideal(0.0),
        Channel::ideal(0.0),
    ];
    // one converter card for all, or a filter in front of some
    let filtered = random.chance(0.4);
    let (card, fine) = (random.chance(0.4), random.uniform(2048.0, 8192.0));
    for channel in &mut channels[..4] {
        if filtered && random.chance(0.7) {
            channel.low_pass = round(random.uniform(0.03, 0.4) * t_sw, 2);
        }
    }
    if card {
        for (index, span) in [(V_OUT, v_out), (I_L, i_l), (I_OUT, i_out), (V_IN, board.source.v)] {
            channels[index].lsb = round(2.0 * span / fine, 2);
        }
    }
    channels[I_L].recorded = random.chance(0.8);
    channels[I_OUT].recorded = random.chance(0.5);
    channels[V_IN].recorded = random.chance(0.4);
    channels[V_OUT].recorded = !channels[I_L].recorded || random.chance(0.95);
    (channels[4].recorded, channels[5].recorded) = (false, false);
    let phase = match random.below(3) {
        0 => 0.0,
        1 => 0.5,
        _ => round(random.uniform(0.05, 0.95), 2),
    };
    Instruments {
        channels,
        phase,
        late: 0.0,
    }
}

/// To so many digits: what a data sheet says.
pub fn round(x: f64, digits: i32) -> f64 {
    if x == 0.0 {
        return 0.0;
    }
    let scale = libm::pow(10.0, f64::from(digits - 1) - libm::floor(libm::log10(x.abs())));
    libm::round(x * scale) / scale
}

/// A load of the bench, as a share of the rated current at the rated voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Resistor,
    Current,
    Power,
}

/// A resistor beside what is asked for, so that the open loop is stable.
pub fn load(design: &Design, kind: Kind, share: f64) -> Load {
    let (v, i) = (design.v_out, design.i_out);
    match kind {
        Kind::Resistor => Load {
            g: round(share * i / v, 3),
            ..Load::default()
        },
        Kind::Current => Load {
            g: round(0.3 * i / v, 3),
            i: round((share - 0.3).max(0.05) * i, 3),
            p: 0.0,
        },
        Kind::Power => Load {
            g: round(0.5 * i / v, 3),
            i: 0.0,
            p: round((share - 0.5).max(0.05) * 0.6 * v * i, 3),
        },
    }
}
