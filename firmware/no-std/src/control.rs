//! What runs in the control interrupt. Safe code, `core` only.
#![forbid(unsafe_code)]

policy_macro::include_policy!(pub "policy/policy.toml");

pub use buck12::{Controller, Measurement};

/// Timer counts of one PWM period.
pub const PERIOD_TICKS: u16 = 8400;

/// Start-up check: this build computes what the policy means, and the tables are intact.
pub fn is_trustworthy() -> bool {
    Controller::self_test().is_ok() && Controller::integrity()
}

/// One control period: samples in, PWM compare value out.
pub fn interrupt(controller: &mut Controller, sample: &Measurement) -> u16 {
    let command = controller.step(sample);
    (command.duty * f32::from(PERIOD_TICKS)) as u16
}
