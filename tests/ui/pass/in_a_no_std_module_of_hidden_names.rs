// names of the user that hide those of core must not reach the generated code
#![no_std]
extern crate std;

#[allow(dead_code)]
mod control {
    pub struct Option;
    pub struct Result;
    pub type Some = ();
    policy_macro::include_policy!(pub "linear/policy.toml");
}

fn main() {
    std::assert!(control::linear::Controller::integrity());
}
