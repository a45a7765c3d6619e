//! Several outputs in one contract: what is read, and what is refused at which place.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use common::{CONTRACT, Folder, assert_says, dense, words};
use policy::{Fault, Faults, Head, Input, Output, Policy, ReadOptions};

/// A choice of three and a continuous output behind one network.
const OUTPUTS: &str = r#"[[output]]
name = "left"
actions = { duties = [0.44, 0.50, 0.56] }
mapping = { file = "drm.toml", load_current = "i_out" }
limits = { duty = [0.40, 0.60], slew = 0.02, initial_duty = 0.5 }
fallback = { duty = 0.0 }

[[output]]
name = "right"
actions = { continuous = { squash = "tanh", scale = 0.3, offset = 0.5 } }
limits = { duty = [0.2, 0.8] }
fallback = { duty = 0.25 }

[fallback]
hold = 3
"#;

/// The contract of the common tests with these outputs in the place of its own, over a last layer of `columns`.
fn folder(columns: usize) -> Folder {
    let (before, _) = CONTRACT.split_once("[actions]").unwrap();
    let network = [dense("net.0", 4, 2), dense("net.2", columns, 4)].concat();
    Folder::new().contract(&format!("{before}{OUTPUTS}")).tensors(&network)
}

fn load(folder: &Folder) -> Result<Policy, Faults> {
    let options = ReadOptions {
        several_outputs: true,
        ..ReadOptions::default()
    };
    policy::load_with(&folder.path().join("policy.toml"), &options)
}

fn policy(folder: &Folder) -> Policy {
    load(folder).unwrap_or_else(|faults| panic!("{faults}"))
}

fn outputs(policy: &Policy) -> &[Output] {
    match &policy.head {
        Head::Several(outputs) => outputs,
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn fault(folder: &Folder) -> Fault {
    let faults = load(folder).expect_err("it is accepted");
    assert_eq!(faults.faults.list.len(), 1, "{faults}");
    faults.faults.list[0].clone()
}

#[test]
fn each_output_has_columns_limits_fallback_and_mapping_of_its_own() {
    let policy = policy(&folder(4));
    let [left, right] = outputs(&policy) else {
        panic!("{:?}", policy.head)
    };
    assert_eq!((left.name.as_str(), left.column, left.head.outputs()), ("left", 0, 3));
    assert_eq!(
        (right.name.as_str(), right.column, right.head.outputs()),
        ("right", 3, 1)
    );
    assert_eq!((left.limits.slew, right.limits.slew), (Some(0.02), None));
    assert_eq!((left.fallback, right.fallback, policy.fallback.hold), (0.0, 0.25, 3));
    // as without outputs: the fallback duty, where the contract says no other
    assert_eq!((left.limits.initial_duty, right.limits.initial_duty), (0.5, 0.25));
    assert!(left.mapping.is_some() && right.mapping.is_none());
    assert_eq!((policy.outputs(), policy.output_names()), (4, vec!["left", "right"]));
    assert!(policy.digests.mapping.is_some());
}

#[test]
fn columns_may_stand_in_another_order_than_the_outputs() {
    let turned = folder(4)
        .replace("name = \"left\"", "name = \"left\"\ncolumn = 1")
        .replace("name = \"right\"", "name = \"right\"\ncolumn = 0");
    let policy = policy(&turned);
    let columns: Vec<_> = policy.paths().iter().map(|path| path.columns()).collect();
    assert_eq!(columns, [1..4, 0..1]);
}

#[test]
fn a_source_names_the_output_whose_duty_it_reads() {
    let own = folder(4).replace(
        "source = \"v_ref - v_out\"\nfilters",
        "source = \"left_previous_duty - right_previous_command\"\nfilters",
    );
    let policy = policy(&own);
    assert!(policy.reads(Input::OutputDuty(0)) && policy.reads(Input::OutputCommand(1)));
    assert!(!policy.reads(Input::OutputCommand(0)) && !policy.reads(Input::PreviousDuty));
    // left: 0.44 to 0.56 and 0, right: 0.2 to 0.8
    let bound = policy.features[1].bound;
    assert!(
        (bound.low + 0.8).abs() < 1e-6 && (bound.high - 0.36).abs() < 1e-6,
        "{bound:?}"
    );
    let vague = folder(4).replace(
        "source = \"v_ref - v_out\"\nfilters",
        "source = \"previous_duty\"\nfilters",
    );
    assert_says(
        &fault(&vague),
        &[
            "does not say of which output",
            "left_previous_duty or right_previous_duty",
        ],
    );
}

#[test]
fn columns_that_overlap_lie_outside_or_do_not_fit_the_network_are_refused() {
    let overlap = folder(4).replace("name = \"right\"", "name = \"right\"\ncolumn = 2");
    assert_says(&fault(&overlap), &["decides two outputs", "columns 2 to 2 and 0 to 2"]);
    let outside = folder(4).replace("name = \"right\"", "name = \"right\"\ncolumn = 7");
    assert_says(&fault(&outside), &["outside of the last layer", "columns 7 to 7 of 4"]);
    // the list has 4 columns, the network 5: said where a wrong number of actions is
    let faults = load(&folder(5)).expect_err("a column that no output reads").to_string();
    assert!(faults.contains('5') && faults.contains('4'), "{faults}");
}

#[test]
fn what_an_output_lacks_or_has_too_much_is_said_at_its_place() {
    let cases: [(&str, &str, &[&str]); 9] = [
        (
            "fallback = { duty = 0.25 }\n",
            "",
            &["`fallback` is missing", "each output"],
        ),
        (
            "fallback = { duty = 0.25 }",
            "fallback = { duty = 0.25, hold = 3 }",
            &["unknown key `hold`", "[fallback]"],
        ),
        (
            "hold = 3",
            "hold = 3\nduty = 0.1",
            &["unknown key `duty`", "each [[output]] has its own"],
        ),
        ("limits = { duty = [0.2, 0.8] }\n", "", &["`limits` is missing"]),
        ("name = \"right\"", "name = \"left\"", &["`left` is used twice"]),
        (
            "name = \"right\"",
            "name = \"Right\"",
            &["cannot be the name of a output"],
        ),
        (
            "continuous = { squash = \"tanh\", scale = 0.3, offset = 0.5 }",
            "base = \"0.5\", offsets = [0.1]",
            &["2 to"],
        ),
        (
            "[fallback]\nhold",
            "[limits]\nduty = [0.1, 0.9]\n\n[fallback]\nhold",
            &["[limits] stands beside [[output]]"],
        ),
        (
            "name = \"i_out\"\nunit = \"A\"",
            "name = \"left_previous_duty\"\nunit = \"A\"",
            &["used twice"],
        ),
    ];
    for (from, to, expected) in cases {
        let faults = load(&folder(4).replace(from, to)).expect_err(from);
        let all: Vec<String> = faults.faults.list.iter().map(words).collect();
        assert!(
            expected.iter().all(|part| all.iter().any(|fault| fault.contains(part))),
            "{from} -> {to}: {expected:?} not in {faults}"
        );
    }
}

const OBSERVER: &str = r#"[[observer]]
name = "model"
duty = "right"
inductance = 2e-3
capacitance = 1.5e-3
input_voltage = 200.0
output_voltage = "v_out"
load_current = "i_out"
compute_delay = 1
gains = { current = 0.1, voltage = 0.2, bias = 0.01 }
current = [0.0, 60.0]
bias = [-8.0, 4.0]

[[output]]
name = "left""#;

#[test]
fn an_observer_names_the_output_that_drives_it() {
    let observed = |duty: &str| {
        let observer = OBSERVER.replace("duty = \"right\"\n", duty);
        folder(4).replace("[[output]]\nname = \"left\"", &observer)
    };
    let of = |duty: &str| policy(&observed(duty));
    let (left, right) = (of("duty = \"left\"\n"), of("duty = \"right\"\n"));
    assert_eq!((left.observers[0].output, right.observers[0].output), (0, 1));
    assert!(right.reads(Input::OutputCommand(1)) && !right.reads(Input::OutputCommand(0)));
    assert_ne!(left.digests.contract, right.digests.contract);
    let said = policy::describe::observers(&right);
    assert!(said.contains("model: driven by right, "), "{said}");
    assert_says(
        &fault(&observed("")),
        &["`duty` is missing", "left, right", "`duty = \"left\"`"],
    );
    let misspelt = fault(&observed("duty = \"rihgt\"\n"));
    assert_says(&misspelt, &["no output `rihgt`", "did you mean `right`"]);
    // nothing of the observer is reported where the list of outputs is what is wrong
    let faulty = observed("duty = \"right\"\n").replace("name = \"right\"", "name = \"left\"");
    assert_says(&fault(&faulty), &["`left` is used twice"]);
}

#[test]
fn an_observer_of_one_output_names_none() {
    let observer = OBSERVER.replace("[[output]]\nname = \"left\"", "[[feature]]\nname = \"e\"");
    let single = Folder::new().replace("[[feature]]\nname = \"e\"", &observer);
    assert_says(&single.fault(), &["names one of several outputs", "leave it out"]);
}

#[test]
fn a_law_is_refused_with_the_way_out() {
    let law = folder(4).replace(
        "continuous = { squash = \"tanh\", scale = 0.3, offset = 0.5 }",
        "base = \"0.5\", offsets = [-0.1, 0.1]",
    );
    assert!(
        load(&law)
            .unwrap_err()
            .to_string()
            .contains("a law of control has one output")
    );
}

/// Chosen actions as trainers save them.
fn indices(name: &str, shape: &[usize], list: &[i32]) -> common::Tensor {
    let data = list.iter().flat_map(|index| index.to_le_bytes()).collect();
    common::raw_tensor(name, safetensors::Dtype::I32, shape, data)
}

/// Golden answers of three vectors with these tensors beside `obs`.
fn with_golden(tensors: &[common::Tensor]) -> Folder {
    let obs = common::f32_tensor("obs", &[3, 2], &[0.0; 6]);
    folder(4).golden(&[&[obs], tensors].concat())
}

#[test]
fn golden_answers_hold_the_last_layer_and_what_became_of_each_output() {
    // the choice of left: 0, 2, 1
    let layer = [1.0, 0.5, 0.0, 4.0, 0.0, 0.5, 1.0, 5.0, -2.0, -1.0, -3.0, 6.0];
    let layer = common::f32_tensor("output", &[3, 4], &layer);
    let actions = indices("action_left", &[3], &[0, 2, 1]);
    let duties = common::f32_tensor("duty_right", &[3], &[0.25, 0.5, 0.75]);
    let policy = policy(&with_golden(&[layer.clone(), actions.clone(), duties.clone()]));
    let golden = policy.golden.as_ref().unwrap();
    assert_eq!((golden.count, golden.q_values.len(), golden.outputs.len()), (3, 12, 2));
    let paths = policy.paths();
    let [left, right] = [0, 1].map(|index| golden.of_output(index, &paths[index].columns()));
    assert_eq!(left.q_values, [1.0, 0.5, 0.0, 0.0, 0.5, 1.0, -2.0, -1.0, -3.0]);
    assert_eq!((left.action_indices, left.duties), (vec![0, 2, 1], vec![]));
    assert_eq!(
        (right.q_values, right.duties),
        (vec![4.0, 5.0, 6.0], vec![0.25, 0.5, 0.75])
    );
    // either part is enough, and the last layer may be called as that of a choice
    let alone = self::policy(&with_golden(&[actions, duties])).golden.unwrap();
    assert!(alone.q_values.is_empty());
    let mut named = layer;
    named.name = "q".to_owned();
    assert_eq!(self::policy(&with_golden(&[named])).golden.unwrap().q_values.len(), 12);
}

#[test]
fn golden_answers_that_leave_an_output_out_or_name_none_are_refused() {
    let actions = |name: &str, list: &[i32]| indices(name, &[3], list);
    let layer = |name: &str| common::f32_tensor(name, &[3, 4], &[0.0, 1.0, 0.0, 0.0].repeat(3));
    let one = fault(&with_golden(&[actions("action_left", &[0, 0, 0])]));
    assert_says(
        &one,
        &["nothing of the outputs right", "`output` f32 [3, 4]", "`duty_right`"],
    );
    let misspelt = fault(&with_golden(&[layer("output"), actions("action_lfet", &[1, 1, 1])]));
    assert_says(
        &misspelt,
        &["`action_lfet` is the answer of no output", "did you mean `action_left`"],
    );
    let whole = fault(&with_golden(&[layer("output"), actions("action", &[1, 1, 1])]));
    assert_says(
        &whole,
        &["`action` is the answer of no output", "action_left, duty_right"],
    );
    let twice = fault(&with_golden(&[layer("output"), layer("q")]));
    assert_says(&twice, &["hold the last layer twice"]);
    let other = fault(&with_golden(&[layer("output"), actions("action_left", &[1, 0, 1])]));
    assert_says(&other, &["row 1", "not the one with the largest q value"]);
    let beyond = fault(&with_golden(&[layer("output"), actions("action_left", &[1, 3, 1])]));
    assert_says(&beyond, &["row 1", "0 to 2"]);
    let narrow = fault(&with_golden(&[common::f32_tensor("output", &[3, 3], &[0.0; 9])]));
    assert_says(&narrow, &["[3, 3]", "[3, 4]"]);
}

#[test]
fn a_reader_that_knows_one_duty_refuses_several_by_name() {
    let fault = folder(4).fault();
    assert_says(
        &fault,
        &["several outputs", "left, right", "`policyc new MODEL --output N`"],
    );
}

#[test]
fn one_output_is_written_without_a_list() {
    let (before, _) = CONTRACT.split_once("[actions]").unwrap();
    let (one, _) = OUTPUTS.split_once("[[output]]\nname = \"right\"").unwrap();
    let single = Folder::new().contract(&format!("{before}{one}[fallback]\nhold = 3\n"));
    assert_says(
        &fault(&single),
        &["too few outputs", "[actions], [limits] and [fallback]"],
    );
}

#[test]
fn one_output_is_taken_by_its_name() {
    let several = policy(&folder(4));
    let chosen = |policy: &Policy, name: Option<&str>| {
        policy
            .chosen_output(name)
            .map_err(|message| toml_input::Faults::from(message).to_string())
    };
    assert_eq!(chosen(&several, Some("right")), Ok(1));
    assert_eq!(chosen(&several, Some("left")), Ok(0));
    let none = chosen(&several, None).unwrap_err();
    assert!(
        none.contains("several outputs") && none.contains("outputs left, right"),
        "{none}"
    );
    let wrong = chosen(&several, Some("rigth")).unwrap_err();
    assert!(
        wrong.contains("one of left, right") && wrong.contains("`right`"),
        "{wrong}"
    );
    let one = Folder::new().policy();
    assert_eq!(chosen(&one, None), Ok(0));
    let named = chosen(&one, Some("left")).unwrap_err();
    assert!(named.contains("left") && named.contains("no name"), "{named}");
    // of a place that there is not it is the first
    let names = |policy: &Policy| [0, 1, 2].map(|index| policy.path(index).named("duty"));
    assert_eq!(names(&several), ["duty_left", "duty_right", "duty_left"]);
    assert_eq!(names(&one), ["duty", "duty", "duty"]);
}

#[test]
fn a_mapping_is_put_before_the_output_of_its_index() {
    let several = policy(&folder(4));
    let mut mapping = *several.path(0).mapping.unwrap();
    mapping.coefficients.b = 0.125;
    let b = |policy: &Policy| {
        policy
            .paths()
            .iter()
            .map(|path| path.mapping.map(|own| own.coefficients.b))
            .collect::<Vec<_>>()
    };
    assert_eq!(b(&several.clone().with_mapping(1, mapping)), [Some(0.0), Some(0.125)]);
    assert_eq!(b(&several.clone().with_mapping(0, mapping)), [Some(0.125), None]);
    assert_eq!(b(&several.with_mapping(2, mapping)), [Some(0.0), None]);
    assert_eq!(b(&Folder::new().policy().with_mapping(0, mapping)), [Some(0.125)]);
}

#[test]
fn golden_duties_of_an_output_may_be_a_column() {
    let duties = |shape: &[usize]| {
        let duties = common::f32_tensor("duty_right", shape, &[0.5, 0.625, 0.75]);
        let actions = common::raw_tensor(
            "action_left",
            safetensors::Dtype::I32,
            &[3],
            [0i32, 1, 2].iter().flat_map(|x| x.to_le_bytes()).collect(),
        );
        let golden = policy(&with_golden(&[actions, duties])).golden.unwrap();
        golden.outputs[1].duties.clone()
    };
    assert_eq!(duties(&[3, 1]), [0.5, 0.625, 0.75]);
    assert_eq!(duties(&[3]), [0.5, 0.625, 0.75]);
}

/// The stand-in of a faulty contract has a field for each name, and a name that is given twice has one.
#[test]
fn a_faulty_contract_still_tells_the_names_of_its_outputs() {
    let names = |folder: &Folder| load(folder).unwrap_err().skeleton.outputs;
    let faulty = folder(4).replace("hold = 3", "hold = -3");
    assert_eq!(names(&faulty), [Some("left".to_owned()), Some("right".to_owned())]);
    let twice = folder(4).replace("name = \"right\"", "name = \"left\"");
    assert_eq!(names(&twice), [Some("left".to_owned()), None]);
}
