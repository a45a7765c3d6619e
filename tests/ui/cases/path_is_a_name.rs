policy_macro::include_policy!(policy);
