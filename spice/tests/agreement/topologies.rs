//! The cases of the boost and of the inverting buck-boost: the buck's effects at benches of their own.

use plant::{Parameters, Rectifier, Topology};

use crate::cases::{Bench, Case, Effect, base, effects, everything_but_esl};

fn converter(topology: Topology) -> Parameters {
    let mut p = base();
    (p.converter.topology, p.converter.v_in) = (topology, 100.0);
    p
}

/// Duties that bring no current at which the drop of a conducting switch opens its body diode as well: the plant's paths
/// conduct one at a time.
const SMALL_CURRENTS: [f64; 4] = [0.46, 0.51, 0.44, 0.49];
/// The switch hardly works, so that what the diode does by itself shows.
const HARDLY: [f64; 4] = [0.0, 0.03, 0.0, 0.0];

/// What only a leg between inductor and output can do: the output starts below the source, and the current begins by itself
/// while the switch is off.
fn of_the_boost() -> Vec<Effect> {
    let effect = |name, change| Effect {
        name,
        light: true,
        change,
        // the output rests a diode's drop below the source, and that of ngspice changes by 1.3 mV with each factor e
        bounds: [4e-3, 2e-3, 4e-3],
    };
    vec![
        effect("output below the source", |p| p.converter.v_in = 202.0),
        effect("output below the source, ESR", |p| {
            (p.converter.v_in, p.capacitor.esr) = (202.0, 0.1);
        }),
        effect("output below the source, dead time", |p| {
            (p.converter.v_in, p.converter.rectifier) = (202.0, Rectifier::Synchronous);
            p.switch.dead_time = 2e-6;
        }),
    ]
}

/// All of them.
pub fn all() -> Vec<Case> {
    let boost = Bench {
        prefix: "boost: ",
        parameters: converter(Topology::Boost),
        v_out: 200.0,
        i_l: 1.8,
        loads: (130.0, 600.0),
        powers: (40.0, 40.0),
        light: [0.31, 0.44, 0.1, 0.49],
    };
    let buck_boost = Bench {
        prefix: "buck-boost: ",
        parameters: converter(Topology::BuckBoost),
        v_out: 100.0,
        loads: (65.0, 300.0),
        powers: (20.0, 20.0),
        ..boost.clone()
    };
    let mut cases = Vec::new();
    for bench in [&boost, &buck_boost] {
        for effect in effects() {
            cases.extend(of_the_buck(bench, effect));
        }
    }
    let bench = Bench { light: HARDLY, ..boost };
    cases.extend(of_the_boost().iter().map(|effect| bench.case(effect)));
    cases
}

/// An effect of the buck's list at another bench, if there is one.
fn of_the_buck(bench: &Bench, mut effect: Effect) -> Option<Case> {
    let mut tried = bench.parameters.clone();
    (effect.change)(&mut tried);
    // no inductance of the capacitor where the leg interrupts its current (`plant::check`)
    if tried.capacitor.esl > 0.0 {
        if effect.name != "everything" {
            return None;
        }
        effect.change = everything_but_esl;
    }
    let [v, i, extremes] = effect.bounds;
    effect.bounds = [v.max(2e-3), i.max(2e-3), extremes];
    let light = match tried.converter.rectifier {
        Rectifier::Synchronous => SMALL_CURRENTS,
        Rectifier::Diode => bench.light,
    };
    let mut case = Bench { light, ..bench.clone() }.case(&effect);
    let p = &mut case.parameters;
    if p.converter.rectifier == Rectifier::Synchronous && p.switch.dead_time == 0.0 {
        // both gates of ngspice are half on for parts of a nanosecond, and source and output then meet in 0.1 ohm: without
        // dead time single edges cost the output up to 0.1 V
        p.switch.dead_time = 20e-9;
    }
    Some(case)
}
