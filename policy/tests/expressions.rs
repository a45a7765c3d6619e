//! Source expressions: what is accepted and folded, and where a fault points.

mod common;
use common::*;
use policy::Expr::{self, Add, Constant, Neg, Scale, Sub};
use policy::Input::{PreviousCommand, PreviousDuty, Signal};

const SOURCE: &str = "[[feature]]\nname = \"e\"\nsource = \"v_ref - v_out\"";

fn tree(source: &str) -> Expr {
    let text = SOURCE.replace("v_ref - v_out", source);
    Folder::new()
        .replace(SOURCE, &text)
        .replace("v_ref = 100.0", "v_ref = 100.0\nc_out = 1.5e-3")
        .policy()
        .features[0]
        .source
        .clone()
}

/// `source` with `¦` before the offending token.
#[track_caller]
fn fault(source: &str, expected: &[&str]) {
    contract_fault(SOURCE, &SOURCE.replace("v_ref - v_out", source), expected);
}

fn v_out() -> Box<Expr> {
    Box::new(Expr::Input(Signal(0)))
}

fn i_out() -> Box<Expr> {
    Box::new(Expr::Input(Signal(1)))
}

fn constant(value: f64) -> Box<Expr> {
    Box::new(Constant(value))
}

#[test]
fn sums_and_products_keep_their_order() {
    assert_eq!(tree("v_out"), *v_out());
    assert_eq!(tree("v_ref - v_out"), Sub(constant(100.0), v_out()));
    assert_eq!(
        tree("v_out + i_out - 2"),
        Sub(Box::new(Add(v_out(), i_out())), constant(2.0))
    );
    assert_eq!(
        tree("v_out - (i_out - 2)"),
        Sub(v_out(), Box::new(Sub(i_out(), constant(2.0))))
    );
    assert_eq!(tree("v_out + 2 * i_out"), Add(v_out(), Box::new(Scale(2.0, i_out()))));
    assert_eq!(
        tree("3 * (v_out + i_out) * 2"),
        Scale(2.0, Box::new(Scale(3.0, Box::new(Add(v_out(), i_out())))))
    );
}

#[test]
fn constants_are_folded_in_binary64() {
    assert_eq!(tree("2 * v_ref + 1 - v_out"), Sub(constant(201.0), v_out()));
    assert_eq!(tree("0.1 * 0.2 * v_out"), Scale(0.1 * 0.2, v_out()));
    assert_eq!(tree("-(1 + 2) * v_out"), Scale(-3.0, v_out()));
    assert_eq!(tree("1e-3 * v_out"), Scale(1e-3, v_out()));
    assert_eq!(
        tree("v_out + .5 + 2."),
        Add(Box::new(Add(v_out(), constant(0.5))), constant(2.0))
    );
}

#[test]
fn division_is_multiplication_by_the_binary64_reciprocal() {
    assert_eq!(tree("v_out / 3"), Scale(1.0 / 3.0, v_out()));
    assert_eq!(
        tree("(v_out - i_out) / c_out"),
        Scale(1.0 / 1.5e-3, Box::new(Sub(v_out(), i_out())))
    );
}

#[test]
fn multiplication_by_exactly_one_is_left_out_and_by_minus_one_is_not() {
    assert_eq!(tree("1 * v_out"), *v_out());
    assert_eq!(tree("v_out / 1"), *v_out());
    assert_eq!(tree("v_out * -1"), Scale(-1.0, v_out()));
    assert_eq!(tree("-v_out"), Neg(v_out()));
    assert_eq!(tree("--v_out"), Neg(Box::new(Neg(v_out()))));
    assert_eq!(tree("+v_out"), *v_out());
}

#[test]
fn remembered_duties_are_inputs() {
    assert_eq!(tree("previous_duty"), Expr::Input(PreviousDuty));
    assert_eq!(
        tree("2 * previous_command"),
        Scale(2.0, Box::new(Expr::Input(PreviousCommand)))
    );
}

#[test]
fn nonlinear_terms_are_refused_at_the_operator() {
    fault(
        "v_out ¦* i_out",
        &["product of two signals is not affine", "constant on one side"],
    );
    fault(
        "v_ref / ¦v_out",
        &["division by a signal is not affine", "constant divisor"],
    );
    fault("v_out / ¦(v_ref + i_out)", &["division by a signal"]);
    fault("v_out / ¦0", &["division by zero"]);
    fault("v_out / ¦(v_ref - 100)", &["division by zero"]);
    fault("¦abs(v_out)", &["functions are not affine", "`abs(...)`"]);
    fault("v_out ¦^ 2", &["`^`", "powers"]);
    fault("v_out ¦> 2", &["`>`", "comparisons"]);
}

#[test]
fn unknown_names_get_the_nearest_one() {
    fault(
        "v_ref - ¦v_oout",
        &["no signal or parameter `v_oout`", "did you mean `v_out`?"],
    );
    fault("¦previous_dutty", &["did you mean `previous_duty`?"]);
    fault("¦V_out", &["did you mean `v_out`?"]);
    fault("¦z", &["one of v_out, i_out, v_ref, previous_duty, previous_command"]);
}

#[test]
fn broken_syntax_points_at_the_token() {
    fault("v_ref - ¦", &["the end of the expression", "a name, a number or `(`"]);
    fault("(v_ref - v_out¦", &["the end of the expression", "`)`"]);
    fault("v_ref ¦v_out", &["`v_out`", "an operator"]);
    fault("v_ref *¦/ v_out", &["`/`"]);
    fault("v_ref ¦) - v_out", &["`)`", "an operator"]);
    fault("¦2v_out", &["operator is missing", "2 * ..."]);
    fault("1¦,5 * v_out", &["`,`", "1.5 instead of 1,5"]);
    fault("44 ¦% * v_out", &["`%`", "0.44"]);
    fault("1.2¦.3 + v_out", &["the number 0.3", "an operator"]);
    fault("¦. + v_out", &["not a number"]);
    fault("v_ref - ¦é", &["`é`", "no place"]);
}

#[test]
fn an_empty_source_is_refused() {
    let text = SOURCE.replace("v_ref - v_out", "");
    let fault = Folder::new().replace(SOURCE, &text).fault();
    assert_says(&fault, &["the end of the expression"]);
}

#[test]
fn constants_that_leave_f32_are_refused() {
    fault("¦1e39 * v_out", &["too large for f32"]);
    fault("v_out + ¦1e-50", &["rounds to 0 in f32"]);
    fault("v_out / ¦1e999", &["not a finite number"]);
    fault("¦1e300 * 1e300 * v_out", &["not a finite number"]);
}

#[test]
fn deep_nesting_and_long_text_are_refused_without_overflow() {
    let nested = format!("{}v_out{}", "(".repeat(31), ")".repeat(31));
    assert_eq!(tree(&nested), *v_out());
    let deep = "(".repeat(200);
    let fault = |source: &str| {
        Folder::new()
            .replace(SOURCE, &SOURCE.replace("v_ref - v_out", source))
            .fault()
    };
    assert_says(&fault(&deep), &["nested too deeply", "32 levels"]);
    assert_says(&fault(&"-".repeat(499)), &["nested too deeply"]);
    assert_says(&fault(&"(".repeat(100_000)), &["too long", "at most 500"]);
    tree(&vec!["v_out"; 80].join("+"));
}

#[test]
fn a_source_of_several_lines_is_shown_in_one() {
    let text = SOURCE.replace("\"v_ref - v_out\"", "\"\"\"\nv_ref\n  - v_out\"\"\"");
    let policy = Folder::new().replace(SOURCE, &text).policy();
    assert_eq!(policy.features[0].source_text, "v_ref - v_out");
}
