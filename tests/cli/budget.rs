//! `policyc compile --clock`: the control period against a model of cycles.

use serde_json::Value;

use super::Desk;

fn fit(desk: &Desk) -> Value {
    let manifest: Value = serde_json::from_str(&desk.read("out/manifest.json")).unwrap();
    manifest["costs"][0]["budget"]["fit"].clone()
}

#[test]
fn a_small_network_meets_its_period_at_a_usual_clock_and_misses_it_at_a_slow_one() {
    let desk = Desk::new("minimal");
    let met = desk.succeed("compile policy --target cortex-m4f --clock 168MHz --out out");
    assert!(
        met.contains("control period met") && met.contains("16,800 cycles at 168 MHz"),
        "{met}"
    );
    assert!(met.contains("never measured") && !met.contains("hint"), "{met}");
    assert_eq!(fit(&desk), "met");
    let missed = desk.succeed("compile policy --target cortex-m4f --clock 1MHz --out out");
    assert!(
        missed.contains("control period NOT met") && missed.contains("no numeric format fits"),
        "{missed}"
    );
    assert_eq!(fit(&desk), "missed");
    // what was generated does not depend on the clock
    desk.succeed("verify policy --generated out --steps 10");
}

/// A policy that samples in the middle of the period has half of it: verdict and advice are of that half.
#[test]
fn what_is_left_of_the_period_behind_the_sample_counts() {
    let desk = Desk::new("minimal");
    let plant = |phase: &str| {
        format!(
            "[converter]\nv_in = 200.0\ninductance = 2e-3\ncapacitance = 1.5e-3\nf_sw = 10e3\n[pwm]\nsampling_phase = {phase}\n"
        )
    };
    let compile = "compile policy --target cortex-m4f --clock 1.5MHz --out out";
    let whole = desk.succeed(compile);
    let share = |said: &str| {
        let line = said.lines().find(|line| line.contains("-O2: ")).unwrap().to_owned();
        let shown = line.split("; ").last().unwrap().split(" %").next().unwrap().to_owned();
        let least: f64 = shown.split(" to ").next().unwrap().parse().unwrap();
        (line, least)
    };
    desk.write("plant.toml", &plant("0.5"));
    let (line, least) = share(&desk.succeed(&format!("{compile} --plant plant.toml")));
    assert!(
        line.contains("the 50 % of the control period behind the sample: "),
        "{line}"
    );
    assert!((least - 2.0 * share(&whole).1).abs() <= 2.0, "{line}\n{whole}");
    // at the start of the period nothing of it is gone
    desk.write("plant.toml", &plant("0.0"));
    assert_eq!(
        share(&desk.succeed(&format!("{compile} --plant plant.toml"))),
        share(&whole)
    );
    // where half of it is too little, the way to the whole is said
    desk.write("plant.toml", &plant("0.5"));
    let missed = desk.succeed("compile policy --target cortex-m4f --clock 7MHz --plant plant.toml --out out");
    assert!(
        missed.contains("trained again with pwm.sampling_phase = 0 and pwm.duty_delay = 1"),
        "{missed}"
    );
    let alone = desk.type_in("compile policy --target cortex-m4f --plant plant.toml --out out");
    assert!(
        alone.code == Some(2) && alone.stderr.contains("--clock"),
        "{}",
        alone.stderr
    );
}

/// Without cycles of its own a core has a bound, and beside it what a modelled one of the same instructions takes.
#[test]
fn a_core_without_cycles_that_is_too_slow_by_any_reading_is_told_so() {
    let desk = Desk::new("minimal");
    let example = tests::example();
    let at = |clock: &str| {
        desk.succeed(&format!(
            "compile {} --target cortex-m33 --clock {clock} --out {clock}",
            example.display()
        ))
    };
    // 100 us at 30 MHz are 3,000 cycles, and no build has less than twice as many instructions
    let slow = at("30MHz");
    for word in [
        "control period NOT met",
        "2 a cycle at most",
        "in less than ",
        "Cortex-M4F",
        "for a step at this clock",
    ] {
        assert!(slow.contains(word), "{word}: {slow}");
    }
    let fast = at("170MHz");
    assert!(fast.contains("cannot be said") && fast.contains("Cortex-M4F"), "{fast}");
}

/// The advice is taken: a network of the size that is named meets its period, one a step wider does not.
#[test]
fn a_network_that_fits_is_named() {
    let desk = Desk::new("minimal");
    let example = tests::example();
    let said = desk.succeed(&format!(
        "compile {} --target cortex-m4f --clock 20MHz --out out",
        example.display()
    ));
    let line = said
        .lines()
        .find(|line| line.contains("cut down to"))
        .unwrap_or_else(|| panic!("{said}"));
    let sizes = line
        .split("cut down to ")
        .nth(1)
        .unwrap()
        .split(" takes")
        .next()
        .unwrap();
    let sizes: Vec<usize> = sizes.split(" -> ").map(|size| size.parse().unwrap()).collect();
    assert_eq!((sizes[0], sizes[3]), (6, 12), "{line}");
    assert!(sizes[1] == sizes[2] && (4..64).contains(&sizes[1]), "{line}");
    let format = line.split(" % in ").nth(1).unwrap().split(' ').next().unwrap();
    let policy = policy::load(&example).unwrap();
    let fits = |width: usize| {
        let cut = policy
            .clone()
            .with_format(policy::NumericFormat::find(format).unwrap())
            .cut_to(width)
            .unwrap();
        let target = targets::find("cortex-m4f").unwrap();
        let files = codegen::generate(&cut, target, &[codegen::Output::C], None)
            .unwrap()
            .files;
        let costs = verify::costs::StepCosts::of(&cut, target, &[codegen::Language::C], &files);
        let clock = verify::budget::Clock::parse("20MHz").unwrap();
        let fit = |costs| verify::budget::Budget::of(costs, clock, cut.sample_period).unwrap().fit;
        costs.measured().any(|costs| fit(costs) == verify::budget::Fit::Met)
    };
    assert!(fits(sizes[1]) && !fits(sizes[1] + 4), "{line}");
}

/// A law on three delayed errors, current and voltage, every 8.33 us: scaling between layers costs integers what they save in them.
const FAST_LAW: &str = r#"
name = "fast_law"
sample_period = 8.333333333333333e-6
signal = [
  { name = "v_in", unit = "V", range = [0.0, 20.0] },
  { name = "v_out", unit = "V", range = [0.0, 40.0] },
  { name = "i_l", unit = "A", range = [-5.0, 20.0] },
]
feature = [
  { name = "e", source = "24 - v_out", clip = [-4.0, 4.0] },
  { name = "e_1", source = "24 - v_out", filters = [{ delay = 1 }], clip = [-4.0, 4.0] },
  { name = "e_2", source = "24 - v_out", filters = [{ delay = 2 }], clip = [-4.0, 4.0] },
  { name = "i", source = "i_l", scale = 0.25, offset = -1.0, clip = [-4.0, 4.0] },
  { name = "vin", source = "v_in", scale = 0.5, offset = -6.0, clip = [-4.0, 4.0] },
  { name = "d", source = "previous_duty", scale = 5.0, offset = -2.5, clip = [-4.0, 4.0] },
]

[network]
weights = "weights.safetensors"
hidden_activation = "relu"

[actions]
base = "previous_duty"
gains = [{ squash = "tanh", scale = 0.03 }]

[limits]
duty = [0.1, 0.8]
initial_duty = 0.5

[fallback]
duty = 0.1
hold = 3
"#;

/// On a core with an FPU the smallest networks are faster in f32 than in i16: that format is tried too, and a hidden layer fewer before
/// another processor is asked for.
#[test]
fn a_network_is_cut_down_in_every_format_of_the_core() {
    let desk = Desk::new("minimal");
    std::fs::create_dir(desk.path("law")).unwrap();
    desk.write("law/policy.toml", FAST_LAW);
    let recipe = tests::fixture::Recipe {
        seed: 3,
        widths: vec![6, 8, 8, 1],
        biases: 0.25,
    };
    std::fs::write(desk.path("law/weights.safetensors"), recipe.network().unwrap()).unwrap();
    let at = |clock: &str| {
        desk.succeed(&format!(
            "compile law --target cortex-m4f --clock {clock} --out {clock}"
        ))
    };
    let said = at("170MHz");
    // i16 takes about as much, and f32 is exact
    assert!(said.contains("next to it comes f32"), "{said}");
    let line = said
        .lines()
        .find(|line| line.contains("cut down to"))
        .unwrap_or_else(|| panic!("{said}"));
    assert!(
        line.contains("6 -> 4 -> 4 -> 1 takes ") && line.contains(" % in f32 with "),
        "{line}"
    );
    let said = at("155MHz");
    let sizes = said.split("cut down to ").nth(1).unwrap_or_else(|| panic!("{said}"));
    let sizes: Vec<&str> = sizes.split(" takes").next().unwrap().split(" -> ").collect();
    assert!(matches!(sizes[..], ["6", _, "1"]), "{said}");
    let said = at("60MHz");
    for word in [
        "not even four neurons",
        "tried in f32 and i16: 6 -> 4 -> 1 takes ",
        "another processor",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
}

#[test]
fn a_processor_without_floats_is_sent_to_integers() {
    let desk = Desk::new("minimal");
    let said = desk.succeed("compile policy --target cortex-m0plus --clock 30MHz --out out");
    assert!(
        said.contains("NOT met") && said.contains("hint: --format i16"),
        "{said}"
    );
}

#[test]
fn a_core_that_cannot_begin_so_many_instructions_is_told_though_no_cycles_are_modelled() {
    let desk = Desk::new("minimal");
    let said = desk.succeed("compile policy --target riscv32imc --clock 1MHz --out out");
    assert!(said.contains("control period NOT met"), "{said}");
    assert!(said.contains("riscv32imc begins 2 a cycle at most"), "{said}");
    // a thousand times the clock, and nobody knows but the board
    let said = desk.succeed("compile policy --target riscv32imc --clock 1GHz --out fast");
    assert!(said.contains("cannot be said"), "{said}");
}

/// 8 bits take a little less than 16 and change decisions; the format that keeps them is named, and no clock that no part of the core has.
#[test]
fn a_format_that_keeps_the_decisions_comes_before_one_that_is_a_little_faster() {
    let desk = Desk::new("minimal");
    let said = desk.succeed(&format!(
        "compile {} --target cortex-m3 --clock 20MHz --golden-decisions 0.4 --out slow",
        tests::example().display()
    ));
    let line = said.lines().find(|line| line.contains("next to it comes"));
    let line = line.unwrap_or_else(|| panic!("{said}"));
    // of the example both change more than allowed: the more exact one is named
    assert!(line.contains("next to it comes i16") && !line.contains("MHz"), "{line}");
}

/// Such cores begin one instruction a cycle: with which format, network or period that does is said, and a network that is named does.
#[test]
fn a_core_of_one_instruction_a_cycle_is_told_what_would_do() {
    let desk = Desk::new("minimal");
    let example = tests::example();
    let at = |clock: &str| {
        desk.succeed(&format!(
            "compile {} --target riscv32imc --clock {clock} --out {clock}",
            example.display()
        ))
    };
    // floats of a library take some 80 instructions for each cycle, 16 bits some 2
    let said = at("108MHz");
    for word in [
        "control period NOT met",
        "in i16 (NOT met by a core that begins one)",
        "next to it comes i16",
        "one instruction a cycle fills a period of ",
        "a Cortex-M4F, which has an FPU",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
    let sizes = said.split("cut down to ").nth(1).unwrap_or_else(|| panic!("{said}"));
    let width: usize = sizes.split(" -> ").nth(1).unwrap().parse().unwrap();
    let policy = policy::load(&example).unwrap().with_format(policy::NumericFormat::I16);
    let target = targets::find("riscv32imc").unwrap();
    let instructions = |width: usize| {
        let cut = policy.cut_to(width).unwrap();
        let files = codegen::generate(&cut, target, &[codegen::Output::C], None)
            .unwrap()
            .files;
        let costs = verify::costs::StepCosts::of(&cut, target, &[codegen::Language::C], &files);
        costs.measured().map(|costs| costs.instructions_max).min().unwrap()
    };
    // 100 us at 108 MHz
    assert!(
        instructions(width) <= 10_800 && instructions(width + 4) > 10_800,
        "{said}"
    );
    // where integers come down to one a cycle, they are the way, and no network is cut
    let said = at("300MHz");
    assert!(
        said.contains("hint: --format i16 needs 0.") && !said.contains("cut down"),
        "{said}"
    );
}

#[test]
fn a_target_without_a_model_says_so() {
    let desk = Desk::new("minimal");
    let said = desk.succeed("compile policy --clock 3GHz --out out");
    assert!(said.contains("cannot be said"), "{said}");
}

/// A kit has a `main` of its own, the others need headers of a tool: none of them is part of a step.
#[test]
fn what_is_generated_beside_the_controller_leaves_its_figures_as_they_are() {
    let desk = Desk::new("minimal");
    let costs = |outputs: &str, folder: &str| -> Value {
        let said = desk.succeed(&format!(
            "compile policy --target cortex-m4f --clock 168MHz{outputs} --out {folder}"
        ));
        assert!(said.contains("control period met"), "{outputs}\n{said}");
        let manifest: Value = serde_json::from_str(&desk.read(&format!("{folder}/manifest.json"))).unwrap();
        manifest["costs"].clone()
    };
    let alone = costs("", "alone");
    let builds: Vec<&str> = alone
        .as_array()
        .unwrap()
        .iter()
        .map(|cost| cost["build"].as_str().unwrap())
        .collect();
    let plain = ["arm-none-eabi-gcc -O2", "arm-none-eabi-gcc -O3"];
    let each = plain.map(|build| [build.to_owned(), format!("{build} -DMINIMAL_ASSEMBLY (assembly)")]);
    assert_eq!(builds, each.concat());
    let instructions = |index: usize| alone[index]["instructions_max"].as_u64().unwrap();
    assert!(
        instructions(1) < instructions(0),
        "the loops of the assembly are shorter: {alone}"
    );
    for output in ["kit", "sfunction", "fmu2", "fmu3"] {
        assert_eq!(alone, costs(&format!(" --emit {output}"), output), "{output}");
    }
    assert_eq!(alone, costs(" --emit c,kit", "both"));
}

#[test]
fn a_missing_emulator_is_not_taken_for_a_missing_model() {
    let desk = Desk::new("minimal");
    let mut command = desk.command();
    command.args("compile policy --target cortex-m4f --clock 168MHz --out out".split(' '));
    let ran = tests::tools::run(command.env("PATH", ""));
    assert_eq!(ran.code, Some(0), "{}", ran.stderr);
    for word in ["not measured", "qemu-system-arm", "cannot be said: no step ran"] {
        assert!(ran.stdout.contains(word), "{word}\n{}", ran.stdout);
    }
    assert!(!ran.stdout.contains("no cycles are modelled"), "{}", ran.stdout);
}

#[test]
fn a_clock_that_is_none_is_refused() {
    let desk = Desk::new("minimal");
    for clock in ["168", "MHz", "168MV", "0Hz"] {
        desk.refuse(
            &format!("compile policy --out out --clock {clock}"),
            &["--clock", "168MHz"],
        );
    }
    desk.refuse(
        "compile policy --out out --no-costs --clock 168MHz",
        &["cannot be used with"],
    );
}
