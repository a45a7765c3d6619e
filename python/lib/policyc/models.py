"""A trained model, whatever its library: its network as files, and its answers while it still lives."""

import json
import os
import re
import struct
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

import numpy as np

from ._policyc import import_model

#: Below it the choice between two actions could be another one after rounding.
SMALLEST_GAP = 1e-4

#: Class in ``torch.nn``, the word of a contract, and the arguments of which it is the function.
ACTIVATIONS: Dict[str, Tuple[str, Dict[str, Any]]] = {
    "ReLU": ('"relu"', {}),
    "Tanh": ('"tanh"', {}),
    "Softsign": ('"softsign"', {}),
    "Sigmoid": ('"sigmoid"', {}),
    "Hardsigmoid": ('"hard_sigmoid"', {}),
    "ELU": ('"elu"', {"alpha": 1.0}),
    "Softplus": ('"softplus"', {"beta": 1.0}),
    "SiLU": ('"silu"', {}),
    "GELU": ('"gelu"', {"approximate": "none"}),
    "Hardswish": ('"hard_swish"', {}),
}
#: Ends of the curves that may stand behind the last layer of a model that commands a number.
CURVES = {"tanh": (-1.0, 1.0), "softsign": (-1.0, 1.0), "sigmoid": (0.0, 1.0), "hard_sigmoid": (0.0, 1.0)}
SILENT = {"Flatten", "Identity", "Dropout"}


@dataclass
class Model:
    """What is taken of a model."""

    #: Entries of ``[network]``, without golden answers.
    network: str
    #: Files beside the contract.
    files: Dict[str, bytes]
    #: Observations ``(n, features)`` to outputs ``(n, actions)``, or to commands ``(n,)`` of a continuous one; None where nothing
    #: can answer.
    answer: Optional[Callable[[np.ndarray], np.ndarray]]
    #: How the one output becomes the trainer's action: a curve or ``clip``, and the action at both ends; None for a choice.
    continuous: Optional[Tuple[str, float, float]]
    #: Least and largest of each observation.
    bounds: Optional[Tuple[np.ndarray, np.ndarray]]
    said: List[str]


def safetensors(tensors: Mapping[str, np.ndarray]) -> bytes:
    """A safetensors file; names in order, so that equal tensors are equal bytes."""
    kinds = {"float32": "F32", "int32": "I32"}
    header, data = {}, b""
    for name in sorted(tensors):
        tensor = np.ascontiguousarray(tensors[name])
        begin, data = len(data), data + tensor.tobytes()
        header[name] = {"dtype": kinds[str(tensor.dtype)], "shape": list(tensor.shape), "data_offsets": [begin, len(data)]}
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + data


def golden(model: Model, observations: np.ndarray, gain: float, shift: float, count: int = 128) -> Optional[bytes]:
    """Known answers of the model itself; a choice between two that are nearly equal is none."""
    if model.answer is None:
        return None
    observations = np.asarray(observations, np.float32)
    answers = np.asarray(model.answer(observations))
    if model.continuous is not None:
        duty = (gain * answers.astype(np.float64).reshape(-1) + shift).astype(np.float32)
        return safetensors({"obs": observations[:count], "duty": duty[:count]})
    best = np.sort(answers, axis=1)
    decided = best[:, -1] - best[:, -2] > SMALLEST_GAP * np.abs(answers).max(axis=1)
    obs, q = observations[decided][:count], answers[decided][:count].astype(np.float32)
    return safetensors({"obs": obs, "q": q, "action": q.argmax(axis=1).astype(np.int32)}) if len(obs) else None


def _drafted(file: str, actions: Optional[int] = None) -> Tuple[str, Dict[str, bytes], List[str], str]:
    """``[network]``, weights, and what was said, from the reader of saved models; and the whole draft."""
    draft, beside, said = import_model(file, os.path.join(os.path.dirname(file), "policy.toml"), actions, None, None)
    section = draft.split("\n[network]\n", 1)[1].split("\n[", 1)[0]
    lines = [line.split("   #")[0].rstrip() for line in section.splitlines()]
    keys = [line for line in lines if line and not line.startswith(("#", "golden"))]
    weights = {name: content for name, content in beside.items() if not name.startswith("golden")}
    # golden answers are made anew, or given: what the reader says of its own would mislead
    said = [line for line in said if not line.startswith("golden")]
    return "\n".join(keys) + "\n", weights, said, draft


def _commanded(draft: str) -> Optional[Tuple[str, float, float]]:
    """What the draft says of a model that commands a number."""
    found = re.search(r"^continuous = \{ (.*?) \}", draft, re.MULTILINE)
    if found is None:
        return None
    number = lambda key, default: float((re.search(key + r" = (-?[0-9.e+-]+)", found[1]) or ["", default])[1])  # noqa: E731
    curve = re.search(r'squash = "(.*?)"', found[1])
    clip = re.search(r"clip = \[(-?[0-9.e+-]+), (-?[0-9.e+-]+)\]", found[1])
    if clip is not None:
        word, low, high = "clip", float(clip[1]), float(clip[2])
    elif curve is not None and curve[1] in CURVES:
        word, (low, high) = curve[1], CURVES[curve[1]]
    else:
        raise ValueError(f"the file does not say what bounds its command: {found[0]}; write the contract with `policyc new`")
    if word == "clip" and re.search(r"scale = -?[0-9]", found[1]):
        # between the clip and the command: `_command` has the ends of the clip alone
        raise ValueError(f"a clip with a scale is not read here: {found[0]}; write the contract with `policyc new`")
    if word == "clip":
        return word, low, high
    # a scale that is still to be said is the action's own range
    scale, offset = number("scale", 1.0), number("offset", 0.0)
    return word, scale * low + offset, scale * high + offset


def from_sb3(model: Any, folder: str) -> Model:
    """DQN, QR-DQN, PPO, A2C, SAC, TD3, DDPG of Stable-Baselines3 and its contrib package."""
    import torch

    file = os.path.join(folder, "model.zip")
    model.save(file)
    network, files, said, _ = _drafted(file)
    policy, kind = model.policy, type(model).__name__
    space = model.action_space
    ends = None if hasattr(space, "n") else (float(space.low.min()), float(space.high.max()))

    def outputs(observations: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            tensor = torch.as_tensor(observations, device=model.device)
            if hasattr(policy, "quantile_net"):
                found = policy.quantile_net(tensor).mean(dim=1)
            elif hasattr(policy, "q_net"):
                found = policy.q_net(tensor)
            else:
                found = policy.action_net(policy.mlp_extractor.forward_actor(policy.extract_features(tensor)))
        return found.cpu().numpy()

    def commands(observations: np.ndarray) -> np.ndarray:
        # frames that lie one behind the other, as the model knows them
        shaped = observations.reshape(-1, *model.observation_space.shape)
        return model.predict(shaped, deterministic=True)[0].reshape(-1)

    squash = "clip" if hasattr(policy, "action_net") else "tanh"
    bounds = model.observation_space
    return Model(
        network=network,
        files=files,
        answer=outputs if ends is None else commands,
        continuous=None if ends is None else (squash, *ends),
        bounds=(bounds.low.reshape(-1), bounds.high.reshape(-1)),
        said=[f"{kind}: " + said[0], *said[1:]] if said else [kind],
    )


def _word(leaf: Any) -> str:
    """The contract's word for an activation of torch."""
    name = type(leaf).__name__
    word, arguments = ACTIVATIONS[name]
    if name == "GELU" and leaf.approximate == "tanh":
        return '"gelu_tanh"'
    for argument, value in arguments.items():
        if getattr(leaf, argument) != value:
            raise ValueError(f"the layer {leaf} is not read: with {argument} = {value!r} it is")
    return word


def from_module(module: Any) -> Model:
    """A module of torch whose layers are called in the order in which it has them."""
    import torch

    layers, activations, squash = [], [], None
    for leaf in module.modules():
        if next(leaf.children(), None) is not None or type(leaf).__name__ in SILENT:
            continue
        name = type(leaf).__name__
        if name == "Linear":
            layers.append(leaf)
            activations.append(None)
        elif name in ACTIVATIONS and layers and activations[-1] is None:
            activations[-1] = _word(leaf)
        elif name == "LeakyReLU" and layers and activations[-1] is None:
            activations[-1] = f"{{ leaky_relu = {leaf.negative_slope!r} }}"
        else:
            raise ValueError(f"the layer {leaf} is not read: dense layers with {', '.join(ACTIVATIONS)} or LeakyReLU behind them are")
    if not layers:
        raise ValueError("the module has no dense layer")
    *hidden, last = activations
    if last is not None:
        word = last.strip('"')
        if word not in CURVES or layers[-1].out_features != 1:
            raise ValueError(f"an activation behind the last layer is read of one output through {', '.join(CURVES)}, and not {last}")
        squash = (word, *CURVES[word])
    if any(one is None for one in hidden):
        raise ValueError("two dense layers follow each other without an activation that is a module")
    names = [f"layer_{index}" for index in range(len(layers))]
    tensors = {}
    for name, layer in zip(names, layers):
        tensors[f"{name}.weight"] = layer.weight.detach().cpu().numpy().astype(np.float32)
        if layer.bias is not None:
            tensors[f"{name}.bias"] = layer.bias.detach().cpu().numpy().astype(np.float32)
    network = 'weights = "weights.safetensors"\n'
    if hidden:
        network += f"hidden_activation = {hidden[0] if len(set(hidden)) == 1 else '[' + ', '.join(hidden) + ']'}\n"

    def answer(observations: np.ndarray) -> np.ndarray:
        was_training = module.training
        module.eval()
        with torch.no_grad():
            found = module(torch.as_tensor(observations)).cpu().numpy()
        module.train(was_training)
        return found

    return Model(
        network=network,
        files={"weights.safetensors": safetensors(tensors)},
        answer=answer,
        continuous=squash,
        bounds=None,
        said=[f"a module of torch: {' > '.join(str(layer) for layer in layers)}"],
    )


def from_file(file: str, folder: str, actions: Optional[int], activation: Optional[str]) -> Model:
    """A saved model. That of an ONNX graph answers where onnxruntime is installed."""
    copied = os.path.join(folder, "model" + os.path.splitext(file)[1])
    for source, target in ((file, copied), (file + ".data", os.path.join(folder, os.path.basename(file) + ".data"))):
        if os.path.exists(source):
            with open(source, "rb") as read, open(target, "wb") as write:
                write.write(read.read())
    network, files, said, draft = _drafted(copied, actions)
    if activation is not None:
        network = network.replace('hidden_activation = "TODO"', f'hidden_activation = "{activation}"')
    answer = None
    if file.endswith(".onnx"):
        try:
            import onnxruntime

            session = onnxruntime.InferenceSession(file, providers=["CPUExecutionProvider"])
            entry = session.get_inputs()[0].name
            answer = lambda observations: session.run(None, {entry: observations})[0]  # noqa: E731
            if _commanded(draft) is not None:
                # whether the graph ends before or behind the squash is the reader's to know, not ours to guess
                answer = None
        except ImportError:
            said.append("onnxruntime is not installed: no golden answers")
    return Model(network, files, answer, _commanded(draft), None, said)
