//@ replace: name = "buck12" => numeric_format = "i16"\nname = "buck12"
policy_macro::include_policy!("policy/policy.toml");
