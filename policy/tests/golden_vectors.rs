//! Golden vectors: what is read, and what cannot be.

mod common;
use common::*;
use safetensors::Dtype;

#[test]
fn golden_vectors_are_read() {
    let obs = f32_tensor("obs", &[2, 2], &[1.0, 5.0, -2.0, -10.0]);
    let q = f32_tensor("q", &[2, 3], &[0.0, 1.0, 0.5, 3.0, 1.0, 2.0]);
    let action = raw_tensor(
        "action",
        Dtype::I64,
        &[2],
        [1i64, 0].iter().flat_map(|v| v.to_le_bytes()).collect(),
    );
    let golden = Folder::new()
        .golden(&[obs.clone(), q.clone(), action.clone()])
        .policy()
        .golden
        .unwrap();
    assert_eq!(
        (golden.count, golden.observations[3], golden.q_values[5]),
        (2, -10.0, 2.0)
    );
    assert_eq!((golden.action_indices, golden.tolerance), (vec![1, 0], 1e-5));
    let q_only = Folder::new().golden(&[obs.clone(), q]).policy().golden.unwrap();
    assert!(q_only.action_indices.is_empty());
    let action_only = Folder::new().golden(&[obs, action]).policy().golden.unwrap();
    assert!(action_only.q_values.is_empty());
}

#[test]
fn observations_that_the_controller_cannot_see_are_refused_with_their_share() {
    let q = f32_tensor("q", &[2, 3], &[0.0, 1.0, 0.5, 3.0, 1.0, 2.0]);
    let fault = |tensors: &[Tensor]| Folder::new().golden(tensors).fault();
    let outside = f32_tensor("obs", &[2, 2], &[1.0, 5.0, 21.0, 0.0]);
    assert_tensor(
        &fault(&[outside.clone(), q.clone()]),
        "golden.safetensors",
        "obs",
        &["row 1", "`e` = 21", "-20 to 20", "order, scale or clip", "[parameters]"],
    );
    // the share is rounded up: 1 of 2 rows is 0.5
    let told = fault(&[outside, q.clone()]).to_string();
    assert!(
        told.contains("1 of 2 rows lies outside") && told.contains("golden_outside = 0.5 "),
        "{told}"
    );
    // with none left there is nothing that could be allowed
    let all = f32_tensor("obs", &[2, 2], &[22.0, 5.0, 21.0, 0.0]);
    let told = fault(&[all, q.clone()]).to_string();
    assert!(
        told.contains("all 2 rows lie outside") && told.contains("row 0") && !told.contains("golden_outside"),
        "{told}"
    );
}

#[test]
fn observations_that_are_left_out_are_counted_in_a_note() {
    let q = f32_tensor("q", &[2, 3], &[0.0, 1.0, 0.5, 3.0, 1.0, 2.0]);
    let outside = f32_tensor("obs", &[2, 2], &[1.0, 5.0, 21.0, 0.0]);
    let allowed = Folder::new()
        .golden(&[outside, q.clone()])
        .replace("hidden_activation", "golden_outside = 0.5\nhidden_activation");
    let notes = allowed.policy().notes.join("\n");
    assert!(notes.contains("1 of 2 golden observations are left out"), "{notes}");
    let inside = f32_tensor("obs", &[2, 2], &[1.0, 5.0, 2.0, 0.0]);
    let notes = Folder::new().golden(&[inside, q]).policy().notes.join("\n");
    assert!(!notes.contains("left out"), "{notes}");
}

#[test]
fn golden_vectors_that_cannot_be_are_refused() {
    const GOLDEN: &str = "golden.safetensors";
    let obs = f32_tensor("obs", &[2, 2], &[1.0, 5.0, -2.0, -10.0]);
    let q = f32_tensor("q", &[2, 3], &[0.0, 1.0, 0.5, 3.0, 1.0, 2.0]);
    let u8s = |values: &[u8]| raw_tensor("action", Dtype::U8, &[values.len()], values.to_vec());
    let fault = |tensors: &[Tensor]| Folder::new().golden(tensors).fault();
    assert_whole_file(&fault(std::slice::from_ref(&q)), GOLDEN, &["need the tensor `obs`"]);
    assert_whole_file(&fault(std::slice::from_ref(&obs)), GOLDEN, &["`q`", "`action`"]);
    assert_tensor(
        &fault(&[obs.clone(), tensor("q", &[2, 4])]),
        GOLDEN,
        "q",
        &["shape [2, 4]", "shape [2, 3]"],
    );
    assert_tensor(
        &fault(&[tensor("obs", &[2, 3]), q.clone()]),
        GOLDEN,
        "obs",
        &["shape [2, 3]", "shape [rows, 2]"],
    );
    assert_tensor(
        &fault(&[tensor("obs", &[2, 5]), tensor("q", &[5, 3])]),
        GOLDEN,
        "obs",
        &["shape [2, 5]", "shape [rows, 2]", "transposed"],
    );
    assert_tensor(
        &fault(&[obs.clone(), tensor("q", &[3, 2])]),
        GOLDEN,
        "q",
        &["shape [3, 2]", ".T.copy()"],
    );
    let column = raw_tensor("action", Dtype::U8, &[2, 1], vec![0, 1]);
    assert_tensor(
        &fault(&[obs.clone(), column]),
        GOLDEN,
        "action",
        &["shape [2, 1]", "squeeze"],
    );
    let real = f32_tensor("action", &[2], &[0.0, 1.0]);
    assert_tensor(&fault(&[obs.clone(), real]), GOLDEN, "action", &["F32", "astype"]);
    assert_whole_file(&fault(&[tensor("states", &[2, 2])]), GOLDEN, &["`states`", "rename"]);
    assert_tensor(
        &fault(&[obs.clone(), u8s(&[0, 3])]),
        GOLDEN,
        "action",
        &["row 1", "3", "0 to 2"],
    );
    assert_tensor(
        &fault(&[obs.clone(), q.clone(), u8s(&[1, 2])]),
        GOLDEN,
        "action",
        &["row 1", "action 2", "action 0"],
    );
    let nan = f32_tensor("obs", &[2, 2], &[1.0, 5.0, f32::NAN, 0.0]);
    assert_tensor(&fault(&[nan, q]), GOLDEN, "obs", &["nan at index 2"]);
    contract_fault(
        "hidden_activation",
        "golden_tolerance = ¦0.0\nhidden_activation",
        &["golden_tolerance"],
    );
    contract_fault(
        "hidden_activation",
        "golden_decisions = ¦1.5\nhidden_activation",
        &["golden_decisions", "0 to 1"],
    );
}

/// Answers that were made of a log are those that a contract reads: actions, duties, and what several outputs call them.
#[test]
fn answers_that_are_written_are_read_again() {
    let written = |policy: &policy::Policy, golden: &policy::Golden| {
        let bytes = policy::golden_file(policy, golden).unwrap();
        let tensors = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        let mut all: Vec<(String, Dtype, Vec<usize>, Vec<u8>)> = (tensors.iter())
            .map(|(name, view)| {
                (
                    name.to_owned(),
                    view.dtype(),
                    view.shape().to_vec(),
                    view.data().to_vec(),
                )
            })
            .collect();
        all.sort_by(|a, b| a.0.cmp(&b.0));
        all
    };
    let obs = f32_tensor("obs", &[2, 2], &[1.0, 5.0, -2.0, -10.0]);
    let action = raw_tensor(
        "action",
        Dtype::I32,
        &[2],
        [2i32, 0].iter().flat_map(|v| v.to_le_bytes()).collect(),
    );
    let policy = Folder::new().golden(&[obs.clone(), action.clone()]).policy();
    let golden = policy.golden.clone().unwrap();
    let of = |tensor: &Tensor| {
        (
            tensor.name.clone(),
            tensor.dtype,
            tensor.shape.clone(),
            tensor.data.clone(),
        )
    };
    assert_eq!(written(&policy, &golden), [of(&action), of(&obs)]);
    // duties in the place of actions
    let duty = f32_tensor("duty", &[2], &[0.5, 0.44]);
    let duties = policy::Golden {
        action_indices: Vec::new(),
        duties: vec![0.5, 0.44],
        ..golden
    };
    assert_eq!(written(&policy, &duties), [of(&duty), of(&obs)]);
}

#[test]
fn answers_beside_a_model_are_those_of_its_shape() {
    let obs = f32_tensor("obs", &[2, 2], &[1.0, 5.0, -2.0, -10.0]);
    let q = f32_tensor("q", &[2, 3], &[0.0, 1.0, 0.5, 3.0, 1.0, 2.0]);
    let bytes = encode(&[obs, q]);
    let fits = |inputs, outputs| {
        let name = toml_input::FileName::new("golden.safetensors".as_ref());
        policy::golden_fits(&name, bytes.clone(), inputs, outputs, &[]).map_err(|faults| faults.to_string())
    };
    assert!(fits(2, 3).is_ok());
    for (inputs, outputs) in [(3, 3), (2, 4)] {
        let said = fits(inputs, outputs).unwrap_err();
        assert!(
            said.contains("not the answers of this network"),
            "{inputs} {outputs}: {said}"
        );
    }
}

/// The row in the middle lies outside: what is left of each answer is that of the first and of the last one.
#[test]
fn a_row_that_is_left_out_takes_its_answers_along() {
    let obs = f32_tensor("obs", &[3, 2], &[1.0, 5.0, 21.0, 0.0, -2.0, -10.0]);
    let kept = [1.0, 5.0, -2.0, -10.0];
    let outside = |folder: Folder| {
        let folder = folder.replace("hidden_activation", "golden_outside = 0.5\nhidden_activation");
        let golden = folder.policy().golden.unwrap();
        assert_eq!(
            (golden.count, golden.outside, &golden.observations[..]),
            (2, 1, &kept[..])
        );
        golden
    };
    let q = [0.0, 1.0, 0.5, 3.0, 1.0, 2.0, 4.0, 5.0, 6.0];
    let action = raw_tensor("action", Dtype::U8, &[3], vec![1, 0, 2]);
    let golden = outside(Folder::new().golden(&[obs.clone(), f32_tensor("q", &[3, 3], &q), action]));
    assert_eq!(golden.q_values, [0.0, 1.0, 0.5, 4.0, 5.0, 6.0]);
    assert_eq!(golden.action_indices, [1, 2]);
    let actor = Folder::new()
        .replace("duties = [0.44, 0.50, 0.56]", "continuous = { clip = [0.41, 0.59] }")
        .tensors(&[dense("net.0", 4, 2), dense("net.2", 1, 4)].concat());
    let output = f32_tensor("output", &[3], &[0.25, 7.0, 0.5]);
    let golden = outside(actor.golden(&[obs, output, f32_tensor("duty", &[3], &[0.41, 0.59, 0.5])]));
    assert_eq!((golden.q_values, golden.duties), (vec![0.25, 0.5], vec![0.41, 0.5]));
}

#[test]
fn the_tolerance_is_the_contracts_or_that_of_rounding() {
    let obs = f32_tensor("obs", &[2, 2], &[1.0, 5.0, -2.0, -10.0]);
    let q = f32_tensor("q", &[2, 3], &[0.0, 1.0, 0.5, 3.0, 1.0, 2.0]);
    let own = Folder::new()
        .golden(&[obs, q])
        .replace("hidden_activation", "golden_tolerance = 0.03125\nhidden_activation");
    assert_eq!(own.policy().golden_tolerance(), 0.03125);
    assert_eq!(Folder::new().policy().golden_tolerance(), 1e-5);
}
