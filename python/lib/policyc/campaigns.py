"""Campaigns: many trainings, simulations, verifications, ... as one, on the cores of this machine or on a cluster of Ray."""

import json
import os
import sys
import time
from dataclasses import dataclass, field
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple, Union

from . import _toml
from ._policyc import NativeCampaign
from .policy import PathLike
from .results import framed


@dataclass(frozen=True)
class Campaign:
    """What a campaign came to."""

    #: Content of ``results.json``.
    results: Dict[str, Any] = field(repr=False)
    #: Folder of the results.
    out: str
    #: Everything is done, and no answer is no: every verification is equal, every training file has a seed that meets its specification.
    holds: bool
    #: The page, of one piece.
    html: str = field(repr=False)
    summary: str = field(repr=False)
    #: Tasks that ran now; the others had been done before.
    ran: int

    def __bool__(self) -> bool:
        return self.holds

    def __str__(self) -> str:
        return self.summary

    def _repr_html_(self) -> str:
        return framed(self.html)

    @property
    def rows(self) -> List[Dict[str, Any]]:
        """A flat row for each task, for a frame: ``pandas.DataFrame(campaign.rows)``."""
        keep = ("kind", "id", "state", "exit", "reason")
        tasks = self.results["tasks"]
        return [{**task["axes"], **task["figures"], **{key: task[key] for key in keep if key in task}} for task in tasks]

    @property
    def best(self) -> Dict[str, str]:
        """The folder of the best policy of each training file, for :meth:`Policy.load`."""
        return {best["axes"]["settings"]: os.path.join(self.out, "tasks", best["id"]) for best in self.results["best"]}

    @property
    def failed(self) -> Dict[str, str]:
        """Why the tasks without a result have none, by name."""
        return {task["id"]: task["reason"] for task in self.results["tasks"] if task["state"] == "failed"}


def campaign(
    plan: Union[PathLike, Mapping[str, Any]],
    out: PathLike,
    *,
    engine: str = "local",
    address: Optional[str] = None,
    jobs: int = 0,
    retries: int = 5,
    progress: Optional[bool] = None,
    overwrite: bool = False,
) -> Campaign:
    """Runs the tasks of a plan that `out` has no result of, and merges all results there, as ``policyc campaign``.

    `plan` is a file, or its entries: ``{"train": [{"settings": "train.toml", "seeds": [0, 1, 2]}]}`` with paths from the working folder
    (docs/reference/plan-file.md). `engine` is ``local``, with `jobs` processes (0: one a core), or ``ray`` (``pip install 'policyc[ray]'``), on the
    cluster at `address`; without an address on the one that Ray finds, or on one that is started on this machine. A cluster needs no shared
    folder: inputs and results travel with the tasks. A task that is lost with its machine runs again, up to `retries` times. `progress`
    writes a line on standard error; by default where that is a terminal. `overwrite`: results in `out` that were edited are replaced.

    Raises :class:`Faults` if the plan or a file that it names is not as it should be; a task that fails is a result (`Campaign.failed`).
    """
    if engine not in ("local", "ray"):
        raise ValueError(f"an engine is 'local' or 'ray', and not {engine!r}")
    if address is not None and engine != "ray":
        raise ValueError("an address is of a cluster of Ray: engine='ray'")
    if isinstance(plan, Mapping):
        file, text = "plan.toml", _toml.document(plan)
    else:
        file, text = os.fspath(plan), None
    native = NativeCampaign(file, text, os.fspath(out), overwrite)
    pending = native.pending()
    tell = _Teller(native.count(), len(pending), sys.stderr.isatty() if progress is None else progress)
    try:
        if pending and engine == "ray":
            from . import _ray

            # before anything is written: it may not be there
            with _ray.Cluster(address) as cluster:
                native.begin()
                _ray.run(native, pending, cluster, retries, tell)
        else:
            native.begin()
            if pending:
                native.run(jobs, worker_program(), tell)
    finally:
        tell.clear()
    holds, results, html, summary = native.finish()
    return Campaign(json.loads(results), os.fspath(out), holds, html, summary, len(pending))


def worker_program() -> List[str]:
    """How a process is started that does as this package does, from where this process has it."""
    code = f"import sys; sys.path[:] = {sys.path!r}; from policyc.__main__ import main; sys.exit(main())"
    return [sys.executable, "-c", code]


class _Teller:
    """A line that says how far a campaign is."""

    def __init__(self, count: int, pending: int, is_shown: bool) -> None:
        self.count, self.pending, self.is_shown = count, pending, is_shown
        self.ended = self.failed = 0
        self.begun, self.last = time.monotonic(), 0.0

    def __call__(self, title: str, reason: Optional[str]) -> None:
        self.ended += 1
        self.failed += reason is not None
        now = time.monotonic()
        # an eye sees no more
        if not self.is_shown or now - self.last < 0.1:
            return
        self.last = now
        left = (now - self.begun) / self.ended * (self.pending - self.ended)
        done = self.count - self.pending + self.ended - self.failed
        failed = f", {self.failed} failed" if self.failed else ""
        sys.stderr.write(f"\r\x1b[K{done} of {self.count} tasks done{failed}, {left:.0f} s left: {title}")
        sys.stderr.flush()

    def clear(self) -> None:
        if self.is_shown and self.ended:
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()


def from_command(asked: Tuple[PathLike, PathLike, Optional[str], List[bool]]) -> int:
    """``policyc campaign --engine ray``: its exit code, as the program would end."""
    from ._policyc import Faults

    plan, out, address, (force, as_json, quiet) = asked
    # paths of pathlib, which JSON has no form for
    plan, out = os.fspath(plan), os.fspath(out)
    show: Callable[[str], None] = lambda text: print(text, file=sys.stderr)  # noqa: E731
    try:
        found = campaign(plan, out, engine="ray", address=address, overwrite=force, progress=False if quiet else None)
    except Faults as faults:
        show(str(faults))
        return 2
    except ImportError as error:
        show(f"error: {error}")
        return 2
    except ConnectionError as error:
        show(f"error: no cluster of Ray: {error}")
        return 2
    except KeyboardInterrupt:
        show("\nInterrupted. To go on, type the same again")
        return 130
    print(json.dumps({"out": out, "ran": found.ran, **found.results}, indent=2) if as_json else found.summary)
    return 0 if found.holds else 1
