//! The integrator against closed forms, and cases against themselves.

use crate::independent::board::{Board, Carrier, Fall, Gates, Knee, Load, Odd, Sink, Source, Stage, Topology};
use crate::independent::circuit::Nodes;
use crate::independent::set::make;
use crate::independent::simulate::{Period, STEPS, Trace, run};
use crate::independent::truth::Family;
use crate::rng::Rng;

/// 24 V, 100 kHz, 22 uH, 47 uF, without any loss.
fn ideal(topology: Topology) -> Board {
    Board {
        topology,
        stage: Stage {
            l: 22e-6,
            l_fall: None,
            r_winding: 0.0,
            core: 0.0,
            c: 47e-6,
            c_fall: None,
            esr: 0.0,
            esl: 0.0,
            r_main: 0.0,
            r_second: 0.0,
            v_f: 0.0,
            r_d: 0.0,
            synchronous: true,
        },
        gates: Gates {
            f_sw: 100e3,
            carrier: Carrier::Trailing,
            dead: 0.0,
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
        },
        source: Source {
            v: 24.0,
            r: 0.0,
            l: 0.0,
            c: 0.0,
            esr: 0.0,
            ripple: (0.0, 1.0, 0.0),
            hunting: (0.0, 1.0),
        },
        sink: Sink {
            gain: 1.0,
            resistor: 1.0,
            bleed: 0.0,
            tau: 0.0,
            fold: 1.0,
            inductive: 0.0,
            cable: None,
        },
        odd: Odd::default(),
    }
}

fn settled(board: &Board, duty: f64, load: Load, steps: usize) -> Trace {
    let period = Period { duty, load, after: 0.0 };
    let whole = run(board, &[period; 4], steps, &mut Rng::new(0, &[]));
    let from = whole.t.partition_point(|t| *t < 2.0 * board.t_sw() - 1e-12);
    Trace {
        t: whole.t[from..].to_vec(),
        nodes: whole.nodes[from..].to_vec(),
    }
}

fn mean(trace: &Trace, of: impl Fn(&Nodes) -> f64) -> f64 {
    let span = trace.t[trace.t.len() - 1] - trace.t[0];
    let area: f64 = (1..trace.t.len())
        .map(|n| 0.5 * (trace.t[n] - trace.t[n - 1]) * (of(&trace.nodes[n]) + of(&trace.nodes[n - 1])))
        .sum();
    area / span
}

fn swing(trace: &Trace, of: impl Fn(&Nodes) -> f64) -> f64 {
    let values = trace.nodes.iter().map(of);
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(x), high.max(x)));
    high - low
}

fn resistor(ohm: f64) -> Load {
    Load {
        g: 1.0 / ohm,
        ..Load::default()
    }
}

#[test]
fn ratios_are_those_of_the_three_topologies() {
    for (topology, ratio) in [
        (Topology::Buck, 0.4),
        (Topology::Boost, 1.0 / 0.6),
        (Topology::BuckBoost, 0.4 / 0.6),
    ] {
        // a large capacitor: the ripple of a boost moves its mean
        let mut board = ideal(topology);
        board.stage.c = 1e-3;
        let v = mean(&settled(&board, 0.4, resistor(8.0), STEPS), |n| n.v_out);
        assert!((v / 24.0 - ratio).abs() < 2e-4 * ratio, "{topology:?}: {}", v / 24.0);
    }
}

#[test]
fn a_buck_falls_by_its_resistances_and_its_lost_duty() {
    let mut board = ideal(Topology::Buck);
    (board.stage.r_winding, board.stage.r_main, board.stage.r_second) = (0.05, 0.03, 0.03);
    let v = mean(
        &settled(
            &board,
            0.4,
            Load {
                i: 2.0,
                ..Load::default()
            },
            STEPS,
        ),
        |n| n.v_out,
    );
    assert!((v - (0.4 * 24.0 - 2.0 * 0.08)).abs() < 1e-4, "{v}");
    // a diode leg that turns on 200 ns late loses 2 % of the source and has its diode that much longer
    let mut late = ideal(Topology::Buck);
    (late.stage.synchronous, late.stage.v_f, late.gates.rise) = (false, 0.7, 200e-9);
    let v = mean(
        &settled(
            &late,
            0.4,
            Load {
                i: 2.0,
                ..Load::default()
            },
            STEPS,
        ),
        |n| n.v_out,
    );
    assert!((v - (0.38 * 24.0 - 0.62 * 0.7)).abs() < 1e-4, "{v}");
}

/// The node falls along a ramp from the source's voltage to the diode's, while the inductor discharges it, unless a switch pulls it down.
#[test]
fn capacitance_of_the_node_adds_half_its_fall_to_the_duty() {
    let load = Load {
        i: 2.0,
        ..Load::default()
    };
    let volts = |synchronous, v_f| {
        let mut board = ideal(Topology::Buck);
        (board.stage.synchronous, board.stage.v_f) = (synchronous, v_f);
        (board.stage.l, board.gates.node) = (2.2e-3, 20e-9);
        mean(&settled(&board, 0.4, load, 400), |n| n.v_out)
    };
    for v_f in [0.0, 2.0] {
        let fall = 20e-9 * (24.0 + v_f) / 2.0;
        let v = 24.0 * 0.4 - 0.6 * v_f + 0.5 * fall * 100e3 * (24.0 + v_f);
        assert!((volts(false, v_f) - v).abs() < 0.03, "{} {v}", volts(false, v_f));
    }
    assert!((volts(true, 0.0) - 9.6).abs() < 1e-3, "{}", volts(true, 0.0));
}

#[test]
fn ripples_are_those_of_the_textbook() {
    let board = ideal(Topology::Buck);
    let trace = settled(&board, 0.4, resistor(4.0), 400);
    let current = 9.6 * 0.6 / (22e-6 * 100e3);
    assert!(
        (swing(&trace, |n| n.i_l) / current - 1.0).abs() < 2e-3,
        "{}",
        swing(&trace, |n| n.i_l)
    );
    let volts = current / (8.0 * 47e-6 * 100e3);
    assert!(
        (swing(&trace, |n| n.v_out) / volts - 1.0).abs() < 5e-3,
        "{}",
        swing(&trace, |n| n.v_out)
    );
}

#[test]
fn discontinuous_conduction_has_the_ratio_of_its_quadratic() {
    let mut board = ideal(Topology::Buck);
    (board.stage.synchronous, board.stage.c) = (false, 470e-6);
    let (duty, ohm) = (0.4, 60.0);
    let k = 2.0 * board.stage.l / (ohm * board.t_sw());
    let ratio = 2.0 / (1.0 + (1.0 + 4.0 * k / (duty * duty)).sqrt());
    let trace = settled(&board, duty, resistor(ohm), STEPS);
    let v = mean(&trace, |n| n.v_out);
    assert!((v / 24.0 / ratio - 1.0).abs() < 1e-3, "{} {ratio}", v / 24.0);
    assert!(trace.nodes.iter().any(|n| n.i_l == 0.0));
}

#[test]
fn power_that_goes_in_comes_out_or_warms_the_copper() {
    for topology in [Topology::Buck, Topology::Boost, Topology::BuckBoost] {
        let mut board = ideal(topology);
        (board.stage.r_winding, board.stage.r_main, board.stage.r_second) = (0.05, 0.02, 0.02);
        board.stage.l_fall = Some(Fall {
            share: 0.4,
            at: 3.0,
            knee: Knee::Power(2),
        });
        let trace = settled(&board, 0.4, resistor(8.0), 400);
        let into = mean(&trace, |n| n.v_in * n.i_in);
        let out = mean(&trace, |n| n.v_out * n.i_out) + 0.07 * mean(&trace, |n| n.i_l * n.i_l);
        assert!((into / out - 1.0).abs() < 2e-3, "{topology:?}: {into} {out}");
    }
}

#[test]
fn the_filter_swings_with_its_own_period() {
    let mut board = ideal(Topology::Buck);
    board.stage.c = 4.7e-4;
    let load = Load {
        i: 1.0,
        ..Load::default()
    };
    let periods: Vec<Period> = (0..60)
        .map(|k| Period {
            duty: if k < 4 { 0.4 } else { 0.45 },
            load,
            after: 0.0,
        })
        .collect();
    let trace = run(&board, &periods, STEPS, &mut Rng::new(0, &[]));
    let (at, peak) =
        trace.nodes.iter().enumerate().fold(
            (0, 0.0),
            |best, (n, nodes)| {
                if nodes.v_out > best.1 { (n, nodes.v_out) } else { best }
            },
        );
    let half = std::f64::consts::PI * (22e-6_f64 * 4.7e-4).sqrt();
    assert!(
        (trace.t[at] - 4e-5 - half).abs() < 0.03 * half,
        "{} {half}",
        trace.t[at]
    );
    assert!((peak - (0.4 * 24.0 + 2.0 * 0.05 * 24.0)).abs() < 0.03, "{peak}");
}

#[test]
fn a_diode_lets_no_current_back_beside_a_lossy_core() {
    let mut board = ideal(Topology::Buck);
    (board.stage.synchronous, board.stage.v_f, board.stage.core) = (false, 0.5, 0.01);
    let trace = settled(&board, 0.2, resistor(100.0), STEPS);
    let least = trace.nodes.iter().map(|n| n.i_l).fold(f64::MAX, f64::min);
    let resting = trace.nodes.iter().filter(|n| n.i_l.abs() < 1e-3).count();
    // the core takes 0.01 S of some 10 V behind the diode
    assert!(least > -1e-3, "{least}");
    assert!(resting > trace.nodes.len() / 10, "{resting} of {}", trace.nodes.len());
}

/// Pulses that reach over the end of their period, a diode that recovers at its start, a node that falls there: the first period has what was before it.
#[test]
fn a_run_of_equal_periods_stays_where_it_begins() {
    let load = Load {
        i: 2.0,
        ..Load::default()
    };
    for topology in [Topology::Buck, Topology::Boost, Topology::BuckBoost] {
        for carrier in [Carrier::Trailing, Carrier::Leading, Carrier::Centre] {
            for (synchronous, fall, recovery, node) in [
                (true, 3e-7, 0.0, 0.0),
                (false, 3e-7, 0.0, 0.0),
                (false, 0.0, 2e-7, 0.0),
                (false, 0.0, 0.0, 5e-9),
            ] {
                if node > 0.0 && topology != Topology::Buck {
                    continue;
                }
                let mut board = ideal(topology);
                (board.stage.synchronous, board.stage.r_winding) = (synchronous, 0.1);
                (board.gates.carrier, board.gates.fall) = (carrier, fall);
                (board.gates.recovery, board.gates.node) = (recovery, node);
                let period = Period {
                    duty: 0.4,
                    load,
                    after: 0.0,
                };
                let trace = run(&board, &[period; 8], STEPS, &mut Rng::new(0, &[]));
                let of = |from: f64, what: fn(&Nodes) -> f64| {
                    let part = |t: &f64| *t >= (from - 1e-6) / 1e5 && *t <= (from + 1.0 + 1e-6) / 1e5;
                    let inside: Vec<usize> = (0..trace.t.len()).filter(|n| part(&trace.t[*n])).collect();
                    let t = inside.iter().map(|n| trace.t[*n]).collect();
                    let nodes = inside.iter().map(|n| trace.nodes[*n]).collect();
                    mean(&Trace { t, nodes }, what)
                };
                let name = format!("{topology:?} {carrier:?} {synchronous} {fall:e} {recovery:e} {node:e}");
                for what in [(|n| n.v_out) as fn(&Nodes) -> f64, |n| n.i_l] {
                    let (first, last) = (of(0.0, what), of(7.0, what));
                    assert!((first / last - 1.0).abs() < 1e-4, "{name}: {first} {last}");
                }
            }
        }
    }
}

#[test]
fn twice_the_steps_change_next_to_nothing() {
    let mut board = ideal(Topology::Buck);
    (
        board.stage.synchronous,
        board.stage.v_f,
        board.stage.esr,
        board.stage.core,
    ) = (false, 0.5, 0.02, 1e-3);
    board.source = Source {
        r: 0.1,
        l: 1e-6,
        c: 1e-5,
        esr: 0.01,
        ..board.source
    };
    board.sink.tau = 2e-5;
    let load = Load {
        g: 0.1,
        p: 10.0,
        ..Load::default()
    };
    let [coarse, fine] = [STEPS, 2 * STEPS].map(|steps| mean(&settled(&board, 0.4, load, steps), |n| n.v_out));
    assert!((coarse / fine - 1.0).abs() < 1e-5, "{coarse} {fine}");
}

#[test]
fn a_case_has_the_same_bytes_again_and_another_seed_has_others() {
    for family in [
        Family::Healthy,
        Family::Cause,
        Family::Disturbed,
        Family::Bench,
        Family::Nonsense,
        Family::Unlisted,
    ] {
        let case = |seed| make(seed, 1, Some(family), true, false, false);
        let first = case(11);
        assert!(first.is_ok(), "{first:?}");
        assert_eq!(first, case(11));
        assert_ne!(first, case(12));
    }
}
