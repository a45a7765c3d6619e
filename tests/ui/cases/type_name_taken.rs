policy_macro::include_policy!(pub Measurement = "policy/policy.toml");
