//! Boost and buck-boost against closed forms, and each way of computing them against the others. Formulas: Erickson and
//! Maksimovic, Fundamentals of Power Electronics, chapters 2, 3 and 5.

#![allow(clippy::unwrap_used)] // helpers of tests stand outside of #[test] functions

use plant::{Batch, Load, Model, Parameters, Plant, Rectifier, Sample, Topology};

const OTHERS: [Topology; 2] = [Topology::Boost, Topology::BuckBoost];

/// 100 V to 200 V, or to -100 V: a duty of 0.5 each.
fn converter(topology: Topology, rectifier: Rectifier) -> Parameters {
    let mut p = Parameters::ideal(100.0, 2e-3, 150e-6, 10e3);
    (p.converter.topology, p.converter.rectifier) = (topology, rectifier);
    p
}

fn v_out(topology: Topology) -> f64 {
    if topology == Topology::Boost { 200.0 } else { 100.0 }
}

fn run(p: &Parameters, load: &Load) -> Vec<Sample> {
    let mut plant = Plant::new(p).unwrap();
    plant.reset_at(v_out(p.converter.topology), 3.0, load);
    let duty = |n: usize| [0.5, 0.533, 0.46, 0.3, 0.51, 0.0][n / 2 % 6];
    (0..40).map(|n| plant.step(duty(n), load)).collect()
}

fn largest(a: &[Sample], b: &[Sample]) -> f64 {
    let both = a.iter().zip(b);
    both.map(|(a, b)| (a.v_out - b.v_out).abs().max((a.i_l - b.i_l).abs()))
        .fold(0.0, f64::max)
}

const LOADS: [Load; 3] = [
    Load {
        conductance: 0.02,
        current: 0.5,
        power: 50.0,
    },
    Load {
        conductance: 1e-3,
        current: 0.0,
        power: 0.0,
    },
    Load {
        conductance: 0.0,
        current: 0.0,
        power: 300.0,
    },
];

#[test]
fn dcm_conversion_ratios_are_the_closed_forms() {
    // table 5.2, K = 2 L / (R T): boost (1 + sqrt(1 + 4 D^2 / K)) / 2, buck-boost D / sqrt(K)
    for topology in OTHERS {
        let mut p = converter(topology, Rectifier::Diode);
        p.converter.capacitance = 1e-2;
        let (r, d) = (600.0, 0.4);
        let k = 2.0 * p.converter.inductance / (r * p.t_sw());
        let ratio = match topology {
            Topology::Boost => 0.5 * (1.0 + (1.0 + 4.0 * d * d / k).sqrt()),
            _ => d / k.sqrt(),
        };
        let mut plant = Plant::new(&p).unwrap();
        plant.reset_at(100.0 * ratio, 0.0, &Load::resistor(r));
        let (sample, rests) = plant.rest(d, &Load::resistor(r));
        let mean = 0.5 * (sample.v_min + sample.v_max) / 100.0;
        assert!(
            rests && sample.discontinuous && sample.i_l == 0.0,
            "{topology:?} {sample:?}"
        );
        assert!((mean / ratio - 1.0).abs() < 1e-4, "{topology:?}: {mean} {ratio}");
    }
}

#[test]
fn settled_duties_follow_the_balance_of_volts_and_seconds() {
    for topology in OTHERS {
        for rectifier in [Rectifier::Diode, Rectifier::Synchronous] {
            let mut p = converter(topology, rectifier);
            // hardly any ripple, so that products of means are means of products
            (p.converter.inductance, p.converter.capacitance) = (40e-3, 20e-3);
            (p.inductor.dcr, p.switch.r_ds_on, p.switch.r_ds_on_low) = (0.1, 0.2, 0.15);
            (p.switch.v_f, p.switch.r_d) = (0.8, 0.05);
            let (drop, r) = match rectifier {
                Rectifier::Diode => (0.8, 0.05),
                Rectifier::Synchronous => (0.0, 0.15),
            };
            let (v, i_out) = (v_out(topology), 2.0);
            let settled = Plant::new(&p).unwrap().settle(v, &Load::current(i_out));
            let (d, other) = (settled.duty, 1.0 - settled.duty);
            let i = i_out / other;
            let source = if topology == Topology::Boost { 100.0 } else { 0.0 };
            let volts = d * (100.0 - 0.2 * i) + other * (source - drop - r * i - v) - 0.1 * i;
            assert!(
                settled.converged && volts.abs() < 5e-3,
                "{topology:?} {rectifier:?} {settled:?}: {volts} V"
            );
        }
    }
}

#[test]
fn settle_holds_every_load_in_both_conductions() {
    for topology in OTHERS {
        for rectifier in [Rectifier::Diode, Rectifier::Synchronous] {
            for load in LOADS {
                for delay in [0, 1] {
                    let mut p = converter(topology, rectifier);
                    p.pwm.duty_delay = delay;
                    let mut plant = Plant::new(&p).unwrap();
                    let settled = plant.settle(v_out(topology), &load);
                    let off = (plant.sample().v_out - v_out(topology)).abs();
                    assert!(
                        settled.converged && off < 1e-6,
                        "{topology:?} {rectifier:?} {load:?} {settled:?} {off}"
                    );
                }
            }
        }
    }
}

#[test]
fn what_the_source_delivers_is_stored_or_drawn() {
    // from samples alone: at rest and without losses v_in times the mean source current is the power of the load
    for topology in OTHERS {
        let p = converter(topology, Rectifier::Synchronous);
        let v = v_out(topology);
        let mut plant = Plant::new(&p).unwrap();
        let settled = plant.settle(v, &Load::current(2.0));
        let sample = plant.step(settled.duty, &Load::current(2.0));
        let (mean_i, mean_v) = (0.5 * (sample.i_min + sample.i_max), 0.5 * (sample.v_min + sample.v_max));
        let share = if topology == Topology::Boost { 1.0 } else { settled.duty };
        let (given, taken) = (100.0 * share * mean_i, mean_v * 2.0);
        assert!((given / taken - 1.0).abs() < 2e-3, "{topology:?}: {given} W, {taken} W");
    }
}

#[test]
fn all_ways_compute_the_same_converter() {
    for topology in OTHERS {
        for rectifier in [Rectifier::Diode, Rectifier::Synchronous] {
            for load in [LOADS[0], LOADS[1], Load::current(1.0)] {
                let p = converter(topology, rectifier);
                let fast = run(&p, &load);
                // a turn-on delay of a femtosecond asks for the general way, an ESR of a picoohm for that of all states
                let (mut walk, mut full) = (p.clone(), p.clone());
                walk.switch.turn_on_delay = 1e-15;
                full.capacitor.esr = 1e-12;
                for (name, way) in [("walk", &walk), ("full", &full)] {
                    let far = largest(&fast, &run(way, &load));
                    assert!(far < 1e-5, "{topology:?} {rectifier:?} {load:?} {name}: {far}");
                }
            }
        }
    }
}

#[test]
fn a_batch_of_all_topologies_gives_the_bits_of_the_plants() {
    let kinds: Vec<_> = [Topology::Buck, Topology::Boost, Topology::BuckBoost]
        .into_iter()
        .flat_map(|topology| [Rectifier::Diode, Rectifier::Synchronous].map(|rectifier| converter(topology, rectifier)))
        .collect();
    let all: Vec<_> = (0..24).map(|n| kinds[n * 5 % 6].clone()).collect();
    let mut batch = Batch::new(&all).unwrap();
    let mut plants: Vec<_> = all.iter().map(|p| Plant::new(p).unwrap()).collect();
    let loads: Vec<_> = (0..24).map(|n| LOADS[n % 3]).collect();
    for (n, plant) in plants.iter_mut().enumerate() {
        plant.reset_at(120.0, n as f64 - 4.0, &loads[n]);
        batch.reset_at(n, 120.0, n as f64 - 4.0, &loads[n]);
    }
    for step in 0..200 {
        let duties: Vec<_> = (0..24)
            .map(|n| [0.5, 0.44, 0.3, 0.0, 0.55, 0.05][(step + n) % 6])
            .collect();
        batch.step(&duties, &loads);
        for (n, plant) in plants.iter_mut().enumerate() {
            let sample = plant.step(duties[n], &loads[n]);
            let bits = (sample.v_out.to_bits(), sample.i_l.to_bits());
            assert_eq!(
                bits,
                (batch.v_out()[n].to_bits(), batch.i_l()[n].to_bits()),
                "{step} {n} {sample:?}"
            );
        }
    }
}

#[test]
fn the_averaged_model_is_the_mean_of_both_positions() {
    for topology in OTHERS {
        let mut p = converter(topology, Rectifier::Synchronous);
        p.converter.model = Model::Averaged;
        let mut plant = Plant::new(&p).unwrap();
        let load = LOADS[0];
        let (mut i, mut v) = (3.0, v_out(topology) - 2.0);
        plant.reset_at(v, i, &load);
        for n in 0..10 {
            let d = [0.5, 0.47, 0.56][n % 3];
            let sample = plant.step(d, &load);
            let source = if topology == Topology::Boost { 100.0 } else { 100.0 * d };
            for _ in 0..20_000 {
                let slopes = |i: f64, v: f64| {
                    let drawn = load.conductance * v + load.current + load.power / v;
                    ((source - (1.0 - d) * v) / 2e-3, ((1.0 - d) * i - drawn) / 150e-6)
                };
                let (di, dv) = slopes(i, v);
                let (di, dv) = slopes(i + 2.5e-9 * di, v + 2.5e-9 * dv);
                (i, v) = (i + 5e-9 * di, v + 5e-9 * dv);
            }
            assert!(
                (sample.v_out - v).abs() < 1e-6 && (sample.i_l - i).abs() < 1e-6,
                "{topology:?} {n} {sample:?}"
            );
        }
    }
}

#[test]
fn the_averaged_model_knows_what_an_esr_costs() {
    // the output stands against the inductor while it receives the current, and is then higher by esr i_l: in the mean this
    // is a resistance of esr d (1 - d), here 0.3 V of 200 V
    for topology in OTHERS {
        let mean = |model: Model| {
            let mut p = converter(topology, Rectifier::Synchronous);
            (p.converter.model, p.capacitor.esr) = (model, 0.3);
            // hardly any ripple but the jump at the edges
            (p.converter.inductance, p.converter.capacitance) = (40e-3, 20e-3);
            let (mut plant, load) = (Plant::new(&p).unwrap(), Load::current(2.0));
            plant.reset_at(v_out(topology), 4.0, &load);
            let (sample, rests) = plant.rest(0.5, &load);
            assert!(rests, "{topology:?} {model:?}");
            // at a duty of 0.5 the output is as long above its mean as below
            0.5 * (sample.v_min + sample.v_max)
        };
        let (averaged, switched) = (mean(Model::Averaged), mean(Model::Switched));
        let lost = v_out(topology) - averaged;
        assert!(
            (averaged - switched).abs() < 0.01 && lost > 0.2,
            "{topology:?}: {averaged} {switched}"
        );
    }
}

#[test]
fn the_output_of_a_boost_comes_up_to_the_source_by_itself() {
    for (rectifier, esr) in [(Rectifier::Diode, 0.0), (Rectifier::Diode, 0.05)] {
        let mut p = converter(Topology::Boost, rectifier);
        (p.switch.v_f, p.inductor.dcr, p.capacitor.esr) = (0.8, 0.5, esr);
        let load = Load::resistor(100.0);
        let mut plant = Plant::new(&p).unwrap();
        plant.reset_at(0.0, 0.0, &load);
        let last = (0..3000).map(|_| plant.step(0.0, &load)).last().unwrap();
        let expected = (100.0 - 0.8) * 100.0 / 100.5;
        assert!((last.v_out - expected).abs() < 1e-3, "{esr}: {last:?}");
        // from above it falls until the diode takes over, without a step
        plant.reset_at(103.0, 0.0, &load);
        let mut lowest = f64::INFINITY;
        for _ in 0..3000 {
            lowest = plant.step(0.0, &load).v_min.min(lowest);
        }
        assert!(
            lowest > 90.0 && (plant.sample().v_out - expected).abs() < 1e-3,
            "{lowest} {:?}",
            plant.sample()
        );
    }
}

#[test]
fn an_inductance_of_the_capacitor_is_refused_with_its_reason() {
    for topology in OTHERS {
        let mut p = converter(topology, Rectifier::Diode);
        p.capacitor.esl = 1e-8;
        let said = Plant::new(&p).unwrap_err().to_string();
        assert!(
            said.contains(topology.word()) && said.contains("interrupts the current"),
            "{said}"
        );
    }
}

#[test]
fn a_file_names_the_topology_and_other_tools_refuse_it_with_its_line() {
    let text = "[converter]\ntopology = \"buck-boost\"\nv_in = 24\ninductance = 1e-4\ncapacitance = 1e-4\nf_sw = 1e5\n";
    let file = std::path::Path::new("plant.toml");
    let p = Parameters::from_toml(file, text).unwrap();
    assert_eq!(p.converter.topology, Topology::BuckBoost);
    let said = p.require_buck("`drm fit`").unwrap_err().to_string();
    assert!(said.contains("drm fit") && said.contains("buck-boost"), "{said}");
    let wrong = Parameters::from_toml(file, &text.replace("buck-boost", "bost"))
        .unwrap_err()
        .to_string();
    assert!(
        wrong.contains("plant.toml:2:") && wrong.contains("did you mean \"boost\"?"),
        "{wrong}"
    );
}
