policy_macro::include_policy!(Regulator = "policy/policy.toml",);

fn main() {
    let regulator: buck12::Regulator = buck12::Regulator::new();
    assert!(buck12::Regulator::integrity());
    assert_eq!(buck12::Regulator::self_test(), Ok(()));
    drop(regulator);
}
