//! Policies drawn at random from a seed, for tests and fuzz targets: every kind of signal, feature, filter, activation, action, mapping and limit,
//! with ties, zeros of both signs and subnormal weights.

mod heads;
pub mod several;

use std::fmt::Write;

use policy::Activation;
use random::{Random, SplitMix};
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensorError};

use heads::{HEAD, SCHEDULE, gains, residual};
pub(crate) use heads::{action_table, continuous};

/// A policy folder.
pub struct Folder {
    /// Removed when dropped.
    pub folder: tempfile::TempDir,
    /// The contract as written.
    pub contract: String,
}

impl Folder {
    /// Path of `policy.toml`.
    #[must_use]
    pub fn path(&self) -> std::path::PathBuf {
        self.folder.path().join("policy.toml")
    }
}

/// What `[actions]` says.
enum Head {
    /// Drawn from the stream of the rest.
    Choice,
    /// Its entry.
    Continuous(String),
    /// That many gains, from this stream.
    Gains(SplitMix, usize),
}

/// The files of a policy folder.
pub struct Files {
    /// `policy.toml`
    pub contract: String,
    /// `weights.safetensors`
    pub weights: Vec<u8>,
    /// `drm.toml`, whether the contract names it or not
    pub mapping: String,
}

/// Writes the policy of that seed into a temporary folder.
///
/// # Errors
/// If the folder cannot be written.
pub fn policy(seed: u64) -> std::io::Result<Folder> {
    let folder = tempfile::tempdir()?;
    let files = files(seed).map_err(std::io::Error::other)?;
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes);
    write("policy.toml", files.contract.as_bytes())?;
    write("weights.safetensors", &files.weights)?;
    write("drm.toml", files.mapping.as_bytes())?;
    let contract = files.contract;
    Ok(Folder { folder, contract })
}

/// The policy of that seed, in memory.
///
/// # Errors
/// If its tensors make no file: a fault of this module.
pub fn files(seed: u64) -> Result<Files, SafeTensorError> {
    let mut rng = SplitMix::new(seed);
    let features = 1 + rng.below(9);
    let actions = 2 + rng.below(32);
    // from a stream of its own: the policies of all other seeds stay what they were
    let mut head = SplitMix::new(seed ^ HEAD);
    let head = head.one_in(4).then(|| continuous(&mut head));
    // from another one, which has the last word
    let mut schedule = SplitMix::new(seed ^ SCHEDULE);
    let gains = schedule.one_in(5).then(|| 1 + schedule.below(4));
    let (head, actions) = match (gains, head) {
        (Some(count), _) => (Head::Gains(schedule, count), count),
        (None, Some(text)) => (Head::Continuous(text), 1),
        (None, None) => (Head::Choice, actions),
    };
    let hidden: Vec<usize> = (0..1 + rng.below(4)).map(|_| 1 + rng.below(40)).collect();
    let contract = contract(&mut rng, seed, [features, actions, hidden.len()], head);
    let (weights, mapping) = weights(&mut rng, features, &hidden, actions)?;
    Ok(Files {
        contract,
        weights,
        mapping,
    })
}

fn contract(rng: &mut SplitMix, seed: u64, [features, actions, hidden]: [usize; 3], head: Head) -> String {
    let period = rng.uniform(1e-5, 1e-3);
    let mut text = format!("name = \"random{seed}\"\nsample_period = {period:?}\n\n");
    let signals = 1 + rng.below(5);
    let _ = writeln!(
        text,
        "[parameters]\nk1 = {:?}\nk2 = {:?}\n",
        rng.uniform(-3.0, 3.0),
        rng.uniform(0.5, 2.0)
    );
    for index in 0..signals {
        let _ = writeln!(text, "[[signal]]\nname = \"s{index}\"\nunit = \"V\"");
        if rng.one_in(4) {
            let (gain, offset) = (rng.uniform(0.01, 0.1), rng.uniform(-5.0, 5.0));
            let high = offset + gain * 4095.0;
            let _ = writeln!(
                text,
                "range = [{offset:?}, {high:?}]\nadc = {{ gain = {gain:?}, offset = {offset:?} }}\n"
            );
        } else {
            let low = rng.uniform(-50.0, 10.0);
            let _ = writeln!(text, "range = [{low:?}, {:?}]\n", low + rng.uniform(1.0, 200.0));
        }
    }
    // from a stream of its own, as the heads are
    let mut beside = SplitMix::new(seed ^ OBSERVER);
    let observers = if beside.one_in(3) { 1 + beside.below(2) } else { 0 };
    let observers: Vec<bool> = (0..observers)
        .map(|index| observer(&mut text, &mut beside, index, signals, period))
        .collect();
    for index in 0..features {
        // drawn in any case, so that the rest of the policy stays what it was
        let source = source(rng, signals);
        let observed = (!observers.is_empty() && !beside.one_in(3)).then(|| estimate(&mut beside, &observers, signals));
        feature(&mut text, rng, index, &observed.unwrap_or(source));
    }
    let _ = writeln!(text, "[network]\nweights = \"weights.safetensors\"");
    let kinds = Activation::EACH;
    let activations: Vec<String> = (0..hidden).map(|_| kinds[rng.below(kinds.len())].written()).collect();
    let _ = writeln!(text, "hidden_activation = [{}]\n", activations.join(", "));
    match head {
        Head::Continuous(head) => drop(writeln!(text, "[actions]\n{head}\n")),
        Head::Gains(mut own, count) => text += &gains(&mut own, count, &observers, [features, signals]),
        Head::Choice => {
            let mut table = String::new();
            action_table(&mut table, rng, actions);
            text += &match beside.one_in(3) {
                true => residual(&mut beside, actions, &observers, signals),
                false => table,
            };
        }
    }
    protection(&mut text, rng, signals);
    text
}

/// Bits in which the seed of the observers' stream differs from that of the rest.
const OBSERVER: u64 = 0x6f62_7365_7276_6572;

/// An observer of any form: each circuit and carrier, diode and synchronous leg, delay 0 and 1, input voltage as a number and
/// as a signal; whether it has a surplus.
pub(crate) fn observer(text: &mut String, rng: &mut SplitMix, index: usize, signals: usize, period: f64) -> bool {
    let (inductance, capacitance) = (period * rng.uniform(1.0, 50.0), period * rng.uniform(0.05, 2.0));
    let low = if rng.one_in(2) { 0.0 } else { rng.uniform(-20.0, -1.0) };
    let source = match rng.one_in(2) {
        true => format!("{:?}", rng.uniform(5.0, 200.0)),
        false => format!("\"s{}\"", rng.below(signals)),
    };
    let circuit = circuit(rng, source.starts_with('"'));
    let _ = writeln!(
        text,
        "[[observer]]\nname = \"o{index}\"\n{circuit}inductance = {inductance:?}\ncapacitance = {capacitance:?}\n\
         input_voltage = {source}\noutput_voltage = \"s{}\"\nload_current = \"s{}\"\ncompute_delay = {}\n\
         gains = {{ current = {:?}, voltage = {:?}, bias = {:?} }}\ncurrent = [{low:?}, {:?}]\nbias = [{:?}, {:?}]\n",
        rng.below(signals),
        rng.below(signals),
        rng.below(2),
        rng.uniform(0.0, 1.5),
        rng.uniform(0.0, 0.9),
        rng.uniform(-0.1, 0.3),
        rng.uniform(1.0, 30.0),
        rng.uniform(-8.0, -0.5),
        rng.uniform(0.0, 8.0),
    );
    circuit.contains("hold")
}

/// Circuit, carrier and, where there can be one, voltage to hold of an observer.
fn circuit(rng: &mut SplitMix, source_is_signal: bool) -> String {
    let topology = ["buck", "boost", "buck-boost"][rng.below(3)];
    let mut text = format!(
        "topology = \"{topology}\"\ncarrier = \"{}\"\n",
        ["trailing", "centre"][rng.below(2)]
    );
    let hold = rng.uniform(1.0, 200.0);
    // what has no surplus: a source that is divided by
    if topology == "boost" || (topology == "buck-boost" && !source_is_signal) {
        let _ = writeln!(text, "hold = {hold:?}");
    }
    text
}

/// A source over estimates of observers, each of which has a surplus or not.
pub(crate) fn estimate(rng: &mut SplitMix, observers: &[bool], signals: usize) -> String {
    let e = |rng: &mut SplitMix| {
        let own = rng.below(observers.len());
        let words = ["current", "voltage", "bias", "surplus"];
        format!("o{own}_{}", words[rng.below(if observers[own] { 4 } else { 3 })])
    };
    match rng.below(3) {
        0 => e(rng),
        1 => format!("{} - s{}", e(rng), rng.below(signals)),
        _ => format!("0.5 * ({} - {}) + k1", e(rng), e(rng)),
    }
}

pub(crate) fn source(rng: &mut SplitMix, signals: usize) -> String {
    let s = |rng: &mut SplitMix| format!("s{}", rng.below(signals));
    match rng.below(7) {
        0 => s(rng),
        1 => format!("k1 - {}", s(rng)),
        2 => format!("({} - {}) / k2", s(rng), s(rng)),
        3 => format!("-(2 * {} + k1) * 0.25 - {}", s(rng), s(rng)),
        4 => "previous_duty".to_owned(),
        5 => format!("previous_command - 0.01 * {}", s(rng)),
        _ => format!("{} + k1 * k2 - 3 * {}", s(rng), s(rng)),
    }
}

pub(crate) fn feature(text: &mut String, rng: &mut SplitMix, index: usize, source: &str) {
    let _ = writeln!(text, "[[feature]]\nname = \"x{index}\"\nsource = \"{source}\"");
    let filters: Vec<String> = (0..rng.below(3)).map(|_| filter(rng)).collect();
    if !filters.is_empty() {
        let _ = writeln!(text, "filters = [{}]", filters.join(", "));
    }
    if !rng.one_in(3) {
        let _ = writeln!(text, "scale = {:?}", rng.uniform(-0.1, 0.1));
    }
    if rng.one_in(3) {
        let _ = writeln!(text, "offset = {:?}", rng.uniform(-1.0, 1.0));
    }
    if !rng.one_in(4) {
        let _ = writeln!(
            text,
            "clip = [{:?}, {:?}]",
            rng.uniform(-4.0, -0.5),
            rng.uniform(0.5, 4.0)
        );
    }
    text.push('\n');
}

fn filter(rng: &mut SplitMix) -> String {
    let tau = rng.uniform(1e-5, 1e-2);
    match rng.below(6) {
        0 => format!("{{ delay = {} }}", 1 + rng.below(4)),
        1 => "\"backward_difference\"".to_owned(),
        2 => format!("{{ low_pass = {{ time_constant = {tau:?} }} }}"),
        3 => format!("{{ filtered_derivative = {{ time_constant = {tau:?} }} }}"),
        4 => format!("{{ moving_average = {} }}", 2 + rng.below(6)),
        // no draw of its own, so that the policies of a seed stay what they are otherwise
        _ if tau > 5e-3 => {
            let leak = match tau {
                // 1 in binary32, and not in binary64
                _ if tau > 9e-3 => 0.999_999_99,
                // keeps next to nothing
                _ if tau > 8e-3 => 1e-3 + 100.0 * (tau - 8e-3),
                _ => 1.0 - 10.0 * tau,
            };
            format!("{{ integrator = {{ min = -0.5, max = 0.75, initial = 0.1, leak = {leak:?} }} }}")
        }
        _ => "{ integrator = { min = -0.5, max = 0.75, initial = 0.1 } }".to_owned(),
    }
}

fn protection(text: &mut String, rng: &mut SplitMix, signals: usize) {
    if !rng.one_in(3) {
        let _ = writeln!(
            text,
            "[mapping]\nfile = \"drm.toml\"\nload_current = \"s{}\"\n",
            rng.below(signals)
        );
    }
    let (low, high) = (rng.uniform(0.0, 0.4), rng.uniform(0.6, 1.0));
    let _ = writeln!(text, "[limits]\nduty = [{low:?}, {high:?}]");
    if rng.one_in(2) {
        let _ = writeln!(text, "slew = {:?}", rng.uniform(0.001, 0.2));
    }
    if rng.one_in(2) {
        let _ = writeln!(
            text,
            "soft_start = {{ from = {:?}, steps = {} }}",
            rng.uniform(0.0, high),
            1 + rng.below(200)
        );
    }
    if rng.one_in(2) {
        let _ = writeln!(text, "initial_duty = {:?}", rng.uniform(0.0, 1.0));
    }
    let _ = writeln!(
        text,
        "\n[fallback]\nduty = {:?}\nhold = {}",
        rng.uniform(0.0, 1.0),
        rng.below(6)
    );
}

/// Weights and, used or not, a mapping.
pub(crate) fn weights(
    rng: &mut SplitMix,
    features: usize,
    hidden: &[usize],
    actions: usize,
) -> Result<(Vec<u8>, String), SafeTensorError> {
    let widths: Vec<usize> = std::iter::once(features)
        .chain(hidden.iter().copied())
        .chain([actions])
        .collect();
    let mut tensors = Vec::new();
    for (layer, pair) in widths.windows(2).enumerate() {
        let (inputs, outputs) = (pair[0], pair[1]);
        let spread = 1.5 / (inputs as f64).sqrt();
        let mut rows: Vec<Vec<f32>> = (0..outputs)
            .map(|_| (0..=inputs).map(|_| weight(rng, spread)).collect())
            .collect();
        // equal rows give equal outputs: ties for argmax
        if rng.one_in(2) {
            let (from, to) = (rng.below(outputs), rng.below(outputs));
            rows[to] = rows[from].clone();
        }
        let matrix: Vec<f32> = rows.iter().flat_map(|row| row[..inputs].to_vec()).collect();
        let bias: Vec<f32> = rows.iter().map(|row| row[inputs]).collect();
        tensors.push((format!("fc{layer}.weight"), vec![outputs, inputs], bytes(&matrix)));
        tensors.push((format!("fc{layer}.bias"), vec![outputs], bytes(&bias)));
    }
    let views: Result<Vec<_>, _> = tensors
        .iter()
        .map(|(name, shape, data)| TensorView::new(Dtype::F32, shape.clone(), data).map(|view| (name.clone(), view)))
        .collect();
    let file = safetensors::serialize(views?, None)?;
    let product = if rng.one_in(2) {
        format!("r = {:?}\n", rng.uniform(-1e-3, 1e-3))
    } else {
        String::new()
    };
    let (a, b, c) = (
        rng.uniform(0.7, 1.3),
        rng.uniform(-0.003, 0.003),
        rng.uniform(-0.05, 0.05),
    );
    let mapping =
        format!("a = {a:?}\nb = {b:?}\nc = {c:?}\n{product}[valid]\ni_out = [0.0, 20.0]\nd_sim = [0.2, 0.8]\n");
    Ok((file, mapping))
}

fn weight(rng: &mut SplitMix, spread: f64) -> f32 {
    match rng.below(24) {
        0 => 0.0,
        1 => -0.0,
        2 => f32::from_bits(1 + rng.below(1 << 22) as u32),
        3 => -f32::from_bits(1 + rng.below(1 << 22) as u32),
        _ => rng.uniform(-spread, spread) as f32,
    }
}

fn bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}
