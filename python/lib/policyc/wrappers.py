"""What stands between a converter and its trainer: wrappers of gymnasium and of Stable-Baselines3, by name, so that neither library
is asked for."""

from dataclasses import dataclass, field
from typing import Any, List, Optional, Tuple

import numpy as np

from .contract import Affine

#: They change neither observation nor action of an environment with one flat Box.
NEUTRAL = {
    "OrderEnforcing",
    "PassiveEnvChecker",
    "TimeLimit",
    "Monitor",
    "RecordEpisodeStatistics",
    "RecordVideo",
    "FlattenObservation",
    "ClipAction",
    "NormalizeReward",
    "TransformReward",
    "ClipReward",
    "Autoreset",
    "HumanRendering",
    "RenderCollection",
    "VecMonitor",
    "VecCheckNan",
    "VecVideoRecorder",
    "DummyVecEnv",
}

#: What a contract says in their place.
STACKS = {"FrameStack", "FrameStackObservation", "VecFrameStack", "DelayObservation"}


@dataclass
class Chain:
    """What was read of the wrappers."""

    #: The environment itself.
    inner: Any
    #: Normalisations of the observation, the innermost first, a list of one for each feature.
    affine: List[List[Affine]] = field(default_factory=list)
    #: The command of the environment from the action of the trainer: ``gain * action + shift``.
    gain: float = 1.0
    shift: float = 0.0
    said: List[str] = field(default_factory=list)


def _normal(rms: Any, epsilon: float, limit: Optional[float]) -> List[Affine]:
    """Scale and offset of running statistics, in binary64."""
    mean, var = np.atleast_1d(np.asarray(rms.mean, float)), np.atleast_1d(np.asarray(rms.var, float))
    scale = 1.0 / np.sqrt(var + epsilon)
    return [(float(s), float(-m * s), limit) for s, m in zip(scale, mean)]


def _ends(space: Any) -> Tuple[float, float]:
    low, high = np.unique(space.low), np.unique(space.high)
    if len(low) != 1 or len(high) != 1:
        raise ValueError("an action space of one number is compiled")
    return float(low[0]), float(high[0])


def read(env: Any) -> Chain:
    """Walks from the outermost wrapper to the environment itself."""
    chain, outwards = Chain(env), []
    while True:
        name = type(env).__name__
        if name in STACKS:
            raise ValueError(
                f"{name}: a stack of frames is not read; give the contract a feature for each frame, with filters = "
                "[{ delay = 1 }], [{ delay = 2 }], ..., and train on its observation"
            )
        if name == "VecNormalize":
            if env.norm_obs:
                outwards.append(_normal(env.obs_rms, env.epsilon, float(env.clip_obs)))
                chain.said.append("observations normalised by VecNormalize")
        elif name == "NormalizeObservation":
            outwards.append(_normal(env.obs_rms, env.epsilon, None))
            chain.said.append("observations normalised by NormalizeObservation")
        elif name == "RescaleAction":
            low, high = _ends(env.env.action_space)
            least, most = _ends(env.action_space)
            gain = (high - low) / (most - least)
            # what is further out comes first
            chain.gain, chain.shift = gain * chain.gain, gain * chain.shift + low - gain * least
            chain.said.append(f"actions rescaled from {least:g} .. {most:g} to {low:g} .. {high:g}")
        elif name not in NEUTRAL and (hasattr(env, "venv") or type(env).__module__.startswith("gymnasium.wrappers")):
            raise ValueError(f"the wrapper {name} is not read: train without it, or say in the contract what it does")
        inner = getattr(env, "venv", None) or (env.envs[0] if hasattr(env, "envs") else None)
        if inner is None and hasattr(env, "env"):
            inner = env.env
        if inner is None:
            chain.inner, chain.affine = env, outwards[::-1]
            return chain
        env = inner
