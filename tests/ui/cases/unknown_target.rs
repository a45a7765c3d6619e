policy_macro::include_policy!("policy/policy.toml", target = "STM32G474");
