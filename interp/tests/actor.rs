//! Continuous heads (contract section 7b) as whole controllers.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests stand outside of #[test] functions

#[allow(dead_code)] // another file of tests has the rest
mod common;

use common::{Dense, PLAIN, load};
use interp::Controller;

/// Ends of what a sound `previous_duty` lies within, of a head with scale 0.5 and offset 0.25.
fn ends(squash: &str) -> (f32, f32) {
    let contract = format!(
        "name = \"actor\"\nsample_period = 0.25\n[[signal]]\nname = \"u\"\nrange = [0.0, 1.0]\n\
         [[feature]]\nname = \"d\"\nsource = \"previous_duty\"\n[network]\nweights = \"weights.safetensors\"\n\
         [actions]\ncontinuous = {{ squash = \"{squash}\", scale = {}, offset = {} }}\n{PLAIN}",
        if squash == "tanh" { 0.25 } else { 0.5 },
        if squash == "tanh" { 0.5 } else { 0.25 },
    );
    let network = Dense {
        inputs: 1,
        outputs: 1,
        weights: &[1.0],
        bias: &[0.0],
    };
    let controller = Controller::<f32>::new(&load(&contract, &[], &[network]));
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
