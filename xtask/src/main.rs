//! One entry for desk and CI.

fn main() {}
