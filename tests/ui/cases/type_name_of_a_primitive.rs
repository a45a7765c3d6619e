policy_macro::include_policy!(f32 = "policy/policy.toml");
