//@ replace: hold = 3 => hold = -1
policy_macro::include_policy!(pub(crate) Regulator = "policy/policy.toml");

pub fn control() -> f32 {
    let mut regulator = buck12::Regulator::default();
    regulator.step(&buck12::Measurement { v_out: 1.0, i_l: 5.0, i_out: 5.0 }).duty
}
