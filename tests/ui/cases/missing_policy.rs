policy_macro::include_policy!("policy/no_such.toml");
