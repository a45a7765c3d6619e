policy_macro::include_policy!("/etc/policy.toml");
