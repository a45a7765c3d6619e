"""The engine of Ray: a task of Ray for each task of a campaign, with its inputs and results as bytes."""

import os
from typing import Any, Callable, Dict, List, Optional

from . import __version__
from ._policyc import NativeCampaign

#: Tasks that a cluster holds at a time. More than any cluster here works on; each costs the driver some kilobytes.
IN_FLIGHT = 2000


def perform(version: str, kind: str, arguments: List[str], paths: List[str], *contents: bytes) -> Any:
    """Runs where Ray wants it to: exit code, files, reason."""
    import policyc
    from policyc import _policyc

    if policyc.__version__ != version:
        # other results under the same name
        return 2, {}, f"the node has policyc {policyc.__version__}, and the campaign is of {version}: install the same on all nodes"
    return _policyc.perform(kind, arguments, dict(zip(paths, contents)))


def connect(ray: Any, address: Optional[str]) -> bool:
    """Connects to a cluster, or starts one; whether it is ours to end."""
    if ray.is_initialized():
        return False
    ray.init(address=address, log_to_driver=False, logging_level="error", configure_logging=True)
    return True


def run(
    native: NativeCampaign,
    pending: List[int],
    address: Optional[str],
    retries: int,
    tell: Callable[[str, Optional[str]], None],
) -> None:
    """Runs the tasks `pending`; the campaign's folder holds what came of them."""
    try:
        import ray
    except ImportError:
        raise ImportError("the engine needs Ray: pip install 'policyc[ray]'") from None
    # Ray says on its way what will be another default once
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    is_ours = connect(ray, address)
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
                running[remote.remote(__version__, kind, arguments, list(digests), *refs)] = index
            ready, _ = ray.wait(list(running), num_returns=1, timeout=1.0)
            for ref in ready:
                index = running.pop(ref)
                reason = None
                try:
                    exit_code, files, reason = ray.get(ref)
                except ray.exceptions.RayError as error:
                    # of a task that broke, or whose machines were lost again and again
                    exit_code, files, reason = 2, {}, str(error).strip().splitlines()[-1]
                if reason is None and exit_code in (0, 1):
                    native.store(index, exit_code, files)
                else:
                    reason = reason or f"exit code {exit_code}"
                    native.fail(index, reason)
                tell(native.title(index), reason)
    finally:
        for ref in running:
            ray.cancel(ref, force=True)
        if is_ours:
            ray.shutdown()
