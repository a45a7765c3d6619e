//! What a reader of the documentation must find there.
#![allow(clippy::unwrap_used)]

use policy::Activation;

fn page(name: &str) -> String {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../docs/reference")
        .join(name);
    std::fs::read_to_string(path).unwrap()
}

/// The interpreter is written from this page alone.
#[test]
fn each_activation_has_its_rows_in_the_numeric_contract_in_floats_and_in_integers() {
    let text = page("numeric-contract.md");
    for each in Activation::EACH {
        let row = format!("| `{}`", each.word());
        let rows = text.lines().filter(|line| line.starts_with(&row)).count();
        let bounds = usize::from(each.curve().is_some());
        assert_eq!(
            rows,
            2 + bounds,
            "numeric-contract.md: rows of `{}` in sections 6 and 6b",
            each.word()
        );
    }
}

/// The stated errors are those that the interpreter's tests try.
#[test]
fn each_curve_has_the_bound_of_its_error_in_the_numeric_contract() {
    let text = page("numeric-contract.md");
    let number = |x: f64| if x == 0.0 { "0".to_owned() } else { format!("{x:e}") };
    for (each, curve) in Activation::EACH.iter().filter_map(|each| Some((each, each.curve()?))) {
        let policy::activation::Error { absolute, relative } = curve.error_32;
        let row = format!("| `{}` | {} | {} |", each.word(), number(absolute), number(relative));
        assert!(text.contains(&row), "numeric-contract.md: {row}");
    }
}

#[test]
fn each_activation_stands_in_the_page_of_the_contract_file() {
    let text = page("policy-file.md");
    for each in Activation::EACH {
        assert!(text.contains(&each.written()), "policy-file.md: {}", each.written());
    }
}
