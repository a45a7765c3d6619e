//@ grow: policy/policy.toml 70000000
policy_macro::include_policy!("policy/policy.toml");
