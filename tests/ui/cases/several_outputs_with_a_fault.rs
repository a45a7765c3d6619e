//@ replace: sample_period = 1e-4 => sample_period = -1e-4
//@ replace: golden = "golden.safetensors" => # no golden answers
//@ replace: [actions] => [[output]]\nname = "left"\n[output.actions]
//@ replace: 0.53, 0.54, 0.55] => 0.53]
//@ replace: [mapping] => [output.mapping]
//@ replace: [limits] => [output.limits]
//@ replace: duty = 0.0                               # switch off => # switch off
//@ replace: [fallback] => [output.fallback]\nduty = 0.0\n[[output]]\nname = "right"\n[output.actions]\nduties = [0.45, 0.5]\n[output.limits]\nduty = [0.4, 0.6]\n[output.fallback]\nduty = 0.1\n[fallback]
policy_macro::include_policy!("policy/policy.toml");

// the fault is named once: what firmware says of each duty still holds
const _: () = assert!(buck12::ACTIONS == 12 && buck12::OUTPUTS == 2 && buck12::OUTPUT_RIGHT == 1);
pub fn right(controller: &mut buck12::Controller, measured: &buck12::Measurement) -> (f32, u32) {
    let command = controller.step(measured);
    (command.duty[buck12::OUTPUT_RIGHT], command.action_index[buck12::OUTPUT_LEFT])
}
