//! Continuous heads (contract section 7b) as whole controllers.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

#[allow(dead_code)] // another file of tests has the rest
mod common;

use common::{Dense, PLAIN, load};
use interp::Controller;
use interp::Sample::Physical;

/// A head with one input, the previous duty or the signal, and weight 1.
fn head(source: &str, curve: &str, scale: f64, offset: f64) -> Controller<f32> {
    let contract = format!(
        "name = \"actor\"\nsample_period = 0.25\n[[signal]]\nname = \"u\"\nrange = [0.0, 1.0]\n\
         [[feature]]\nname = \"d\"\nsource = \"{source}\"\n[network]\nweights = \"weights.safetensors\"\n\
         [actions]\ncontinuous = {{ {curve}, scale = {scale:?}, offset = {offset:?} }}\n{PLAIN}",
    );
    let network = Dense {
        inputs: 1,
        outputs: 1,
        weights: &[1.0],
        bias: &[0.0],
    };
    Controller::<f32>::new(&load(&contract, &[], &[network]))
}

/// Ends of what a sound `previous_duty` lies within, of a head with scale 0.5 and offset 0.25.
fn ends(squash: &str) -> (f32, f32) {
    let (scale, offset) = if squash == "tanh" { (0.25, 0.5) } else { (0.5, 0.25) };
    let controller = head("previous_duty", &format!("squash = \"{squash}\""), scale, offset);
    let at = controller.state_names().iter().position(|name| name == "previous_duty");
    controller.sound_ends()[at.unwrap()].unwrap()
}

/// From the fallback, 0.0625, to the upper end of the head: its curve ends at 0 and 1, or at -1 and 1.
#[test]
fn a_sound_duty_lies_between_the_ends_of_its_own_curve() {
    for squash in ["tanh", "sigmoid", "hard_sigmoid"] {
        assert_eq!(ends(squash), (0.0625, 0.75), "{squash}");
    }
}

/// The clipped input times the scale, plus the offset: all of them numbers of binary32.
#[test]
fn scales_of_one_and_two_are_both_multiplied_by() {
    for (scale, offset, duty) in [
        (1.0, 0.125, 0.375),
        (2.0, 0.0, 0.5),
        (-2.0, 1.0, 0.5),
        (0.5, 0.5, 0.625),
    ] {
        let mut controller = head("u", "clip = [0.125, 0.375]", scale, offset);
        let command = controller.step(&[Physical(0.25)]).unwrap().command;
        assert_eq!(command.duty, duty, "{scale} {offset}");
    }
}
