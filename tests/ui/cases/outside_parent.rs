policy_macro::include_policy!("../outside/policy.toml");
