//! What can be wrong with a plant file, as it happens on boards and benches: one cause, wired in one of several ways.
//!
//! The ids are the words of the diagnosis; the physics is that of the board.

use crate::independent::board::{Cable, Fall, Knee, Topology};
use crate::independent::draw::Design;
use crate::independent::instruments::{I_L, I_OUT, V_IN, V_OUT};
use crate::independent::program::World;
use crate::independent::records::Needs;
use crate::rng::Rng;

type Set = Box<dyn Fn(&mut World, f64) + Send + Sync>;

/// A number that a cause has.
pub struct Knob {
    pub name: &'static str,
    pub unit: &'static str,
    /// What the plant file has.
    pub nominal: f64,
    /// What is drawn.
    pub drawn: (f64, f64),
    /// What is possible.
    pub allowed: (f64, f64),
    /// Whether the size may have either sign around the nominal one: `drawn` is then a distance.
    pub signed: bool,
    set: Set,
}

/// A cause with its wiring.
pub struct Variant {
    pub id: &'static str,
    pub wiring: &'static str,
    pub knobs: Vec<Knob>,
    pub needs: Needs,
}

impl Variant {
    /// The world with these values.
    pub fn applied(&self, world: &World, values: &[f64]) -> World {
        let mut world = world.clone();
        for (knob, value) in self.knobs.iter().zip(values) {
            (knob.set)(&mut world, *value);
        }
        world
    }

    /// Values as they are hidden.
    pub fn draw(&self, random: &mut Rng) -> Vec<f64> {
        let mut draw = |knob: &Knob| {
            let size = random.uniform(knob.drawn.0, knob.drawn.1);
            match knob.signed {
                true if random.chance(0.5) => knob.nominal - size,
                true => knob.nominal + size,
                false => size,
            }
        };
        self.knobs.iter().map(&mut draw).collect()
    }
}

struct List(Vec<Variant>);

impl List {
    fn one(
        &mut self,
        (id, wiring): (&'static str, &'static str),
        (name, unit, nominal): (&'static str, &'static str, f64),
        drawn: (f64, f64),
        set: impl Fn(&mut World, f64) + Send + Sync + 'static,
    ) -> &mut Variant {
        let allowed = (0.0, 10.0 * drawn.1.max(nominal));
        let knob = Knob {
            name,
            unit,
            nominal,
            drawn,
            allowed,
            signed: false,
            set: Box::new(set),
        };
        self.0.push(Variant {
            id,
            wiring,
            knobs: vec![knob],
            needs: Needs::default(),
        });
        let last = self.0.len() - 1;
        &mut self.0[last]
    }
}

impl Variant {
    fn signed(&mut self) -> &mut Self {
        if let Some(knob) = self.knobs.last_mut() {
            knob.signed = true;
            knob.allowed = (knob.nominal - 10.0 * knob.drawn.1, knob.nominal + 10.0 * knob.drawn.1);
        }
        self
    }

    fn and(
        &mut self,
        (name, unit, nominal): (&'static str, &'static str, f64),
        drawn: (f64, f64),
        set: impl Fn(&mut World, f64) + Send + Sync + 'static,
    ) -> &mut Self {
        let allowed = (0.05 * drawn.0, 10.0 * drawn.1);
        self.knobs.push(Knob {
            name,
            unit,
            nominal,
            drawn,
            allowed,
            signed: false,
            set: Box::new(set),
        });
        self
    }

    fn within(&mut self, low: f64, high: f64) -> &mut Self {
        if let Some(knob) = self.knobs.last_mut() {
            knob.allowed = (low, high);
        }
        self
    }

    fn needs(&mut self, power: bool, sink: bool, rows: bool) -> &mut Self {
        self.needs = Needs { power, sink, rows };
        self
    }
}

/// Every cause that can be wired to this design.
pub fn variants(design: &Design) -> Vec<Variant> {
    let mut list = List(Vec::new());
    losses(design, &mut list);
    edges(design, &mut list);
    storage(design, &mut list);
    source(design, &mut list);
    sensors(design, &mut list);
    timing_of_sensors(design, &mut list);
    command(design, &mut list);
    sink(design, &mut list);
    list.0
}

fn losses(design: &Design, list: &mut List) {
    let stage = design.world.board.stage.clone();
    let factor = if design.world.board.topology == Topology::Buck {
        1.0
    } else {
        (1.0 - design.duty).powi(2)
    };
    let r = design.r_load() * factor;
    let more = |nominal: f64| (nominal + 0.01 * r, nominal + 0.06 * r);
    list.one(
        ("dcr", "winding"),
        ("dcr", "ohm", stage.r_winding),
        more(stage.r_winding),
        |w, x| {
            w.board.stage.r_winding = x;
        },
    );
    list.one(
        ("r_ds_on", "main switch"),
        ("r_ds_on", "ohm", stage.r_main),
        more(stage.r_main),
        |w, x| {
            w.board.stage.r_main = x;
        },
    );
    if stage.synchronous {
        let nominal = stage.r_main;
        let ratio = stage.r_second / stage.r_main;
        list.one(
            ("r_ds_on", "both switches"),
            ("r_ds_on", "ohm", nominal),
            more(nominal),
            move |w, x| {
                w.board.stage.r_main = x;
                w.board.stage.r_second = x * ratio;
            },
        );
    } else {
        let v = (
            stage.v_f + 0.01 * design.v_out,
            stage.v_f + (0.04 * design.v_out).min(1.5),
        );
        if v.1 > v.0 {
            list.one(("diode", "forward voltage"), ("v_f", "V", stage.v_f), v, |w, x| {
                w.board.stage.v_f = x
            });
        }
        list.one(
            ("diode", "resistance"),
            ("r_d", "ohm", stage.r_d),
            more(stage.r_d),
            |w, x| w.board.stage.r_d = x,
        );
    }
    list.one(
        ("core_loss", "core"),
        ("core", "S", 0.0),
        (0.005 / r, 0.04 / r),
        |w, x| w.board.stage.core = x,
    );
}

fn edges(design: &Design, list: &mut List) {
    let gates = &design.world.board.gates;
    let t = design.world.board.t_sw();
    let span = (gates.dead + 0.01 * t, gates.dead + 0.05 * t);
    list.one(
        ("dead_time", "between the switches"),
        ("dead_time", "s", gates.dead),
        span,
        |w, x| w.board.gates.dead = x,
    );
    list.one(
        ("turn_on_delay", "driver"),
        ("turn_on_delay", "s", 0.0),
        (0.01 * t, 0.05 * t),
        |w, x| w.board.gates.rise = x,
    )
    .within(0.0, 0.3 * t);
    list.one(
        ("turn_off_delay", "driver"),
        ("turn_off_delay", "s", 0.0),
        (0.01 * t, 0.05 * t),
        |w, x| {
            w.board.gates.fall = x;
        },
    )
    .within(0.0, 0.3 * t);
}

fn storage(design: &Design, list: &mut List) {
    let board = &design.world.board;
    let stage = board.stage.clone();
    let ripple = 1.0 / (8.0 * stage.c * board.gates.f_sw);
    list.one(
        ("esr", "output capacitor"),
        ("esr", "ohm", stage.esr),
        (stage.esr + 0.7 * ripple, stage.esr + 3.0 * ripple),
        |w, x| {
            w.board.stage.esr = x;
        },
    );
    if board.topology == Topology::Buck {
        let l = stage.l;
        list.one(
            ("esl", "output capacitor"),
            ("esl", "H", 0.0),
            (0.002 * l, 0.02 * l),
            |w, x| w.board.stage.esl = x,
        )
        .within(0.0, 0.1 * l);
    }
    let (c, l) = (stage.c, stage.l);
    list.one(
        ("c_wrong", "aged or of another kind"),
        ("capacitance", "F", c),
        (0.1 * c, 0.4 * c),
        |w, x| w.board.stage.c = x,
    )
    .signed()
    .within(0.1 * c, 4.0 * c);
    list.one(
        ("l_wrong", "of another lot"),
        ("inductance", "H", l),
        (0.06 * l, 0.3 * l),
        |w, x| w.board.stage.l = x,
    )
    .signed()
    .within(0.1 * l, 4.0 * l);
    for (wiring, knee) in [("ceramic", Knee::Gauss), ("film and ceramic", Knee::Power(2))] {
        let v = design.v_out;
        list.one(
            ("c_derating", wiring),
            ("derating", "1", 0.0),
            (0.25, 0.6),
            move |w, x| {
                w.board.stage.c_fall = Some(Fall { share: x, at: v, knee });
            },
        )
        .within(0.0, 0.9)
        .and(("v_half", "V", v), (0.5 * v, 1.3 * v), |w, x| {
            if let Some(fall) = &mut w.board.stage.c_fall {
                fall.at = x;
            }
        });
    }
    for (wiring, knee) in [
        ("ferrite", Knee::Power(4)),
        ("powder", Knee::Tanh),
        ("powder, soft", Knee::Power(2)),
    ] {
        let i = design.i_l();
        list.one(
            ("l_saturation", wiring),
            ("saturation", "1", 0.0),
            (0.25, 0.6),
            move |w, x| {
                w.board.stage.l_fall = Some(Fall { share: x, at: i, knee });
            },
        )
        .within(0.0, 0.9)
        .and(("i_sat", "A", i), (0.6 * i, 1.4 * i), |w, x| {
            if let Some(fall) = &mut w.board.stage.l_fall {
                fall.at = x;
            }
        });
    }
}

fn source(design: &Design, list: &mut List) {
    let board = &design.world.board;
    let (v, f) = (board.source.v, board.gates.f_sw);
    list.one(
        ("v_in_wrong", "supply"),
        ("v_in", "V", v),
        (0.01 * v, 0.08 * v),
        |w, x| w.board.source.v = x,
    )
    .signed();
    let r = v * v / (design.v_out * design.i_out);
    list.one(
        ("source_impedance", "leads"),
        ("resistance", "ohm", 0.0),
        (0.008 * r, 0.05 * r),
        |w, x| w.board.source.r = x,
    );
    // an input filter that swings between a fifth and a twentieth of the switching frequency
    let z = 0.1 * r;
    let swing = 10.0 / (2.0 * std::f64::consts::PI * f);
    list.one(
        ("source_impedance", "leads and input filter"),
        ("resistance", "ohm", 0.0),
        (0.008 * r, 0.05 * r),
        move |w, x| {
            let source = &mut w.board.source;
            (source.r, source.esr) = (x, 0.02 * r);
        },
    )
    .and(("inductance", "H", 0.0), (0.5 * z * swing, 1.5 * z * swing), |w, x| {
        w.board.source.l = x
    })
    .and(("c_in", "F", 0.0), (0.5 * swing / z, 1.5 * swing / z), |w, x| {
        w.board.source.c = x
    })
    .needs(false, false, true);
    list.one(
        ("input_ripple", "rectified mains"),
        ("ripple", "V", 0.0),
        (0.004 * v, 0.02 * v),
        |w, x| {
            w.board.source.ripple.0 = x;
        },
    )
    .and(
        ("ripple_frequency", "Hz", 100.0),
        ((f / 250.0).max(100.0), (f / 80.0).max(360.0)),
        |w, x| {
            w.board.source.ripple.1 = x;
        },
    )
    .and(("ripple_phase", "1", 0.0), (0.0, 1.0), |w, x| {
        w.board.source.ripple.2 = x
    })
    .within(-2.0, 2.0)
    .needs(false, false, true);
}

fn sensors(design: &Design, list: &mut List) {
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

fn timing_of_sensors(design: &Design, list: &mut List) {
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

fn command(design: &Design, list: &mut List) {
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
    let _ = design;
}

fn sink(design: &Design, list: &mut List) {
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
