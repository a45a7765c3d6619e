//! What a hostile editor, or a careless build, would do to the generated code.

use codegen::Output;
use policy::Policy;
use verify::{Files, Options, Outcome, Report};

fn example() -> Policy {
    policy::load(&tests::example()).unwrap()
}

fn generated(policy: &Policy, core: Output) -> Files {
    codegen::sources(policy, targets::find("host").unwrap(), &[core], None)
        .unwrap()
        .files
}

fn verify_files(policy: &Policy, files: &Files, compiler: &str, extra: &[&str]) -> Report {
    let options = Options {
        steps: 20_000,
        generated: Some(files),
        compilers: vec![compiler.to_owned()],
        extra_flags: extra.iter().map(|flag| (*flag).to_owned()).collect(),
        ..Options::default()
    };
    verify::run(policy, options).unwrap()
}

/// Replaces the first `from` in the source file; the edit must have happened.
fn edited(policy: &Policy, core: Output, edit: &dyn Fn(&str) -> String) -> Files {
    let mut files = generated(policy, core);
    let extension = if core == Output::C { "c" } else { "rs" };
    let text = files.get_mut(&format!("{}.{extension}", policy.name)).unwrap();
    let new = edit(text);
    assert_ne!(*text, new, "the edit has found its place");
    *text = new;
    files
}

/// No build passes, and those that ran differ in what the contract promises (or refuse to run).
fn assert_caught(report: &Report) {
    assert!(!report.passed());
    for build in &report.builds {
        let caught = matches!(
            build.outcome,
            Outcome::Different { .. } | Outcome::CompileError { .. } | Outcome::Failed { .. }
        );
        assert!(caught, "{} was not caught: {:?}", build.build, build.outcome);
    }
}

/// The literals of a table, as (start, end) in the text.
fn table_literals(text: &str, table: &str) -> Vec<(usize, usize)> {
    let start = text.find(table).unwrap();
    let open = start + text[start..].find('{').unwrap() + 1;
    let close = open + text[open..].find("};").unwrap();
    let mut literals = Vec::new();
    let mut from = open;
    for piece in text[open..close].split(',') {
        let trimmed = piece.trim();
        if !trimmed.is_empty() {
            let at = from + piece.find(trimmed).unwrap();
            literals.push((at, at + trimmed.len()));
        }
        from += piece.len() + 1;
    }
    literals
}

/// Flags that ask for fused multiply-add; the machine must have it to run the result.
#[cfg(target_arch = "x86_64")]
const FUSED: [&str; 2] = ["-mfma", "-ffp-contract=fast"];

/// Names of the builds that ran and were found different.
#[cfg(target_arch = "x86_64")]
fn caught(report: &Report) -> Vec<&str> {
    let differs = |outcome: &Outcome| matches!(outcome, Outcome::Different { .. } | Outcome::Failed { .. });
    report
        .builds
        .iter()
        .filter(|build| differs(&build.outcome))
        .map(|build| build.build.as_str())
        .collect()
}

#[test]
fn unedited_files_pass() {
    let policy = example();
    assert!(verify_files(&policy, &generated(&policy, Output::C), "gcc", &[]).passed());
    assert!(verify_files(&policy, &generated(&policy, Output::Rust), "rustc", &[]).passed());
}

#[test]
fn two_swapped_weights_are_caught() {
    let policy = example();
    let files = edited(&policy, Output::C, &|text| {
        let literals = table_literals(text, "buck12_weights1[4096]");
        let ((a, b), (c, d)) = (literals[1000], literals[1001]);
        format!(
            "{}{}{}{}{}",
            &text[..a],
            &text[c..d],
            &text[b..c],
            &text[a..b],
            &text[d..]
        )
    });
    assert_caught(&verify_files(&policy, &files, "gcc", &[]));
}

#[test]
fn one_flipped_bit_of_a_weight_is_caught() {
    let policy = example();
    let files = edited(&policy, Output::C, &|text| {
        let (a, b) = table_literals(text, "buck12_weights0[384]")[17];
        let value: f32 = text[a..b].trim_end_matches('f').parse().unwrap();
        format!("{}{:e}f{}", &text[..a], f32::from_bits(value.to_bits() ^ 1), &text[b..])
    });
    assert_caught(&verify_files(&policy, &files, "gcc", &[]));
}

#[test]
fn a_dropped_bias_is_caught() {
    let policy = example();
    let files = edited(&policy, Output::C, &|text| {
        let (a, b) = table_literals(text, "buck12_bias2[12]")[3];
        format!("{}0.0f{}", &text[..a], &text[b..])
    });
    assert_caught(&verify_files(&policy, &files, "clang", &[]));
}

/// A network whose outputs are all equal: the lowest index must win.
fn ties() -> (tempfile::TempDir, Policy) {
    let folder = tests::random::policy(0).unwrap().folder;
    let zeros = vec![0_u8; 4 * 4];
    let view =
        |shape: Vec<usize>| safetensors::tensor::TensorView::new(safetensors::Dtype::F32, shape, &zeros).unwrap();
    let tensors = [("fc0.weight", view(vec![4, 1])), ("fc0.bias", view(vec![4]))];
    std::fs::write(
        folder.path().join("weights.safetensors"),
        safetensors::serialize(tensors, None).unwrap(),
    )
    .unwrap();
    let contract = "name = \"ties\"\nsample_period = 1e-4\n[[signal]]\nname = \"v\"\nunit = \"V\"\nrange = [0.0, 1.0]\n\
        [[feature]]\nname = \"x\"\nsource = \"v\"\n[network]\nweights = \"weights.safetensors\"\n\
        [actions]\nduties = [0.1, 0.2, 0.3, 0.4]\n[limits]\nduty = [0.0, 1.0]\n[fallback]\nduty = 0.0\nhold = 0\n";
    std::fs::write(folder.path().join("policy.toml"), contract).unwrap();
    let policy = policy::load(&folder.path().join("policy.toml")).unwrap();
    (folder, policy)
}

#[test]
fn greater_or_equal_in_argmax_is_caught_in_c() {
    let (_folder, policy) = ties();
    assert!(verify_files(&policy, &generated(&policy, Output::C), "gcc", &[]).passed());
    let files = edited(&policy, Output::C, &|text| {
        text.replace("flag(output > best)", "flag(output >= best)")
    });
    assert_caught(&verify_files(&policy, &files, "gcc", &[]));
}

#[test]
fn greater_or_equal_in_argmax_is_caught_in_rust() {
    let (_folder, policy) = ties();
    let files = edited(&policy, Output::Rust, &|text| text.replace("*q > best", "*q >= best"));
    assert_caught(&verify_files(&policy, &files, "rustc", &[]));
}

#[test]
fn a_limit_applied_before_the_mapping_is_caught() {
    let policy = example();
    let files = edited(&policy, Output::C, &|text| {
        text.replace(
            "command->duty = buck12_select(usable, v7,",
            "command->duty = buck12_select(usable, v3,",
        )
    });
    assert_caught(&verify_files(&policy, &files, "gcc", &[]));
}

#[test]
fn a_filter_that_forgets_is_caught() {
    let policy = example();
    let files = edited(&policy, Output::C, &|text| {
        text.replace("state->memory[0] = push0;", "")
    });
    assert_caught(&verify_files(&policy, &files, "gcc", &[]));
}

#[test]
fn an_eval_that_changes_the_state_is_caught() {
    let policy = example();
    let files = edited(&policy, Output::C, &|text| {
        let place = "    buck12_answer(state, measured, index, command);\n}";
        text.replacen(
            place,
            &place.replace("\n}", "\n    ((buck12_state *)state)->bad_count += 1u;\n}"),
            1,
        )
    });
    assert_caught(&verify_files(&policy, &files, "gcc", &[]));
}

#[test]
fn fast_math_is_refused_by_the_source() {
    let policy = example();
    let files = generated(&policy, Output::C);
    for compiler in ["gcc", "clang"] {
        for flag in ["-ffast-math", "-Ofast"] {
            let report = verify_files(&policy, &files, compiler, &[flag]);
            let refused = |outcome: &Outcome| matches!(outcome, Outcome::CompileError { message } if message.contains("-ffast-math"));
            assert!(
                report.builds.iter().all(|build| refused(&build.outcome)),
                "{compiler} {flag}: {:?}",
                report.builds
            );
        }
    }
}

/// gcc obeys the pragma in the source: the build is equal although the flags ask for contraction.
#[cfg(target_arch = "x86_64")]
#[test]
fn contraction_on_fma_hardware_flags_does_not_reach_the_code_with_gcc() {
    let policy = example();
    let files = generated(&policy, Output::C);
    assert!(verify_files(&policy, &files, "gcc", &FUSED).passed());
    let files = edited(&policy, Output::C, &|text| text.replace("\"fp-contract=off\", ", ""));
    assert_eq!(
        caught(&verify_files(&policy, &files, "gcc", &FUSED)),
        ["gcc -O2", "gcc -O3"],
        "-O0 and -O1 fuse nothing"
    );
}

/// clang ignores the pragma under this flag: the self test and the comparison catch it.
#[cfg(target_arch = "x86_64")]
#[test]
fn contraction_on_fma_hardware_flags_is_caught_with_clang() {
    let policy = example();
    let report = verify_files(&policy, &generated(&policy, Output::C), "clang", &FUSED);
    assert!(!report.passed());
    // sums are vectors, which clang fuses without optimisation, too
    assert_eq!(caught(&report), ["clang -O0", "clang -O2", "clang -O3"]);
}

#[test]
fn unsafe_math_optimisations_are_refused_with_gcc() {
    let policy = example();
    let report = verify_files(
        &policy,
        &generated(&policy, Output::C),
        "gcc",
        &["-funsafe-math-optimizations"],
    );
    assert!(
        report
            .builds
            .iter()
            .all(|build| matches!(build.outcome, Outcome::CompileError { .. })),
        "{:?}",
        report.builds
    );
}

/// What makes another law of a gain schedule: another order of the sum, a gain without its limits, another sign, exchanged gains.
#[test]
fn another_law_of_the_same_gains_is_caught() {
    let path = tests::root().join("tests/golden/cases/scheduled/policy.toml");
    let policy = policy::load(&path).unwrap();
    for (core, compiler, from, to) in [
        (Output::C, "gcc", "v10 = v5 + v9", "v10 = front->base + (v4 + v9)"),
        (Output::C, "gcc", "scheduled_clamp(v2, 0.004f, 0.02f)", "v2"),
        (Output::C, "gcc", "v15 * -0.05f", "v15 * 0.05f"),
        (
            Output::C,
            "gcc",
            "scheduled_tanh(outputs[0])",
            "scheduled_tanh(outputs[3])",
        ),
        (
            Output::Rust,
            "rustc",
            "v10: f32 = v5 + v9",
            "v10: f32 = front.base + (v4 + v9)",
        ),
        (Output::Rust, "rustc", "clamp(v11, -0.002, 0.005)", "v11"),
        (Output::Rust, "rustc", "v17: f32 = v14 + v16", "v17: f32 = v14 - v16"),
    ] {
        let files = edited(&policy, core, &|text| text.replacen(from, to, 1));
        assert_caught(&verify_files(&policy, &files, compiler, &[]));
    }
}
