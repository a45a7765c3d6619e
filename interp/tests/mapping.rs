//! Mapping and memory layout of whole controllers.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

mod common;

use common::{PLAIN, threshold};
use interp::Sample::Physical;
use interp::{Controller, State, status};

const SOURCE: &str = "source = \"u\"";

fn controller(feature: &str, rest: &str, files: &[(&str, &str)]) -> Controller<f32> {
    Controller::new(&threshold(feature, rest, files))
}

const MAPPING: &str = "
[mapping]
file = \"drm.toml\"
load_current = \"i\"
";

fn mapped(drm: &str) -> Controller<f32> {
    controller(SOURCE, &format!("{MAPPING}{PLAIN}"), &[("drm.toml", drm)])
}

const THREE_TERMS: &str = "
a = 0.5
b = 0.0625
c = 0.125
[valid]
i_out = [-1.0, 2.0]
d_sim = [0.25, 0.75]
[adjust]
a = [0.25, 2.0]
b = [-0.1, 0.1]
c = [-0.5, 0.5]
";

#[test]
fn three_term_mapping_uses_the_duty_and_the_load_current() {
    let mut c = mapped(THREE_TERMS);
    let trace = c.step(&[Physical(9.0), Physical(2.0)]).unwrap();
    // 0.5 * 0.75 + 0.0625 * 2 + 0.125
    assert_eq!((trace.command.duty_sim, trace.command.duty), (0.75, 0.625));
    assert_eq!((trace.mapped, trace.decision(0).mapped), (0.625, 0.625));
    assert_eq!(trace.command.status, status::PRIMED);
}

#[test]
fn a_load_current_outside_the_validity_range_warns_and_still_maps() {
    let mut c = mapped(THREE_TERMS);
    let trace = c.step(&[Physical(9.0), Physical(4.0)]).unwrap();
    assert_eq!(
        (trace.command.duty, trace.command.status),
        (0.75, status::PRIMED | status::MAPPING_RANGE)
    );
    // the held current counts, not the measured one
    let trace = c.step(&[Physical(9.0), Physical(f32::INFINITY)]).unwrap();
    assert_eq!(
        (trace.command.duty, trace.command.status),
        (0.75, status::HELD | status::MAPPING_RANGE)
    );
}

fn four_terms() -> String {
    let drm = THREE_TERMS.replace("c = 0.125", "c = 0.125\nr = 0.0625");
    format!("{drm}r = [-0.125, 0.125]\n")
}

#[test]
fn four_term_mapping_adds_the_product() {
    let mut c = mapped(&four_terms());
    let trace = c.step(&[Physical(9.0), Physical(2.0)]).unwrap();
    assert_eq!(trace.command.duty, 0.625 + 0.0625 * 2.0 * 0.75);
    assert!(!c.set_mapping(1.0, 0.0, 0.0, None), "the form cannot change");
    // 0.25 - 0.125 * 2 = 0 at the upper end of the current: does not rise
    assert!(!c.set_mapping(0.25, 0.0, 0.0, Some(-0.125)));
    assert!(c.set_mapping(0.5, 0.0, 0.0, Some(-0.125)));
}

#[test]
fn mapping_coefficients_survive_a_reset_and_refused_ones_change_nothing() {
    let mut c = mapped(THREE_TERMS);
    assert!(c.set_mapping(1.0, 0.0, 0.0, None));
    let before = c.state_words();
    assert!(!c.set_mapping(f32::NAN, 0.0, 0.0, None));
    assert!(!c.set_mapping(2.0_f32.next_up(), 0.0, 0.0, None));
    assert!(!c.set_mapping(1.0, 0.0, 0.0, Some(0.0)));
    assert_eq!(c.state_words(), before);
    c.reset();
    assert_eq!(c.state_words(), before);
    assert_eq!(c.step(&[Physical(9.0), Physical(1.0)]).unwrap().command.duty, 0.75);
}

#[test]
fn without_a_mapping_no_coefficients_are_accepted() {
    assert!(!controller(SOURCE, PLAIN, &[]).set_mapping(1.0, 0.0, 0.0, None));
}

#[test]
fn state_words_have_the_order_of_the_contract() {
    let feature = "source = \"u\"\nfilters = [{ filtered_derivative = { time_constant = 0.75 } }, { delay = 2 }]";
    let rest = format!(
        "{MAPPING}{}",
        PLAIN.replace("initial_duty", "soft_start = { from = 0.25, steps = 10 }\ninitial_duty")
    );
    let mut c = controller(feature, &rest, &[("drm.toml", THREE_TERMS)]);
    let names = [
        "held.u",
        "held.i",
        "f.0.filtered_derivative.x1",
        "f.0.filtered_derivative.y1",
        "f.1.delay[0]",
        "f.1.delay[1]",
        "previous_duty",
        "previous_command",
        "soft_cap",
        "mapping.a",
        "mapping.b",
        "mapping.c",
        "mapping.check",
        "bad_count",
        "primed",
    ];
    assert_eq!(c.state_names(), names);
    let fresh = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.25, 0.5, 0.0625, 0.125].map(f32::to_bits);
    // 3F000000, 3D800000 and 3E000000 are 0.5, 0.0625 and 0.125
    let check = 0x4B4B_4B4B ^ 0x3F00_0000 ^ 0x3D80_0000 ^ 0x3E00_0000;
    assert_eq!(c.state_words(), [&fresh[..], &[check, 0, 0]].concat());
    c.step(&[Physical(2.0), Physical(0.0)]).unwrap();
    c.step(&[Physical(3.0), Physical(1.0)]).unwrap();
    let words = c.state_words();
    // p = 0.75, k = 1: the derivative is 1 after a step of 1, its delay still holds the 0 of the first step
    assert_eq!(words[..6], [3.0, 1.0, 3.0, 1.0, 0.0, 1.0].map(f32::to_bits));
    assert_eq!(words[12..], [check, 0, 1]);
}

#[test]
fn a_coefficient_that_has_become_no_number_is_answered_with_the_fallback_until_init() {
    let fallback = |c: &mut Controller<f32>| {
        let command = c.step(&[Physical(9.0), Physical(2.0)]).unwrap().command;
        (command.duty, command.duty_sim, command.action_index, command.status)
    };
    let damaged = (0.0625, 0.0625, 0, status::FALLBACK | status::STATE);
    for a in [f32::NAN, f32::INFINITY, 0.25_f32.next_down(), 2.0_f32.next_up(), -0.5] {
        let mut c = mapped(THREE_TERMS);
        c.step(&[Physical(9.0), Physical(2.0)]).unwrap();
        let mut state = c.state().clone();
        if let Some(mapping) = &mut state.mapping {
            mapping.a = a;
        }
        assert!(c.restore(&state));
        assert_eq!(fallback(&mut c), damaged, "{a}");
        assert_eq!(c.state().primed, 2);
        // the state is sound again but for the mark
        assert!(c.set_mapping(0.5, 0.0625, 0.125, None));
        assert_eq!(fallback(&mut c), damaged, "{a}: it stays visible");
        c.reset();
        assert_eq!(fallback(&mut c).3, status::PRIMED, "{a}");
    }
}

/// Every step from `damaged` answers with the fallback and marks the state, and a reset does not hide it.
fn assert_seen(c: &Controller<f32>, damaged: &State<f32>, what: &str) {
    let mut hit = c.clone();
    assert!(hit.restore(damaged));
    for _ in 0..2 {
        let command = hit.step(&[Physical(9.0), Physical(1.0)]).unwrap().command;
        assert_eq!(command.status, status::STATE | status::FALLBACK, "{what}");
    }
    hit.reset();
    let command = hit.step(&[Physical(9.0), Physical(1.0)]).unwrap().command;
    assert_ne!(command.status & status::STATE, 0, "{what}, after a reset");
    hit.reset();
    let r = c.state().mapping.unwrap().r.map(|_| 0.0);
    assert!(hit.set_mapping(1.0, 0.0, 0.0, r));
    let command = hit.step(&[Physical(9.0), Physical(1.0)]).unwrap().command;
    assert_eq!(command.status & status::STATE, 0, "{what}, after other coefficients");
}

#[test]
fn every_flipped_bit_of_a_coefficient_or_of_their_check_word_is_seen_at_once() {
    for drm in [THREE_TERMS.to_owned(), four_terms()] {
        let mut c = mapped(&drm);
        let r = c.state().mapping.unwrap().r.map(|_| 0.0);
        assert!(c.set_mapping(1.0, 0.0, 0.0, r), "also those of the lab");
        let state = c.state().clone();
        let flip = |x: f32, bit: u32| f32::from_bits(x.to_bits() ^ (1 << bit));
        for bit in 0..32 {
            let mut damaged = [(); 5].map(|()| state.clone());
            let [a, b, c_word, r_word, check] = &mut damaged;
            a.mapping.as_mut().unwrap().a = flip(1.0, bit);
            b.mapping.as_mut().unwrap().b = flip(0.0, bit);
            c_word.mapping.as_mut().unwrap().c = flip(0.0, bit);
            r_word.mapping.as_mut().unwrap().r = r.map(|r| flip(r, bit));
            check.mapping_check = state.mapping_check.map(|word| word ^ (1 << bit));
            for (damaged, word) in damaged.iter().zip(["a", "b", "c", "r", "check"]) {
                if word != "r" || r.is_some() {
                    assert_seen(&c, damaged, &format!("bit {bit} of {word}"));
                }
            }
        }
    }
}

#[test]
fn coefficients_and_check_word_of_one_pattern_are_not_sound() {
    let c = mapped(THREE_TERMS);
    for pattern in [0, 0x4B4B_4B4B, 0xA5A5_A5A5, 0x7FC0_0000, u32::MAX] {
        let mut state = c.state().clone();
        let own = state.mapping.as_mut().unwrap();
        (own.a, own.b, own.c) = (
            f32::from_bits(pattern),
            f32::from_bits(pattern),
            f32::from_bits(pattern),
        );
        state.mapping_check = Some(pattern.into());
        assert_seen(&c, &state, &format!("{pattern:x}"));
    }
}

/// Two signals and two duties that no step reads, then what may be set: three coefficients or four, rounded inwards.
#[test]
fn sound_ends_stand_in_the_order_of_the_words() {
    let ends = mapped(THREE_TERMS).sound_ends();
    assert_eq!(ends[..4], [Some((0.0, 10.0)), Some((-5.0, 5.0)), None, None]);
    let tenth = 0.1_f32.next_down();
    assert_eq!(ends[4..], [Some((0.25, 2.0)), Some((-tenth, tenth)), Some((-0.5, 0.5))]);
    assert_eq!(mapped(&four_terms()).sound_ends().len(), ends.len() + 1);
}
