//! The controller that `include_policy!` makes, inside this very program, against the interpreter.

use interp::{Controller, Sample};
use verify::traces::{Event, Stream};

policy_macro::include_policy!(Regulator = "policy/policy.toml");

/// `POLICYC_STEPS` for more.
fn steps() -> u64 {
    std::env::var("POLICYC_STEPS")
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(100_000)
}

#[test]
fn the_macro_is_equal_to_the_interpreter_in_q_state_and_duty() {
    let policy = policy::load(&tests::example()).unwrap();
    let mut oracle = Controller::<f32>::new(&policy);
    let mut controller = buck12::Regulator::new();
    let mut stream = Stream::new(&policy, 5, &[]);
    let mut done = 0;
    while done < steps() {
        match stream.next_event(&oracle) {
            Event::Step(samples) => {
                let trace = oracle.step(&samples).unwrap();
                let value = |index: usize| match samples[index] {
                    Sample::Physical(x) => x,
                    Sample::Wide(x) => x as f32,
                    Sample::Code(code) => code as f32,
                };
                let measured = buck12::Measurement {
                    v_out: value(0),
                    i_l: value(1),
                    i_out: value(2),
                };
                let observation = controller.observe(&measured);
                let q = buck12::Regulator::q_values(&observation);
                let command = controller.step(&measured);
                let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&q), bits(&trace.q_values.to_vec()), "Q at step {done}");
                let duties = (command.duty.to_bits(), command.duty_sim.to_bits());
                assert_eq!(
                    duties,
                    (trace.command.duty.to_bits(), trace.command.duty_sim.to_bits()),
                    "duty at step {done}"
                );
                assert_eq!(
                    (command.action_index as usize, command.status),
                    (trace.command.action_index as usize, trace.command.status),
                    "step {done}"
                );
                assert_eq!(
                    controller.state_words().to_vec(),
                    oracle.state_words(),
                    "state after step {done}"
                );
                done += 1;
            }
            Event::Reset => {
                oracle.reset();
                controller.reset();
            }
            Event::SetMapping { a, b, c, .. } => {
                let [a, b, c] = [a, b, c].map(|x| x as f32);
                assert_eq!(controller.set_mapping(a, b, c), oracle.set_mapping(a, b, c, None));
            }
            Event::Init => {
                oracle = Controller::new(&policy);
                controller = buck12::Regulator::new();
            }
            Event::Network(_) => {}
        }
    }
    assert_eq!(buck12::Regulator::self_test(), Ok(()));
    assert!(buck12::Regulator::integrity());
}
