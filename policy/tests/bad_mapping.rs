//! Faults of drm.toml and of the section that names it.

mod common;
use common::*;

#[test]
fn a_gain_that_is_not_positive_is_refused() {
    mapping_fault("a = 1.0", "a = ¦-1.0", &["`a` must be greater than 0", "-1"]);
    mapping_fault("a = 1.0", "a = ¦0.0", &["> 0"]);
}

#[test]
fn a_coefficient_that_is_not_a_number_is_refused() {
    mapping_fault("b = 0.0", "b = ¦nan", &["`b` is not a finite number", "nan"]);
    mapping_fault("c = 0.0", "c = 0¦,1", &["write 1.5 instead of 1,5"]);
    mapping_fault("c = 0.0", "c = ¦\"0.1\"", &["a number"]);
}

#[test]
fn unknown_duplicate_and_missing_keys_are_refused() {
    mapping_fault("c = 0.0", "c = 0.0\n¦d = 1.0", &["unknown key `d`"]);
    mapping_fault("c = 0.0", "c = 0.0\n¦c = 1.0", &["duplicate key"]);
    mapping_fault(
        "i_out = [0.0, 12.0]",
        "¦i_o = [0.0, 12.0]\ni_out = [0.0, 12.0]",
        &["unknown key `i_o` in [valid]"],
    );
    let fault = Folder::new()
        .file("drm.toml", MAPPING.replace("c = 0.0\n", "").as_bytes())
        .fault();
    assert_whole_file(&fault, "drm.toml", &["`c` is missing"]);
}

#[test]
fn crossed_and_percent_ranges_are_refused() {
    mapping_fault("[0.0, 12.0]", "¦[12.0, 0.0]", &["`i_out` are crossed"]);
    mapping_fault("[0.40, 0.60]", "¦[40, 60]", &["percentage: write 0.4"]);
}

#[test]
fn a_coefficient_outside_its_adjustment_is_refused() {
    mapping_fault(
        "[0.8, 1.25]",
        "¦[1.1, 1.25]",
        &["`a` lies outside its [adjust] interval", "1.1 to 1.25"],
    );
    mapping_fault("[0.8, 1.25]", "¦[0.0, 1.25]", &["lower end of adjust a", "> 0"]);
    mapping_fault(
        "[0.8, 1.25]",
        "[0.8, 1.25]\nr = ¦[0.0, 1.0]",
        &["`adjust r` is given without `r`"],
    );
}

#[test]
fn a_mapping_that_does_not_rise_is_refused() {
    mapping_fault(
        "c = 0.0",
        "c = 0.0\nr = ¦-0.1",
        &["does not rise with d_sim", "at i_out = 12", "a + r i > 0"],
    );
    // flat is not rising
    mapping_fault(
        "c = 0.0\n\n[valid]\ni_out = [0.0, 12.0]",
        "c = 0.0\nr = ¦-0.0625\n\n[valid]\ni_out = [0.0, 16.0]",
        &["does not rise with d_sim", "at i_out = 16", "a + r i > 0"],
    );
    let policy = Folder::new()
        .file("drm.toml", MAPPING.replace("c = 0.0", "c = 0.0\nr = -0.01").as_bytes())
        .policy();
    let mapping = policy.mapping.unwrap();
    assert_eq!(mapping.coefficients.r, Some(-0.01));
    assert_eq!(
        (mapping.adjust_r.low, mapping.adjust_r.high),
        (-0.01 - 0.05, -0.01 + 0.05)
    );
}

#[test]
fn adjustments_have_defaults() {
    let text = MAPPING
        .split("[adjust]")
        .next()
        .unwrap()
        .replace("a = 1.0", "a = 1.2")
        .replace("b = 0.0", "b = 0.01");
    let mapping = Folder::new()
        .file("drm.toml", text.as_bytes())
        .policy()
        .mapping
        .unwrap();
    assert_eq!((mapping.adjust_a.low, mapping.adjust_a.high), (0.6, 2.4));
    assert_eq!(
        (mapping.adjust_b.low, mapping.adjust_b.high),
        (0.01 - 0.05, 0.01 + 0.05)
    );
    assert_eq!((mapping.adjust_c.low, mapping.adjust_c.high), (-0.2, 0.2));
}

#[test]
fn the_load_current_must_be_a_signal() {
    contract_fault(
        "load_current = \"i_out\"",
        "load_current = ¦\"i_ot\"",
        &["no signal `i_ot`", "did you mean `i_out`?", "v_out, i_out"],
    );
    contract_fault(
        "[mapping]\nfile = \"drm.toml\"\n",
        "¦[mapping]\n",
        &["`file` is missing in [mapping]"],
    );
}

#[test]
fn a_policy_without_a_mapping_is_accepted() {
    let policy = Folder::new()
        .replace("[mapping]\nfile = \"drm.toml\"\nload_current = \"i_out\"\n", "")
        .policy();
    assert!(policy.mapping.is_none() && policy.digests.mapping.is_none());
}

/// Duties lie from 0 to 0.56 and the load from -1 to 40 A: 6e37 * 0.56 + 1e36 * 40 is 7.4e37, of at most 8.5e37; below it is
/// -4e37.
#[test]
fn what_may_be_set_at_run_time_must_not_overflow_at_any_duty_and_load() {
    let with = |a: &str, b: &str| {
        let adjust = format!("a = [0.8, {a}]\nb = [-{b}, {b}]");
        Folder::new().file("drm.toml", MAPPING.replace("a = [0.8, 1.25]", &adjust).as_bytes())
    };
    assert!(with("6e37", "1e36").load().is_ok());
    for (a, b) in [("8.4e37", "1e36"), ("6e37", "2e36")] {
        let fault = with(a, b).fault();
        assert_whole_file(&fault, "drm.toml", &["the mapped duty"]);
    }
}
