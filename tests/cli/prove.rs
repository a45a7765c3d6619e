//! `policyc prove`: what it writes, and that it names what it did not run.

use serde_json::Value;

use super::certify::two_outputs;
use super::{Desk, run};

/// Without provers on the path nothing is proved, which is said, and is no failure of the policy.
#[test]
fn provers_that_are_missing_are_named_with_the_command_that_installs_them() {
    let desk = Desk::new("minimal");
    let empty = desk.path("empty");
    std::fs::create_dir(&empty).unwrap();
    let mut command = desk.command();
    command
        .args("prove policy --out proof --goals".split(' '))
        .env("PATH", &empty);
    let ran = run(&mut command);
    let said = ran.stdout;
    assert_eq!(ran.code, Some(0), "{said}{}", ran.stderr);
    assert!(said.contains("apt-get install frama-c-base"), "{said}");
    assert!(said.contains("pip install bitwuzla"), "{said}");
    let proof: Value = serde_json::from_str(&desk.read("proof/proof.json")).unwrap();
    assert_eq!(proof.pointer("/holds"), Some(&Value::Bool(false)), "nothing is proved");
    // each goal is a claim that waits for a solver, and one line says how many
    let goals = tests::tools::listing(&desk.path("proof"));
    let goals = goals.iter().filter(|name| name.ends_with(".smt2")).count();
    assert!(goals > 10, "{goals}");
    assert!(
        said.contains(&format!("not run (f32): {goals} claims, the first of them: ")),
        "{said}"
    );
    assert_eq!(said.matches("pip install bitwuzla").count(), 1, "{said}");
    let claims = proof.pointer("/claims").and_then(Value::as_array).unwrap();
    let waiting = claims.iter().filter(|claim| claim["prover"] == "smt").count();
    assert_eq!(waiting, goals);
    assert!(
        said.contains(&format!("of {} claims {} not run", claims.len(), claims.len())),
        "{said}"
    );
    // the goals are there for a solver of one's own
    let goal = desk.read("proof/f32-c.duty.smt2");
    assert!(goal.contains("(check-sat)"), "{goal}");
    assert!(desk.path("proof/proof.html").exists());
}

#[test]
fn several_outputs_are_named_and_have_goals_of_their_own() {
    let desk = two_outputs();
    let empty = desk.path("empty");
    std::fs::create_dir(&empty).unwrap();
    let mut command = desk.command();
    command
        .args("prove policy --format f32-fma --out proof --goals".split(' '))
        .env("PATH", &empty);
    let ran = run(&mut command);
    assert_eq!(ran.code, Some(0), "{}{}", ran.stdout, ran.stderr);
    let proof: Value = serde_json::from_str(&desk.read("proof/proof.json")).unwrap();
    assert_eq!(proof.pointer("/outputs"), Some(&serde_json::json!(["left", "right"])));
    for goal in [
        "c.duty.left",
        "eva.duty_sim.right",
        "rust.action_index.left",
        "c.status",
    ] {
        assert!(desk.path(&format!("proof/f32-fma-{goal}.smt2")).exists(), "{goal}");
    }
}

#[test]
fn a_policy_that_is_none_leaves_no_folder() {
    let desk = Desk::new("minimal");
    desk.refuse("prove nowhere --out proof", &["nowhere"]);
    assert!(!desk.path("proof").exists());
}
