//! A law whose gains the network gives, from a trainer's archive to code, certificate and replay.

use interp::{Controller, Sample};

use super::Desk;
use super::actor::{PROTECTION, REST};

/// What `new --gains` made of an archive with five commands, filled in: a bias and four factors.
fn desk() -> Desk {
    let desk = Desk::new("minimal");
    std::fs::create_dir(desk.path("law")).unwrap();
    let archive = tests::root().join("tests/fixtures/trainers/sb3_several.zip");
    std::fs::copy(archive, desk.path("model.zip")).unwrap();
    desk.succeed("new model.zip --gains --out law/policy.toml");
    let draft = desk.read("law/policy.toml");
    let network = draft.find("[network]").unwrap();
    let limits = draft.find("[limits]").unwrap();
    let mut text = draft[network..limits].to_owned();
    for (from, to) in [
        ("{ source = \"TODO\", clip = [0.1, 0.85] }", "{ clip = [0.1, 0.85] }"),
        (
            "source = \"TODO\", clip = [-1.0",
            "source = \"(100 - v_out) / 1000\", clip = [-1.0",
        ),
        (
            "source = \"TODO\", clip = [0.0, 0.05]",
            "feature = \"e_del\", clip = [0.0, 0.05]",
        ),
        (
            "source = \"TODO\", clip = [-2.0",
            "source = \"0.001 * (i_out - i_l)\", clip = [-2.0",
        ),
        (
            "source = \"TODO\", clip = [0.0, 40.0]",
            "source = \"0.0001 * i_out\", clip = [0.0, 40.0]",
        ),
    ] {
        assert!(text.contains(from), "{from}\n{text}");
        text = text.replacen(from, to, 1);
    }
    desk.write("law/policy.toml", &format!("{REST}\n{text}\n{PROTECTION}"));
    desk
}

#[test]
fn gains_become_code_that_is_compared_in_every_word() {
    let desk = desk();
    let said = desk.succeed("inspect law");
    for line in [
        "duty = 0 + g0 + g1 * ((100 - v_out) / 1000) + g2 * e_del before scale, offset and clip",
        "g4 = y4 clipped to [0, 40], in [0, 40], times [-1.0000e-4, 0.004]",
        "64 golden vectors",
    ] {
        assert!(said.contains(line), "{line}\n{said}");
    }
    desk.succeed("compile law --emit c,rust --out code --no-costs");
    let said = desk.succeed("verify law --generated code --steps 2000");
    assert!(said.contains("gains in f32: off by at most"), "{said}");
    assert!(desk.read("code/manifest.json").contains("\"actions\": 5"));
}

#[test]
fn a_format_that_costs_too_much_of_a_gain_is_refused_until_the_contract_accepts_it() {
    let desk = desk();
    desk.edit("law/policy.toml", "[network]\n", "[network]\ngolden_duty = 1e-6\n");
    desk.refuse(
        "compile law --format i8 --emit c --out code --no-costs",
        &["changes the trainer's gains more than allowed", "golden_duty = "],
    );
    desk.edit("law/policy.toml", "golden_duty = 1e-6", "golden_duty = 0.9");
    desk.succeed("compile law --format i8 --emit c --out code --no-costs");
    assert!(desk.read("code/manifest.json").contains("duty_error_bound"));
    desk.refuse(
        "verify law --golden-decisions 0.5",
        &["gains in [actions]", "golden_duty"],
    );
}

#[test]
fn a_certificate_is_about_the_duty_of_the_law() {
    let desk = desk();
    let said = desk.succeed("certify law --format i16 --out certificate --boxes 100 --samples 50");
    assert!(said.contains("|duty - real duty| <= "), "{said}");
    assert!(desk.read("certificate/certificate.json").contains("\"schedule\""));
    desk.refuse(
        "certify law --axis v_out --axis i_l --out other",
        &["commands a number"],
    );
}

#[test]
fn replay_compares_the_duties_of_a_log_with_those_of_the_law() {
    let desk = desk();
    let policy = policy::load(&desk.path("law/policy.toml")).unwrap();
    let mut controller = Controller::<f32>::new(&policy);
    let mut log = "v_out,i_l,i_out,duty\n".to_owned();
    for k in 0..40 {
        let t = f64::from(k);
        let i_out = 4.0 + (0.05 * t).cos();
        let row = [100.0 + 4.0 * (0.2 * t).sin(), i_out + (0.3 * t).sin(), i_out].map(|x| x as f32);
        let duty = controller.step(&row.map(Sample::Physical)).unwrap().duty_sim;
        log += &format!("{},{},{},{duty}\n", row[0], row[1], row[2]);
    }
    desk.write("log.csv", &log);
    let said = desk.succeed("replay law log.csv");
    assert!(said.contains("duty equal in 40 of 40"), "{said}");
    desk.edit("law/policy.toml", "(100 - v_out) / 1000", "(100 - v_out) / 100");
    let ran = desk.type_in("replay law log.csv");
    assert_eq!(ran.code, Some(1), "{}{}", ran.stdout, ran.stderr);
    assert!(ran.stdout.contains("base and factors of a law"), "{}", ran.stdout);
}
