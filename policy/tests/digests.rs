//! Digests depend on content and on nothing else.

mod common;
use common::*;
use safetensors::Dtype;

#[test]
fn layout_comments_key_order_and_line_ends_do_not_matter() {
    let plain = Folder::new().policy().digests;
    assert_eq!(plain.contract.len(), 64);
    assert!(
        plain
            .contract
            .chars()
            .all(|c| c.is_ascii_hexdigit() && !c.is_ascii_uppercase())
    );
    let same = [
        CONTRACT.replace('\n', "\r\n"),
        CONTRACT.replace(" = ", "=").replace("# a comment\n", "# another\n\n"),
        CONTRACT.replace("scale = 0.2\nclip = [-20.0, 20.0]", "clip = [-2e1, +20]\nscale = 2e-1"),
        CONTRACT.replacen("[limits]\nduty = [0.40, 0.60]\ninitial_duty = 0.5\n\n", "", 1)
            + "\n[limits]\ninitial_duty = 0.5\nduty = [0.4, 0.6]\n",
        CONTRACT.replace(
            "filters = [{ delay = 1 }]",
            "filters = [{ delay = 1 }]\nscale = 1.0\noffset = 0",
        ),
        CONTRACT.replace(
            "sample_period = 1e-4",
            "sample_period = 0.0001\nnumeric_format = \"f32\"",
        ),
        CONTRACT
            .replace("\"v_ref - v_out\"", "\" v_ref  -  v_out \"")
            .replace("v_ref  -  v_out", "v_ref   - v_out"),
        CONTRACT.replace(
            "hidden_activation",
            "golden_tolerance = 1e-3\ngolden_decisions = 0.5\nhidden_activation",
        ),
    ];
    for text in same {
        assert_eq!(Folder::new().contract(&text).policy().digests, plain, "{text}");
    }
    let mapping = MAPPING.replace("a = 1.0", "a = 1  # comment") + "b = [-0.05, 0.05]\n";
    assert_eq!(
        Folder::new().file("drm.toml", mapping.as_bytes()).policy().digests,
        plain
    );
}

#[test]
fn every_value_that_changes_the_controller_changes_its_digest() {
    let plain = Folder::new().policy().digests;
    let changes = [
        ("name = \"buck\"", "name = \"boost\""),
        ("1e-4", "2e-4"),
        ("v_ref = 100.0", "v_ref = 101.0"),
        ("250.0", "251.0"),
        ("unit = \"V\"", "unit = \"mV\""),
        ("name = \"e_del\"", "name = \"e_old\""),
        ("scale = 0.2", "scale = 0.25"),
        ("[-20.0, 20.0]", "[-20.0, 21.0]"),
        ("delay = 1 ", "delay = 2 "),
        ("\"relu\"", "\"tanh\""),
        ("0.44", "0.45"),
        ("initial_duty = 0.5", "initial_duty = 0.51"),
        ("initial_duty = 0.5", "initial_duty = 0.5\nslew = 0.1"),
        ("duty = 0.0", "duty = 0.1"),
        ("hold = 3", "hold = 4"),
    ];
    let mut seen = vec![plain.contract.clone()];
    for (from, to) in changes {
        let digests = Folder::new().replace(from, to).policy().digests;
        assert!(!seen.contains(&digests.contract), "{from} -> {to}");
        assert_eq!((&digests.weights, &digests.mapping), (&plain.weights, &plain.mapping));
        seen.push(digests.contract);
    }
}

#[test]
fn weights_and_mapping_have_digests_of_their_own() {
    let plain = Folder::new().policy().digests;
    let other = Folder::new()
        .file("drm.toml", MAPPING.replace("b = 0.0", "b = 0.01").as_bytes())
        .policy()
        .digests;
    assert_ne!(other.mapping, plain.mapping);
    assert_eq!(
        (other.weights, other.contract),
        (plain.weights.clone(), plain.contract.clone())
    );
    let mut tensors = network();
    tensors[0].data[0] ^= 1;
    let other = Folder::new().tensors(&tensors).policy().digests;
    assert_ne!(other.weights, plain.weights);
    assert_eq!(other.contract, plain.contract);
}

#[test]
fn the_same_weights_in_other_clothes_have_the_same_digest() {
    let plain = Folder::new().policy().digests.weights;
    let widened = network().into_iter().map(|t| {
        let data = t
            .data
            .chunks(4)
            .flat_map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap())).to_le_bytes());
        raw_tensor(&t.name.replace("net.", "q.q."), Dtype::F64, &t.shape, data.collect())
    });
    assert_eq!(
        Folder::new()
            .tensors(&widened.collect::<Vec<_>>())
            .policy()
            .digests
            .weights,
        plain
    );
}
