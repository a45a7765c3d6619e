//! What a step costs: the count of executed instructions does not depend on the data, no library, little stack.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};

use codegen::Output;
use policy::{NumericFormat, Policy};
use targets::{Fpu, Runner, TargetSpec};
use verify::estimate::estimate;
use verify::measure::{Costs, STEPS, measure};
use verify::toolchain;

fn example() -> Policy {
    policy::load(&tests::example()).unwrap()
}

fn emulated(has_fpu: bool) -> impl Iterator<Item = &'static TargetSpec> {
    targets::TARGETS
        .iter()
        .filter(move |target| matches!(target.runner, Runner::Emulated(_)) && (target.fpu != Fpu::None) == has_fpu)
}

/// Costs of the builds of the target at these levels, at all if there are none, for the example in a format. Several tests
/// ask for the same, and measuring takes long.
fn costs(format: NumericFormat, target: &'static TargetSpec, levels: &[&str]) -> Vec<Costs> {
    type Measured = BTreeMap<(&'static str, &'static str, String), Arc<OnceLock<Vec<Costs>>>>;
    static MEASURED: Mutex<Measured> = Mutex::new(BTreeMap::new());
    let cell = Arc::clone(
        MEASURED
            .lock()
            .unwrap()
            .entry((format.name(), target.name, levels.join(" ")))
            .or_default(),
    );
    cell.get_or_init(|| {
        let policy = example().with_format(format);
        let files = codegen::generate(&policy, target, &Output::CORES, None).unwrap().files;
        let compilers: Vec<String> = super::compilers(target).into_iter().map(str::to_owned).collect();
        let levels: Vec<String> = levels.iter().map(ToString::to_string).collect();
        let builds = toolchain::builds(target, &compilers, &levels);
        let costs = builds.iter().map(|build| {
            let costs = measure(&policy, target, &files, build);
            costs.unwrap_or_else(|error| panic!("{} {}: {error}", target.name, build.name()))
        });
        costs.collect()
    })
    .clone()
}

/// Helpers of the compilers' libraries for processors without FPU: floats and wide products. No C library.
fn is_compiler_helper(name: &str) -> bool {
    let arithmetic = ["sf2", "sf3", "sisf", "sfsi", "si3", "di3"];
    name.starts_with("__aeabi_f")
        || name.starts_with("__aeabi_cf")
        || ["__aeabi_i2f", "__aeabi_ui2f", "__aeabi_lmul", "__aeabi_uidiv"].contains(&name)
        || (name.starts_with("__") && arithmetic.iter().any(|end| name.ends_with(end)))
}

/// rustc brings its own functions for clearing and copying memory with every target.
fn is_memory_helper(name: &str) -> bool {
    ["memset", "memcpy", "memmove"].contains(&name) || name.starts_with("__aeabi_mem")
}

fn check_core(target: &TargetSpec, costs: &Costs) {
    let what = format!("{} {costs:?}", target.name);
    assert_eq!(costs.static_ram_bytes, 0, "{what}");
    assert_eq!(costs.steps, STEPS, "{what}");
    assert!(costs.instructions_min > 1000, "the step itself was counted: {what}");
    assert!(costs.flash_bytes > 21_000 && costs.flash_bytes < 64_000, "{what}");
    assert!(costs.stack_bytes >= 64 && costs.stack_bytes < 2048, "{what}");
    let is_rust = costs.build.starts_with(toolchain::RUSTC);
    let is_allowed =
        |name: &String| (target.fpu == Fpu::None && is_compiler_helper(name)) || (is_rust && is_memory_helper(name));
    assert!(costs.library_calls.iter().all(is_allowed), "{what}");
}

/// Target, compiler and largest spread where LLVM makes a number of a comparison by a jump over one instruction:
/// docs/results/target-costs.md says so.
const BRANCHES: [(&str, &str, u64); 1] = [("dspace-ds1202", "rustc", 24)];

#[test]
fn the_instruction_count_does_not_depend_on_the_data_where_floats_are_hardware() {
    for target in emulated(true) {
        for costs in costs(NumericFormat::F32, target, &[]) {
            check_core(target, &costs);
            println!("{} {costs:?}", target.name);
            let spread = costs.instructions_max - costs.instructions_min;
            assert!(
                spread <= allowed_spread(target, &costs.build),
                "{} {costs:?}",
                target.name
            );
        }
    }
}

/// Filters, limits and activations of other policies, in one build per target.
#[test]
fn nor_does_that_of_random_policies() {
    for (seed, target) in (9000..).zip(emulated(true)) {
        let folder = tests::random::policy(seed).unwrap();
        let policy = policy::load(&folder.path()).unwrap();
        let files = codegen::generate(&policy, target, &Output::CORES, None).unwrap().files;
        let build = &toolchain::builds(target, &[], &[])[0];
        let costs = measure(&policy, target, &files, build).unwrap();
        assert_eq!(
            costs.instructions_min, costs.instructions_max,
            "{} {costs:?}\n{}",
            target.name, folder.contract
        );
    }
}

/// The load current leaves the range of the mapping on both sides, between the ends of its sensor. A jump over one instruction makes
/// a number of a comparison there; two comparisons joined by an `or` were jumps over three, and the spread was 11.
#[test]
fn on_powerpc_no_comparison_in_rust_is_jumped_over() {
    let target = targets::find("dspace-ds1202").unwrap();
    let policy = policy::load(&tests::root().join("tests/golden/cases/adc_mapping/policy.toml")).unwrap();
    let files = codegen::generate(&policy, target, &[Output::Rust], None).unwrap().files;
    let builds = toolchain::builds(target, &[toolchain::RUSTC.to_owned()], &[]);
    let costs = measure(&policy, target, &files, &builds[0]).unwrap();
    let spread = costs.instructions_max - costs.instructions_min;
    assert!(spread <= 9, "{costs:?}");
}

/// Largest spread of a build of the target.
fn allowed_spread(target: &TargetSpec, build: &str) -> u64 {
    let exception = BRANCHES
        .iter()
        .find(|(name, compiler, _)| *name == target.name && build.starts_with(compiler));
    exception.map_or(0, |(_, _, largest)| *largest)
}

/// The integer network takes one count everywhere; without FPU the few floats around it are library calls.
#[test]
fn nor_does_that_of_the_integer_formats() {
    for format in [NumericFormat::I16, NumericFormat::I8] {
        for (target, around) in emulated(true).map(|t| (t, 0)).chain(emulated(false).map(|t| (t, 320))) {
            for costs in costs(format, target, &["-O2", "-O"]) {
                println!("{} {} {costs:?}", target.name, format.name());
                let spread = costs.instructions_max - costs.instructions_min;
                let allowed = allowed_spread(target, &costs.build) + around;
                assert!(spread <= allowed, "{} {} {costs:?}", target.name, format.name());
            }
        }
    }
}

/// The float library's count does depend on the data; `docs/results/target-costs.md` states by how much.
#[test]
fn without_fpu_only_the_float_library_is_called_and_its_count_varies() {
    for target in emulated(false) {
        for costs in costs(NumericFormat::F32, target, &[]) {
            check_core(target, &costs);
            println!("{} {costs:?}", target.name);
            assert!(
                costs.instructions_min < costs.instructions_max,
                "{} {costs:?}",
                target.name
            );
            assert!(!costs.library_calls.is_empty(), "{} {costs:?}", target.name);
        }
    }
}

/// Where floats are hardware, nothing but the controller's own frames is on the stack; the painted depth has the return
/// addresses of the call and steps of 16 bytes in it.
#[test]
fn the_estimated_stack_is_near_the_painted_one() {
    let policy = example();
    for target in emulated(true) {
        let files = codegen::generate(&policy, target, &[Output::C], None).unwrap().files;
        let compiler = [target.c_compilers[0].program.to_owned()];
        let measured = costs(NumericFormat::F32, target, &[]);
        for build in toolchain::builds(target, &compiler, &[]) {
            let name = build.name();
            let painted = measured.iter().find(|costs| costs.build == name).unwrap().stack_bytes;
            let estimated = estimate(&policy, target, &files, &build).unwrap().estimated_stack_bytes;
            println!("{} {name}: estimated {estimated}, painted {painted}", target.name);
            assert!(estimated.abs_diff(painted) <= 32, "{} {name}", target.name);
        }
    }
}

/// A machine with the cross compiler and without the emulator.
#[test]
fn without_the_emulator_compile_says_what_it_estimates() {
    let folder = tempfile::tempdir().unwrap();
    let compiler = toolchain::find("arm-none-eabi-gcc").unwrap();
    std::os::unix::fs::symlink(compiler, folder.path().join("arm-none-eabi-gcc")).unwrap();
    let mut command = std::process::Command::new(tests::tools::policyc());
    command
        .arg("compile")
        .arg(tests::example())
        .args(["--target", "cortex-m4f", "--out"]);
    command.arg(folder.path().join("out")).env("PATH", folder.path());
    let ran = tests::tools::run(&mut command);
    assert_eq!(ran.code, Some(0), "{ran:?}");
    for text in [
        "estimated from the compiler's frames, nothing was run",
        "not measured: qemu-system-arm",
    ] {
        assert!(ran.stdout.contains(text), "{text}\n{}", ran.stdout);
    }
    let manifest = std::fs::read_to_string(folder.path().join("out/manifest.json")).unwrap();
    assert!(manifest.contains("\"estimated_stack_bytes\"") && !manifest.contains("\"stack_bytes\""));
}

/// One hidden layer of 64 floats is 256 of them; the other is never there as a whole.
#[test]
fn the_example_takes_less_than_540_bytes_of_stack_on_a_cortex_m4f() {
    let target = targets::find("cortex-m4f").unwrap();
    for costs in costs(NumericFormat::F32, target, &[]) {
        assert!(costs.stack_bytes > 256 && costs.stack_bytes < 540, "{costs:?}");
    }
}

/// One hidden layer of 64 integers is 128 bytes, the sums of the last layer are 48.
#[test]
fn in_integers_the_example_takes_256_bytes_of_stack_on_a_cortex_m4f() {
    let target = targets::find("cortex-m4f").unwrap();
    for format in [NumericFormat::I16, NumericFormat::I8] {
        for costs in costs(format, target, &[]) {
            let most = if costs.build.starts_with("arm-none-eabi-gcc") {
                256
            } else {
                340
            };
            assert!(costs.stack_bytes > 176 && costs.stack_bytes <= most, "{costs:?}");
        }
    }
}

/// The measurement itself: a branch on the data, a static variable and a call of the C library must show.
#[test]
fn a_branch_a_static_variable_and_a_library_call_are_seen() {
    let policy = example();
    let target = targets::find("cortex-m4f").unwrap();
    let mut files = codegen::generate(&policy, target, &[Output::C], None).unwrap().files;
    let text = files.get_mut("buck12.c").unwrap();
    let honest = "return (x + __builtin_fabsf(x)) * 0.5f;";
    assert!(text.contains(honest), "the place of the ReLU");
    *text = text.replace(
        honest,
        "if (x < 0.0f) { return 0.0f; } __asm__ volatile(\"nop\"); planted = (planted * 5u) + 1u; return x;",
    );
    let place = text.find("BUCK12_TABLE static const float").unwrap();
    text.insert_str(place, "static uint32_t planted;\n");
    let build = &toolchain::builds(target, &["arm-none-eabi-gcc".to_owned()], &["-O2".to_owned()])[0];
    let costs = measure(&policy, target, &files, build).unwrap();
    assert!(costs.instructions_min < costs.instructions_max, "{costs:?}");
    assert_eq!(costs.static_ram_bytes, 4, "{costs:?}");
}
