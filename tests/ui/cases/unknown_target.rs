policy_macro::include_policy!("policy/policy.toml", target = "thumbv7em-none-eabihf");
