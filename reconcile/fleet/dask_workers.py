"""The workers of dask: local processes or a running cluster, and the run of one task in a worker.

Only this file imports dask and distributed. Local workers listen on loopback only.
"""

import contextlib
import logging
import os
import signal
import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from reconcile.errors import ReconcileError
from reconcile.fleet.limit import run_with_time_limit

STUCK_GRACE_S = 30.0
"""Time after its limit in which compiled code of a task may return; then its worker is killed."""
CONNECT_S = 60.0
"""Bounds every wait for an answer of scheduler or worker that costs them no work."""
BEGIN_S = 600.0
"""Bounds the first answer of a worker, which loads the package: 8 s of a processor, minutes of a busy one."""
SINGLE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
DASK_CONFIG = {
    "distributed.scheduler.worker-saturation": 1.0,  # no more tasks wait at a worker than it works on
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    # forking from a process that has imported the libraries starts a worker in a tenth of the time
    "distributed.worker.multiprocessing-method": "forkserver",
    "distributed.nanny.pre-spawn-environ": SINGLE_THREAD,
    # all memory of a worker is in use, so spilling cannot help: above the limit the worker is killed, and its
    # task repeated
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": 0.95,
}
INSTALL = "pip install 'servo-ctrl[fleet]'"


@contextlib.contextmanager
def client_of_local_workers(workers: int, memory: str) -> Iterator[tuple[Any, str]]:
    """Start single-threaded worker processes on this computer; yield a client and the scheduler's address."""
    dask, distributed = _libraries()
    with (
        tempfile.TemporaryDirectory(prefix="reconcile-workers-") as scratch,
        dask.config.set({**DASK_CONFIG, "temporary-directory": scratch}),
    ):
        cluster = distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=memory,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",  # distributed requires one; it has no routes
            scheduler_kwargs={"dashboard": False, "allowed_failures": 0},
            silence_logs=logging.CRITICAL,
        )
        with cluster, distributed.Client(cluster, timeout=CONNECT_S) as client:
            client.register_plugin(_worker_plugin(distributed))
            yield client, cluster.scheduler_address


@contextlib.contextmanager
def client_of_scheduler(address: str) -> Iterator[Any]:
    """Yield a client of a running cluster. Raises ReconcileError: no scheduler answers, or no worker."""
    _, distributed = _libraries()
    try:
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        remedy = "its address is like tcp://HOST:8786; `dask scheduler` prints it"
        raise ReconcileError(address, "", f"no scheduler answers: {error}", remedy) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=CONNECT_S)
        except TimeoutError:
            remedy = f"start some: dask worker {address} --nthreads 1"
            raise ReconcileError(address, "", "the scheduler has no worker", remedy) from None
        yield client


def _libraries() -> tuple[Any, Any]:
    try:
        import dask  # noqa: PLC0415  # an extra of the installation
        import distributed  # noqa: PLC0415  # as above
    except ImportError:
        raise ReconcileError("reconcile fleet", "", "dask is not installed", INSTALL) from None
    return dask, distributed


def _worker_plugin(distributed: Any) -> Any:
    """Return a plugin with which workers ignore Ctrl-C: the process that has the results ends them."""

    class IgnoreInterrupt(distributed.WorkerPlugin):  # type: ignore[misc]  # distributed has no types
        name = "ignore-interrupt"

        def setup(self, worker: Any) -> None:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            tempfile.tempdir = worker.local_directory  # removed with the cluster, however the worker ends

    return IgnoreInterrupt()


def run_in_worker(work: Callable[[Any], Any], limit_s: float, task: Any) -> Any:
    """Run `work(task)` in a worker, for at most `limit_s`. Raises TimeLimitError."""
    return run_with_time_limit(partial(work, task), limit_s, _kill_worker, STUCK_GRACE_S)


def _kill_worker() -> None:
    """Kill this process if a nanny restarts it; the scheduler repeats its task elsewhere."""
    from distributed import get_worker  # noqa: PLC0415  # on a worker, which has it

    with contextlib.suppress(ValueError):
        if get_worker().nanny:
            os.kill(os.getpid(), signal.SIGKILL)
