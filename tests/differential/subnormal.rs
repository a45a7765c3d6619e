//! A processor that takes subnormal numbers for zero: constants that would vanish are refused.

use codegen::Output;
use policy::NumericFormat;

#[test]
fn a_constant_that_the_processor_takes_for_zero_is_refused_by_name() {
    let mut policy = policy::load(&tests::example()).unwrap();
    let c2000 = targets::find("c2000-c28x").unwrap();
    let generate = |policy: &policy::Policy, target| codegen::generate(policy, target, &[Output::C], None);
    generate(&policy, c2000).unwrap();
    // the last weight of the last layer
    *policy.layers[2].weights.last_mut().unwrap() = 1e-40;
    let error = generate(&policy, c2000).unwrap_err();
    let text = toml_input::Faults::from(error).to_string();
    for word in [
        "take a constant of the policy for zero",
        "e-41 in the table `weights2`",
        "--format i16",
    ] {
        assert!(text.contains(word), "{word}\n{text}");
    }
    generate(&policy, targets::host()).unwrap();
    generate(&policy.clone().with_format(NumericFormat::I16), c2000).unwrap();
    *policy.layers[2].weights.last_mut().unwrap() = 0.5;
    policy.layers[0].bias[3] = -1e-39;
    assert!(
        toml_input::Faults::from(generate(&policy, c2000).unwrap_err())
            .to_string()
            .contains("bias0")
    );
}
