"""Where the cells of a sweep run: joblib on this machine, or on the workers of a dask scheduler."""

import asyncio
import logging
from collections.abc import Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from typing import TYPE_CHECKING

from joblib import Parallel, effective_n_jobs, parallel_config

from .command import ConfigError
from .config import Execution
from .tables import package_versions

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["executor"]

PATIENCE = 10  # seconds for the scheduler to answer, and for its first worker to be there


@contextmanager
def executor(execution: Execution, tasks: int) -> Iterator[Parallel]:
    """Open the backend of the settings: a joblib ``Parallel`` that generates results in order.

    No more processes are started than there are tasks: each takes a second to begin.

    It is a `ConfigError` where dask is not installed, no scheduler with a worker answers, a worker
    has other packages than this process, or the cluster is lost in the middle.
    """
    if execution.backend != "dask":
        n_jobs = max(1, min(effective_n_jobs(execution.n_jobs), tasks))
        yield Parallel(n_jobs=n_jobs, backend=execution.backend, return_as="generator")
        return
    address = str(execution.dask_address)
    with _connect(address) as client, parallel_config("dask", client=client):
        from distributed import KilledWorker

        _check_workers(client, address)
        try:
            yield Parallel(return_as="generator")
        except (CancelledError, KilledWorker) as error:
            reason = " ".join(str(error).split())
            raise ConfigError(
                f"setting 'dask_address': lost the cluster at {address} ({reason})"
            ) from None


def _connect(address: str) -> "Client":
    try:
        from distributed import Client
    except ImportError:
        raise ConfigError(
            "setting 'backend': dask is not installed; pip install -e '.[cluster]'"
        ) from None
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # no tracebacks: see above
    try:
        asyncio.run(_ask(address))
        return Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, TypeError, ValueError) as error:
        reason = str(error) or f"nobody answers within {PATIENCE} s"
        raise ConfigError(
            f"setting 'dask_address': no dask scheduler at {address} ({reason})"
        ) from None


async def _ask(address: str) -> None:
    """Make sure that a scheduler answers: a client waits for ever for a listener that is none."""
    from distributed import rpc

    async with asyncio.timeout(PATIENCE), rpc(address) as scheduler:
        await scheduler.identity()


def _check_workers(client: "Client", address: str) -> None:
    """Make sure that there are workers, and that the provenance holds for what they compute."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError:
        raise ConfigError(
            f"setting 'dask_address': the scheduler at {address} has no workers after {PATIENCE} s"
        ) from None
    try:
        workers = client.run(package_versions)
    except Exception as error:  # dask does not say which: whatever a worker raised
        raise ConfigError(
            f"setting 'dask_address': a worker cannot import this project ({error})"
        ) from None
    ours = package_versions()
    for worker, theirs in workers.items():
        for name in ours:
            if theirs[name] != ours[name]:
                raise ConfigError(
                    f"setting 'dask_address': worker {worker} has {name} {theirs[name]}, this "
                    f"process {ours[name]}; give both the same environment"
                )
