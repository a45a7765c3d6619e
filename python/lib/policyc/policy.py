"""A policy: its contract and its network, checked, and what is made of them."""

import json
import os
from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

from ._policyc import NativePolicy

PathLike = Union[str, "os.PathLike[str]"]


@dataclass(frozen=True)
class Signal:
    """A measured quantity."""

    name: str
    unit: str
    #: Smallest and largest plausible value, in `unit`; a sample outside is held.
    range: Tuple[float, float]
    #: Gain (unit per code) and offset (unit) of a converter; None where the value arrives in its unit.
    adc: Optional[Tuple[float, float]] = None


@dataclass(frozen=True)
class Feature:
    """One input of the network: ``clip(scale * filters(source) + offset)``."""

    name: str
    #: The expression as the contract has it, such as ``v_ref - v_out``.
    source: str
    scale: float
    offset: float
    #: Ends of the observation, without a unit; None where it is not clipped.
    clip: Optional[Tuple[float, float]]


@dataclass(frozen=True)
class Layer:
    """A dense layer."""

    name: str
    inputs: int
    outputs: int
    #: Name of the activation behind it; a leaky ReLU has its slope beside it in `Inspection.json`.
    activation: str


@dataclass(frozen=True)
class Inspection:
    """What a policy means."""

    name: str
    #: Control period, s.
    sample_period: float
    #: ``f32``, ``f32-fma``, ``f64``, ``i16`` or ``i8``.
    numeric_format: str
    signals: List[Signal]
    features: List[Feature]
    layers: List[Layer]
    #: Duty of each action before the mapping, 0..1; empty for a continuous policy, and for one that adds to a law.
    duties: List[float]
    #: What each action adds to the duty of the contract's law, -1..1; empty without a law.
    offsets: List[float]
    #: Smallest and largest commanded duty, 0..1.
    duty_limits: Tuple[float, float]
    #: How many known answers of the trainer there are.
    golden_vectors: int
    #: SHA-256 of weights, contract and mapping, hexadecimal.
    digests: Mapping[str, str]
    notes: List[str]
    #: Everything that ``policyc inspect --json`` prints.
    json: Dict[str, Any] = field(repr=False)
    text: str = field(repr=False)

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Verification:
    """What a comparison of the generated code with the interpreter found."""

    #: Every build gives the interpreter's bits, and the network the trainer's answers.
    equal: bool
    #: One entry for each build: ``build``, ``compiler``, ``steps_compared``, ``outcome``.
    builds: List[Dict[str, Any]]
    #: CRC-32 over everything that was expected.
    checksum: Optional[str]
    #: Everything that ``policyc verify --json`` prints.
    json: Dict[str, Any] = field(repr=False)
    text: str = field(repr=False)

    def __bool__(self) -> bool:
        return self.equal

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Certificate:
    """Sound bounds of what a numeric format does to the outputs of the network."""

    #: Content of ``certificate.json``.
    json: Dict[str, Any] = field(repr=False)
    #: The page, of one piece.
    html: str = field(repr=False)
    #: Where actions are proven, as SVG; None where there is no map.
    svg: Optional[str] = field(repr=False)
    summary: str = ""

    def __str__(self) -> str:
        return self.summary

    def _repr_html_(self) -> str:
        from .results import framed

        return framed(self.html)


def _pair(interval: Optional[Mapping[str, float]]) -> Optional[Tuple[float, float]]:
    return None if interval is None else (interval["low"], interval["high"])


def _activation(value: Any) -> str:
    return value if isinstance(value, str) else next(iter(value))


class Policy:
    """A checked policy. Made by :meth:`load`."""

    def __init__(self, native: NativePolicy, path: PathLike) -> None:
        self._native = native
        #: Where it was read from.
        self.path = os.fspath(path)

    @classmethod
    def load(cls, path: PathLike, *, format: Optional[str] = None, allow_outside: bool = False) -> "Policy":
        """Reads and checks ``policy.toml`` (or the folder that holds it) and the files that it names.

        `format` is a numeric format in the place of the contract's. Files outside of the contract's folder are refused unread
        unless `allow_outside`. Raises :class:`Faults` with everything that is wrong.
        """
        return cls(NativePolicy.load(os.fspath(path), allow_outside, format), path)

    @property
    def name(self) -> str:
        """Name in files and symbols."""
        return self._native.name()

    @property
    def numeric_format(self) -> str:
        """``f32``, ``f32-fma``, ``f64``, ``i16`` or ``i8``."""
        return self._native.numeric_format()

    def __repr__(self) -> str:
        return f"<policyc.Policy {self.name} in {self.numeric_format} from {self.path!r}>"

    def with_format(self, format: str) -> "Policy":
        """The same policy in another numeric format."""
        return Policy(self._native.with_format(format), self.path)

    def _in(self, format: Optional[str]) -> NativePolicy:
        return self._native if format is None else self._native.with_format(format)

    def inspect(self) -> Inspection:
        """Signals, features, network, actions, limits and digests."""
        data = json.loads(self._native.inspect_json())
        duties = [action["duty"] for action in data["actions"] if "duty" in action]
        adc = lambda adc: None if adc is None else (adc["gain"], adc["offset"])  # noqa: E731
        return Inspection(
            name=data["name"],
            sample_period=data["sample_period"],
            numeric_format=data["numeric_format"],
            signals=[Signal(s["name"], s["unit"], _pair(s["range"]), adc(s["adc"])) for s in data["signals"]],
            features=[
                Feature(f["name"], f["source_text"], f["scale"], f["offset"], _pair(f["clip"]))
                for f in data["features"]
            ],
            layers=[
                Layer(la["name"], la["inputs"], la["outputs"], _activation(la["activation"])) for la in data["layers"]
            ],
            duties=[] if "residual" in data else duties,
            offsets=duties if "residual" in data else [],
            duty_limits=_pair(data["limits"]["duty"]),
            golden_vectors=data["golden_vectors"],
            digests=data["digests"],
            notes=data["notes"],
            json=data,
            text=self._native.inspect_text(),
        )

    def compile(
        self,
        target: str = "host",
        emit: Union[str, Sequence[str]] = "c",
        format: Optional[str] = None,
        *,
        kit_steps: Optional[int] = None,
        costs: bool = True,
        clock: Optional[str] = None,
        golden_decisions: Optional[float] = None,
    ) -> Dict[str, bytes]:
        """The generated files, name to bytes: those that ``policyc compile`` writes with the same options.

        `emit` names outputs (``c``, ``rust``, ``simulink``, ...), one or several; the cores that one calls come along. `costs`
        builds and runs the code under the target's emulator where there is one, for the figures in ``manifest.json``. `clock` is
        the processor's, such as ``168MHz``. `golden_decisions` is the share of the trainer's decisions, 0 to 1, that the format
        may change. Raises :class:`Faults`, also if the network does not give the trainer's golden answers.
        """
        names = emit.split(",") if isinstance(emit, str) else list(emit)
        native = self._in(format)
        return native.compile(target, [name.strip() for name in names], kit_steps, costs, clock, golden_decisions)

    def verify(
        self,
        target: Optional[str] = None,
        *,
        format: Optional[str] = None,
        steps: int = 20_000,
        seed: int = 1,
        generated: Optional[PathLike] = None,
        traces: Sequence[PathLike] = (),
        map: Optional[Mapping[str, str]] = None,
        golden_decisions: Optional[float] = None,
    ) -> Verification:
        """Builds the generated code with every compiler at hand and compares `steps` control steps with the interpreter, bit by
        bit.

        `generated` is a folder of code to verify in the place of code made anew, in that code's format unless `format`. `traces`
        are CSV files of measurements to replay first; `map` says which column of theirs a signal is: ``{"v_out": "CH1"}``. Raises
        :class:`Faults` if nothing could be compared; a difference is a result, not an error.
        """
        generated = None if generated is None else os.fspath(generated)
        paths = [os.fspath(path) for path in traces]
        columns = ",".join(f"{signal}={column}" for signal, column in (map or {}).items())
        native = self._in(format)
        equal, report, text = native.verify(target, steps, seed, generated, format is None, paths, columns, golden_decisions)
        data = json.loads(report)
        found = data["report"] or {}
        return Verification(equal, found.get("builds", []), found.get("checksum"), data, text)

    def certify(
        self,
        *,
        format: Optional[str] = None,
        axis: Sequence[str] = (),
        at: Sequence[str] = (),
        samples: int = 1000,
        boxes: int = 2000,
        seed: int = 1,
    ) -> Certificate:
        """Bounds what the numeric format does to the outputs, and maps where it can change an action.

        `axis` are two of ``NAME`` or ``NAME=LOW:HIGH``, `at` values of other coordinates, ``NAME=VALUE``. `samples` states are
        drawn, and the states split into `boxes`.
        """
        files, summary = self._in(format).certify(list(axis), list(at), samples, boxes, seed)
        return Certificate(
            json=json.loads(files["certificate.json"]),
            html=files["certificate.html"],
            svg=files.get("map.svg"),
            summary=summary,
        )
