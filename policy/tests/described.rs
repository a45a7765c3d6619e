//! A policy in words: what `inspect` shows, against lines that follow from the contract by hand.
#![allow(clippy::unwrap_used)]

mod common;
use common::*;
use policy::{ReadOptions, describe};

const DUTIES: &str = "duties = [0.44, 0.50, 0.56]";

/// All of these lines, whole and in this order.
#[track_caller]
fn lines(text: &str, expected: &[&str]) {
    let mut rest = text.lines();
    for line in expected {
        assert!(rest.any(|found| found == *line), "{line:?} is not next in:\n{text}");
    }
}

#[test]
fn signals_and_parameters_stand_below_each_other() {
    let folder = Folder::new().replace("name = \"i_out\"\nunit", "name = \"i\"\nunit");
    let folder = folder.replace("load_current = \"i_out\"", "load_current = \"i\"");
    let policy = folder.policy();
    assert_eq!(
        describe::head(&policy),
        "buck   one step every 100 us (10.000000 kHz), f32\n"
    );
    assert_eq!(
        describe::signals(&policy),
        "\nsignals (plausible range; a sample outside is held)\n  v_out  [0, 250] V\n  i      [-1, 40] A\n  v_ref  100 (parameter)\n"
    );
}

#[test]
fn a_code_is_shown_with_what_makes_volts_of_it() {
    let policy = Folder::new()
        .replace(
            "range = [0.0, 250.0]",
            "adc = { gain = 0.0625, offset = -1.5 }\nrange = [0.0, 250.0]",
        )
        .policy();
    lines(
        &describe::signals(&policy),
        &["  v_out  [0, 250] V   = 0.0625 * code + -1.5"],
    );
}

#[test]
fn features_are_formulas_with_bounds_and_what_golden_vectors_have_of_them() {
    let formulas = [
        // 0.2 (100 - 250) to 0.2 * 100, and the clip's ends are nearer than the first
        "   0  e = clip(0.2 * (v_ref - v_out), -20, 20)   in [-20, 20]",
        "   1  e_del = delay1(v_ref - v_out)   in [-150, 100]",
    ];
    let said = describe::observation(&Folder::new().policy());
    lines(&said, &formulas);
    assert!(!said.contains("golden"), "{said}");
    let obs = f32_tensor("obs", &[3, 2], &[1.0, 5.0, -2.0, -10.0, 0.5, 2.0]);
    let q = f32_tensor("q", &[3, 3], &[0.0, 1.0, 0.5, 3.0, 1.0, 2.0, 1.0, 2.0, 3.0]);
    let said = describe::observation(&Folder::new().golden(&[obs, q]).policy());
    let [e, e_del] = formulas;
    let (e, e_del) = (
        format!("{e}, golden in [-2, 1]"),
        format!("{e_del}, golden in [-10, 5]"),
    );
    lines(&said, &[&e, &e_del]);
    assert!(said.contains("golden vectors begin at the observation"), "{said}");
    // no scale, an offset to either side, and a scale behind a filter
    for (feature, formula) in [
        ("offset = -1.5", "e = v_ref - v_out - 1.5"),
        ("offset = 1.5", "e = v_ref - v_out + 1.5"),
        (
            "scale = 2.0\nfilters = [{ delay = 3 }]",
            "e = 2 * delay3(v_ref - v_out)",
        ),
        ("filters = [\"backward_difference\"]", "e = difference(v_ref - v_out)/T"),
        ("filters = [{ moving_average = 4 }]", "e = average4(v_ref - v_out)"),
        (
            "filters = [{ low_pass = { time_constant = 2e-3 } }]",
            "e = low_pass[0.002 s](v_ref - v_out)",
        ),
    ] {
        let policy = Folder::new()
            .replace("scale = 0.2\nclip = [-20.0, 20.0]", feature)
            .policy();
        let said = describe::formula(&policy.features[0], &policy);
        assert_eq!(said, formula);
    }
}

#[test]
fn layers_are_shown_with_sizes_and_activations() {
    let said = describe::network(&Folder::new().policy());
    for part in ["   2 -> 4    relu, outputs in [0, ", "   4 -> 3    "] {
        assert!(said.contains(part), "{part:?} is not in:\n{said}");
    }
}

#[test]
fn actions_are_broken_into_lines_that_fit() {
    let said = |actions: &str, count: usize| {
        let network = [dense("net.0", 4, 2), dense("net.2", count, 4)].concat();
        let folder = Folder::new().replace(DUTIES, actions).tensors(&network);
        describe::actions(&folder.policy())
    };
    assert_eq!(
        said(DUTIES, 3),
        "\nactions (argmax of Q, lowest index wins)\n  0: 0.44   1: 0.5   2: 0.56\n"
    );
    let duties: Vec<String> = (0..30)
        .map(|n| format!("{:?}", 0.4 + 0.00390625 * f64::from(n)))
        .collect();
    let long = said(&format!("duties = [{}]", duties.join(", ")), 30);
    let rows: Vec<&str> = long.lines().skip(2).collect();
    let entries = rows.iter().flat_map(|row| row.trim().split("   "));
    let found: Vec<String> = entries
        .map(|entry| entry.split_once(": ").unwrap().1.to_owned())
        .collect();
    assert_eq!(found, duties, "each once, in order");
    assert!(
        rows.len() > 3 && rows.iter().all(|row| row.len() <= 2 + 96 + 3),
        "{long}"
    );
    // a row is left when the next entry would not fit into it
    assert!(rows.iter().rev().skip(1).all(|row| row.len() > 80), "{long}");
    let pairs = "pairs = [{ xi = 0.5, phi = 0.0625 }]";
    lines(
        &said(pairs, 3),
        &["  0: 0.5 -1 * 0.0625 = 0.437500   1: 0.5 +0 * 0.0625 = 0.500000   2: 0.5 +1 * 0.0625 = 0.562500"],
    );
}

#[test]
fn a_continuous_duty_is_a_formula_with_its_ends() {
    let said = |head: &str| {
        let network = [dense("net.0", 4, 2), dense("net.2", 1, 4)].concat();
        let folder = Folder::new().replace(DUTIES, &format!("continuous = {{ {head} }}"));
        describe::actions(&folder.tensors(&network).policy())
    };
    let heading = "action (continuous, y is the network's output)";
    for (head, line) in [
        (
            "squash = \"tanh\", scale = 0.0625, offset = 0.5",
            "  duty = 0.0625 * tanh(y) + 0.5, in [0.4375, 0.5625]",
        ),
        (
            "clip = [0.45, 0.55]",
            "  duty = y clipped to [0.45, 0.55], in [0.45, 0.55]",
        ),
        (
            "clip = [0.75, 1.0], offset = -0.3125",
            "  duty = y clipped to [0.75, 1] - 0.3125, in [0.4375, 0.6875]",
        ),
    ] {
        lines(&said(head), &[heading, line]);
    }
}

#[test]
fn a_law_with_gains_names_its_factors_and_the_ends_of_each_gain() {
    let gains = "base = \"0.25\"\ngains = [{ source = \"v_ref - v_out\", squash = \"tanh\", scale = 0.01, offset = 0.0125 }, \
                 { feature = \"e_del\", clip = [-1, 1], scale = -0.002 }, { limits = [-0.1, 0.1], scale = 0.5 }]";
    lines(
        &describe::actions(&Folder::new().replace(DUTIES, gains).policy()),
        &[
            "law (summed in this order)",
            "  duty = 0.25 + g0 * (v_ref - v_out) + g1 * e_del before scale, offset and clip + g2, in [0.4, 0.6]",
            "gains (y0, y1, ... are the network's outputs)",
            "  g0 = 0.01 * tanh(y0) + 0.0125, in [0.0025, 0.0225], times [-150, 100]",
            "  g1 = -0.002 * y1 clipped to [-1, 1], in [-0.002, 0.002], times [-150, 100]",
            "  g2 = 0.5 * y2, in [-0.1, 0.1]",
        ],
    );
}

#[test]
fn a_mapping_is_a_formula_with_its_range_and_what_may_be_set() {
    let mapping = "a = 1.0\nb = 0.25\nc = -0.5\nr = 0.125\n\n[valid]\ni_out = [0.0, 12.0]\nd_sim = [0.40, 0.60]\n\n[adjust]\na = [0.8, 1.25]\n\
                   b = [0.0, 0.5]\nc = [-1.0, 0.0]\nr = [0.0, 0.25]\n";
    lines(
        &describe::mapping(&Folder::new().file("drm.toml", mapping.as_bytes()).policy()),
        &[
            "mapping",
            "  duty = 1 d_sim +0.25 i_out -0.5 +0.125 i_out d_sim",
            "  valid for i_out in [0, 12], d_sim in [0.4, 0.6]",
            "  at run time a in [0.8, 1.25], b in [0, 0.5], c in [-1, 0], r in [0, 0.25]",
        ],
    );
    // three terms: nothing is said of a fourth
    let said = describe::mapping(&Folder::new().policy());
    lines(&said, &["  duty = 1 d_sim +0 i_out +0"]);
    assert!(!said.contains("r in"), "{said}");
}

#[test]
fn limits_tell_slew_soft_start_and_what_follows_a_bad_sample() {
    let plain =
        "\nlimits\n  duty in [0.4, 0.6], 0.5 before the first step\n  invalid measurement: hold 3 steps, then duty 0\n";
    assert_eq!(describe::limits(&Folder::new().policy()), plain);
    let folder = Folder::new().replace(
        "initial_duty = 0.5",
        "initial_duty = 0.44\nslew = 0.02\nsoft_start = { from = 0.44, steps = 500 }",
    );
    lines(
        &describe::limits(&folder.policy()),
        &[
            "  duty in [0.4, 0.6], 0.44 before the first step",
            "  at most 0.02 per step",
            "  soft start: upper limit from 0.44 in 500 steps",
            "  invalid measurement: hold 3 steps, then duty 0",
        ],
    );
}

#[test]
fn an_observer_is_shown_with_what_drives_it_and_its_gains() {
    let observer = |more: &str| {
        format!(
            "[[observer]]\nname = \"model\"\ninductance = 2e-3\ncapacitance = 1.5e-3\ninput_voltage = 200.0\noutput_voltage = \"v_out\"\n\
             load_current = \"i_out\"\ngains = {{ current = 0.1, voltage = 0.2, bias = 0.01 }}\ncurrent = [0.0, 60.0]\nbias = [-8.0, 4.0]\n{more}\n\
             [[feature]]\nname = \"e\""
        )
    };
    let said = |more: &str| {
        let folder = Folder::new().replace("[[feature]]\nname = \"e\"", &observer(more));
        describe::observers(&folder.policy())
    };
    lines(
        &said("compute_delay = 1"),
        &[
            "observers (estimates stand beside the signals)",
            "  model: L 0.002 H, C 0.0015 F, V 200 V, corrected by v_out, loaded by i_out; the duty acts one period later",
            "    model_current  [0, 60] A, 0.1 A/V",
            "    model_voltage  [0, 250] V, 0.2 V/V",
            "    model_bias  [-8, 4] V, 0.01 V/V",
        ],
    );
    lines(
        &said("compute_delay = 0"),
        &[
            "  model: L 0.002 H, C 0.0015 F, V 200 V, corrected by v_out, loaded by i_out; the duty acts in the same period",
        ],
    );
    assert_eq!(describe::observers(&Folder::new().policy()), "");
}

#[test]
fn each_of_several_outputs_has_its_columns_and_its_limits() {
    let (before, _) = CONTRACT.split_once("[actions]").unwrap();
    let outputs = "[[output]]\nname = \"left\"\nactions = { duties = [0.44, 0.50, 0.56] }\n\
                   mapping = { file = \"drm.toml\", load_current = \"i_out\" }\nlimits = { duty = [0.40, 0.60], initial_duty = 0.5 }\n\
                   fallback = { duty = 0.0 }\n[[output]]\nname = \"right\"\n\
                   actions = { continuous = { squash = \"tanh\", scale = 0.25, offset = 0.5 } }\nlimits = { duty = [0.2, 0.8] }\n\
                   fallback = { duty = 0.25 }\n[fallback]\nhold = 3\n";
    let network = [dense("net.0", 4, 2), dense("net.2", 4, 4)].concat();
    let folder = Folder::new().contract(&format!("{before}{outputs}")).tensors(&network);
    let options = ReadOptions {
        several_outputs: true,
        ..ReadOptions::default()
    };
    let policy = policy::load_with(&folder.path().join("policy.toml"), &options).unwrap();
    lines(
        &describe::actions(&policy),
        &[
            "output left (columns 0 to 2 of the last layer)",
            "  argmax of 3 duties: 0.44 0.5 0.56",
            "output right (column 3 of the last layer)",
            "  continuous, duty = 0.25 * tanh(y) + 0.5, in [0.25, 0.75]",
        ],
    );
    lines(
        &describe::mapping(&policy),
        &[
            "mapping of left",
            "  duty = 1 d_sim +0 i_out +0",
            "mapping of right",
            "  none: duty = duty of the action",
        ],
    );
    lines(
        &describe::limits(&policy),
        &[
            "limits of left",
            "  invalid measurement: hold 3 steps, then duty 0",
            "limits of right",
            "  invalid measurement: hold 3 steps, then duty 0.25",
        ],
    );
}

#[test]
fn digests_are_those_of_the_policy() {
    let policy = Folder::new().policy();
    let said = describe::digests(&policy);
    let digests = &policy.digests;
    let expected = [
        format!("  weights  {}", digests.weights),
        format!("  contract {}", digests.contract),
        format!("  mapping  {}", digests.mapping.as_ref().unwrap()),
    ];
    lines(&said, &expected.each_ref().map(String::as_str));
}
