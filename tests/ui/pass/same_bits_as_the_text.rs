// what the macro expands to and what `policyc compile --emit rust` writes are the same controller
policy_macro::include_policy!("linear/policy.toml");

#[allow(dead_code)]
mod text {
    include!(concat!(env!("CARGO_MANIFEST_DIR"), "/text/linear.rs"));
}

fn main() {
    let (mut a, mut b) = (linear::Controller::new(), text::Controller::new());
    for step in 0..2000_u32 {
        let v_out = if step % 97 == 0 { f32::NAN } else { (step.wrapping_mul(2654435761) >> 8) as f32 * 2e-5 - 30.0 };
        let x = a.step(&linear::Measurement { v_out });
        let y = b.step(&text::Measurement { v_out });
        assert_eq!((x.duty.to_bits(), x.duty_sim.to_bits()), (y.duty.to_bits(), y.duty_sim.to_bits()));
        assert_eq!((x.action_index, x.status), (y.action_index, y.status));
        assert_eq!(a.state_words(), b.state_words());
    }
}
