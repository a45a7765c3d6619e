//! What a contract is made of: the contract, its weights, its golden vectors, its mapping.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use policy::{NumericFormat, Policy, ReadOptions};

use super::Target;
use super::seeds::{answer, at, files, folder, read, refused};
use crate::forms::Form;
use crate::guard::{Answer, Limits, Reader};

/// Cases of the golden tests: between them every key of a contract.
const CASES: [&str; 12] = [
    "activations",
    "adc_mapping",
    "clipped_actor",
    "constructs",
    "continuous",
    "filters",
    "linear",
    "minimal",
    "paper",
    "scheduled",
    "tail_blocks",
    "wide",
];

/// Every `GENERATED`th policy that is taken goes through the compiler too, which costs as much as ten readings.
const GENERATED: u8 = 16;

pub(super) static TARGETS: &[Target] = &[
    Target {
        name: "contract",
        about: "policy.toml: read, check, describe, bounds; some through the compiler",
        form: Form::Bytes,
        words: WORDS,
        limits: Limits::READER,
        seeds: || {
            CASES
                .iter()
                .map(|case| read(&format!("tests/golden/cases/{case}/policy.toml")))
                .collect()
        },
        reader: contract,
    },
    Target {
        name: "weights",
        about: "weights.safetensors of a contract",
        form: Form::Safetensors,
        words: TENSORS,
        limits: Limits::READER,
        seeds: || {
            let mut seeds = Vec::new();
            for case in ["minimal", "filters", "adc_mapping", "paper", "constructs", "wide"] {
                seeds.push(read(&format!("tests/golden/cases/{case}/weights.safetensors"))?);
            }
            Ok(seeds)
        },
        reader: || companion("tests/golden/cases/minimal", "weights.safetensors"),
    },
    Target {
        name: "golden-vectors",
        about: "golden.safetensors of a contract",
        form: Form::Safetensors,
        words: TENSORS,
        limits: Limits::READER,
        seeds: golden_seeds,
        reader: || companion("examples/buck12", "golden.safetensors"),
    },
    Target {
        name: "mapping",
        about: "drm.toml, alone and as the mapping of a contract",
        form: Form::Bytes,
        words: WORDS,
        limits: Limits::READER,
        seeds: || {
            files(&[
                "examples/buck12/drm.toml",
                "examples/drm/drm.toml",
                "examples/blind/policy/drm.toml",
                "tests/golden/cases/adc_mapping/drm.toml",
                "tests/golden/cases/paper/drm.toml",
                "tests/golden/cases/wide/drm.toml",
            ])
        },
        reader: mapping,
    },
];

const WORDS: &[&str] = &[
    "name",
    "sample_period",
    "numeric_format",
    "f32",
    "f64",
    "f32-fma",
    "i16",
    "i8",
    "[parameters]",
    "[[signal]]",
    "unit",
    "range",
    "adc",
    "gain",
    "offset",
    "[[feature]]",
    "source",
    "filters",
    "scale",
    "clip",
    "previous_duty",
    "previous_command",
    "kind",
    "delay",
    "steps",
    "moving_average",
    "length",
    "low_pass",
    "high_pass",
    "tau",
    "integrator",
    "derivative",
    "filtered_derivative",
    "difference",
    "pi",
    "ki",
    "clamp",
    "[network]",
    "weights",
    "golden",
    "layers",
    "prefix",
    "hidden_activation",
    "output_activation",
    "relu",
    "tanh",
    "sigmoid",
    "elu",
    "gelu",
    "softplus",
    "silu",
    "leaky_relu",
    "alpha",
    "identity",
    "[actions]",
    "duties",
    "pairs",
    "xi",
    "phi",
    "continuous",
    "squash",
    "clip",
    "[mapping]",
    "file",
    "load_current",
    "[limits]",
    "duty",
    "slew",
    "soft_start",
    "from",
    "initial_duty",
    "[fallback]",
    "hold",
    "a",
    "b",
    "c",
    "r",
    "[valid]",
    "[adjust]",
    "[simulation]",
    "v_in",
    "v_f",
    "r_d",
    "i_out",
    "d_sim",
    "TODO",
    "weights.safetensors",
    "drm.toml",
    "golden.safetensors",
    "../policy.toml",
    "((((((((((((((((",
    "v_ref - v_out",
];
const TENSORS: &[&str] = &[
    "__metadata__",
    "dtype",
    "shape",
    "data_offsets",
    "F32",
    "F16",
    "BF16",
    "F64",
    "I64",
    "U32",
    "F8_E4M3",
    "BOOL",
    "fc0.weight",
    "fc0.bias",
    "fc1.weight",
    "fc1.bias",
    "observations",
    "observation",
    "q_values",
    "actions",
    "duties",
    "[0,0]",
    "[4294967295,4294967295]",
    "[18446744073709551615]",
];

/// The files of a folder of the repository, as if they stood beside each other in memory.
struct Folder {
    files: BTreeMap<PathBuf, Vec<u8>>,
}

impl Folder {
    fn of(path: &str) -> Result<Self, String> {
        let mut files = BTreeMap::new();
        let entries = std::fs::read_dir(at(path)).map_err(|error| format!("{path}: {error}"))?;
        for entry in entries.flatten().filter(|entry| entry.path().is_file()) {
            let bytes = std::fs::read(entry.path()).map_err(|error| format!("{path}: {error}"))?;
            files.insert(entry.file_name().into(), bytes);
        }
        Ok(Folder { files })
    }

    /// The policy with `bytes` in the place of one of its files.
    fn with(&self, name: &str, bytes: &[u8]) -> Result<Policy, policy::Faults> {
        let held = self.files.iter().map(|(name, bytes)| (name.clone(), bytes.clone()));
        let mut options = ReadOptions::embedded(held.chain([(name.into(), bytes.to_vec())]));
        // a contract that names another file must not lead out of the memory
        options.own_folder = true;
        policy::load_with(Path::new("policy.toml"), &options)
    }
}

fn contract() -> Result<Box<Reader>, String> {
    // the weights of all cases under the names that their contracts use: a contract that fits none is refused for it
    let folders: Result<Vec<Folder>, String> = CASES
        .iter()
        .map(|case| Folder::of(&format!("tests/golden/cases/{case}")))
        .collect();
    let folders = folders?;
    Ok(Box::new(move |bytes| {
        // the case whose name stands in the text has the weights that fit; most changes leave the name
        let text = String::from_utf8_lossy(bytes);
        let named = CASES.iter().position(|case| text.contains(&format!("\"{case}\"")));
        let folder = named.and_then(|index| folders.get(index)).or(folders.first());
        match folder.map(|folder| folder.with("policy.toml", bytes)) {
            Some(Ok(policy)) => sound(&policy, bytes),
            Some(Err(faults)) => refused(&faults.faults),
            None => Answer::refused("no folder"),
        }
    }))
}

fn companion(path: &str, name: &'static str) -> Result<Box<Reader>, String> {
    let folder = Folder::of(path)?;
    Ok(Box::new(move |bytes| match folder.with(name, bytes) {
        Ok(policy) => {
            // a prediction of every golden vector: what a user's `verify` begins with
            let result = interp::golden::golden_result(&policy);
            sound(&policy, bytes);
            Answer::accepted(format!("golden {}", result.is_some_and(|result| result.passed())))
        }
        Err(faults) => refused(&faults.faults),
    }))
}

/// What must work for every policy that is taken.
fn sound(policy: &Policy, bytes: &[u8]) -> Answer {
    use policy::describe;
    let told = [
        describe::head(policy),
        describe::signals(policy),
        describe::observation(policy),
    ];
    let more = [
        describe::network(policy),
        describe::actions(policy),
        describe::mapping(policy),
    ];
    let rest = [describe::limits(policy), describe::digests(policy)];
    let length: usize = told.iter().chain(&more).chain(&rest).map(String::len).sum();
    let bounds = policy::memory_bounds(policy);
    assert!(
        bounds.iter().all(|bound| !bound.is_nan()),
        "a bound of the memory is no number"
    );
    let sum = bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_add(*byte));
    if sum % GENERATED == 0 {
        generated(policy, sum);
    }
    Answer::accepted(format!("accepted {}", if length > 0 { "and told" } else { "" }))
}

fn generated(policy: &Policy, choice: u8) {
    let format = NumericFormat::ALL[usize::from(choice / GENERATED) % NumericFormat::ALL.len()];
    let policy = policy.clone().with_format(format);
    let outputs = [codegen::Output::C, codegen::Output::Rust];
    // a refusal is an answer too, such as of subnormal constants
    let _ = codegen::target("host").map(|target| codegen::generate(&policy, target, &outputs, None));
}

fn golden_seeds() -> Result<Vec<Vec<u8>>, String> {
    // the whole file has 400 vectors; what its header says is what is changed
    let mut seeds = files(&["examples/buck12/golden.safetensors"])?;
    seeds.extend(folder(
        "tests/fixtures/trainers",
        &["dueling.expected.safetensors", "gemm.expected.safetensors"],
    )?);
    Ok(seeds)
}

fn mapping() -> Result<Box<Reader>, String> {
    let folder = Folder::of("tests/golden/cases/adc_mapping")?;
    Ok(Box::new(move |bytes| {
        // as part of a contract it has to fit the contract's signals and limits too
        if let Ok(policy) = folder.with("drm.toml", bytes) {
            sound(&policy, bytes);
        }
        match std::str::from_utf8(bytes) {
            Ok(text) => answer(policy::read_mapping(Path::new("drm.toml"), text), |_| {
                "mapping".to_owned()
            }),
            Err(_) => Answer::refused("no text"),
        }
    }))
}
