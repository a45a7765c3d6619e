//! What is read and what is refused: the golden files, and texts that leave the subset.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use equivalence::{Goal, Reading, Refusal, Source, Sources, goals};
use policy::Policy;

struct Code {
    policy: Policy,
    header: String,
    c: String,
    rust: String,
}

fn golden(case: &str) -> Code {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../tests/golden/cases")
        .join(case);
    let read = |extension: &str| std::fs::read_to_string(folder.join(format!("expected/{case}.{extension}"))).unwrap();
    Code {
        policy: policy::load(&folder.join("policy.toml")).unwrap_or_else(|faults| panic!("{faults}")),
        header: read("h"),
        c: read("c"),
        rust: read("rs"),
    }
}

impl Code {
    fn goals(&self) -> Result<Vec<Goal>, Refusal> {
        let sources = Sources {
            c: Some((
                Source {
                    name: "a.h",
                    text: &self.header,
                },
                Source {
                    name: "a.c",
                    text: &self.c,
                },
            )),
            readings: &[Reading::Compiler, Reading::FramaC],
            rust: Some(Source {
                name: "a.rs",
                text: &self.rust,
            }),
        };
        goals(&self.policy, &sources)
    }
}

/// Replaces `from`, which must be there, and expects a refusal at the line where the text then stands.
fn refused(file: &str, from: &str, to: &str, message: &str) {
    let mut code = golden("adc_mapping");
    let text = if file == "a.c" { &mut code.c } else { &mut code.rust };
    let at = text.find(from).unwrap_or_else(|| panic!("`{from}` is not there"));
    let line = text[..at].lines().count();
    *text = text.replacen(from, to, 1);
    let refusal = code.goals().expect_err("the edited code is refused");
    assert_eq!((refusal.file.as_str(), refusal.line), (file, line), "{refusal}");
    assert!(refusal.message.contains(message), "{refusal}");
}

#[test]
fn the_golden_files_are_read_and_every_goal_has_its_own_name() {
    for case in ["adc_mapping", "filters", "minimal", "constructs", "activations"] {
        let goals = golden(case).goals().unwrap_or_else(|refusal| panic!("{refusal}"));
        let names: BTreeSet<&str> = goals.iter().map(|goal| goal.name.as_str()).collect();
        assert_eq!(names.len(), goals.len());
        for part in [
            "observation",
            "duty",
            "status",
            "commit.held",
            "commit.counters",
            "step",
            "init",
            "defined",
        ] {
            assert!(
                names.contains(&*format!("c.{part}")) && names.contains(&*format!("rust.{part}")),
                "{part}"
            );
        }
        for goal in &goals {
            assert!(
                goal.text.ends_with("(check-sat)\n") && goal.text.contains("(set-logic QF_"),
                "{}",
                goal.name
            );
        }
    }
}

#[test]
fn equal_code_gives_equal_goals() {
    let texts = || golden("adc_mapping").goals().unwrap().into_iter().map(|goal| goal.text);
    assert!(texts().eq(texts()));
}

#[test]
fn a_jump_is_refused_with_its_line() {
    refused("a.c", "const float v10 = v9 * 0.5f;", "goto end;", "expected");
}

#[test]
fn a_loop_that_the_subset_does_not_have_is_refused_with_its_line() {
    refused("a.c", "const float v10 = v9 * 0.5f;", "while (1) { }", "expected");
    refused(
        "a.rs",
        "let v10: f32 = v9 * 0.5;",
        "let v10: f32 = loop { break v9; };",
        "not read here",
    );
}

#[test]
fn assembly_with_an_instruction_is_refused() {
    refused(
        "a.c",
        "const uint32_t f20 =",
        "__asm__(\"nop\" : \"+r\"(f8)); const uint32_t f20 =",
        "assembly with an instruction",
    );
}

#[test]
fn a_sum_in_another_format_is_refused() {
    refused(
        "a.c",
        "const float v10 = v9 * 0.5f;",
        "const float v10 = (float)((double)v9 * 0.5);",
        "a conversion of",
    );
}

#[test]
fn a_sum_of_integers_that_rust_checks_is_refused() {
    refused(
        "a.rs",
        "let counted = self.bad_count.wrapping_add(flag(self.bad_count <= 4));",
        "let counted = self.bad_count + 1;",
        "debug build",
    );
}

#[test]
fn a_read_before_a_write_is_refused() {
    let mut code = golden("adc_mapping");
    code.c = code.c.replacen("front->observation[0] = v11;", "", 1);
    let refusal = code.goals().unwrap_err();
    assert!(
        refusal.message.contains("read before anything was written"),
        "{refusal}"
    );
}

#[test]
fn a_state_with_another_member_is_refused() {
    let mut code = golden("adc_mapping");
    code.header = code.header.replacen("float soft_cap;", "float cap;", 1);
    assert!(code.goals().unwrap_err().message.contains("other members"));
}

#[test]
fn a_return_that_depends_on_the_data_is_refused() {
    refused(
        "a.c",
        "const float v10 = v9 * 0.5f;",
        "if (f8 != 0u) { return; } const float v10 = v9 * 0.5f;",
        "a return that depends",
    );
}

#[test]
fn an_index_beyond_an_array_is_refused() {
    refused(
        "a.c",
        "front->signal[1] = v7;",
        "front->signal[2] = v7;",
        "element 2 of an array of 2",
    );
}
