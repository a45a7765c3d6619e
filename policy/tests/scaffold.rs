//! New contracts and formulas for people; the example.

mod common;
use std::path::Path;

use common::*;

fn example() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/buck12")
}

#[test]
fn the_buck12_example_loads_without_complaint() {
    let policy = policy::load(&example().join("policy.toml")).unwrap_or_else(|faults| panic!("{faults}"));
    let sizes: Vec<_> = policy
        .layers
        .iter()
        .map(|layer| (layer.inputs, layer.outputs))
        .collect();
    assert_eq!(sizes, [(6, 64), (64, 64), (64, 12)]);
    assert_eq!(policy.golden.as_ref().map(|golden| golden.count), Some(515));
    let formulas: Vec<_> = policy
        .features
        .iter()
        .map(|f| policy::describe::formula(f, &policy))
        .collect();
    assert_eq!(formulas[0], "e = clip(0.2 * (v_ref - v_out), -20, 20)");
    assert_eq!(formulas[1], "e_del = clip(0.2 * delay1(v_ref - v_out), -20, 20)");
    assert_eq!(policy.notes, ["layers, first to last: q_net.0, q_net.2, q_net.4"]);
}

#[test]
fn a_new_contract_has_the_right_counts_and_todo_for_the_rest() {
    let text = scaffold(&example().join("weights.safetensors")).unwrap_or_else(|faults| panic!("{faults}"));
    assert_eq!(text.matches("   # network input ").count(), 6, "{text}");
    assert!(
        text.contains(&format!("\nduties = [{}]\n", ["\"TODO\""; 12].join(", "))),
        "{text}"
    );
    assert!(text.contains("weights = \"weights.safetensors\""));
    assert!(text.contains("q_net.0 > q_net.2 > q_net.4"));
}

#[test]
fn golden_vectors_beside_the_weights_are_named() {
    let text = scaffold(&example().join("weights.safetensors")).unwrap_or_else(|faults| panic!("{faults}"));
    assert!(text.contains("\ngolden = \"golden.safetensors\""), "{text}");
    let folder = Folder::new();
    let text = scaffold(&folder.path().join("weights.safetensors")).unwrap();
    assert!(text.contains("\n# golden = \"golden.safetensors\""), "{text}");
}

#[test]
fn golden_vectors_are_named_in_the_folder_of_the_weights() {
    for (weights, golden) in [
        ("w.st", "golden.safetensors"),
        ("a/w.st", "a/golden.safetensors"),
        ("../nets/b/w.st", "../nets/b/golden.safetensors"),
    ] {
        let text = policy::draft(&policy::Draft {
            weights: weights.to_owned(),
            inputs: 1,
            outputs: 2,
            chains: vec!["l".to_owned()],
            golden: true,
            ..policy::Draft::default()
        });
        assert!(text.contains(&format!("\ngolden = \"{golden}\" ")), "{text}");
    }
}

#[test]
fn every_placeholder_of_a_new_contract_is_a_fault_by_name() {
    let folder = Folder::new();
    let text = scaffold(&folder.path().join("weights.safetensors")).unwrap();
    let faults = folder.contract(&text).faults();
    let todo = text
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.matches("\"TODO\"").count());
    assert_eq!(faults.faults.list.len(), todo.sum::<usize>(), "{faults}");
    for fault in &faults.faults {
        assert_says(fault, &["still says TODO: fill in"]);
        assert!(fault.line_column().is_some());
    }
}

#[test]
fn a_filled_in_contract_is_accepted() {
    let folder = Folder::new();
    let text = scaffold(&folder.path().join("weights.safetensors")).unwrap();
    let filled = text
        .replace("name = \"TODO\"", "name = \"v_out\"")
        .replace("source = \"TODO\"", "source = \"v_out\"")
        .replace("unit = \"TODO\"", "unit = \"V\"")
        .replace("hidden_activation = \"TODO\"", "hidden_activation = \"relu\"")
        .replace("sample_period = \"TODO\"", "sample_period = 1e-4")
        .replace("[\"TODO\", \"TODO\"]", "[0.25, 0.75]")
        .replace("\"TODO\"", "0.5");
    assert_eq!(folder.contract(&filled).policy().features.len(), 2);
}

#[test]
fn a_new_contract_of_an_ambiguous_file_asks_for_the_prefix() {
    let tensors = [
        dense("a.0", 4, 2),
        dense("a.1", 3, 4),
        dense("b.0", 4, 2),
        dense("b.1", 3, 4),
    ]
    .concat();
    let folder = Folder::new().tensors(&tensors);
    let text = scaffold(&folder.path().join("weights.safetensors")).unwrap();
    assert!(
        text.contains("#   a.0 > a.1\n#   b.0 > b.1\nprefix = \"TODO\"\n"),
        "{text}"
    );
    let folder = folder.tensors(&[dense("a.0", 4, 2), dense("b.0", 4, 3)].concat());
    let faults = scaffold(&folder.path().join("weights.safetensors")).unwrap_err();
    assert_says(&faults.faults.list[0], &["more than one chain"]);
}

#[test]
fn a_new_contract_needs_a_sound_file() {
    let folder = Folder::new();
    let faults = scaffold(&folder.path().join("none.safetensors")).unwrap_err();
    assert_says(&faults.faults.list[0], &["cannot find the file"]);
    let text = scaffold(&folder.path().join("policy.toml")).unwrap_err();
    assert_says(&text.faults.list[0], &["not a sound safetensors file"]);
}

#[test]
fn signals_and_parameters_without_use_are_noted() {
    let notes = Folder::new()
        .replace("v_ref = 100.0", "v_ref = 100.0\nspare = 1.0")
        .replace("[mapping]\nfile = \"drm.toml\"\nload_current = \"i_out\"\n", "")
        .policy()
        .notes;
    assert!(
        notes.iter().any(|note| note == "parameter `spare` is not used"),
        "{notes:?}"
    );
    assert!(
        notes
            .iter()
            .any(|note| note.starts_with("signal `i_out` feeds no feature")),
        "{notes:?}"
    );
}

#[test]
fn formulas_show_filters_scale_and_offset() {
    let filters = "filters = [{ delay = 2 }, { moving_average = 4 }]\nscale = 2\noffset = -1.5";
    let policy = Folder::new().replace("filters = [{ delay = 1 }]", filters).policy();
    let formula = policy::describe::formula(&policy.features[1], &policy);
    assert_eq!(formula, "e_del = 2 * average4(delay2(v_ref - v_out)) - 1.5");
    assert_eq!(
        policy::describe::expression(&policy.features[1].source, &policy),
        "100 - v_out"
    );
}

/// Duties of many actions stand in lines of twelve, one for each output.
#[test]
fn many_duties_are_broken_into_lines() {
    let network = [dense("net.0", 4, 2), dense("net.2", 30, 4)].concat();
    let folder = Folder::new().tensors(&network);
    let text = scaffold(&folder.path().join("weights.safetensors")).unwrap();
    let duties = text.split_once("\nduties = [").unwrap().1.split_once(']').unwrap().0;
    let rows: Vec<usize> = duties.split(",\n").map(|row| row.matches("\"TODO\"").count()).collect();
    assert_eq!(rows, [12, 12, 6], "{duties}");
    assert!(!duties.starts_with(','), "{duties}");
}

#[test]
fn a_clip_of_the_training_is_written_with_whose_it_is() {
    let feature = |clip: Option<(f64, f64, String)>| policy::DraftFeature {
        affine: Some((0.5, 0.0)),
        clip,
        ..policy::DraftFeature::default()
    };
    let text = policy::draft(&policy::Draft {
        weights: "w.st".to_owned(),
        inputs: 2,
        outputs: 2,
        chains: vec!["l".to_owned()],
        features: vec![feature(Some((-4.0, 4.0, "the box".to_owned()))), feature(None)],
        ..policy::Draft::default()
    });
    assert!(
        text.contains("clip = [-4.0, 4.0] },   # network input 0; clip: the box\n"),
        "{text}"
    );
    assert!(text.contains("# network input 1\n"), "{text}");
}
