//! Policies with several outputs, drawn at random from a seed: choices and continuous heads mixed, each with limits, fallback and,
//! mostly, a mapping of its own, features that read the duty of one of them, and in every second policy observers that one of them drives.

use std::fmt::Write;

use policy::Activation;
use random::{Random, SplitMix};
use safetensors::SafeTensorError;

use super::{Folder, action_table, continuous, estimate, feature, observer, source, weights};

/// Names of the outputs, as many as are drawn.
const NAMES: [&str; 4] = ["left", "right", "mid", "spare"];

/// Writes the policy of that seed into a temporary folder.
///
/// # Errors
/// If the folder cannot be written.
pub fn policy(seed: u64) -> std::io::Result<Folder> {
    let folder = tempfile::tempdir()?;
    let (contract, files) = files(seed).map_err(std::io::Error::other)?;
    std::fs::write(folder.path().join("policy.toml"), &contract)?;
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes)?;
    }
    Ok(Folder { folder, contract })
}

/// A golden case of twelve features and five columns, `constructs` or `wide`, as three legs: two choices with mappings of four and
/// three terms, slew limit and soft start, and a continuous one with its limits alone.
///
/// # Errors
/// If the case cannot be read or the folder cannot be written.
pub fn legs(case: &str) -> std::io::Result<Folder> {
    let from = crate::root().join("tests/golden/cases").join(case);
    let folder = tempfile::tempdir()?;
    let read = |name: &str| std::fs::read_to_string(from.join(name));
    let single = read("policy.toml")?;
    let (top, _) = single
        .split_once("[actions]")
        .ok_or_else(|| std::io::Error::other("no [actions]"))?;
    let top = top
        .replace("\"previous_duty\"", "\"left_previous_duty\"")
        .replace("previous_command", "right_previous_command");
    let contract = top + LEGS;
    let mapping = read("drm.toml")?;
    let three = mapping.lines().filter(|line| !line.starts_with("r = "));
    let three: String = three.map(|line| format!("{line}\n")).collect();
    std::fs::write(folder.path().join("policy.toml"), &contract)?;
    std::fs::write(folder.path().join("left.toml"), mapping)?;
    std::fs::write(
        folder.path().join("right.toml"),
        three.replace("b = -0.0025", "b = -0.0015"),
    )?;
    std::fs::copy(
        from.join("weights.safetensors"),
        folder.path().join("weights.safetensors"),
    )?;
    Ok(Folder { folder, contract })
}

/// Those of the construct suite of the kit.
const LEGS: &str = include_str!("../../../verify/src/kit/constructs/outputs.toml");

/// How a contract with several outputs is read.
#[must_use]
pub fn options() -> policy::ReadOptions {
    policy::ReadOptions {
        several_outputs: true,
        ..policy::ReadOptions::default()
    }
}

type Files = Vec<(String, Vec<u8>)>;

fn files(seed: u64) -> Result<(String, Files), SafeTensorError> {
    let mut rng = SplitMix::new(seed ^ 0x6475_7469_6573_0000);
    let features = 2 + rng.below(6);
    let count = 2 + rng.below(3);
    let hidden: Vec<usize> = (0..1 + rng.below(3)).map(|_| 1 + rng.below(30)).collect();
    let signals = 1 + rng.below(4);
    let (mut text, period) = top(&mut rng, seed, signals);
    // from a stream of its own, so that the rest of the policy stays what it was
    let mut beside = SplitMix::new(seed ^ OBSERVER);
    let observers = if beside.one_in(2) { 1 + beside.below(2) } else { 0 };
    let observers: Vec<bool> = (0..observers)
        .map(|index| driven(&mut text, &mut beside, (index, &NAMES[..count]), signals, period))
        .collect();
    for index in 0..features {
        let own = source(&mut rng, signals);
        let own = NAMES[..count].iter().fold(own, |own, _| {
            let name = NAMES[rng.below(count)];
            // a source has one of the words at most; a name that is there already begins with a letter before the word
            match own.find(" previous_").or(own.starts_with("previous_").then_some(0)) {
                Some(at) => {
                    let (before, behind) = own.split_at(at);
                    format!(
                        "{before}{}",
                        behind.replacen("previous_", &format!("{name}_previous_"), 1)
                    )
                }
                None => own,
            }
        });
        let observed = (!observers.is_empty() && !beside.one_in(3)).then(|| estimate(&mut beside, &observers, signals));
        feature(&mut text, &mut rng, index, &observed.unwrap_or(own));
    }
    // one output always reads what another one commanded
    text += &format!(
        "[[feature]]\nname = \"told\"\nsource = \"{}_previous_command - {}_previous_duty\"\n\n",
        NAMES[1], NAMES[0]
    );
    let _ = writeln!(text, "[network]\nweights = \"weights.safetensors\"");
    let kinds = Activation::EACH;
    let activations: Vec<String> = hidden.iter().map(|_| kinds[rng.below(kinds.len())].written()).collect();
    let _ = writeln!(text, "hidden_activation = [{}]\n", activations.join(", "));
    let mut columns = 0;
    let mut files = Files::new();
    for name in &NAMES[..count] {
        let (output, width) = output(&mut rng, name, signals);
        text += &output;
        columns += width;
    }
    let (network, _) = weights(&mut rng, features + 1, &hidden, columns)?;
    files.push(("weights.safetensors".to_owned(), network));
    for name in &NAMES[..count] {
        let (_, mapping) = weights(&mut rng, 1, &[], 1)?;
        files.push((format!("{name}.toml"), mapping.into_bytes()));
    }
    let _ = writeln!(text, "[fallback]\nhold = {}", rng.below(6));
    Ok((text, files))
}

/// Bits in which the seed of the observers' stream differs from that of the rest.
const OBSERVER: u64 = 0x6f62_735f_6475_7479;

/// An observer that is driven by one of these outputs; whether it has a surplus.
fn driven(
    text: &mut String,
    rng: &mut SplitMix,
    (index, outputs): (usize, &[&str]),
    signals: usize,
    period: f64,
) -> bool {
    let mut own = String::new();
    let has_surplus = observer(&mut own, rng, index, signals, period);
    let duty = format!("duty = \"{}\"\ncompute_delay", outputs[rng.below(outputs.len())]);
    *text += &own.replacen("compute_delay", &duty, 1);
    has_surplus
}

/// Name, period, parameters and signals, and the period in seconds.
fn top(rng: &mut SplitMix, seed: u64, signals: usize) -> (String, f64) {
    let period = rng.uniform(1e-5, 1e-3);
    let mut text = format!(
        "name = \"several{seed}\"\nsample_period = {period:?}\n\n[parameters]\nk1 = {:?}\nk2 = {:?}\n\n",
        rng.uniform(-3.0, 3.0),
        rng.uniform(0.5, 2.0)
    );
    for index in 0..signals {
        let low = rng.uniform(-50.0, 10.0);
        let _ = writeln!(
            text,
            "[[signal]]\nname = \"s{index}\"\nunit = \"V\"\nrange = [{low:?}, {:?}]\n",
            low + rng.uniform(1.0, 200.0)
        );
    }
    (text, period)
}

/// An output and the columns that it takes.
fn output(rng: &mut SplitMix, name: &str, signals: usize) -> (String, usize) {
    let mut text = format!("[[output]]\nname = \"{name}\"\n");
    let width = if rng.one_in(2) { 1 } else { 2 + rng.below(7) };
    match width {
        1 => {
            let _ = writeln!(text, "[output.actions]\n{}", continuous(rng));
        }
        count => {
            let mut table = String::new();
            action_table(&mut table, rng, count);
            text += &table.replace("[actions]", "[output.actions]");
        }
    }
    if !rng.one_in(3) {
        let current = rng.below(signals);
        let _ = writeln!(
            text,
            "[output.mapping]\nfile = \"{name}.toml\"\nload_current = \"s{current}\""
        );
    }
    let (low, high) = (rng.uniform(0.0, 0.4), rng.uniform(0.6, 1.0));
    let _ = writeln!(text, "[output.limits]\nduty = [{low:?}, {high:?}]");
    if rng.one_in(2) {
        let _ = writeln!(text, "slew = {:?}", rng.uniform(0.001, 0.2));
    }
    if rng.one_in(2) {
        let from = rng.uniform(0.0, high);
        let _ = writeln!(
            text,
            "soft_start = {{ from = {from:?}, steps = {} }}",
            1 + rng.below(200)
        );
    }
    if rng.one_in(2) {
        let _ = writeln!(text, "initial_duty = {:?}", rng.uniform(0.0, 1.0));
    }
    let _ = writeln!(text, "[output.fallback]\nduty = {:?}\n", rng.uniform(0.0, 1.0));
    (text, width)
}
