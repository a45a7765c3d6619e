"""Converters under control as environments of gymnasium.

``gymnasium.make("policyc/Converter-v0", plant="plant.toml", contract="policy.toml")`` is one converter,
``gymnasium.make_vec("policyc/Converter-v0", num_envs=1024, ...)`` many side by side. The observation is that of the contract, through
the interpreter's own code with filters, mapping and limits: what is trained is what is compiled.
"""

import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode

from . import _toml
from ._policyc import Episodes, contract_facts
from .policy import PathLike
from .render import picture

#: Rows of :attr:`ConverterVectorEnv.states`.
STATES = ("v_out", "i_l", "i_out", "v_in", "duty", "load")


def _settings(
    plant: Optional[PathLike],
    contract: Optional[PathLike],
    training: Optional[PathLike],
    v_ref: Optional[float],
    reward: Optional[Mapping[str, Any]],
    episode: Optional[Mapping[str, Any]],
    randomise: Sequence[Mapping[str, Any]],
    set: Optional[Mapping[str, float]],
) -> Tuple[str, Optional[str]]:
    """File and text of a training."""
    if training is not None:
        given = {"plant": plant, "contract": contract, "v_ref": v_ref, "reward": reward, "episode": episode, "set": set}
        doubled = [name for name, value in given.items() if value is not None] + ["randomise"] * bool(randomise)
        if doubled:
            raise TypeError(f"a training file says everything: leave out {', '.join(doubled)}")
        return os.fspath(training), None
    if plant is None or contract is None:
        raise TypeError("a converter needs `plant` and `contract`, or `training`")
    contract = os.path.abspath(contract)
    if os.path.isdir(contract):
        contract = os.path.join(contract, "policy.toml")
    held, _ = contract_facts(contract)
    reward, episode = dict(reward or {}), dict(episode or {})
    v_ref = v_ref if v_ref is not None else reward.get("v_ref", held)
    if v_ref is None:
        raise TypeError("the contract names no voltage to hold: give `v_ref`, in V")
    reward["v_ref"] = float(v_ref)
    if "loads" not in episode:
        # those of another converter would be taken without a word
        raise TypeError('say which loads the converter meets: episode={"loads": {"range": [150, 1050]}}, in W with load_kind="power"')
    text = _toml.document(
        {
            "plant": os.path.abspath(plant),
            "contract": contract,
            # of a training, which the trainer's library does here
            "steps": 1,
            "set": set or None,
            "reward": reward,
            "episode": episode,
            # on these a training is judged, which an environment is not; the file asks for them
            "selection": {"load_steps": [[1.0, 2.0]]},
            "evaluation": {"load_steps": [[1.0, 2.0]]},
            "randomise": [dict(one) for one in randomise] or None,
        }
    )
    return os.path.abspath("arguments of policyc/Converter-v0"), text


class _Spaces:
    """Spaces and episodes, which both environments have."""

    def _open(self, count: int, arguments: Dict[str, Any], load_kind: str, load_profile: Sequence[Any]) -> None:
        file, text = _settings(**arguments)
        profile = [(int(period), float(load)) for period, load in load_profile]
        self._episodes = Episodes(file, text, count, load_kind, profile)
        low, high = self._episodes.observation_ends()
        self._observation = spaces.Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)
        self._continuous = self._episodes.is_continuous()
        duties = self._episodes.duties()
        if self._continuous:
            self._action = spaces.Box(np.float32(min(duties)), np.float32(max(duties)), (1,), np.float32)
        else:
            self._action = spaces.Discrete(len(duties))
        #: The contract's file, for :func:`policyc.export`.
        self.contract = os.path.abspath(self._episodes.contract())
        #: Duty of each action, 0..1, or what it adds to a law; of a policy that commands a number the duties at both ends.
        self.duties = duties
        #: Control period, s.
        self.sample_period = self._episodes.sample_period()

    def _act(self, actions: np.ndarray, over: np.ndarray, given: Tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
        if self._continuous:
            self._episodes.step_duty(np.ascontiguousarray(actions, np.float32).reshape(-1), over, given)
        else:
            self._episodes.step_index(np.ascontiguousarray(actions, np.int64).reshape(-1), over, given)


class ConverterEnv(_Spaces, gymnasium.Env):
    """One converter.

    Observation: the features of the contract, ``float32``, within their clips. Action: an index into the contract's duties or offsets, or for
    a policy that commands a number the duty before the mapping, 0..1, shape ``(1,)``. An episode is never terminated, because
    control has no end; it is truncated when its time is over or the voltage is lost. `info` has the true state: ``v_out`` and
    ``v_in`` in V, ``i_l`` and ``i_out`` in A, what the sensors show under ``measured``, the ``duty`` that left the controller, its
    ``status`` bits, the ``load`` and the ``period`` of the episode.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 30}

    def __init__(
        self,
        plant: Optional[PathLike] = None,
        contract: Optional[PathLike] = None,
        *,
        training: Optional[PathLike] = None,
        v_ref: Optional[float] = None,
        reward: Optional[Mapping[str, Any]] = None,
        episode: Optional[Mapping[str, Any]] = None,
        randomise: Sequence[Mapping[str, Any]] = (),
        set: Optional[Mapping[str, float]] = None,
        load_kind: str = "power",
        load_profile: Sequence[Tuple[int, float]] = (),
        render_mode: Optional[str] = None,
    ) -> None:
        """A converter of the file `plant` under the contract `contract`, whose weights need not exist yet.

        `reward`, `episode`, `randomise` and `set` are the tables of a training file (docs/reference/training-file.md):
        ``reward={"duty_change_weight": 1.0}``, ``episode={"steps": 400, "load_every": 100, "loads": {"range": [150, 1050]}}``,
        ``randomise=[{"key": "converter.inductance", "factor": [0.7, 1.3]}]``, ``set={"switch.v_f": 0.8}``; `training` is such a file
        in the place of all of them. `load_kind` is ``power`` (W), ``current`` (A) or ``resistance`` (ohm) and says what the loads
        are. `load_profile` takes the place of drawn loads: pairs of control period and load, the first at period 0.
        """
        arguments = dict(
            plant=plant,
            contract=contract,
            training=training,
            v_ref=v_ref,
            reward=reward,
            episode=episode,
            randomise=randomise,
            set=set,
        )
        self._open(1, arguments, load_kind, load_profile)
        self.observation_space, self.action_space = self._observation, self._action
        self.render_mode = render_mode
        self._over = np.zeros(1, bool)
        self._history: List[Tuple[float, float]] = []

    def reset(
        self, *, seed: Optional[int] = None, options: Optional[Mapping[str, Any]] = None
    ) -> Tuple[np.ndarray, Dict[str, Any]]:
        """Begins an episode. `options` with ``v_out`` (V) gives the start in the place of a drawn one: ``i_l`` (A; that of the load
        unless given), ``load`` in its unit, and ``noise``, the seed of the sensors' noise; nothing is randomised then."""
        super().reset(seed=seed)
        if seed is not None:
            self._episodes.seed(0, seed & 0xFFFF_FFFF_FFFF_FFFF)
        options = dict(options or {})
        start = [options.pop(name, None) for name in ("v_out", "i_l", "load")]
        noise = options.pop("noise", 0)
        if options or (start[0] is None and any(one is not None for one in start)):
            raise ValueError("options are v_out, and beside it i_l, load and noise")
        self._episodes.begin(0, *start, noise)
        observation = np.empty((1, *self.observation_space.shape), np.float32)
        self._episodes.observe(observation)
        info = self._episodes.info(0)
        self._history = [(info["v_out"], info["duty"])]
        return observation[0], info

    def step(self, action: Any) -> Tuple[np.ndarray, float, bool, bool, Dict[str, Any]]:
        """One control period."""
        observation = np.empty((1, *self.observation_space.shape), np.float32)
        reward, truncated = np.empty(1), np.empty(1, bool)
        self._act(np.asarray(action), self._over, (observation, reward, truncated))
        info = self._episodes.info(0)
        if self.render_mode is not None:
            self._history.append((info["v_out"], info["duty"]))
        return observation[0], float(reward[0]), False, bool(truncated[0]), info

    def render(self) -> Optional[np.ndarray]:
        """Output voltage (above) and duty (below) of this episode, shape ``(240, 400, 3)``, ``uint8``."""
        return picture(self._history) if self.render_mode == "rgb_array" else None


class ConverterVectorEnv(_Spaces, gymnasium.vector.VectorEnv):
    """Many converters side by side; those that are plain enough are computed in the lanes of the vector unit. The arguments are
    those of :class:`ConverterEnv`.

    Converter `n`, seeded with `s + n`, lives the life of a single environment seeded with `s + n`, to the bit. An episode that is
    truncated is followed by the next one: in the step after (``next_step``), or at once (``same_step``), where the last observation
    stands in ``info["final_obs"]``. `info` has arrays of shape ``(num_envs,)``: ``v_out``, ``i_l``, ``i_out``, ``v_in``, ``duty``,
    ``load``; `states=False` leaves them out, which is faster.
    """

    metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        plant: Optional[PathLike] = None,
        contract: Optional[PathLike] = None,
        *,
        training: Optional[PathLike] = None,
        v_ref: Optional[float] = None,
        reward: Optional[Mapping[str, Any]] = None,
        episode: Optional[Mapping[str, Any]] = None,
        randomise: Sequence[Mapping[str, Any]] = (),
        set: Optional[Mapping[str, float]] = None,
        load_kind: str = "power",
        load_profile: Sequence[Tuple[int, float]] = (),
        autoreset_mode: Union[str, AutoresetMode] = AutoresetMode.NEXT_STEP,
        states: bool = True,
        render_mode: None = None,
    ) -> None:
        arguments = dict(
            plant=plant,
            contract=contract,
            training=training,
            v_ref=v_ref,
            reward=reward,
            episode=episode,
            randomise=randomise,
            set=set,
        )
        modes = {"next_step": AutoresetMode.NEXT_STEP, "same_step": AutoresetMode.SAME_STEP}
        mode = modes.get(autoreset_mode, autoreset_mode)
        if mode not in modes.values():
            raise ValueError(f"autoreset_mode is one of {', '.join(modes)}")
        self._open(num_envs, arguments, load_kind, load_profile)
        self.num_envs = num_envs
        self.metadata = {**self.metadata, "autoreset_mode": mode}
        self.render_mode = render_mode
        self.single_observation_space, self.single_action_space = self._observation, self._action
        self.observation_space = gymnasium.vector.utils.batch_space(self._observation, num_envs)
        self.action_space = gymnasium.vector.utils.batch_space(self._action, num_envs)
        self._at_once = mode is AutoresetMode.SAME_STEP
        self._with_states = states
        self._over = np.zeros(num_envs, bool)
        self._never = np.zeros(num_envs, bool)

    @property
    def is_batch(self) -> bool:
        """Whether the converters are computed in the lanes of the vector unit."""
        return self._episodes.is_batch()

    @property
    def states(self) -> np.ndarray:
        """True states, shape ``(6, num_envs)``, with the rows of :data:`STATES`."""
        into = np.empty((len(STATES), self.num_envs))
        self._episodes.states(into)
        return into

    def _infos(self) -> Dict[str, Any]:
        return dict(zip(STATES, self.states)) if self._with_states else {}

    def reset(
        self,
        *,
        seed: Optional[Union[int, Sequence[Optional[int]]]] = None,
        options: Optional[Mapping[str, Any]] = None,
    ) -> Tuple[np.ndarray, Dict[str, Any]]:
        """Begins an episode of every converter, or of those of ``options["reset_mask"]``. `seed` seeds converter `n` with
        ``seed + n``; or one for each."""
        options = dict(options or {})
        mask = options.pop("reset_mask", np.ones(self.num_envs, bool))
        start = [options.pop(name, None) for name in ("v_out", "i_l", "load")]
        noise = options.pop("noise", 0)
        if options:
            raise ValueError("options are reset_mask, v_out, i_l, load and noise")
        seeds: Sequence[Optional[int]] = [None] * self.num_envs
        if seed is not None and np.ndim(seed) == 0:
            super().reset(seed=seed)
            seeds = [seed + n for n in range(self.num_envs)]
        elif seed is not None:
            seeds = list(seed)
        for index in np.flatnonzero(mask):
            if seeds[index] is not None:
                self._episodes.seed(int(index), int(seeds[index]) & 0xFFFF_FFFF_FFFF_FFFF)
            self._episodes.begin(int(index), *start, noise)
        self._over[mask] = False
        observations = np.empty(self.observation_space.shape, np.float32)
        self._episodes.observe(observations)
        return observations, self._infos()

    def step(self, actions: Any) -> Tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, Dict[str, Any]]:
        """One control period of every converter."""
        observations = np.empty(self.observation_space.shape, np.float32)
        rewards, truncated = np.empty(self.num_envs), np.empty(self.num_envs, bool)
        self._act(np.asarray(actions), self._over, (observations, rewards, truncated))
        terminated = np.zeros(self.num_envs, bool)
        if not self._at_once:
            self._over = truncated.copy()
            return observations, rewards, terminated, truncated, self._infos()
        infos = self._infos()
        ended = np.flatnonzero(truncated)
        if len(ended):
            infos["final_obs"], infos["_final_obs"] = observations.copy(), truncated.copy()
            for index in ended:
                self._episodes.begin(int(index), None, None, None, 0)
            self._episodes.observe(observations)
        return observations, rewards, terminated, truncated, infos

