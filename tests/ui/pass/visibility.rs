mod control {
    policy_macro::include_policy!(pub(crate) "policy/policy.toml");
}

fn main() {
    let command = control::buck12::Controller::new().step(&control::buck12::Measurement {
        v_out: 95.0,
        i_l: 5.0,
        i_out: 5.0,
    });
    assert_eq!(command.status & control::buck12::status::PRIMED, control::buck12::status::PRIMED);
    assert!((0.4..=0.6).contains(&command.duty));
}
