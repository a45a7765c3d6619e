//! Causes that are wired in ways of their own, at converters drawn at random, from a generator that shares nothing with the plant.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod lab;
mod survey;

use diagnose::diagnosis::diagnose;
use diagnose::findings::{Findings, Verdict};
use lab::{Drawn, InputFilter, Knee, Resistors, drawn};

const ALL: [&str; 5] = ["v_out", "i_l", "i_out", "v_in", "r_load"];
const WITHOUT_I_OUT: [&str; 4] = ["v_out", "i_l", "v_in", "r_load"];

fn found(drawn: &mut Drawn, resistors: &Resistors, columns: &[&str]) -> Findings {
    let labs = drawn.labs(resistors);
    let [duty, load, held] = drawn.records(&labs, columns);
    diagnose(&drawn.model, vec![duty, load], &[held], &|_| ()).findings
}

fn ids(findings: &Findings) -> Vec<&'static str> {
    let mut ids: Vec<&str> = findings.causes.iter().map(|cause| cause.id).collect();
    ids.sort_unstable();
    ids
}

/// Within a share of the truth, beyond what is left of it in an interval.
fn is_near(findings: &Findings, id: &str, parameter: &str, truth: f64, share: f64) {
    let cause = findings.causes.iter().find(|cause| cause.id == id);
    let value = cause.map_or(f64::NAN, |cause| cause.parameters[parameter].value);
    assert!(
        (value / truth - 1.0).abs() < share,
        "{id} {parameter}: {value} of {truth}"
    );
}

/// Whether causes are named and have no rivals; a channel that a held-out record leaves over the noise may be set aside.
fn is_answered(findings: &Findings) -> bool {
    matches!(findings.verdict, Verdict::Explained | Verdict::MostlyExplained)
}

#[test]
fn resistors_that_are_each_off_by_something_else_are_named_beside_a_winding() {
    for seed in [11, 12] {
        let mut d = drawn(seed);
        let mut resistors = d.resistors();
        resistors.off = [0.07, -0.05, 0.04];
        d.lab.dcr += 0.04 * d.v_out / d.i_l;
        let findings = found(&mut d, &resistors, &WITHOUT_I_OUT);
        println!("{seed}: {}\n{:#?}", findings.sentence, findings.noise.repairs);
        assert!(is_answered(&findings), "{:?}", findings.verdict);
        assert_eq!(ids(&findings), ["dcr", "load_gain"]);
        is_near(&findings, "dcr", "dcr", d.lab.dcr, 0.02);
        // printed, the largest conductance first
        for (parameter, truth) in [("resistor_1", 0.95), ("resistor_2", 1.07), ("resistor_3", 1.04)] {
            is_near(&findings, "load_gain", parameter, truth, 0.002);
        }
        let note = findings
            .noise
            .repairs
            .iter()
            .find(|note| note.contains("resistor_2 is the one of"));
        assert!(note.is_some(), "{:?}", findings.noise.repairs);
    }
}

/// A gain for each resistor does the same with three numbers; milliohms and millisiemens that are much for a small converter are little for a large one.
#[test]
fn a_conductance_beside_all_resistors_leads_before_a_gain_for_each() {
    for seed in [71, 72, 73, 74] {
        let mut d = drawn(seed);
        let mut resistors = d.resistors();
        let beside = 0.03 * d.g;
        resistors.off = resistors.g.map(|g| beside / g);
        let findings = found(&mut d, &resistors, &ALL);
        println!("{seed}: {} S: {}", beside, findings.sentence);
        let first = findings.causes.first().map(|cause| cause.id);
        assert_eq!(
            (first, findings.causes.len()),
            (Some("bleed"), 1),
            "{}",
            findings.sentence
        );
        is_near(&findings, "bleed", "bleed", beside, 0.02);
    }
}

#[test]
fn a_core_that_saturates_at_once_is_named() {
    for seed in [21, 22] {
        let mut d = drawn(seed);
        let knee = Knee {
            at: 1.2 * d.i_l,
            width: 0.2,
            left: 0.2,
        };
        d.lab.knee = Some(knee);
        let resistors = d.resistors();
        let findings = found(&mut d, &resistors, &ALL);
        println!("{seed}: {}", findings.sentence);
        assert!(is_answered(&findings), "{:?}", findings.verdict);
        assert_eq!(ids(&findings), ["l_saturation"]);
        // half of what is lost is lost in the middle of the fall
        is_near(
            &findings,
            "l_saturation",
            "i_sat",
            knee.at * (1.0 + 0.5 * knee.width),
            0.05,
        );
    }
}

#[test]
fn an_input_filter_that_rings_is_named() {
    for seed in [31, 32] {
        let mut d = drawn(seed);
        let seen = d.lab.v_in * d.lab.v_in / (d.v_out * d.v_out * d.g);
        let (z, rate) = (0.07 * seen, std::f64::consts::TAU * d.lab.f_sw / 12.0);
        let filter = InputFilter {
            r: 0.012 * seen,
            l: z / rate,
            c: 1.0 / (z * rate),
            esr: 0.003 * seen,
        };
        d.lab.filter = Some(filter);
        let resistors = d.resistors();
        let findings = found(&mut d, &resistors, &ALL);
        println!("{seed}: {}", findings.sentence);
        assert!(is_answered(&findings), "{:?}", findings.verdict);
        assert_eq!(ids(&findings), ["source_impedance"]);
        is_near(&findings, "source_impedance", "inductance", filter.l, 0.05);
        is_near(&findings, "source_impedance", "c_in", filter.c, 0.05);
        is_near(&findings, "source_impedance", "resistance", filter.r, 0.05);
    }
}

// not beside another cause, and not at every count: docs/explanation/limits.md
#[test]
fn a_modulator_that_cuts_off_is_named() {
    for (seed, counts) in [(41, 64.0), (42, 47.0)] {
        let mut d = drawn(seed);
        (d.lab.counts, d.lab.floors) = (counts, true);
        let resistors = d.resistors();
        let findings = found(&mut d, &resistors, &ALL);
        println!("{seed}: {}", findings.sentence);
        assert!(is_answered(&findings), "{:?}", findings.verdict);
        assert_eq!(ids(&findings), ["duty_quantisation"]);
        is_near(&findings, "duty_quantisation", "duty_lsb", 1.0 / counts, 0.002);
    }
}

/// What the records cannot tell apart is a tie of the two, and the time is that of the edge.
#[test]
fn late_edges_are_named_with_their_time_or_tied_with_a_dead_time() {
    for (seed, late) in [(51, [0.03, 0.0]), (52, [0.0, 0.03])] {
        let mut d = drawn(seed);
        let [on, off] = late.map(|share| share / d.lab.f_sw);
        (d.lab.late_on, d.lab.late_off) = (on, off);
        let resistors = d.resistors();
        let findings = found(&mut d, &resistors, &ALL);
        println!("{seed}: {}", findings.sentence);
        let [cause] = &findings.causes[..] else {
            panic!("{:?}", ids(&findings))
        };
        let value = cause.parameters.values().next().unwrap().value;
        let is_tied = cause.rivals.iter().flatten().any(|id| *id == "turn_on_delay");
        match on > 0.0 {
            true => assert!(cause.id == "turn_on_delay" || cause.id == "dead_time" && is_tied),
            false => assert_eq!(cause.id, "turn_off_delay"),
        }
        assert!((value / (on + off) - 1.0).abs() < 0.02, "{value}");
    }
}
