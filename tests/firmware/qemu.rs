//! The firmware with its own converter, on an emulated Cortex-M4F: the interpreter closes the same loop here.

use std::path::PathBuf;
use std::process::Command;

use interp::{Controller, Sample};
use plant::{Load, Parameters, Plant};
use policy::Policy;
use tests::tools::{Ran, artifacts, cargo, run};
use verify::toolchain::{Toolchain, debian, toolchain};

use super::run::{Outcome, PERIODS, Run};

const TRIPLE: &str = "thumbv7em-none-eabihf";

fn example() -> Policy {
    policy::load(&tests::example()).unwrap()
}

/// The run with the interpreter as controller.
fn interpreted(policy: &Policy) -> Outcome {
    let mut controller = Controller::<f32>::new(policy);
    let mut run = Run::new();
    while run.period() < PERIODS {
        let samples = run.samples().map(Sample::Physical);
        let command = controller.step(&samples).unwrap().command;
        run.advance(command.duty, command.status);
    }
    run.outcome()
}

/// What the image prints for an outcome.
fn text(outcome: &Outcome) -> String {
    let Outcome {
        checksum,
        extremes: [lowest, highest],
        settled_error,
    } = outcome;
    format!(
        "{PERIODS} periods of 100 us, 200 W, 800 W, 200 W\n\
         v_out {lowest} to {highest} mV, within {settled_error} mV once settled\n\
         late control interrupts: 0\n\
         checksum {checksum:016x}\n"
    )
}

/// The image; `None` where `cargo xtask test` could have no Rust for the processor and has said so.
fn image() -> Option<PathBuf> {
    let without = std::env::var("POLICYC_WITHOUT_RUST_TARGETS").unwrap_or_default();
    if without.split(',').any(|triple| triple == TRIPLE) {
        return None;
    }
    let _turn = super::turn();
    let target = targets::find("cortex-m4f").unwrap();
    let mut command = match toolchain(target.rust.unwrap()) {
        Ok(Toolchain::OnPath) => cargo(),
        Ok(Toolchain::Debian(_)) => debian(),
        Err(missing) => panic!("{missing:?}"),
    };
    command
        .args(["build", "--release", "--message-format=json-render-diagnostics"])
        .current_dir(tests::root().join("firmware/qemu-m4"))
        .env("CARGO_TARGET_DIR", super::target_folder());
    let ran = run(&mut command);
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    let own = artifacts(&ran.stdout);
    let own = own.iter().find(|artifact| artifact.name == "firmware-qemu-m4").unwrap();
    Some(PathBuf::from(&own.files[0]))
}

/// Debian's cargo brings no linker for a bare board, so that the C compiler's links.
fn debian() -> Command {
    let mut command = debian::cargo().unwrap();
    command.args([debian::BUILD_CORE, "--config"]);
    command.arg(format!("target.{TRIPLE}.linker = \"arm-none-eabi-gcc\""));
    command
        .args(["--config"])
        .arg(format!("target.{TRIPLE}.rustflags = [\"-Clink-arg=-nostartfiles\"]"));
    command
}

/// As in the crate's `.cargo/config.toml`: time is counted in instructions, so that every run is the same.
fn emulate(image: &PathBuf) -> Ran {
    let mut command = Command::new("timeout");
    command.args(["120", "qemu-system-arm", "-machine", "mps2-an386", "-display", "none"]);
    command.args(["-serial", "none", "-monitor", "none", "-icount", "shift=0,sleep=off"]);
    command.args(["-semihosting-config", "enable=on,target=native", "-kernel"]);
    run(command.arg(image))
}

#[test]
fn the_image_regulates_and_its_duties_are_the_interpreters_to_the_bit() {
    let Some(image) = image() else { return };
    let ran = emulate(&image);
    assert_eq!(
        (ran.code, ran.stdout),
        (Some(0), text(&interpreted(&example()))),
        "{}",
        ran.stderr
    );
    let symbols = run(Command::new("nm").arg(&image)).stdout;
    let heap = |line: &&str| {
        ["__rust_alloc", "__rdl_", "5alloc", "malloc"]
            .iter()
            .any(|part| line.contains(part))
    };
    assert!(symbols.contains("SysTick"), "stripped?\n{symbols}");
    assert_eq!(symbols.lines().filter(heap).collect::<Vec<_>>(), [""; 0]);
}

/// The comparison itself: one action's duty moved by one unit in the last place is another checksum.
#[test]
fn a_duty_off_by_one_bit_is_another_checksum() {
    let mut policy = example();
    let honest = interpreted(&policy);
    let duty = policy.actions()[5].duty as f32;
    policy.actions_mut()[5].duty = f64::from(f32::from_bits(duty.to_bits() + 1));
    assert_ne!(interpreted(&policy).checksum, honest.checksum);
}

/// The converter in the image is a fair one: the crate `plant`, which shares no code with it, shows the same dip and rise.
#[test]
fn the_converter_of_the_image_agrees_with_the_plant() {
    let path = tests::root().join("examples/plants/sb3-buck12.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let parameters = Parameters::from_toml(&path, &text).unwrap_or_else(|faults| panic!("{faults}"));
    let mut plant = Plant::new(&parameters).unwrap_or_else(|faults| panic!("{faults}"));
    let policy = example();
    let mut controller = Controller::<f32>::new(&policy);
    let (light, heavy) = (Load::power(200.0), Load::power(800.0));
    let mut sample = plant.reset_at(100.0, 2.0, &light);
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    for period in 0..PERIODS {
        let load = if (500..1250).contains(&period) { &heavy } else { &light };
        let i_out = load.power / sample.v_out + 1e-4 * sample.v_out;
        let measured = [sample.v_out, sample.i_l, i_out].map(|x| Sample::Physical(x as f32));
        let command = controller.step(&measured).unwrap().command;
        sample = plant.step(f64::from(command.duty), load);
        if period + 1 >= 500 {
            lowest = lowest.min(sample.v_out);
            highest = highest.max(sample.v_out);
        }
    }
    let [low, high] = interpreted(&policy)
        .extremes
        .map(|millivolts| f64::from(millivolts) * 1e-3);
    // duties are a table: a difference of microvolts may take another action once and move the extremes a little
    assert!(
        (low - lowest).abs() < 0.1 && (high - highest).abs() < 0.1,
        "{low} {lowest} {high} {highest}"
    );
    assert!(low < 98.0 && high > 101.0, "the load steps show: {low} {high}");
}
