#![deny(warnings)]

mod own {
    policy_macro::include_policy!(pub "policy/policy.toml");
}
mod of_another_core {
    policy_macro::include_policy!(pub Regulator = "policy/policy.toml", target = "cortex-m4f",);
}

fn main() {
    let (mut own, mut other) = (own::buck12::Controller::new(), of_another_core::buck12::Regulator::new());
    for step in 0..200_i16 {
        let v_out = 90.0 + 0.1 * f32::from(step);
        let here = own.step(&own::buck12::Measurement { v_out, i_l: 4.0, i_out: 5.0 });
        let there = other.step(&of_another_core::buck12::Measurement { v_out, i_l: 4.0, i_out: 5.0 });
        assert_eq!(here.duty.to_bits(), there.duty.to_bits());
        assert_eq!((here.action_index, here.status), (there.action_index, there.status));
    }
    assert_eq!(own.state_words(), other.state_words());
}
