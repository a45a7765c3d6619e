policy_macro::include_policy!(42);
