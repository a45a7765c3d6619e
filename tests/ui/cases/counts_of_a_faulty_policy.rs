//@ replace: sample_period = 1e-4 => sample_period = -1e-4
policy_macro::include_policy!("policy/policy.toml");

// the fault is named once: what firmware asserts of the policy still holds
const _: () = assert!(buck12::ACTIONS == 12 && buck12::FEATURES == 6 && buck12::SIGNALS == 3);
