//! Layer chains from the names of every trainer we know.

mod common;
use common::*;
use safetensors::Dtype;

fn names(tensors: &[Tensor]) -> Vec<String> {
    let layers = Folder::new().tensors(tensors).policy().layers;
    layers.into_iter().map(|layer| layer.name).collect()
}

fn all(stems: &[(&str, usize, usize)]) -> Vec<Tensor> {
    stems
        .iter()
        .flat_map(|(stem, outputs, inputs)| dense(stem, *outputs, *inputs))
        .collect()
}

/// 2 - 4 - 4 - 3, so that shapes alone do not order the first two... and numbers must.
fn three(stems: [&str; 3]) -> Vec<Tensor> {
    all(&[(stems[0], 4, 2), (stems[1], 4, 4), (stems[2], 3, 4)])
}

fn notes(tensors: &[Tensor]) -> String {
    Folder::new().tensors(tensors).policy().notes.join("\n")
}

#[test]
fn stable_baselines3_takes_the_online_network_and_notes_the_target_network() {
    let own = ["q_net.q_net.0", "q_net.q_net.2", "q_net.q_net.4"];
    let target = ["q_net_target.q_net.0", "q_net_target.q_net.2", "q_net_target.q_net.4"];
    assert_eq!(names(&three(own)), own);
    let both = [three(target), three(own)].concat();
    assert_eq!(names(&both), own);
    let text = notes(&both);
    assert!(
        text.contains("passed over as a target network: q_net_target.q_net.0"),
        "{text}"
    );
    assert!(!text.contains("unused"), "{text}");
    assert_eq!(names(&three(target)), target, "alone it is taken");
}

#[test]
fn cleanrl_tianshou_and_plain_pytorch_names_are_followed() {
    for stems in [
        ["network.0", "network.2", "network.4"],
        ["model.model.0", "model.model.2", "model.model.4"],
        ["net.0", "net.2", "net.4"],
        ["fc1", "fc2", "fc3"],
        ["layer1", "layer2", "layer3"],
        ["model.0.linear", "model.1.linear", "model.2.linear"],
    ] {
        assert_eq!(names(&three(stems)), stems);
    }
}

#[test]
fn numbers_are_ordered_as_numbers() {
    assert_eq!(names(&three(["fc8", "fc9", "fc10"])), ["fc8", "fc9", "fc10"]);
    assert_eq!(
        names(&three(["net.2", "net.10", "net.100"])),
        ["net.2", "net.10", "net.100"]
    );
}

#[test]
fn equal_shapes_are_ordered_by_number_and_not_by_text() {
    let stems = ["fc8", "fc9", "fc10", "fc11"];
    let sizes = [(4, 2), (4, 4), (4, 4), (3, 4)];
    let tensors: Vec<_> = stems
        .iter()
        .zip(sizes)
        .flat_map(|(stem, (o, i))| dense(stem, o, i))
        .collect();
    assert_eq!(names(&tensors), stems);
    let keras = ["dense", "dense_1", "dense_2", "dense_3"];
    let tensors: Vec<_> = keras
        .iter()
        .zip(sizes)
        .flat_map(|(stem, (o, i))| dense(stem, o, i))
        .collect();
    assert_eq!(names(&tensors), keras);
}

#[test]
fn keras_and_flax_kernels_are_transposed() {
    for stems in [
        ["dense", "dense_1", "dense_2"],
        ["params/Dense_0", "params/Dense_1", "params/Dense_2"],
    ] {
        for suffix in ["", ":0"] {
            let sizes = [(4, 2), (4, 4), (3, 4)];
            let tensors = stems.iter().zip(sizes).flat_map(|(stem, (outputs, inputs))| {
                [
                    tensor(&format!("{stem}/kernel{suffix}"), &[inputs, outputs]),
                    tensor(&format!("{stem}/bias{suffix}"), &[outputs]),
                ]
            });
            let tensors: Vec<_> = tensors.collect();
            assert_eq!(names(&tensors), stems);
            let layer = &Folder::new().tensors(&tensors).policy().layers[0];
            let stored: Vec<f32> = tensors[0]
                .data
                .chunks(4)
                .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
                .collect();
            assert_eq!(layer.weights, [0, 4, 1, 5, 2, 6, 3, 7].map(|i: usize| stored[i]));
        }
    }
}

#[test]
fn mixed_names_are_chained_by_their_shapes() {
    assert_eq!(names(&three(["fc1", "fc2", "out"])), ["fc1", "fc2", "out"]);
    assert_eq!(
        names(&three(["body.0", "body.2", "head"])),
        ["body.0", "body.2", "head"]
    );
    assert_eq!(
        names(&all(&[("first", 4, 2), ("hidden", 5, 4), ("final", 3, 5)])),
        ["first", "hidden", "final"]
    );
}

#[test]
fn a_second_network_that_does_not_fit_is_left_unused() {
    let tensors = [
        three(["actor.0", "actor.2", "actor.4"]),
        all(&[("critic.0", 4, 2), ("critic.2", 1, 4)]),
    ]
    .concat();
    assert_eq!(names(&tensors), ["actor.0", "actor.2", "actor.4"]);
    assert!(notes(&tensors).contains("tensors left unused: critic.0.bias, critic.0.weight"));
}

#[test]
fn numbered_layers_come_before_the_head_where_shapes_allow_a_rotation() {
    // without a contract, as many outputs as inputs would let the head stand first as well
    let tensors = all(&[("fc1", 8, 4), ("fc2", 8, 8), ("out", 4, 8)]);
    let folder = Folder::new().tensors(&tensors);
    let weights = folder.path().join("weights.safetensors");
    let text = scaffold(&weights).unwrap();
    assert!(text.contains("first to last: fc1 > fc2 > out"), "{text}");
}

#[test]
fn a_tensor_of_no_dense_layer_is_refused_unless_the_layers_are_named() {
    let mut tensors = three(["fc1", "fc2", "fc3"]);
    tensors.push(tensor("ln.weight", &[4]));
    let folder = Folder::new().tensors(&tensors);
    assert_tensor(
        &folder.fault(),
        "weights.safetensors",
        "ln.weight",
        &["no dense layer", "[4]", "layers = "],
    );
    let named = folder.replace(
        "hidden_activation",
        "layers = [\"fc1\", \"fc2\", \"fc3\"]\nhidden_activation",
    );
    assert!(named.policy().notes.join("\n").contains("left unused: ln.weight"));
}

#[test]
fn several_fitting_chains_ask_for_a_prefix() {
    let tensors = [three(["a.0", "a.2", "a.4"]), three(["b.0", "b.2", "b.4"])].concat();
    let folder = Folder::new().tensors(&tensors);
    let fault = folder.fault();
    assert_whole_file(
        &fault,
        "weights.safetensors",
        &["more than one chain", "a.0 > a.2 > a.4; b.0 > b.2 > b.4", "prefix = "],
    );
    let with = |setting: &str| {
        let folder = Folder::new()
            .tensors(&tensors)
            .replace("hidden_activation", &format!("{setting}\nhidden_activation"));
        folder.policy().layers[0].name.clone()
    };
    assert_eq!(with("prefix = \"b\""), "b.0");
    assert_eq!(with("prefix = \"b.\""), "b.0");
    assert_eq!(with("layers = [\"a.0\", \"a.2\", \"a.4\"]"), "a.0");
    assert_eq!(with("layers = [\"b.0\", \"a.4\"]"), "b.0");
}

#[test]
fn a_prefix_ends_where_a_part_of_the_name_ends() {
    let tensors = [three(["q.0", "q.2", "q.4"]), three(["q_old.0", "q_old.2", "q_old.4"])].concat();
    let folder = Folder::new()
        .tensors(&tensors)
        .replace("hidden_activation", "prefix = \"q\"\nhidden_activation");
    assert_eq!(folder.policy().layers[0].name, "q.0");
}

#[test]
fn an_order_that_shapes_do_not_decide_asks_for_the_layers() {
    let tensors = all(&[("first", 4, 2), ("left", 4, 4), ("right", 4, 4), ("last", 3, 4)]);
    let fault = Folder::new().tensors(&tensors).fault();
    assert_says(
        &fault,
        &["more than one chain", "left > right", "right > left", "layers = "],
    );
    let layers = "layers = [\"first\", \"right\", \"left\", \"last\"]\nhidden_activation";
    let policy = Folder::new()
        .tensors(&tensors)
        .replace("hidden_activation", layers)
        .policy();
    assert_eq!(policy.layers[1].name, "right");
}

#[test]
fn listed_layers_and_prefixes_must_exist_and_fit() {
    let before = "hidden_activation = ";
    let with = |setting: &str| format!("{setting}\n{before}");
    contract_fault(
        before,
        &with("layers = [\"net.0\", ¦\"net.3\"]"),
        &["no layer `net.3`", "net.0, net.2", "did you mean"],
    );
    contract_fault(
        before,
        &with("layers = [\"net.0\", ¦\"net.0\"]"),
        &["`net.0` is listed twice"],
    );
    contract_fault(
        before,
        &with("prefix = ¦\"q_net\""),
        &["no layer begins with the prefix `q_net`", "net.0, net.2"],
    );
    contract_fault(before, &with("layers = ¦[]"), &["too few layers"]);
    let fault = Folder::new()
        .replace(before, &with("layers = [\"net.2\", \"net.0\"]"))
        .fault();
    assert_tensor(
        &fault,
        "weights.safetensors",
        "net.2.weight",
        &["shape [3, 4]", "shape [3, 2]"],
    );
}

#[test]
fn a_file_without_dense_layers_says_how_to_name_them() {
    let fault = Folder::new().tensors(&[tensor("table", &[3, 4])]).fault();
    assert_says(&fault, &["no dense layer", "<layer>.weight", "state_dict"]);
}

#[test]
fn more_than_nine_layers_are_refused() {
    let stems: Vec<String> = (0..10).map(|i| format!("net.{i}")).collect();
    let sizes = |i: usize| (if i == 9 { 3 } else { 4 }, if i == 0 { 2 } else { 4 });
    let tensors: Vec<_> = stems
        .iter()
        .enumerate()
        .flat_map(|(i, stem)| dense(stem, sizes(i).0, sizes(i).1))
        .collect();
    assert_says(
        &Folder::new().tensors(&tensors).fault(),
        &["too many layers", "10", "at most 9"],
    );
    let nine: Vec<_> = tensors[2..].to_vec();
    assert_says(
        &Folder::new().tensors(&nine).fault(),
        &["shape [4, 4]", "takes 4 inputs"],
    );
}

#[test]
fn nine_layers_are_read() {
    let sizes = |i: usize| (if i == 8 { 3 } else { 4 }, if i == 0 { 2 } else { 4 });
    let nine: Vec<_> = (0..9)
        .flat_map(|i| dense(&format!("net.{i}"), sizes(i).0, sizes(i).1))
        .collect();
    assert_eq!(names(&nine).len(), 9);
    // beside another network that fits nothing
    let two: Vec<_> = nine.into_iter().chain(dense("other.0", 5, 7)).collect();
    assert_eq!(names(&two).len(), 9);
}

#[test]
fn a_row_of_more_than_nine_layers_is_no_rival_of_one_that_fits() {
    let sizes = |i: usize| (if i == 9 { 3 } else { 4 }, if i == 0 { 2 } else { 4 });
    let deep = (0..10).flat_map(|i| dense(&format!("deep.{i}"), sizes(i).0, sizes(i).1));
    let tensors: Vec<_> = deep.chain(dense("flat.0", 4, 2)).chain(dense("flat.1", 3, 4)).collect();
    let policy = Folder::new().tensors(&tensors).policy();
    assert_eq!(policy.layers.len(), 2);
    assert!(
        policy.notes.join("\n").contains("left unused: deep.0"),
        "{:?}",
        policy.notes
    );
}

#[test]
fn chains_of_a_file_end_in_a_choice_or_else_in_one_number() {
    let shapes = |sizes: &[(usize, usize)]| {
        let named = |(i, (inputs, outputs)): (usize, &(usize, usize))| (format!("net.{i}"), *inputs, *outputs);
        policy::chains(&sizes.iter().enumerate().map(named).collect::<Vec<_>>())
    };
    assert_eq!(shapes(&[(2, 4), (4, 3)]), [[0, 1]]);
    assert_eq!(shapes(&[(2, 4), (4, 1)]), [[0, 1]], "a continuous actor");
    // two of the three make a chain, too; the whole is what is meant
    assert_eq!(shapes(&[(2, 4), (4, 4), (4, 1)]), [[0, 1, 2]]);
}

#[test]
fn of_networks_that_do_not_fit_the_longest_row_is_explained() {
    // neither takes two inputs and ends in three actions; the row of three is told, not the one that comes first
    let tensors = all(&[("alpha.0", 4, 5), ("beta.0", 4, 6), ("beta.2", 4, 4), ("beta.4", 3, 4)]);
    let fault = Folder::new().tensors(&tensors).fault();
    assert_says(&fault, &["beta.0"]);
    assert!(!fault.to_string().contains("alpha.0"), "{fault}");
}

#[test]
fn a_layer_wider_than_1024_is_refused() {
    let tensors = all(&[("net.0", 1025, 2), ("net.2", 3, 1025)]);
    assert_says(
        &Folder::new().tensors(&tensors).fault(),
        &["too wide", "1025 outputs", "at most 1024"],
    );
}

#[test]
fn many_equal_layers_that_never_fit_are_refused_at_once() {
    let stems = ["a", "b", "c", "d", "e", "f", "g", "h", "i"].map(|stem| format!("x/y/z/{stem}"));
    let tensors: Vec<_> = stems.iter().flat_map(|stem| dense(stem, 4, 4)).collect();
    let start = std::time::Instant::now();
    assert_says(
        &Folder::new().tensors(&tensors).fault(),
        &["shape [4, 4]", "shape [4, 2]"],
    );
    assert!(start.elapsed().as_secs() < 5);
}

/// Each way in which a trainer names the network that it keeps beside the one in use; a name that only begins or ends alike is another one's.
#[test]
fn target_networks_are_known_by_a_part_of_their_names() {
    let own = ["net.0", "net.2", "net.4"];
    for target in ["target", "target_net", "q_target", "agent.target.q", "agent/q_target"] {
        let stems = [0, 2, 4].map(|n| format!("{target}.{n}"));
        let both = [three(stems.each_ref().map(String::as_str)), three(own)].concat();
        assert_eq!(names(&both), own, "{target}");
        assert!(notes(&both).contains("passed over as a target network"), "{target}");
    }
    for other in ["targets", "retarget", "q_targeted"] {
        let stems = [0, 2, 4].map(|n| format!("{other}.{n}"));
        let both = [three(stems.each_ref().map(String::as_str)), three(own)].concat();
        let fault = Folder::new().tensors(&both).fault();
        assert_says(&fault, &["more than one chain"]);
    }
}

/// A file may hold its tensors in any order, as by the width of their elements; they are told by name.
#[test]
fn tensors_of_a_file_are_told_in_the_order_of_their_names() {
    let wide = raw_tensor(
        "b",
        Dtype::F64,
        &[2],
        [0.5_f64, -2.0].iter().flat_map(|x| x.to_le_bytes()).collect(),
    );
    let bytes = encode(&[f32_tensor("c", &[1], &[3.0]), wide, f32_tensor("a", &[1], &[1.0])]);
    let tensors = policy::named_tensors(&"weights.safetensors".into(), bytes).unwrap();
    let told: Vec<_> = tensors
        .into_iter()
        .map(|tensor| (tensor.name, tensor.values.unwrap()))
        .collect();
    let expected = [("a", vec![1.0]), ("b", vec![0.5, -2.0]), ("c", vec![3.0])];
    assert_eq!(told, expected.map(|(name, values)| (name.to_owned(), values)));
}
