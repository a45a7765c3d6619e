"""The engine of Ray: a task of Ray for each task of a campaign, with its inputs and results as bytes."""

import os
from typing import Any, Callable, Dict, List, Optional

from ._policyc import BUILD, NativeCampaign

#: Tasks that a cluster holds at a time. More than any cluster here works on; each costs the driver some kilobytes.
IN_FLIGHT = 2000


def perform(build: str, kind: str, arguments: List[str], paths: List[str], *contents: bytes) -> Any:
    """Runs where Ray wants it to: exit code, files, reason."""
    from policyc import _policyc

    # a node may have a package that knows of no builds
    own = getattr(_policyc, "BUILD", _policyc.__version__)
    if own != build:
        # other results under the same name
        return 2, {}, f"the node has policyc {own}, and the campaign is of {build}: install the same on all nodes"
    return _policyc.perform(kind, arguments, dict(zip(paths, contents)))


class Cluster:
    """A connection to a cluster; one that was there before stays when it is left."""

    def __init__(self, address: Optional[str]) -> None:
        """Connects, or starts a cluster. Raises ImportError without Ray, and ConnectionError whatever Ray says."""
        try:
            import ray
        except ImportError:
            raise ImportError("the engine needs Ray: pip install 'policyc[ray]'") from None
        # Ray says on its way what will be another default once
        os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
        self.ray: Any = ray
        self.is_ours = not ray.is_initialized()
        if self.is_ours:
            try:
                ray.init(address=address, log_to_driver=False, logging_level="error", configure_logging=True)
            except Exception as error:
                # of many classes: an address that is none, another version, nobody there
                raise ConnectionError(_line(error)) from error

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, *_: Any) -> None:
        if self.is_ours:
            self.ray.shutdown()


def _line(error: BaseException) -> str:
    """The last line of what it says, or its name."""
    return (str(error).strip().splitlines() or [type(error).__name__])[-1]


def run(
    native: NativeCampaign,
    pending: List[int],
    cluster: Cluster,
    retries: int,
    tell: Callable[[str, Optional[str]], None],
) -> None:
    """Runs the tasks `pending`; the campaign's folder holds what came of them."""
    ray = cluster.ray
    running: Dict[Any, int] = {}
    try:
        remote = ray.remote(max_retries=retries, num_cpus=1)(perform)
        contents: Dict[str, Any] = {}
        waiting = list(reversed(pending))
        while waiting or running:
            while waiting and len(running) < IN_FLIGHT:
                index = waiting.pop()
                kind, arguments, digests = native.shipped(index)
                for path, digest in digests.items():
                    if digest not in contents:
                        # once for all tasks that read it
                        contents[digest] = ray.put(native.content(index, path))
                refs = [contents[digest] for digest in digests.values()]
                running[remote.remote(BUILD, kind, arguments, list(digests), *refs)] = index
            ready, _ = ray.wait(list(running), num_returns=1, timeout=1.0)
            for ref in ready:
                index = running.pop(ref)
                reason = None
                try:
                    exit_code, files, reason = ray.get(ref)
                except ray.exceptions.RayError as error:
                    # of a task that broke, or whose machines were lost again and again
                    exit_code, files, reason = 2, {}, _line(error)
                if reason is None and exit_code in (0, 1):
                    native.store(index, exit_code, files)
                else:
                    reason = reason or f"exit code {exit_code}"
                    native.fail(index, reason)
                tell(native.title(index), reason)
    finally:
        for ref in running:
            ray.cancel(ref, force=True)
