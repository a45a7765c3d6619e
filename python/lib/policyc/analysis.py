"""Simulation, mapping and diagnosis on arrays and frames: the commands' own results, without files to look after."""

import csv
import io
import json
import os
import tempfile
from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _toml
from ._policyc import files as _files
from .policy import PathLike, Policy
from .results import framed

#: A table: a frame of pandas or polars, columns by name, or the path of a file.
Table = Union[PathLike, Mapping[str, Any], Any]


def _columns(table: Any) -> Dict[str, np.ndarray]:
    """Columns by name of a frame or a mapping."""
    if isinstance(table, Mapping):
        found = {str(name): np.asarray(values) for name, values in table.items()}
    elif hasattr(table, "columns"):
        found = {str(name): np.asarray(table[name]) for name in table.columns}
    elif getattr(getattr(table, "dtype", None), "names", None):
        found = {name: np.asarray(table[name]) for name in table.dtype.names}
    else:
        raise TypeError(f"a table is a frame, columns by name, a structured array or a path, and no {type(table).__name__}")
    if len({len(values) for values in found.values()}) > 1:
        raise ValueError("columns of one length make a table")
    return found


def _as_file(table: Table, folder: str, name: str) -> str:
    """The path of a table; one in memory is written so that every number survives the round trip."""
    if isinstance(table, (str, os.PathLike)):
        return os.path.abspath(table)
    columns = _columns(table)
    path = os.path.join(folder, f"{name}.csv")
    # `repr` of a float survives the round trip, and what was not measured is an empty cell
    cell = lambda value: "" if value is None or value != value else repr(value) if isinstance(value, float) else value  # noqa: E731
    with open(path, "w", encoding="utf-8", newline="") as write:
        table = csv.writer(write, lineterminator="\n")
        table.writerow(columns)
        table.writerows(map(cell, row) for row in zip(*(values.tolist() for values in columns.values())))
    return path


def _option(name: str, value: Any) -> List[str]:
    return [] if value is None else [f"--{name}", str(value)]


@dataclass(frozen=True)
class _Page:
    """What has a page."""

    #: Every file that the command would write: name to text.
    files: Dict[str, str] = field(repr=False)
    #: The page, of one piece.
    html: str = field(repr=False)

    def _repr_html_(self) -> str:
        return framed(self.html)


@dataclass(frozen=True)
class Simulation(_Page):
    """Load steps of a policy, of classical controllers and of the physical limit."""

    #: Content of ``metrics.json``: V and s.
    metrics: Dict[str, Any] = field(repr=False)
    #: By load step and controller, such as ``("200-500W", "policy")``: columns by name, as ``t_s``, ``v_out_V``, ``duty``.
    trajectories: Dict[Tuple[str, str], Dict[str, np.ndarray]] = field(repr=False)
    summary: str

    def __str__(self) -> str:
        return self.summary


def _trajectory(text: str) -> Dict[str, np.ndarray]:
    names = text.split("\n", 1)[0].split(",")
    table = np.genfromtxt(io.StringIO(text), delimiter=",", skip_header=1, ndmin=2)
    return dict(zip(names, table.T.copy()))


def simulate(
    policy: Union[Policy, PathLike],
    plant: Optional[PathLike] = None,
    scenario: Union[PathLike, Mapping[str, Any], None] = None,
    *,
    format: Optional[str] = None,
    controller: str = "interpreter",
) -> Simulation:
    """Closes the loop of a policy on a simulated converter, as ``policyc simulate``.

    `scenario` is a file, or its entries: ``{"load_steps": [[200, 500]], "instants": 24, "baselines": ["pid"], "limit": False}`` with loads
    in W (docs/reference/scenario-file.md). `plant` takes the place of the scenario's. `controller` is ``interpreter``, ``c`` or ``rust``.
    """
    with tempfile.TemporaryDirectory(prefix="policyc-simulate-") as folder:
        if scenario is None or isinstance(scenario, Mapping):
            entries, file = dict(scenario or {}), os.path.join(folder, "scenario.toml")
            if plant is None and "plant" in entries:
                plant = entries["plant"]
            with open(file, "w", encoding="utf-8") as write:
                write.write(_toml.document({**entries, "plant": None}))
        else:
            file = os.fspath(scenario)
        path, own = (policy.path, policy.numeric_format) if isinstance(policy, Policy) else (os.fspath(policy), None)
        line = ["simulate", file, "--policy", path, "--out", os.path.join(folder, "out"), "--controller", controller]
        line += _option("format", format or own) + _option("plant", plant and os.path.abspath(plant))
        files = _files(line)
    tables = {}
    for name, text in files.items():
        if name.endswith(".csv") and name != "metrics.csv":
            # a load step is two numbers and a unit, and a controller may have a hyphen in its name: `200-500W-feed-forward.csv`
            before, after, controller_name = name[:-4].split("-", 2)
            tables[(f"{before}-{after}", controller_name)] = _trajectory(text)
    return Simulation(
        files=files,
        html=files["report.html"],
        metrics=json.loads(files["metrics.json"]),
        trajectories=tables,
        summary=files["summary.txt"],
    )


@dataclass(frozen=True)
class MappingFit(_Page):
    """A duty ratio mapping ``d_real = a d_sim + b i_out + c (+ r i_out d_sim)``, and how far it can be trusted."""

    #: Text of ``drm.toml``.
    toml: str = field(repr=False)
    #: The report as data.
    report: Dict[str, Any] = field(repr=False)
    text: str

    def __str__(self) -> str:
        return self.text

    def save(self, path: PathLike) -> None:
        """Writes ``drm.toml``."""
        with open(path, "w", encoding="utf-8", newline="\n") as write:
            write.write(self.toml)


def drm_fit(
    table: Table,
    *,
    plant: Optional[PathLike] = None,
    v_in: Optional[float] = None,
    terms: str = "auto",
    components: Optional[int] = None,
    options: Sequence[str] = (),
) -> MappingFit:
    """Fits a duty ratio mapping to settled points, as ``policyc drm fit``.

    `table` has the columns ``duty`` (or ``d_real``, 0..1), ``v_out`` (V), ``i_out`` (A) and ``v_in`` (V), a row each point. `plant` is the
    converter, for its boundary of discontinuous conduction. `terms` is ``auto``, ``three`` or ``four``. `options` are more of the command's,
    as they are typed.
    """
    with tempfile.TemporaryDirectory(prefix="policyc-drm-") as folder:
        if v_in is not None and not isinstance(table, (str, os.PathLike)):
            columns = _columns(table)
            columns.setdefault("v_in", np.full(len(next(iter(columns.values()))), float(v_in)))
            table = columns
        line = ["drm", "fit", _as_file(table, folder, "table"), "--terms", terms, *options]
        line += _option("components", components) + _option("plant", plant and os.path.abspath(plant))
        files = _files(line)
    return MappingFit(
        files=files,
        html=files["report.html"],
        toml=files["drm.toml"],
        report=json.loads(files["report.json"]),
        text=files["report.txt"],
    )


@dataclass(frozen=True)
class Diagnosis(_Page):
    """What a simulation gets wrong about measured records."""

    #: One word, such as ``explained``.
    verdict: str
    sentence: str
    #: Everything that was found: content of ``diagnosis.json``.
    findings: Dict[str, Any] = field(repr=False)
    #: Text of the better plant file.
    plant: str = field(repr=False)
    #: Text of the refitted mapping; None without a policy.
    mapping: Optional[str] = field(repr=False)

    def __str__(self) -> str:
        return f"{self.verdict}: {self.sentence}"


def diagnose(
    model: PathLike,
    train: Union[Table, Sequence[Table]],
    heldout: Union[Table, Sequence[Table]] = (),
    *,
    settled: bool = False,
    policy: Union[Policy, PathLike, None] = None,
    options: Sequence[str] = (),
) -> Diagnosis:
    """Compares the plant file `model` with measured records and names what it gets wrong, as ``policyc diagnose``.

    A record is a table with the columns ``t`` (s), ``duty`` (0..1), ``v_out``, ``v_in`` (V), ``i_l``, ``i_out`` (A), ``r_load`` (ohm),
    ``i_load`` (A), ``p_load`` (W), as far as there are any. `heldout` records only judge the extended model. `settled`: each row is a
    settled point. `options` are more of the command's, as they are typed.
    """
    with tempfile.TemporaryDirectory(prefix="policyc-diagnose-") as folder:
        named = lambda tables, name: [  # noqa: E731
            _as_file(table, folder, f"{name}_{index}") for index, table in enumerate(_several(tables))
        ]
        line = ["diagnose", "--model", os.path.abspath(model), "--out", os.path.join(folder, "out")]
        line += ["--train", *named(train, "train")]
        judged = named(heldout, "heldout")
        line += ["--heldout", *judged] if judged else []
        line += ["--settled"] if settled else []
        path = policy.path if isinstance(policy, Policy) else policy
        files = _files(line + _option("policy", path and os.path.abspath(path)) + list(options))
    found = json.loads(files["diagnosis.json"])
    return Diagnosis(
        files=files,
        html=files["report.html"],
        verdict=found["verdict"] if isinstance(found["verdict"], str) else next(iter(found["verdict"])),
        sentence=found["sentence"],
        findings=found,
        plant=files["plant.extended.toml"],
        mapping=files.get("drm.toml"),
    )


def _several(tables: Any) -> List[Any]:
    return list(tables) if isinstance(tables, (list, tuple)) else [tables]
