//! A continuous actor from the trainer's archive to code: the library's own commands, logs, and what is refused.

use safetensors::SafeTensors;

use super::Desk;

/// The rest of a contract for the environment of tests/fixtures/trainers/make.py.
pub const REST: &str = r#"name = "actor"
sample_period = 1e-4
signal = [
  { name = "v_out", unit = "V", range = [0.0, 250.0] },
  { name = "i_l", unit = "A", range = [-5.0, 60.0] },
  { name = "i_out", unit = "A", range = [-1.0, 40.0] },
]
feature = [
  { name = "e", source = "100 - v_out", scale = 0.2, clip = [-20.0, 20.0] },
  { name = "e_del", source = "100 - v_out", filters = [{ delay = 1 }], scale = 0.2, clip = [-20.0, 20.0] },
  { name = "di", source = "i_out - i_l", scale = 0.2, clip = [-3.0, 3.0] },
  { name = "v", source = "v_out - 100", scale = 0.2, clip = [-20.0, 20.0] },
  { name = "i", source = "i_l", scale = 0.1, offset = -1.5, clip = [-1.5, 1.5] },
  { name = "p", source = "i_out - 5", scale = 0.2, clip = [-1.0, 1.0] },
]
"#;
pub const PROTECTION: &str = "[limits]\nduty = [0.1, 0.9]\n\n[fallback]\nduty = 0.0\nhold = 3\n";

/// What `new` made of the archive of an actor, filled in.
fn desk(model: &str) -> Desk {
    let desk = Desk::new("minimal");
    std::fs::create_dir(desk.path("actor")).unwrap();
    let archive = tests::root().join("tests/fixtures/trainers").join(model);
    std::fs::copy(archive, desk.path("model.zip")).unwrap();
    desk.succeed("new model.zip --out actor/policy.toml");
    let draft = desk.read("actor/policy.toml");
    let network = draft.find("[network]").unwrap();
    let limits = draft.find("[limits]").unwrap();
    // `# Duty ratio mapping ...` stands between and is a comment
    desk.write(
        "actor/policy.toml",
        &format!("{REST}\n{}\n{PROTECTION}", &draft[network..limits]),
    );
    desk
}

#[test]
fn the_actor_of_an_archive_becomes_code_that_commands_the_librarys_duties() {
    let desk = desk("sb3_sac_duty.zip");
    // the library's predict(), in the place of the products that `new` computed itself
    let library = tests::root().join("tests/fixtures/trainers/sb3_sac_duty.expected.safetensors");
    std::fs::copy(library, desk.path("actor/golden.safetensors")).unwrap();
    let said = desk.succeed("inspect actor");
    assert!(
        said.contains("duty = 0.375 * tanh(y) + 0.475, in [0.1, 0.85]"),
        "{said}"
    );
    assert!(said.contains("64 golden vectors"), "{said}");
    let said = desk.succeed("compile actor --emit c,rust --out code --no-costs");
    assert!(said.contains("actor.c"), "{said}");
    let said = desk.succeed("verify actor --generated code --steps 2000");
    assert!(said.contains("duties in f32: off by at most"), "{said}");
    // of the libraries' own single precision: 1e-5 of the range is allowed, less is seen
    let manifest = desk.read("code/manifest.json");
    assert!(manifest.contains("\"actions\": 1"), "{manifest}");
}

/// The limits that `new` writes are the ends of the action space, of which binary32 has neighbours.
#[test]
fn limits_at_the_ends_of_the_command_cut_nothing_off() {
    let desk = desk("sb3_sac_duty.zip");
    for (limits, is_cut) in [("[0.1, 0.85]", false), ("[0.1, 0.849]", true)] {
        let draft = desk.read("actor/policy.toml");
        let from = draft.find("[limits]\nduty = ").unwrap();
        let line = draft[from..].lines().nth(1).unwrap().to_owned();
        desk.edit("actor/policy.toml", &line, &format!("duty = {limits}"));
        let said = desk.succeed("inspect actor");
        assert_eq!(said.contains("are cut off"), is_cut, "{limits}: {said}");
    }
}

#[test]
fn a_format_that_costs_too_much_of_the_duty_is_refused_until_the_contract_accepts_it() {
    let desk = desk("sb3_ppo_duty.zip");
    let said = desk.refuse(
        "compile actor --format i8 --emit c --out code --no-costs",
        &["changes the trainer's duties more than allowed", "golden_duty = "],
    );
    assert!(!desk.path("code").exists());
    let accepted = said.split("golden_duty = ").nth(1).unwrap();
    let accepted = accepted.split(' ').next().unwrap();
    desk.edit(
        "actor/policy.toml",
        "[network]\n",
        &format!("[network]\ngolden_duty = {accepted}\n"),
    );
    desk.succeed("compile actor --format i8 --emit c --out code --no-costs");
    // a share of choices says nothing of a number
    desk.refuse(
        "compile actor --golden-decisions 0.5 --emit c --out other --no-costs",
        &["--golden-decisions", "golden_duty"],
    );
    desk.refuse(
        "verify actor --golden-decisions 0.5",
        &["--golden-decisions", "golden_duty"],
    );
    let said = desk.succeed("certify actor --out certificate --boxes 200 --samples 100");
    assert!(said.contains("|duty - real duty| <= "), "{said}");
    assert!(
        desk.read("certificate/certificate.html")
            .contains("what f32 does to the duty")
    );
    desk.refuse(
        "certify actor --axis v_out --axis i_l --out other",
        &["commands a number", "--axis"],
    );
}

#[test]
fn another_scale_than_the_trainings_is_told_from_another_network() {
    let desk = desk("sb3_sac_duty.zip");
    // outputs as `new` wrote them, and duties of another scale beside them
    let bytes = std::fs::read(desk.path("actor/golden.safetensors")).unwrap();
    let tensors = SafeTensors::deserialize(&bytes).unwrap();
    let (obs, output) = (tensors.tensor("obs").unwrap(), tensors.tensor("output").unwrap());
    let outputs: Vec<f32> = numbers(output.data());
    let duties: Vec<u8> = (outputs.iter())
        .flat_map(|y| (0.5 + 0.3 * y.tanh()).to_le_bytes())
        .collect();
    let duty = safetensors::tensor::TensorView::new(safetensors::Dtype::F32, vec![64], &duties).unwrap();
    let file = safetensors::serialize([("obs", obs), ("output", output), ("duty", duty)], None).unwrap();
    std::fs::write(desk.path("actor/golden.safetensors"), file).unwrap();
    let ran = desk.type_in("inspect actor");
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(
        ran.stderr.contains("the network's outputs are the trainer's"),
        "{}",
        ran.stderr
    );
}

fn numbers(bytes: &[u8]) -> Vec<f32> {
    bytes
        .as_chunks::<4>()
        .0
        .iter()
        .map(|b| f32::from_le_bytes(*b))
        .collect()
}

/// The duty of an observation by the tensors that `new` wrote, in binary64 and without the interpreter.
fn duty(weights: &SafeTensors<'_>, observation: &[f64]) -> f64 {
    let mut x = observation.to_vec();
    for layer in 0..3 {
        let tensor = |part: &str| numbers(weights.tensor(&format!("layer_{layer}.{part}")).unwrap().data());
        let (weight, bias) = (tensor("weight"), tensor("bias"));
        let sum = |(row, bias): (&[f32], &f32)| {
            f64::from(*bias) + row.iter().zip(&x).map(|(w, x)| f64::from(*w) * x).sum::<f64>()
        };
        let next: Vec<f64> = weight.chunks(x.len()).zip(&bias).map(sum).collect();
        x = if layer < 2 {
            next.into_iter().map(|x| x.max(0.0)).collect()
        } else {
            next
        };
    }
    0.475 + 0.375 * x[0].tanh()
}

#[test]
fn replay_compares_the_duties_of_a_log_with_the_actors() {
    let desk = desk("sb3_td3_duty.zip");
    let bytes = std::fs::read(desk.path("actor/weights.safetensors")).unwrap();
    let weights = SafeTensors::deserialize(&bytes).unwrap();
    let log = |scale: f64, name: &str| {
        let mut text = format!("v_out,i_l,i_out,{name}\n");
        let mut before = None;
        for k in 0..80 {
            let t = f64::from(k);
            let (v, i_out) = (100.0 + 4.0 * (0.2 * t).sin(), 4.0 + (0.05 * t).cos());
            let i_l = i_out + (0.3 * t).sin();
            let clip = |x: f64, most: f64| x.clamp(-most, most);
            let e = clip(0.2 * (100.0 - v), 20.0);
            let e_del = before.unwrap_or(e);
            before = Some(e);
            let observation = [
                e,
                e_del,
                clip(0.2 * (i_out - i_l), 3.0),
                clip(0.2 * (v - 100.0), 20.0),
                clip(0.1 * i_l - 1.5, 1.5),
                clip(0.2 * (i_out - 5.0), 1.0),
            ];
            let duty = 0.475 + scale * (duty(&weights, &observation) - 0.475);
            text += &format!("{v:.8},{i_l:.8},{i_out:.8},{duty:.8}\n");
        }
        text
    };
    desk.write("log.csv", &log(1.0, "duty"));
    let said = desk.succeed("replay actor log.csv");
    assert!(said.contains("duty equal in 80 of 80, largest difference "), "{said}");
    assert!(
        said.contains("e-7 of its range, in line ") || said.contains("e-6 of its range, in line "),
        "{said}"
    );
    desk.write("log.csv", &log(0.9, "duty"));
    let ran = desk.type_in("replay actor log.csv");
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(
        ran.stdout.contains("squash or clip, scale and offset"),
        "{}",
        ran.stdout
    );
    // in units of the trainer's action space: what they mean the log does not say
    desk.write("log.csv", &log(1.0, "action"));
    desk.refuse("replay actor log.csv", &["commands a number", "called `duty`"]);
}
