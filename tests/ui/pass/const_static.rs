#![forbid(unsafe_code)]

use std::sync::Mutex;

policy_macro::include_policy!("policy/policy.toml");

static CONTROLLER: Mutex<buck12::Controller> = Mutex::new(buck12::Controller::new());
const ACTIONS: [f32; buck12::ACTIONS] = [0.0; buck12::ACTIONS];
const _: () = assert!(buck12::ACTIONS == 12 && buck12::FEATURES == 6 && buck12::SIGNALS == 3);

fn main() {
    let blind = buck12::Measurement { v_out: f32::NAN, i_l: 0.0, i_out: 0.0 };
    let command = CONTROLLER.lock().unwrap().step(&blind);
    assert_eq!((command.duty, command.status), (0.0, buck12::status::FALLBACK));
    assert_eq!(ACTIONS.len(), 12);
}
