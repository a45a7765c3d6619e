"""What stands between a converter and its trainer: wrappers of gymnasium and of Stable-Baselines3, by name, so that neither library
is asked for."""

from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple, Union

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

#: They show the latest observations together, the oldest first: how many.
STACKS: Dict[str, Callable[[Any], int]] = {
    "FrameStackObservation": lambda env: int(env.stack_size),
    "VecFrameStack": lambda env: int(env.stacked_obs.n_stack),
}


@dataclass
class Chain:
    """What was read of the wrappers."""

    #: The environment itself.
    inner: Any
    #: What becomes of the observation, the innermost first: normalisations, one for each feature, or as many frames together.
    observed: List[Union[List[Affine], int]] = field(default_factory=list)
    #: The command of the environment from the action of the trainer: ``gain * action + shift``.
    gain: float = 1.0
    shift: float = 0.0
    said: List[str] = field(default_factory=list)
    #: Wrappers whose statistics follow what they see, and the attribute that stops them.
    statistics: List[Tuple[Any, str]] = field(default_factory=list)


def _normal(rms: Any, epsilon: float, limit: Optional[float]) -> List[Affine]:
    """Scale and offset of running statistics, in binary64."""
    mean, var = np.asarray(rms.mean, float).reshape(-1), np.asarray(rms.var, float).reshape(-1)
    scale = 1.0 / np.sqrt(var + epsilon)
    return [(float(s), float(-m * s), limit) for s, m in zip(scale, mean)]


def _frames(env: Any, name: str, said: List[str]) -> int:
    """How many observations a wrapper shows together; what a controller does in another way is said."""
    count = STACKS[name](env)
    is_same = getattr(env, "padding_type", "zero") == "reset"
    differs = "" if is_same else "; before the first of an episode the controller sees the first again, and not the trainer's padding"
    said.append(f"{count} observations stacked by {name}{differs}")
    return count


def _ends(space: Any) -> Tuple[float, float]:
    low, high = np.unique(space.low), np.unique(space.high)
    if len(low) != 1 or len(high) != 1:
        raise ValueError("an action space of one number is compiled")
    return float(low[0]), float(high[0])


def read(env: Any) -> Chain:
    """Walks from the outermost wrapper to the environment itself."""
    chain = Chain(env)
    outwards: List[Union[List[Affine], int]] = []
    while True:
        name = type(env).__name__
        if name in STACKS:
            outwards.append(_frames(env, name, chain.said))
        elif name == "VecNormalize":
            if env.norm_obs:
                outwards.append(_normal(env.obs_rms, env.epsilon, float(env.clip_obs)))
                chain.said.append("observations normalised by VecNormalize")
            # those of the reward, too
            chain.statistics.append((env, "training"))
        elif name == "NormalizeObservation":
            outwards.append(_normal(env.obs_rms, env.epsilon, None))
            chain.statistics.append((env, "update_running_mean"))
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
            chain.inner, chain.observed = env, outwards[::-1]
            return chain
        env = inner


@contextmanager
def held(chain: Chain) -> Iterator[None]:
    """A look at the environment that leaves the statistics of its wrappers as they are."""
    before = [getattr(env, name) for env, name in chain.statistics]
    try:
        for env, name in chain.statistics:
            setattr(env, name, False)
        yield
    finally:
        for (env, name), value in zip(chain.statistics, before):
            setattr(env, name, value)
