//! A page of each kind, made by the command from examples.

use std::path::{Path, PathBuf};
use std::process::Command;

use prove::{Answer, Claim, Verdict};
use tests::root;
use tests::tools::{copy_folder, policyc, run};

const TRAINING: &str = "plant = \"plants/paper-model.toml\"\ncontract = \"paper12/policy.toml\"\nseeds = [3, 5]\nsteps = 1200\n\
    [network]\nhidden = [8]\n[learning]\nbatch = 16\nwarm_up = 100\n[reward]\nv_ref = 100.0\n\
    [episode]\nloads = { values = [200, 500, 800], range = [150, 1050], share = 0.5 }\n\
    [selection]\nevery = 200\nload_steps = [[210, 480]]\ninstants = 2\nlead = 20\nafter = 40\ntail = 10\n\
    [evaluation]\nload_steps = [[200, 500]]\ninstants = 2\nlead = 20\nafter = 40\ntail = 10\n\
    [[spec]]\ndeviation = 5.0\nsettling = 5e-3\ntail = 0.5\n";
const PLAN: &str = "name = \"Two kinds\"\n[[simulate]]\nscenarios = \"short.toml\"\npolicies = \"buck12\"\n\
    plants = [\"plants/paper-model.toml\", \"plants/paper-table.toml\"]\n";
const SCENARIO: &str = "plant = \"plants/paper-model.toml\"\nload_steps = [[200, 500], [500, 200]]\ninstants = 1\nsampling_instants = 1\n\
    lead = 20\nafter = 40\ntail = 10\nlimit = false\nbaselines = [\"feed-forward\"]\n";

/// Name, what is typed in, and the page.
const TYPED: [(&str, &str, &str); 11] = [
    (
        "simulate",
        "simulate simulate/sb3-buck12.toml --policy buck12 --out simulated",
        "simulated/report.html",
    ),
    ("train", "train training.toml --out trained", "trained/report.html"),
    (
        "compile",
        "compile buck12 --emit c,rust --no-costs --out code --report compiled.html",
        "compiled.html",
    ),
    (
        "verify",
        "verify buck12 --generated code --drift-only --report html=verified.html",
        "verified.html",
    ),
    (
        "certify",
        "certify buck12 --format i16 --samples 50 --boxes 50 --out certified",
        "certified/certificate.html",
    ),
    (
        "fit",
        "drm fit far.csv --plant drm/plants/far.toml --trained-on plants/sb3-buck12.toml --out far.toml --report fitted.html",
        "fitted.html",
    ),
    (
        "transfer",
        "drm transfer drm/cases.toml --policy drm/policy.toml --real drm/plants/near.toml,drm/plants/far.toml --controller interpreter \
         --allow-outside --out transferred",
        "transferred/report.html",
    ),
    (
        "diagnose: consistent",
        "diagnose --model blind/plant.toml --train diagnose/records/nothing-wrong.csv --out consistent",
        "consistent/report.html",
    ),
    (
        "diagnose: explained",
        "diagnose --model blind/plant.toml --train diagnose/records/load-steps.csv diagnose/records/duty-steps.csv \
         --heldout diagnose/records/power-steps.csv --out explained",
        "explained/report.html",
    ),
    (
        "diagnose: settled points and a capture",
        "diagnose --model diagnose/capture/board.toml --train diagnose/capture/sweep.csv diagnose/capture/capture.csv --columns map.toml \
         --out captured",
        "captured/report.html",
    ),
    ("campaign", "campaign plan.toml --out campaign", "campaign/report.html"),
];

/// The pages of these kinds, with their names.
pub fn of(folder: &Path, kinds: &[&str]) -> Vec<(&'static str, PathBuf)> {
    let examples = folder.join("examples");
    copy_folder(&root().join("examples"), &examples);
    copy_folder(&root().join("examples/train/paper12"), &examples.join("paper12"));
    for (name, text) in [
        ("training.toml", TRAINING),
        ("plan.toml", PLAN),
        ("short.toml", SCENARIO),
        ("map.toml", &captured_map()),
    ] {
        std::fs::write(examples.join(name), text).unwrap();
    }
    let typed = |line: &str| {
        let mut command = Command::new(policyc());
        let ran = run(command.current_dir(&examples).args(line.split_whitespace()));
        // 1 is a specification that a short training misses
        assert!(matches!(ran.code, Some(0 | 1)), "{line}\n{}", ran.stderr);
    };
    if kinds.contains(&"fit") {
        typed("drm acquire --plant drm/plants/far.toml --duties 0.44:0.02:0.62 --currents 2,4,6,8,10 --out far.csv");
    }
    let wanted = TYPED.into_iter().filter(|(name, ..)| kinds.contains(name));
    wanted
        .map(|(name, line, page)| {
            typed(line);
            (name, examples.join(page))
        })
        .collect()
}

/// All kinds. What is proved takes a minute and provers: its page is made of claims.
pub fn all(folder: &Path) -> Vec<(&'static str, PathBuf)> {
    let mut pages = of(folder, &TYPED.map(|(name, ..)| name));
    let proof = folder.join("proof.html");
    std::fs::write(&proof, prove::page::page(&answer()).unwrap()).unwrap();
    pages.push(("prove", proof));
    pages
}

/// The map of the how-to on captures.
fn captured_map() -> String {
    let page = std::fs::read_to_string(root().join("docs/how-to/captures.md")).unwrap();
    let (_, behind) = page.split_once("toml,file=map.toml\n").expect("the page has map.toml");
    behind.split_once("```").unwrap().0.to_owned()
}

fn answer() -> Answer {
    let verdicts = [Verdict::Proved, Verdict::Unproven, Verdict::Refuted, Verdict::NotRun];
    let claim = |(n, verdict): (usize, Verdict)| Claim {
        prover: "eva",
        name: format!("claim-{n}"),
        text: "Eva: whatever the measurement, the commanded duty is a number within its limits".to_owned(),
        subject: "one step from every sound state".to_owned(),
        format: policy::NumericFormat::F32,
        settings: vec!["gcc_x86_64".to_owned()],
        verdict,
        reason: if verdict == Verdict::Proved {
            String::new()
        } else {
            "no prover was found".to_owned()
        },
        seconds: 1.5,
        tool: "Frama-C".to_owned(),
        details: vec![
            "buck12.c:1234: a long line of an alarm that a prover gives, with an address and much more than fits"
                .to_owned(),
        ],
    };
    let policy = policy::load(&tests::example()).unwrap();
    let target = codegen::target("host").unwrap();
    let task = prove::Task {
        policy: &policy,
        target,
    };
    Answer::new(&[task], verdicts.into_iter().enumerate().map(claim).collect())
}
