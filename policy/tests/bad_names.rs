//! Names: an allow-list minus the words of C, C++ and Rust.

mod common;
use common::*;

#[track_caller]
fn policy_name(name: &str, expected: &[&str]) {
    contract_fault("name = \"buck\"", &format!("name = ¦\"{name}\""), expected);
}

#[test]
fn keywords_of_c_cpp_and_rust_are_refused() {
    for word in [
        "int",
        "restrict",
        "typeof",
        "co_await",
        "namespace",
        "interrupt",
        "linux",
    ] {
        policy_name(
            word,
            &[
                "cannot be the name of a policy",
                "C or C++",
                &format!("try `{word}_value`"),
            ],
        );
    }
    for word in ["fn", "dyn", "yield", "async", "gen", "u16", "f64"] {
        policy_name(word, &["Rust"]);
    }
}

#[test]
fn reserved_identifiers_are_refused_and_their_lookalikes_are_not() {
    for word in ["main", "nan", "inf", "errno", "uint8_t", "isnan"] {
        policy_name(word, &["reserved by the C library"]);
    }
    for word in ["core", "std", "self_test", "math", "stdint", "con"] {
        policy_name(word, &["would hide an existing one"]);
    }
    for word in ["strong", "memory", "member", "total", "is_on", "integer", "x"] {
        assert_eq!(
            Folder::new().replace("\"buck\"", &format!("\"{word}\"")).policy().name,
            word
        );
    }
}

#[test]
fn odd_characters_are_refused_by_name() {
    policy_name("Buck", &["write `buck`", "lower-case"]);
    policy_name("Buck36-15", &["write `buck36_15`"]);
    policy_name("1buck", &["begin with a lower-case letter"]);
    policy_name("_buck", &["begin with a lower-case letter"]);
    policy_name("a-b", &["`-` is not allowed"]);
    policy_name("a*/b", &["`*` is not allowed"]);
    policy_name("a\\\"b", &["is not allowed"]);
    policy_name("a\\nb", &["`\\n` is not allowed"]);
    policy_name("a]]>b", &["`]` is not allowed"]);
    policy_name("../buck", &["`.` is not allowed"]);
    policy_name("", &["empty"]);
}

#[test]
fn unicode_lookalikes_are_refused_with_their_code_point() {
    policy_name("buсk", &["`с` (U+0441) is not ASCII"]);
    policy_name("bu\u{200b}ck", &["U+200B"]);
    policy_name("ｂuck", &["U+FF42"]);
}

#[test]
fn names_have_at_most_31_characters() {
    let longest = "a".repeat(31);
    assert_eq!(
        Folder::new()
            .replace("\"buck\"", &format!("\"{longest}\""))
            .policy()
            .name,
        longest
    );
    policy_name(&"a".repeat(32), &["32 characters", "at most 31"]);
}

#[test]
fn signals_parameters_and_features_follow_the_same_rules() {
    contract_fault("name = \"e_del\"", "name = ¦\"double\"", &["name of a feature"]);
    contract_fault("v_ref = 100.0", "v_ref = 100.0\n¦while = 1.0", &["name of a parameter"]);
    contract_fault(
        "v_ref = 100.0",
        "v_ref = 100.0\n¦previous_duty = 1.0",
        &["the controller's own memory"],
    );
    contract_fault(
        "[[signal]]\nname = \"i_out\"",
        "[[signal]]\nname = \"i_out\"\nrange = [0.0, 1.0]\n[[signal]]\nname = ¦\"previous_command\"",
        &["own memory"],
    );
}

#[test]
fn duplicate_names_are_refused() {
    contract_fault("name = \"e_del\"", "name = ¦\"e\"", &["the name `e` is used twice"]);
    contract_fault(
        "v_ref = 100.0",
        "v_ref = 100.0\ni_l = 2.0\n[[signal]]\nrange = [0.0, 1.0]\nname = ¦\"i_l\"",
        &["a signal and a parameter"],
    );
    contract_fault(
        "[[signal]]\nname = \"i_out\"",
        "[[signal]]\nname = \"i_out\"\nrange = [0.0, 1.0]\n[[signal]]\nname = ¦\"v_out\"",
        &["used twice", "a signal and a signal"],
    );
    let shared = Folder::new().replace("name = \"e_del\"", "name = \"v_out\"").policy();
    assert_eq!(
        shared.features[1].name, "v_out",
        "a feature may be called like a signal"
    );
}

#[test]
fn units_must_be_fit_for_a_comment() {
    for unit in [
        "*/",
        "a\\\"b",
        "a\\\\",
        "V\\n",
        "'",
        "a?\u{202e}",
        "12345678901234567",
        "]]>",
    ] {
        contract_fault(
            "unit = \"V\"",
            &format!("unit = ¦\"{unit}\""),
            &["unit cannot be printed"],
        );
    }
    for unit in ["", "V/s", "°C", "Ω", "1/A", "%"] {
        assert_eq!(
            Folder::new()
                .replace("unit = \"V\"", &format!("unit = \"{unit}\""))
                .policy()
                .signals[0]
                .unit,
            unit
        );
    }
}
