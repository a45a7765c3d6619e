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
