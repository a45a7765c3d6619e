//! `policyc compile --clock`: the control period against a model of cycles.

use serde_json::Value;

use super::Desk;

fn fit(desk: &Desk) -> Value {
    let manifest: Value = serde_json::from_str(&desk.read("out/manifest.json")).unwrap();
    manifest["costs"][0]["budget"]["fit"].clone()
}

#[test]
fn a_small_network_meets_its_period_at_a_usual_clock_and_misses_it_at_a_slow_one() {
    let desk = Desk::new("minimal");
    let met = desk.succeed("compile policy --target cortex-m4f --clock 168MHz --out out");
    assert!(
        met.contains("control period met") && met.contains("16,800 cycles at 168 MHz"),
        "{met}"
    );
    assert!(met.contains("never measured") && !met.contains("hint"), "{met}");
    assert_eq!(fit(&desk), "met");
    let missed = desk.succeed("compile policy --target cortex-m4f --clock 1MHz --out out");
    assert!(
        missed.contains("control period NOT met") && missed.contains("no numeric format fits"),
        "{missed}"
    );
    assert_eq!(fit(&desk), "missed");
    // what was generated does not depend on the clock
    desk.succeed("verify policy --generated out --steps 10");
}

#[test]
fn a_processor_without_floats_is_sent_to_integers() {
    let desk = Desk::new("minimal");
    let said = desk.succeed("compile policy --target cortex-m0plus --clock 30MHz --out out");
    assert!(
        said.contains("NOT met") && said.contains("hint: --format i16"),
        "{said}"
    );
}

#[test]
fn a_target_without_a_model_says_so() {
    let desk = Desk::new("minimal");
    let said = desk.succeed("compile policy --clock 3GHz --out out");
    assert!(said.contains("cannot be said"), "{said}");
}

#[test]
fn a_clock_that_is_none_is_refused() {
    let desk = Desk::new("minimal");
    for clock in ["168", "MHz", "168MV", "0Hz"] {
        desk.refuse(
            &format!("compile policy --out out --clock {clock}"),
            &["--clock", "168MHz"],
        );
    }
    desk.refuse(
        "compile policy --out out --no-costs --clock 168MHz",
        &["cannot be used with"],
    );
}
