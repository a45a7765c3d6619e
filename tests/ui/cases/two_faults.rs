//@ replace: duty = [0.40, 0.60] => duty = [0.60, 0.40]
//@ replace: hold = 3 => hold = -3
policy_macro::include_policy!("policy/policy.toml");

pub use buck12::status::FALLBACK;
pub use buck12::{Command, Controller, Measurement, SIGNALS};

pub static CONTROLLER: std::sync::Mutex<Controller> = std::sync::Mutex::new(Controller::new());

pub fn control(controller: &mut buck12::Controller, v_out: f32) -> f32 {
    let measured = buck12::Measurement { v_out, i_l: 5.0, i_out: 5.0 };
    let seen: [f32; buck12::FEATURES] = controller.observe(&measured);
    let q: [f32; buck12::ACTIONS] = buck12::Controller::q_values(&seen);
    let command: buck12::Command = controller.step(&measured);
    if command.status & buck12::status::FALLBACK != 0 || !buck12::Controller::integrity() {
        controller.reset();
    }
    command.duty + q[0]
}
