//@ replace: hidden_activation = "relu" => hidden_activation = "tanh"
policy_macro::include_policy!("policy/policy.toml");
