"""From a live model to a verified policy folder."""

import os
import shutil
import tempfile
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import contract as contracts
from . import models, wrappers
from ._policyc import contract_json
from .policy import PathLike, Policy, Signal

#: Observations that are collected for golden answers.
OBSERVATIONS = 512


def export(
    model: Any,
    out: PathLike,
    *,
    env: Any = None,
    name: Optional[str] = None,
    signals: Optional[Sequence[Union[Signal, Mapping[str, Any]]]] = None,
    features: Optional[Sequence[Mapping[str, Any]]] = None,
    parameters: Optional[Mapping[str, float]] = None,
    sample_period: Optional[float] = None,
    duties: Optional[Sequence[float]] = None,
    duty: Optional[Tuple[float, float]] = None,
    limits: Optional[Mapping[str, Any]] = None,
    fallback: Optional[Mapping[str, Any]] = None,
    actions: Optional[int] = None,
    activation: Optional[str] = None,
    observations: Optional[np.ndarray] = None,
    verify: int = 2000,
    overwrite: bool = False,
) -> Policy:
    """Writes the whole policy folder `out` of a trained model, with golden answers of the model itself, and verifies it.

    `model` is one of Stable-Baselines3 (DQN, QR-DQN, PPO, A2C, SAC, TD3, DDPG), a ``torch.nn.Module`` whose layers are called in the
    order in which it has them, or the path of a saved model (ONNX, ``.zip``, ``.pt``, safetensors). `env` is what it was trained on;
    without it the model's own. Of its wrappers VecNormalize, NormalizeObservation, VecFrameStack, FrameStackObservation,
    FlattenObservation and RescaleAction are read, and those that would change what the network sees in another way are refused by name.

    Behind the wrappers an environment ``policyc/Converter-v0`` gives everything else: the contract is its own. For another one say
    `signals` (:class:`Signal` or mappings with ``name``, ``unit``, ``range``), `features` (mappings with ``name``, ``source``,
    ``filters``, ``scale``, ``offset``, ``clip``; without them observation `n` is signal `n`), `parameters`, `sample_period` (s), `duties`
    of the actions (0..1), or for a model that commands a number `duty`, the ends of the duty that its action stands for;
    `limits` (``{"duty": [low, high]}``) and `fallback` (``{"duty": 0.0, "hold": 3}``). They replace those of the contract, too.

    Of a saved model `actions` says how many there are where several outputs belong to each, and `activation` what stands behind the
    hidden layers (``relu``, ``tanh``) where the file does not.

    `observations` of shape ``(n, features)``, as the network sees them, are what golden answers are given to; without them the
    environment is run, or they are drawn within their bounds. `verify` control steps are compared with every compiler at hand; 0 leaves
    it out. Returns the policy. Raises :class:`Faults` or ``ValueError``; nothing is written then.
    """
    out = os.fspath(out)
    if os.path.exists(os.path.join(out, "policy.toml")) and not overwrite:
        raise FileExistsError(f"{out} holds a policy already: move it away, or overwrite=True")
    with tempfile.TemporaryDirectory(prefix="policyc-export-") as scratch:
        taken = _taken(model, scratch, actions, activation)
        env = env if env is not None else _own(model)
        chain = wrappers.read(env) if env is not None else wrappers.Chain(None)
        given = {
            "name": name,
            "signals": None if signals is None else [_signal(signal) for signal in signals],
            "features": None if features is None else [dict(feature) for feature in features],
            "parameters": parameters,
            "sample_period": sample_period,
            "limits": limits,
            "fallback": fallback,
        }
        entries, mapping = _entries(chain, given, taken)
        entries["features"] = _observed(entries["features"], chain)
        gain, shift = _command(chain, taken, duty, entries, duties)
        if observations is None and env is not None and hasattr(model, "predict"):
            with wrappers.held(chain):
                observations = _run(model, env)
        elif observations is None:
            # what the controller can ever see is known once the contract is read
            observations = _drawn(_written(os.path.join(scratch, "bounds"), entries, taken, chain, None, mapping))
        golden = models.golden(taken, observations, gain, shift)
        folder = os.path.join(scratch, "policy")
        _check(_written(folder, entries, taken, chain, golden, mapping), verify)
        os.makedirs(out, exist_ok=True)
        for file in sorted(os.listdir(folder)):
            shutil.copyfile(os.path.join(folder, file), os.path.join(out, file))
    return Policy.load(out)


def _taken(model: Any, scratch: str, actions: Optional[int], activation: Optional[str]) -> models.Model:
    if isinstance(model, (str, os.PathLike)):
        return models.from_file(os.fspath(model), scratch, actions, activation)
    if hasattr(model, "policy") and hasattr(model, "save"):
        return models.from_sb3(model, scratch)
    if hasattr(model, "state_dict") and hasattr(model, "modules"):
        return models.from_module(model)
    raise TypeError(f"{type(model).__name__} is neither a model of Stable-Baselines3, nor a torch.nn.Module, nor a path")


def _own(model: Any) -> Any:
    """The environment that a model of Stable-Baselines3 knows."""
    return model.get_env() if hasattr(model, "get_env") else None


def _signal(signal: Union[Signal, Mapping[str, Any]]) -> Dict[str, Any]:
    if isinstance(signal, Signal):
        adc = None if signal.adc is None else {"gain": signal.adc[0], "offset": signal.adc[1]}
        return {"name": signal.name, "unit": signal.unit, "range": list(signal.range), "adc": adc}
    return dict(signal)


def _entries(chain: wrappers.Chain, given: Dict[str, Any], taken: models.Model) -> Tuple[Dict[str, Any], Optional[str]]:
    """The entries of the contract, and its mapping's file."""
    import json

    said = {key: value for key, value in given.items() if value is not None}
    inner = getattr(chain.inner, "unwrapped", chain.inner)
    path = getattr(inner, "contract", None)
    if path is not None:
        path = os.path.join(path, "policy.toml") if os.path.isdir(path) else path
        data = json.loads(contract_json(path))
        return {**contracts.from_inspection(data), **said}, contracts.mapping_file(data["files"])
    needed = ("name", "signals", "sample_period", "limits", "fallback")
    missing = [key for key in needed if key not in said]
    if missing:
        raise ValueError(f"the environment is none of policyc's: say {', '.join(missing)}")
    if "features" not in said:
        low, high = taken.bounds if taken.bounds is not None else (None, None)
        said["features"] = []
        for index, signal in enumerate(said["signals"]):
            ends = None if low is None else [float(low[index]), float(high[index])]
            clip = ends if ends is not None and np.all(np.abs(ends) < 1e30) else None
            said["features"].append({"name": f"o_{signal['name']}", "source": signal["name"], "clip": clip})
    return {"actions": {}, **said}, None


def _observed(features: List[Dict[str, Any]], chain: wrappers.Chain) -> List[Dict[str, Any]]:
    """The features behind the wrappers."""
    for step in chain.observed:
        if isinstance(step, int):
            features = contracts.stacked(features, step)
        elif len(step) != len(features):
            raise ValueError(f"{len(step)} observations are normalised, and there are {len(features)} features")
        else:
            features = [contracts.normalised(feature, one) for feature, one in zip(features, step)]
    return features


def _command(
    chain: wrappers.Chain,
    taken: models.Model,
    duty: Optional[Tuple[float, float]],
    entries: Dict[str, Any],
    duties: Optional[Sequence[float]],
) -> Tuple[float, float]:
    """Fills in the actions; gain and shift from the trainer's action to a duty."""
    if taken.continuous is None:
        if duties is not None and "base" in entries["actions"]:
            raise ValueError("the actions of this contract add to a law: `duties` would be another controller")
        if duties is not None:
            entries["actions"] = {"duties": [float(one) for one in duties]}
        if not entries["actions"]:
            raise ValueError("say `duties`, one for each action")
        return 1.0, 0.0
    squash, low, high = taken.continuous
    gain, shift = chain.gain, chain.shift
    if duty is not None:
        least, largest = min(low, high), max(low, high)
        gain = (duty[1] - duty[0]) / (largest - least)
        shift = duty[0] - gain * least
    ends = gain * low + shift, gain * high + shift
    # a rounding of the trainer's binary32 is no command beyond the duties
    if not -1e-6 <= min(ends) <= max(ends) <= 1 + 1e-6:
        raise ValueError(f"the action stands for {ends[0]:g} .. {ends[1]:g}, which is no duty: say `duty`, its ends")
    if squash in models.CURVES:
        least, largest = models.CURVES[squash]
        scale = (high - low) / (largest - least)
        offset = low - scale * least
        entries["actions"] = {
            "continuous": {"squash": squash, "scale": gain * scale, "offset": gain * offset + shift}
        }
    else:
        entries["actions"] = {"continuous": {"clip": [low, high], "scale": gain, "offset": shift}}
    return gain, shift


def _drawn(policy: Policy) -> np.ndarray:
    """Observations within the bounds of what the controller can see."""
    bounds = [feature["bound"] for feature in policy.inspect().json["features"]]
    low, high = np.array([(bound["low"], bound["high"]) for bound in bounds]).T
    # most around the middle, where a controller is most of the time, and some at the ends
    spread = np.random.default_rng(1).uniform(-1.0, 1.0, (OBSERVATIONS, len(bounds))) ** 3
    drawn = 0.5 * (low + high) + 0.5 * (high - low) * spread
    return np.clip(drawn.astype(np.float32), low.astype(np.float32), high.astype(np.float32))


def _run(model: Any, env: Any) -> np.ndarray:
    """A run with the model, which explores a little so that it meets more than one state."""
    is_vector = hasattr(env, "num_envs") and hasattr(env, "step_wait")
    first = env.reset()
    observation = first if is_vector else first[0]
    seen: List[np.ndarray] = []
    draws = np.random.default_rng(1)
    while len(seen) < OBSERVATIONS:
        # frames lie one behind the other, as the network sees them
        seen.extend(np.asarray(observation, np.float32).reshape(len(observation) if is_vector else 1, -1))
        action, _ = model.predict(observation, deterministic=draws.random() < 0.7)
        if is_vector:
            observation = env.step(action)[0]
        else:
            observation, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                observation, _ = env.reset()
    return np.array(seen[:OBSERVATIONS], np.float32)


def _written(
    folder: str,
    entries: Dict[str, Any],
    taken: models.Model,
    chain: wrappers.Chain,
    golden: Optional[bytes],
    mapping: Optional[str],
) -> Policy:
    """The folder of a policy, read again."""
    os.makedirs(folder)
    files = dict(taken.files)
    network = taken.network
    if golden is not None:
        files["golden.safetensors"] = golden
        network += 'golden = "golden.safetensors"\n'
    if mapping is not None and entries.get("mapping"):
        entries = {**entries, "mapping": {"file": os.path.basename(mapping), **entries["mapping"]}}
        shutil.copyfile(mapping, os.path.join(folder, os.path.basename(mapping)))
    for file, content in files.items():
        with open(os.path.join(folder, file), "wb") as write:
            write.write(content)
    about = ["Written by policyc.export."] + [line for line in [*taken.said, *chain.said]]
    with open(os.path.join(folder, "policy.toml"), "w", encoding="utf-8", newline="\n") as write:
        write.write(contracts.text(entries, network, [part for line in about for part in line.splitlines()]))
    return Policy.load(folder)


def _check(policy: Policy, steps: int) -> None:
    """Golden answers first, by a compilation; then the code against the interpreter."""
    policy.compile(costs=False)
    if steps > 0:
        found = policy.verify(steps=steps)
        if not found.equal:
            raise ValueError(f"the generated code differs from the interpreter; nothing was written\n{found}")
