//! Observers and laws: what they mean, and what of them is refused.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use policy::{Circuit, Estimate, Head, Input, InputVoltage, OnTime};

const OBSERVER: &str = "[[observer]]
name = \"model\"
inductance = 2e-3
capacitance = 1.5e-3
input_voltage = 200.0
output_voltage = \"v_out\"
load_current = \"i_out\"
compute_delay = 1
gains = { current = 0.1, voltage = 0.2, bias = 0.01 }
current = [0.0, 60.0]
bias = [-8.0, 4.0]

[[feature]]
name = \"e\"";

const LAW: &str = "base = \"0.5 - 0.01 * (model_current - i_out)\"
offsets = [-0.1, 0.0, 0.1]
dead_zone = [{ source = \"model_voltage - v_ref\", within = 0.25 }]";

fn folder() -> Folder {
    Folder::new().replace("[[feature]]\nname = \"e\"", OBSERVER)
}

fn with_law() -> Folder {
    folder().replace("duties = [0.44, 0.50, 0.56]", LAW)
}

#[test]
fn a_law_is_described_with_where_it_is_left_alone() {
    let said = policy::describe::actions(&with_law().policy());
    for part in [
        "duty = 0.5 - 0.01 * (model_current - i_out)",
        "nothing is added where |model_voltage - v_ref| <= 0.25",
        "offsets",
        "-0.1",
    ] {
        assert!(said.contains(part), "lacks {part}:\n{said}");
    }
}

/// The one fault of a folder says all of it.
fn refused(folder: Folder, parts: &[&str]) {
    let faults = folder.faults();
    assert_eq!(faults.faults.list.len(), 1, "{faults}");
    let said = faults.to_string();
    for part in parts {
        assert!(said.contains(part), "lacks {part:?}:\n{said}");
    }
}

#[test]
fn estimates_are_read_as_signals_are() {
    let policy = folder()
        .replace(
            "source = \"v_ref - v_out\"\nscale",
            "source = \"v_ref - model_voltage\"\nscale",
        )
        .policy();
    let observer = &policy.observers[0];
    assert_eq!((observer.output_voltage, observer.load_current), (0, 1));
    assert_eq!(observer.input_voltage, InputVoltage::Constant(200.0));
    assert_eq!(observer.range(Estimate::Voltage), policy.signals[0].range);
    assert!(policy.features[0].source.reads(Input::Estimate(0, Estimate::Voltage)));
    assert!(policy.reads(Input::PreviousCommand), "the command drives the model");
    assert!(policy.reads(Input::Signal(1)), "the model is loaded by it");
    assert!(
        policy.notes.iter().all(|note| !note.contains("feeds no feature")),
        "{:?}",
        policy.notes
    );
    // the estimate's range bounds the feature: 100 less 0 to 250, times 0.2, clipped at 20
    let bound = policy.features[0].bound;
    assert!(
        (bound.low + 20.0).abs() < 1e-5 && (bound.high - 20.0).abs() < 1e-5,
        "{bound:?}"
    );
}

#[test]
fn an_observer_that_nothing_reads_is_noted() {
    let policy = folder().policy();
    assert!(
        policy
            .notes
            .iter()
            .any(|note| note.contains("nothing reads an estimate of observer `model`")),
        "{:?}",
        policy.notes
    );
}

#[test]
fn a_law_and_what_is_added_to_it() {
    let policy = with_law().policy();
    let Head::Residual(head) = &policy.head else {
        panic!("{:?}", policy.head)
    };
    let offsets: Vec<f64> = head.offsets.iter().map(|action| action.duty).collect();
    assert_eq!(offsets, [-0.1, 0.0, 0.1]);
    assert_eq!((head.limits.low, head.limits.high), (0.4, 0.6));
    assert_eq!(head.dead_zone[0].within, 0.25);
    // nothing leaves the limits, so these are the ends of all duties
    let ends = policy.head.duties();
    assert!(ends[0] >= 0.4 && ends[1] <= 0.6 && ends.len() == 2, "{ends:?}");
    let law = policy.law_alone().unwrap();
    assert!(law.actions().iter().all(|action| action.duty == 0.0));
    assert!(Folder::new().policy().law_alone().is_none());
}

#[test]
fn a_base_that_reads_nothing_measured_is_no_law_of_its_own() {
    let base = |text: &str| {
        with_law()
            .replace("0.5 - 0.01 * (model_current - i_out)", text)
            .policy()
            .law_alone()
            .is_some()
    };
    assert!(!base("previous_duty"), "a constant for ever");
    assert!(!base("0.5"));
    assert!(base("previous_duty + 0.001 * (100 - v_out)"), "an integral law");
}

#[test]
fn equal_contracts_have_equal_digests_and_another_gain_another() {
    let digest = |folder: Folder| folder.policy().digests.contract;
    assert_eq!(digest(with_law()), digest(with_law()));
    assert_ne!(
        digest(with_law()),
        digest(with_law().replace("voltage = 0.2", "voltage = 0.21"))
    );
    assert_ne!(
        digest(with_law()),
        digest(with_law().replace("within = 0.25", "within = 0.26"))
    );
    assert_ne!(
        digest(with_law()),
        digest(with_law().replace("0.5 - 0.01", "0.5 - 0.02"))
    );
}

#[test]
fn faults_of_an_observer_say_what_it_wants() {
    let faulty = |from: &str, to: &str| folder().replace(from, to);
    refused(
        faulty("output_voltage = \"v_out\"", "output_voltage = \"v_ou\""),
        &["v_ou", "did you mean `v_out`"],
    );
    refused(
        faulty("load_current = \"i_out\"\ncompute", "compute"),
        &["load_current", "the signal of the load current"],
    );
    refused(
        faulty("input_voltage = 200.0", "input_voltage = \"v_in\""),
        &["v_in", "signal"],
    );
    refused(
        faulty("compute_delay = 1", "compute_delay = 2"),
        &["compute_delay", "0", "1"],
    );
    refused(faulty(", bias = 0.01", ""), &["bias", "gains"]);
    refused(faulty("inductance = 2e-3", "inductance = 0.0"), &["inductance"]);
    refused(faulty("bias = [-8.0, 4.0]", "bias = [1.0, 4.0]"), &["bias", "0 in it"]);
    refused(faulty("current = [0.0, 60.0]", "current = [60.0, 0.0]"), &["current"]);
    refused(faulty("name = \"model\"", "name = \"i\"\nnome = 1"), &["nome"]);
    let (one, _) = OBSERVER.split_once("\n\n[[feature]]").unwrap();
    let five: String = (0..5)
        .map(|number| one.replace("model", &format!("model_{number}")) + "\n")
        .collect();
    refused(faulty(one, &five), &["too many observers", "5", "0 to 4"]);
}

#[test]
fn names_of_estimates_clash_with_nothing() {
    let called = folder().replace("v_ref = 100.0", "v_ref = 100.0\nmodel_bias = 1.0");
    refused(called, &["model_bias"]);
    // the observer is faulty, but what reads it is not reported beside it
    let misspelt = folder().replace("inductance = 2e-3", "inductance = -1.0").replace(
        "source = \"v_ref - v_out\"\nscale",
        "source = \"v_ref - model_voltage\"\nscale",
    );
    refused(misspelt, &["inductance"]);
    let unknown = folder().replace(
        "source = \"v_ref - v_out\"\nscale",
        "source = \"v_ref - model_volts\"\nscale",
    );
    refused(unknown, &["model_volts", "did you mean `model_voltage`"]);
}

#[test]
fn a_prediction_that_could_leave_the_format_is_refused() {
    let faults = folder().replace("capacitance = 1.5e-3", "capacitance = 1e-42");
    refused(faults, &["observer `model`"]);
}

#[test]
fn faults_of_a_law_say_what_it_wants() {
    let faulty = |from: &str, to: &str| with_law().replace(from, to);
    refused(
        faulty("base = \"0.5 - 0.01 * (model_current - i_out)\"\n", ""),
        &["`offsets` is given without `base`", "law"],
    );
    refused(
        faulty("offsets = [-0.1, 0.0, 0.1]", "offsets = [-0.1, 0.0, 1.5]"),
        &["1.5", "-1"],
    );
    refused(faulty("within = 0.25", "within = 0.0"), &["within"]);
    refused(
        faulty("model_voltage - v_ref\"", "model_volt - v_ref\""),
        &["model_volt", "did you mean"],
    );
    let without = folder().replace("duties = [0.44", "base = \"0.5\"\nduties = [0.44");
    refused(without, &["`base` is given without `offsets`"]);
    let both = faulty("offsets = ", "duties = [0.4, 0.5, 0.6]\noffsets = ");
    let faults = both.faults().to_string();
    assert!(faults.contains("exactly one of"), "{faults}");
}

/// A boost from the 200 V of the observer above.
fn boosted(keys: &str) -> Folder {
    folder().replace("name = \"model\"\n", &format!("name = \"model\"\n{keys}\n"))
}

#[test]
fn a_circuit_with_a_voltage_to_hold_has_a_surplus() {
    let policy = boosted("topology = \"boost\"\ncarrier = \"centre\"\nhold = 400.0")
        .replace(
            "source = \"v_ref - v_out\"\nscale",
            "source = \"v_ref - model_surplus\"\nscale",
        )
        .policy();
    let observer = &policy.observers[0];
    assert_eq!((observer.topology, observer.carrier), (Circuit::Boost, OnTime::Centre));
    let hold = observer.hold.unwrap();
    // 1/400 V, and twice the current of the load
    assert_eq!((hold.voltage, hold.share, hold.start), (400.0, 0.0025, 2.0));
    // a current of 0 to 60 A less the load
    let load = policy.signals[1].range;
    let range = observer.range(Estimate::Surplus);
    assert_eq!((range.low, range.high), (-load.high, 60.0 - load.low));
    // none of a current that never falls to 0 may reach the output, too, and none of one that never rises to it
    let surplus = |current: &str| {
        let folder = boosted("topology = \"boost\"\nhold = 400.0").replace("current = [0.0, 60.0]", current);
        folder.policy().observers[0].range(Estimate::Surplus)
    };
    assert_eq!(surplus("current = [2.0, 60.0]").low, -load.high);
    assert_eq!(surplus("current = [-60.0, -2.0]").high, -load.low);
    assert_eq!(observer.words(), 3, "the surplus is no state");
    assert_eq!(observer.estimates().count(), 4);
    assert!(policy.features[0].source.reads(Input::Estimate(0, Estimate::Surplus)));
    let said = policy::describe::observers(&policy);
    for part in ["boost, on in the middle", "model_surplus", "at 400 V"] {
        assert!(said.contains(part), "{said}");
    }
    let plain = folder().policy();
    assert!(
        plain.observers[0]
            .estimates()
            .all(|estimate| estimate != Estimate::Surplus)
    );
    let spelled = boosted("topology = \"buck\"\ncarrier = \"trailing\"").policy();
    assert_eq!(
        plain.digests.contract, spelled.digests.contract,
        "what was the only circuit is the usual one"
    );
    assert_ne!(plain.digests.contract, policy.digests.contract);
}

#[test]
fn a_faulty_circuit_is_refused() {
    refused(boosted("topology = \"bost\""), &["bost", "did you mean", "boost"]);
    refused(boosted("carrier = \"leading\""), &["leading", "trailing, centre"]);
    refused(
        boosted("hold = 100.0"),
        &["no surplus", "a buck converter", "model_current - i_out"],
    );
    refused(boosted("topology = \"boost\"\nhold = 0.0"), &["hold"]);
    refused(boosted("topology = \"boost\"\nhold = 1e-60"), &["hold", "f32"]);
    refused(
        boosted("topology = \"buck-boost\"\nhold = 100.0")
            .replace("input_voltage = 200.0", "input_voltage = \"v_out\""),
        &["no surplus", "input voltage is a signal"],
    );
    // without a voltage to hold there is no such estimate
    let blind = boosted("topology = \"boost\"").replace(
        "source = \"v_ref - v_out\"\nscale",
        "source = \"v_ref - model_surplus\"\nscale",
    );
    refused(blind, &["model_surplus"]);
}
