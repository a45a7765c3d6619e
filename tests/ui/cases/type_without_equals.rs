policy_macro::include_policy!(pub Regulator "policy/policy.toml");
