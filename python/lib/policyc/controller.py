"""The reference interpreter of a policy, step by step or over a table of measurements."""

from enum import IntFlag
from typing import Any, List, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np

from ._policyc import Command
from ._policyc import Controller as _Native
from .policy import PathLike, Policy


class Status(IntFlag):
    """Bits of :attr:`Command.status`, as in the generated header and ``docs/reference/numeric-contract.md``."""
    HELD = 1 << 0
    FALLBACK = 1 << 1
    PRIMED = 1 << 2
    CLIPPED = 1 << 3
    MAPPING_RANGE = 1 << 4
    SLEW_LIMITED = 1 << 5
    SOFT_START = 1 << 6
    LIMITED = 1 << 7
    STATE = 1 << 8


class Steps(NamedTuple):
    """What a controller did in `n` control periods."""

    #: Duty to apply, 0..1; shape ``(n,)``.
    duty: np.ndarray
    #: Duty before the mapping, 0..1; shape ``(n,)``.
    duty_sim: np.ndarray
    #: Index of the chosen action; shape ``(n,)``, ``uint32``.
    action_index: np.ndarray
    #: Bits of :class:`Status`; shape ``(n,)``, ``uint32``.
    status: np.ndarray
    #: What the network saw; shape ``(n, features)``.
    observation: np.ndarray
    #: What the network said: Q values, or the one output of a continuous policy; shape ``(n, outputs)``.
    outputs: np.ndarray


class Controller:
    """A policy at work, with the bits of the generated code. One object is one controller with its own state."""

    def __init__(self, policy: Union[Policy, PathLike], format: Optional[str] = None, *, output: Optional[str] = None) -> None:
        """The controller of a policy (or of the one at a path) as switched on, in the policy's numeric format or another.

        Of a policy with several outputs `output` names the one whose commands :meth:`step` and :meth:`step_batch` return;
        :attr:`commands` has all of the last step.
        """
        if not isinstance(policy, Policy):
            policy = Policy.load(policy)
        self.policy = policy if format is None else policy.with_format(format)
        self._native = _Native(self.policy._native, output)
        #: One control step: the numbers of a measurement in the order of :attr:`signals`, or by name, in the signals' units (ADC
        #: signals: codes). Returns a :class:`Command`.
        self.step = self._native.step

    @property
    def signals(self) -> List[str]:
        """Names of the measured signals, in order."""
        return self._native.signals()

    def reset(self) -> None:
        """As switched on, except that mapping coefficients set at run time are kept."""
        self._native.reset()

    def step(self, measurement: Union[Sequence[float], Mapping[str, float], np.ndarray]) -> Command:  # noqa: F811
        """One control step."""
        return self._native.step(measurement)

    def step_batch(self, measurements: Any) -> Steps:
        """Control steps one after the other, a row each.

        `measurements` has the shape ``(n, signals)`` with columns in the order of :attr:`signals`, or is a data frame with columns
        of their names. An array of ``float64`` is read where it lies.
        """
        if hasattr(measurements, "columns"):
            measurements = np.column_stack([measurements[name] for name in self.signals])
        return Steps(*self._native.step_batch(np.asarray(measurements, dtype=np.float64)))

    @property
    def commands(self) -> List[Command]:
        """The command of each output in the last step, in the order of the contract."""
        return self._native.commands()

    @property
    def observation(self) -> np.ndarray:
        """What the network saw in the last step; shape ``(features,)``."""
        return self._native.observation()

    @property
    def outputs(self) -> np.ndarray:
        """What the network said in the last step; shape ``(outputs,)``."""
        return self._native.outputs()

    @property
    def state_words(self) -> np.ndarray:
        """The state as words of 32 bits, in the order of the numeric contract."""
        return np.array(self._native.state_words(), dtype=np.uint32)

    def set_mapping(self, a: float, b: float, c: float, r: Optional[float] = None) -> bool:
        """Replaces the coefficients of the duty ratio mapping (`b` and `r` per ampere). False and no change where the contract does
        not allow them."""
        return self._native.set_mapping(a, b, c, r)
