//@ replace: name = "buck12" => name = "while"
policy_macro::include_policy!("policy/policy.toml");
