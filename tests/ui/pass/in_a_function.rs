fn duty(v_out: f32) -> f32 {
    policy_macro::include_policy!("linear/policy.toml");
    linear::Controller::new().step(&linear::Measurement { v_out }).duty
}

fn main() {
    assert!((0.4..=0.6).contains(&duty(100.0)));
}
