//! The executed instruction count of a step does not depend on the input: counted by callgrind, call by call.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use policy::Policy;
use random::{Random, SplitMix};

/// Calls counted per program.
const CALLS: usize = 256;

#[test]
fn the_count_does_not_depend_on_the_input_gcc_o2() {
    all_policies(&|policy, folder| c_program(policy, folder, "gcc", "-O2"));
}

#[test]
fn the_count_does_not_depend_on_the_input_gcc_o3() {
    all_policies(&|policy, folder| c_program(policy, folder, "gcc", "-O3"));
}

#[test]
fn the_count_does_not_depend_on_the_input_clang_o2() {
    all_policies(&|policy, folder| c_program(policy, folder, "clang", "-O2"));
}

#[test]
fn the_count_does_not_depend_on_the_input_clang_o3() {
    all_policies(&|policy, folder| c_program(policy, folder, "clang", "-O3"));
}

#[test]
fn the_count_does_not_depend_on_the_input_rustc() {
    all_policies(&rust_program);
}

/// The measurement itself: a controller with a plain `?:` in its ReLU must be found out.
#[test]
fn a_branch_on_the_data_is_seen() {
    let policy = policy::load(&tests::example()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let text = generate(&policy, codegen::Output::C, folder.path());
    let branchy = text.replace(
        "return (x + __builtin_fabsf(x)) * 0.5f;",
        "if (x < 0.0f) { return 0.0f; } __asm__ volatile(\"nop\\n nop\\n nop\\n nop\"); return x;",
    );
    assert_ne!(text, branchy, "the planted branch has found its place");
    std::fs::write(folder.path().join("buck12.c"), branchy).unwrap();
    let program = link_c(&policy, folder.path(), "gcc", "-O2");
    assert!(counts(&program, folder.path()).len() > 1);
}

fn all_policies(build: &dyn Fn(&Policy, &Path) -> PathBuf) {
    check(&policy::load(&tests::example()).unwrap(), build);
    // every kind of filter, activation and limit occurs in these
    for seed in 9000..9006 {
        let folder = tests::random::policy(seed).unwrap();
        check(&policy::load(&folder.path()).unwrap(), build);
    }
}

fn check(policy: &Policy, build: &dyn Fn(&Policy, &Path) -> PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let program = build(policy, folder.path());
    let counts = counts(&program, folder.path());
    assert_eq!(counts.len(), 1, "{}: {counts:?} instructions per step", policy.name);
}

/// The different instruction counts of `measured_step`, one dump of callgrind per call.
fn counts(program: &Path, folder: &Path) -> BTreeSet<u64> {
    let output = Command::new("valgrind")
        .args([
            "-q",
            "--tool=callgrind",
            "--toggle-collect=measured_step",
            "--dump-after=measured_step",
        ])
        .arg(format!("--callgrind-out-file={}", folder.join("calls").display()))
        .arg(program)
        .output()
        .expect("valgrind is installed by `cargo xtask setup`");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut counts = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap().map(Result::unwrap) {
        // `calls.N` is one call, `calls` the rest of the program
        if entry.file_name().to_string_lossy().starts_with("calls.") {
            let text = std::fs::read_to_string(entry.path()).unwrap();
            let summary = text.lines().find_map(|line| line.strip_prefix("summary: ")).unwrap();
            counts.push(summary.trim().parse::<u64>().unwrap());
        }
    }
    assert_eq!(counts.len(), CALLS, "one dump per call");
    assert!(
        counts.iter().all(|count| *count > 50),
        "the step itself was counted: {counts:?}"
    );
    counts.into_iter().collect()
}

fn generate(policy: &Policy, core: codegen::Output, folder: &Path) -> String {
    let target = targets::find("host").unwrap();
    let files = codegen::sources(policy, target, &[core], None).unwrap().files;
    for (name, text) in &files {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let extension = if core == codegen::Output::C { "c" } else { "rs" };
    files[&format!("{}.{extension}", policy.name)].clone()
}

fn c_program(policy: &Policy, folder: &Path, compiler: &str, level: &str) -> PathBuf {
    generate(policy, codegen::Output::C, folder);
    link_c(policy, folder, compiler, level)
}

/// Samples as bits per call and signal: inside the range, anywhere among the floats, not a number.
fn samples(policy: &Policy) -> Vec<Vec<u32>> {
    let mut rng = SplitMix::new(7);
    let mut sample = |signal: &policy::Signal| match (rng.below(4), signal.adc) {
        (0, None) => rng.bits() as u32,
        (0, Some(_)) => rng.bits() as u32,
        (1, None) => f32::NAN.to_bits(),
        (_, Some(adc)) => ((rng.uniform(signal.range.low, signal.range.high) - adc.offset) / adc.gain) as i32 as u32,
        (_, None) => (rng.uniform(signal.range.low, signal.range.high) as f32).to_bits(),
    };
    (0..CALLS)
        .map(|_| policy.signals.iter().map(&mut sample).collect())
        .collect()
}

fn link_c(policy: &Policy, folder: &Path, compiler: &str, level: &str) -> PathBuf {
    let name = &policy.name;
    let rows = samples(policy);
    let table: Vec<String> = rows.iter().flatten().map(|bits| format!("0x{bits:x}u")).collect();
    let main = format!(
        "#include <string.h>\n#include \"{name}.h\"\n\
         static const uint32_t samples[] = {{ {} }};\n\
         __attribute__((noinline)) void measured_step({name}_state *s, const {name}_measurement *m, {name}_command *c)\n\
         {{ {name}_step(s, m, c); }}\n\
         int main(void) {{\n\
           {name}_state s; {name}_measurement m; {name}_command c; unsigned i; {name}_init(&s);\n\
           for (i = 0; i < {CALLS}u; ++i) {{ memcpy(&m, &samples[i * {}u], sizeof m); measured_step(&s, &m, &c); }}\n\
           return 0; }}\n",
        table.join(","),
        policy.signals.len()
    );
    std::fs::write(folder.join("main.c"), main).unwrap();
    let target = targets::find("host").unwrap();
    let program = folder.join("program");
    let status = Command::new(compiler)
        .current_dir(folder)
        .args(target.c_flags)
        .args([level, "main.c", &format!("{name}.c"), "-o"])
        .arg(&program)
        .status()
        .unwrap();
    assert!(status.success());
    program
}

fn rust_program(policy: &Policy, folder: &Path) -> PathBuf {
    generate(policy, codegen::Output::Rust, folder);
    let name = &policy.name;
    let mut rows = String::new();
    for row in samples(policy) {
        let fields = policy.signals.iter().zip(row).map(|(signal, bits)| match signal.adc {
            Some(_) => format!("{}: {}", signal.name, bits as i32),
            None => format!("{}: f32::from_bits({bits})", signal.name),
        });
        let _ = writeln!(rows, "Measurement {{ {} }},", fields.collect::<Vec<_>>().join(", "));
    }
    let main = format!(
        "#[path = \"{name}.rs\"] #[allow(dead_code)] mod controller; use controller::*;\n\
         #[no_mangle] #[inline(never)] pub extern \"C\" fn measured_step(s: &mut Controller, m: &Measurement, c: &mut Command) {{\n\
           *c = s.step(m); }}\n\
         fn main() {{ let mut s = Controller::new();\n\
           let mut c = Command {{ duty: 0.0, duty_sim: 0.0, action_index: 0, status: 0 }};\n\
           let samples: [Measurement; {CALLS}] = [{rows}];\n\
           for m in &samples {{ measured_step(&mut s, m, &mut c); }} }}\n"
    );
    std::fs::write(folder.join("main.rs"), main).unwrap();
    let program = folder.join("program");
    let status = Command::new("rustc")
        .current_dir(folder)
        .args(["--edition=2021", "-O", "-A", "warnings", "main.rs", "-o"])
        .arg(&program)
        .status()
        .unwrap();
    assert!(status.success());
    program
}
