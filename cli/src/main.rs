//! policyc: from a trained policy to verified controller code.

fn main() {}
