//! What trainers save: every format that `policyc new` reads. The name of a file tells its reader nothing.

use std::path::PathBuf;

use import::Options;

use super::Target;
use super::folders::Desk;
use super::seeds::{answer, files, folder, read};
use crate::forms::{Form, zip};
use crate::guard::{Limits, Reader};

const TRAINERS: &str = "tests/fixtures/trainers";

pub(super) static TARGETS: &[Target] = &[
    Target {
        name: "torch",
        about: "archives of torch.save: state dicts, checkpoints, whole modules",
        form: Form::Zip,
        words: PICKLE,
        limits: Limits::READER,
        seeds: torch_seeds,
        reader: model,
    },
    Target {
        name: "sb3",
        about: "archives of stable-baselines3 and sb3-contrib",
        form: Form::Zip,
        words: SB3,
        limits: Limits::READER,
        seeds: || smaller(folder(TRAINERS, &[".zip"])?),
        reader: model,
    },
    Target {
        name: "pickle",
        about: "bare pickles: arrays of numpy, torch before 1.6",
        form: Form::Bytes,
        words: PICKLE,
        limits: Limits::READER,
        seeds: || folder(TRAINERS, &["arrays_2.pkl", "arrays_5.pkl", "legacy.pth"]),
        reader: model,
    },
    Target {
        name: "vecnormalize",
        about: "statistics that VecNormalize saved, beside a model",
        form: Form::Bytes,
        words: PICKLE,
        limits: Limits::READER,
        seeds: || folder(TRAINERS, &["vecnormalize.pkl"]),
        reader: statistics,
    },
    Target {
        name: "onnx",
        about: "ONNX models",
        form: Form::Protobuf,
        words: ONNX,
        limits: Limits::READER,
        seeds: || {
            let mut seeds = folder(TRAINERS, &[".onnx"])?;
            seeds.extend(folder(&format!("{TRAINERS}/activations"), &[".onnx"])?);
            Ok(seeds)
        },
        reader: model,
    },
    Target {
        name: "mat",
        about: "MAT files of level 5, and HDF5 files that are refused",
        form: Form::Mat,
        words: &[
            "MATLAB 5.0 MAT-file",
            "Weights",
            "Bias",
            "fc1",
            "double",
            "single",
            "cell",
            "\x0e\0\0\0",
            "\x0f\0\0\0",
        ],
        limits: Limits::READER,
        seeds: || folder(TRAINERS, &[".mat", ".h5"]),
        reader: model,
    },
    Target {
        name: "tensors",
        about: "safetensors whose chain is to be recognised",
        form: Form::Safetensors,
        words: TENSORS,
        limits: Limits::READER,
        seeds: tensor_seeds,
        reader: model,
    },
];

const PICKLE: &[&str] = &[
    "\u{0}",
    "collections\nOrderedDict\n",
    "torch._utils\n_rebuild_tensor_v2\n",
    "torch\nFloatStorage\n",
    "torch\nLongStorage\n",
    "numpy.core.multiarray\n_reconstruct\n",
    "numpy\nndarray\n",
    "numpy\ndtype\n",
    "numpy.core.multiarray\nscalar\n",
    "storage",
    "f4",
    "f8",
    "<",
    ">",
    "weight",
    "bias",
    "data.pkl",
    "byteorder",
    "little",
    "version",
    "\u{1}",
    "}",
    "]",
    ")",
    "(",
    "R",
    "b",
    "s",
    "u",
    "t",
    "e",
    "q\u{0}",
    "h\u{0}",
    "0",
    "1",
    "2",
    "N",
    "\u{5d}\u{5d}\u{5d}\u{5d}",
    "((((",
    "a",
    "tR",
    ".",
    "posix\nsystem\n",
    "running_mean",
    "running_var",
    "state_dict",
    "model",
    "0.weight",
    "0.bias",
];
const SB3: &[&str] = &[
    "policy_class",
    "stable_baselines3.dqn.policies.DQNPolicy",
    "sb3_contrib.qrdqn.policies.QRDQNPolicy",
    "stable_baselines3.common.policies.ActorCriticPolicy",
    "stable_baselines3.sac.policies.SACPolicy",
    "stable_baselines3.td3.policies.TD3Policy",
    "policy_kwargs",
    "net_arch",
    "activation_fn",
    "torch.nn.modules.activation.Tanh",
    "action_space",
    "observation_space",
    "Discrete",
    "Box",
    "MultiDiscrete",
    "MultiBinary",
    ":serialized:",
    ":type:",
    "n",
    "low",
    "high",
    "low_repr",
    "features_extractor_class",
    "FlattenExtractor",
    "use_sde",
    "squash_output",
    "n_quantiles",
    "__module__",
    "__doc__",
    "gAWV",
    "AAAA",
    "====",
    "[64, 64]",
    "{\"pi\": [64], \"vf\": [64]}",
    "q_net.q_net.0.weight",
    "policy.pth",
    "data",
];
const ONNX: &[&str] = &[
    "Gemm",
    "MatMul",
    "Add",
    "Relu",
    "Tanh",
    "Sigmoid",
    "Elu",
    "LeakyRelu",
    "Gelu",
    "Softplus",
    "HardSigmoid",
    "HardSwish",
    "Mul",
    "Sub",
    "Div",
    "Clip",
    "Flatten",
    "Reshape",
    "Transpose",
    "Identity",
    "Constant",
    "Cast",
    "BatchNormalization",
    "Softmax",
    "ReduceMean",
    "transA",
    "transB",
    "alpha",
    "beta",
    "axis",
    "perm",
    "to",
    "value",
    "Erf",
    "Min",
    "Max",
    "Squeeze",
    "Unsqueeze",
    "Concat",
    "Slice",
    "Gather",
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
    "[1,1]",
    "weight",
    "bias",
    "kernel",
    "0.weight",
    "0.bias",
    "2.weight",
    "layers.0.weight",
    "actor",
    "critic",
    "q_net",
    "target",
    "advantage",
    "value",
    "running_mean",
    "running_var",
    "weight_mu",
    "weight_sigma",
    "log_std",
    "mu",
    "num_batches_tracked",
];

/// Reads what lies at a path, as `policyc new` does.
fn model() -> Result<Box<Reader>, String> {
    let desk = Desk::new()?;
    let contract = desk.path("policy.toml");
    // how many actions there are decides what a chain of names may be; both ways are read
    let options = [None, Some(4)].map(|actions| Options {
        actions,
        ..Options::default()
    });
    Ok(Box::new(move |bytes| {
        let file = desk.file("model", bytes);
        let which = &options[bytes.len() % options.len()];
        answer(import::new_policy(&file, &contract, which), |new| {
            assert!(!new.contract.is_empty(), "a contract without text");
            format!("new, {} files beside", new.beside.len())
        })
    }))
}

fn statistics() -> Result<Box<Reader>, String> {
    let desk = Desk::new()?;
    let model: PathBuf = desk.file("model.zip", &read("tests/fixtures/trainers/sb3_ppo.zip")?);
    let contract = desk.path("policy.toml");
    Ok(Box::new(move |bytes| {
        let options = Options {
            vecnormalize: Some(desk.file("statistics", bytes)),
            ..Options::default()
        };
        answer(import::new_policy(&model, &contract, &options), |_| {
            "new, normalised".to_owned()
        })
    }))
}

fn torch_seeds() -> Result<Vec<Vec<u8>>, String> {
    let mut seeds = folder(TRAINERS, &[".pt", "dueling.pth", "state_dict.pth"])?;
    seeds.extend(folder(&format!("{TRAINERS}/trained"), &[".pt"])?);
    seeds.extend(folder(&format!("{TRAINERS}/activations"), &["elu.pt", "gelu_tanh.pt"])?);
    smaller(seeds)
}

/// Archives without the members that no reader opens: statistics of the optimiser, versions, licences.
fn smaller(archives: Vec<Vec<u8>>) -> Result<Vec<Vec<u8>>, String> {
    let without = |bytes: Vec<u8>| match zip::unpack(&bytes) {
        Some(mut members) => {
            members.retain(|(name, _)| !name.ends_with(b"optimizer.pth") && !name.ends_with(b"variables.pth"));
            zip::pack(&members)
        }
        None => bytes,
    };
    Ok(archives.into_iter().map(without).collect())
}

fn tensor_seeds() -> Result<Vec<Vec<u8>>, String> {
    let mut seeds = files(&[
        "tests/golden/cases/minimal/weights.safetensors",
        "tests/golden/cases/constructs/weights.safetensors",
        "tests/golden/cases/wide/weights.safetensors",
    ])?;
    for names in NAMINGS {
        let tensors: Vec<(String, &[usize])> = names.iter().map(|(name, shape)| ((*name).to_owned(), *shape)).collect();
        seeds.push(drawn(&tensors));
    }
    Ok(seeds)
}

/// Names that libraries give their tensors: each is another way through the recognition.
const NAMINGS: [&[(&str, &[usize])]; 5] = [
    &[
        ("0.weight", &[5, 3]),
        ("0.bias", &[5]),
        ("2.weight", &[4, 5]),
        ("2.bias", &[4]),
    ],
    &[
        ("trunk.0.weight", &[5, 3]),
        ("trunk.0.bias", &[5]),
        ("advantage.weight", &[4, 5]),
        ("advantage.bias", &[4]),
        ("value.weight", &[1, 5]),
        ("value.bias", &[1]),
    ],
    &[
        ("actor.0.weight", &[5, 3]),
        ("actor.0.bias", &[5]),
        ("actor.2.weight", &[4, 5]),
        ("actor.2.bias", &[4]),
        ("critic.0.weight", &[5, 3]),
        ("critic.0.bias", &[5]),
        ("critic.2.weight", &[1, 5]),
        ("critic.2.bias", &[1]),
    ],
    &[
        ("dense/kernel", &[3, 5]),
        ("dense/bias", &[5]),
        ("dense_1/kernel", &[5, 4]),
        ("dense_1/bias", &[4]),
    ],
    &[
        ("0.weight", &[5, 3]),
        ("0.bias", &[5]),
        ("1.weight", &[5]),
        ("1.bias", &[5]),
        ("1.running_mean", &[5]),
        ("1.running_var", &[5]),
        ("3.weight", &[4, 5]),
        ("3.bias", &[4]),
    ],
];

/// A safetensors file of these shapes; every value is a half.
fn drawn(tensors: &[(String, &[usize])]) -> Vec<u8> {
    let mut at = 0;
    let mut header = Vec::new();
    for (name, shape) in tensors {
        let bytes = 4 * shape.iter().product::<usize>();
        header.push(format!(
            "\"{name}\":{{\"dtype\":\"F32\",\"shape\":{shape:?},\"data_offsets\":[{at},{}]}}",
            at + bytes
        ));
        at += bytes;
    }
    let header = format!("{{{}}}", header.join(","));
    let values = 0.5_f32.to_le_bytes().repeat(at / 4);
    [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &values].concat()
}
