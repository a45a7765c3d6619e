policy_macro::include_policy!("policy/policy.toml");
policy_macro::include_policy!("linear/policy.toml");

fn main() {
    assert!(buck12::Controller::integrity() && linear::Controller::integrity());
    assert_eq!((buck12::ACTIONS, linear::ACTIONS), (12, 4));
    let a = buck12::Controller::new().step(&buck12::Measurement { v_out: 99.0, i_l: 5.0, i_out: 5.0 });
    let b = linear::Controller::new().step(&linear::Measurement { v_out: 99.0 });
    assert!(a.status & b.status & linear::status::PRIMED != 0);
}
