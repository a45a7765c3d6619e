//! Mapping and memory layout of whole controllers.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

mod common;

use common::{PLAIN, threshold};
use interp::Sample::Physical;
use interp::{Controller, status};

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

#[test]
fn four_term_mapping_adds_the_product() {
    let drm = THREE_TERMS.replace("c = 0.125", "c = 0.125\nr = 0.0625");
    let drm = format!("{drm}r = [-0.125, 0.125]\n");
    let mut c = mapped(&drm);
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
        "bad_count",
        "primed",
    ];
    assert_eq!(c.state_names(), names);
    let fresh = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.25, 0.5, 0.0625, 0.125].map(f32::to_bits);
    assert_eq!(c.state_words(), [&fresh[..], &[0, 0]].concat());
    c.step(&[Physical(2.0), Physical(0.0)]).unwrap();
    c.step(&[Physical(3.0), Physical(1.0)]).unwrap();
    let words = c.state_words();
    // p = 0.75, k = 1: the derivative is 1 after a step of 1, its delay still holds the 0 of the first step
    assert_eq!(words[..6], [3.0, 1.0, 3.0, 1.0, 0.0, 1.0].map(f32::to_bits));
    assert_eq!(words[12..], [0, 1]);
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
