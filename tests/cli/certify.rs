//! `policyc certify`: what it writes and what it refuses.

use serde_json::Value;

use super::Desk;

fn certificate(desk: &Desk, folder: &str) -> Value {
    serde_json::from_str(&desk.read(&format!("{folder}/certificate.json"))).unwrap()
}

#[test]
fn a_certificate_holds_bounds_shares_and_a_map_and_has_the_same_bytes_twice() {
    let desk = Desk::new("minimal");
    let line = "certify policy --format i16 --samples 50 --boxes 20 --out";
    let said = desk.succeed(&format!("{line} a"));
    desk.succeed(&format!("{line} b"));
    for name in ["certificate.json", "certificate.html", "map.svg"] {
        let read = |folder: &str| std::fs::read(desk.path(folder).join(name)).unwrap();
        assert_eq!(read("a"), read("b"), "{name}");
    }
    let i16 = certificate(&desk, "a");
    let number = |value: &Value, path: &str| value.pointer(path).and_then(Value::as_f64).unwrap();
    let bound = number(&i16, "/state_bound/bound/largest");
    assert!(number(&i16, "/measured/largest_error") <= bound, "{said}");
    assert!(bound <= number(&i16, "/box_bound/largest"), "{said}");
    assert!((0.0..=1.0).contains(&number(&i16, "/map/proven_share")));
    // fewer bits, wider bounds; floats are far nearer than both
    desk.succeed("certify policy --format i8 --samples 50 --boxes 20 --out c");
    desk.succeed("certify policy --format f32 --samples 50 --boxes 20 --out d");
    assert!(number(&certificate(&desk, "c"), "/box_bound/largest") > number(&i16, "/box_bound/largest"));
    assert!(number(&certificate(&desk, "d"), "/box_bound/largest") < 0.1 * number(&i16, "/box_bound/largest"));
}

#[test]
fn axes_that_are_none_are_refused_with_what_there_is() {
    let desk = Desk::new("minimal");
    for (arguments, expected) in [
        ("--axis nothing", "no such coordinate"),
        ("--axis v_out", "two different axes"),
        ("--axis v_out --axis v_out", "two different axes"),
        ("--axis v_out=3 --axis i_l", "a number is missing"),
        ("--axis v_out=120:80 --axis i_l", "outside of the plausible range"),
        ("--at i_l=1e9", "outside of the plausible range"),
        ("--at i_l=many", "a number is missing"),
    ] {
        desk.refuse(
            &format!("certify policy {arguments} --out out"),
            &[expected, "expected:"],
        );
        assert!(!desk.path("out").exists());
    }
}

/// Two outputs over the three columns of the case: a choice and a duty.
const OUTPUTS: &str = r#"[[output]]
name = "left"
actions = { duties = [0.4, 0.6] }
limits = { duty = [0.1, 0.9] }
fallback = { duty = 0.0 }

[[output]]
name = "right"
actions = { continuous = { squash = "tanh", scale = 0.01, offset = 0.5 } }
limits = { duty = [0.1, 0.9] }
fallback = { duty = 0.25 }

[fallback]
hold = 0
"#;

/// The case with two outputs in the place of its one.
pub(super) fn two_outputs() -> Desk {
    let desk = Desk::new("minimal");
    let contract = desk.read("policy/policy.toml");
    let (before, _) = contract.split_once("[actions]").unwrap();
    desk.write("policy/policy.toml", &format!("{before}{OUTPUTS}"));
    desk
}

#[test]
fn each_of_several_outputs_has_a_statement_with_its_name() {
    let desk = two_outputs();
    let said = desk.succeed("certify policy --format i16 --samples 50 --boxes 20 --out out");
    assert!(said.contains("minimal, output left in i16: |Q - real Q|"), "{said}");
    assert!(
        said.contains("minimal, output right in i16: |duty - real duty|"),
        "{said}"
    );
    let found = certificate(&desk, "out");
    let at = |path: &str| found.pointer(path).unwrap_or(&Value::Null);
    assert_eq!(
        (at("/outputs/0/output"), at("/outputs/1/output")),
        (&"left".into(), &"right".into())
    );
    assert!(
        at("/box_bound").is_null() && at("/coordinates/0").is_object(),
        "{found}"
    );
    // a choice has actions, a share and a map; a duty has none of these, and a bound in its own unit
    assert_eq!(at("/outputs/0/box_bound/per_action").as_array().map(Vec::len), Some(2));
    assert!(at("/outputs/0/proven_share").is_object() && at("/outputs/0/map").is_object());
    assert!(at("/outputs/1/proven_share").is_null() && at("/outputs/1/map").is_null());
    assert!(at("/outputs/1/continuous").is_object());
    let number = |path: &str| at(path).as_f64().unwrap();
    assert!(number("/outputs/1/box_bound/largest") <= 0.0201, "{found}");
    for output in 0..2 {
        let of = |rest: &str| number(&format!("/outputs/{output}/{rest}"));
        assert!(
            of("measured/largest_error") <= of("state_bound/bound/largest"),
            "{found}"
        );
        assert!(of("state_bound/bound/largest") <= of("box_bound/largest"), "{found}");
    }
    let page = desk.read("out/certificate.html");
    for words in [
        "no Q value of left",
        "no duty of right",
        "Action of left",
        "Error of the duty of right",
    ] {
        assert!(page.contains(words), "{words}");
    }
    assert!(desk.path("out/map-left.svg").exists() && !desk.path("out/map-right.svg").exists());
}
