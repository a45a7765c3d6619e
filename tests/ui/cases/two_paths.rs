policy_macro::include_policy!("policy/policy.toml" "policy/policy.toml");
