"""Run tasks on a dask cluster: each comes back once, with its result or the reason why there is none.

dask hands tasks to free workers. When one dies, it blames all tasks that the worker held; which of them
killed it shows when each is tried again alone. This file adds that, a bound on every wait and on every task,
few tasks in flight, reasons in words, and a local cluster that listens on loopback only.
"""

import contextlib
import logging
import os
import queue
import signal
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple

from reconcile.errors import ReconcileError
from reconcile.fleet.limit import TimeLimitError, run_with_time_limit

MOST_DEATHS = 3
"""Workers that die of one task before the attempts end."""
STUCK_GRACE_S = 30.0
"""Time beyond its limit in which compiled code of a task may return; then its worker is killed."""
CONNECT_S = 60.0
"""Bounds every wait for an answer of scheduler or worker."""
MAX_WITHOUT_WORKERS_S = 300.0
"""Workers of a shared cluster may be restarted or lent to others; after this time the cluster is lost."""
POLL_S = 5.0
MIN_IN_FLIGHT, IN_FLIGHT_PER_THREAD = 16, 3
"""Tasks submitted at a time: no worker idles, and little work is lost by Ctrl-C."""
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
    # what is in memory is in use, so spilling cannot help: above its limit a worker is killed, its task
    # repeated
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": 0.95,
}
INSTALL = "pip install 'servo-ctrl[fleet]'"


class TaskOutcome(NamedTuple):
    """A finished task: its `value`, or the kind of its failure and the reason."""

    task: Any
    value: Any
    failure: str = ""
    """Empty, `killed`, `over time` or `failed`."""
    reason: str = ""
    deaths: int = 0
    """Workers that died while they held it."""


class Cluster:
    """A connection to the workers of a dask scheduler."""

    def __init__(self, client: Any, address: str) -> None:
        self._client = client
        self.address = address
        self._in_flight = MIN_IN_FLIGHT
        self._polled_s = -POLL_S

    def threads(self) -> int:
        """Return how many tasks the cluster can work on at a time, now."""
        return sum(self._client.nthreads().values())

    def run_on_every_worker(self, function: Callable[[], Any]) -> dict[str, Any]:
        """Return the result of `function` by worker. Raises ReconcileError naming a worker that has none."""
        # Client.run would wait for ever where a worker cannot import the function
        sent = {
            worker: self._client.submit(function, workers=[worker], pure=False)
            for worker in self._client.nthreads()
        }
        results = {}
        for worker, future in sent.items():
            try:
                results[worker] = future.result(timeout=CONNECT_S)
            except Exception as error:  # whatever the worker raised, or could not import
                reason = f"worker {worker} cannot run it: {type(error).__name__}: {error}"
                remedy = "install the same version on the scheduler and on every worker"
                raise ReconcileError(self.address, "", reason, remedy) from error
        return results

    def run(self, work: Callable[[Any], Any], tasks: Iterable[Any], limit_s: float) -> Iterator[TaskOutcome]:
        """Yield the outcome of `work(task)` of each task as it ends. Raises ReconcileError: cluster lost."""
        job = partial(_in_worker, work, limit_s)
        suspects = []
        for ended in self._run_together(job, iter(tasks), limit_s):
            if ended.deaths:
                suspects.append(ended)
            else:
                yield ended
        for suspect in suspects:
            yield self._run_alone(job, suspect, limit_s)

    def _run_alone(self, job: Any, suspect: TaskOutcome, limit_s: float) -> TaskOutcome:
        """Try a task again that a dead worker held, while no other is there to be blamed or to blame."""
        while suspect.deaths < MOST_DEATHS:
            (ended,) = self._run_together(job, iter([suspect.task]), limit_s)
            if not ended.deaths:
                return ended
            suspect = _killed(ended.task, suspect.deaths + ended.deaths)
        return suspect

    def _run_together(self, job: Any, waiting: Iterator[Any], limit_s: float) -> Iterator[TaskOutcome]:
        finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
        in_flight: dict[Any, Any] = {}
        try:
            self._submit(job, waiting, in_flight, finished)
            while in_flight:
                future = self._next_finished(finished, limit_s)
                task, _ = in_flight[future.key]
                outcome = self._outcome(task, future)
                if outcome is None:
                    future.add_done_callback(finished.put)
                    continue
                del in_flight[future.key], future  # lets the worker release the result
                yield outcome
                self._submit(job, waiting, in_flight, finished)
        finally:
            with contextlib.suppress(Exception):
                self._client.cancel([future for _, future in in_flight.values()], force=True)

    def _submit(
        self, job: Any, waiting: Iterator[Any], in_flight: dict[Any, Any], finished: queue.SimpleQueue[Any]
    ) -> None:
        now_s = time.monotonic()
        if now_s - self._polled_s > POLL_S:  # workers come and go
            self._in_flight = max(MIN_IN_FLIGHT, IN_FLIGHT_PER_THREAD * self.threads())
            self._polled_s = now_s
        while len(in_flight) < self._in_flight:
            task = next(waiting, None)
            if task is None:
                return
            future = self._client.submit(job, task, pure=False)
            in_flight[future.key] = (task, future)
            future.add_done_callback(finished.put)

    def _next_finished(self, finished: queue.SimpleQueue[Any], limit_s: float) -> Any:
        """Return the next finished future. Raises ReconcileError: no connection, worker or progress."""
        start_s = alive_s = time.monotonic()
        longest_s = (limit_s + STUCK_GRACE_S) * (MOST_DEATHS + 1) + MAX_WITHOUT_WORKERS_S
        while True:
            with contextlib.suppress(queue.Empty):
                return finished.get(timeout=POLL_S)
            now_s = time.monotonic()
            if self._client.status != "running":
                raise self._lost("the connection to the scheduler is lost")
            if self.threads():
                alive_s = now_s
            elif now_s - alive_s > MAX_WITHOUT_WORKERS_S:
                raise self._lost(f"there has been no worker for {MAX_WITHOUT_WORKERS_S:g} s")
            if now_s - start_s > longest_s:
                raise self._lost(f"nothing has been done for {longest_s:g} s")

    def _outcome(self, task: Any, future: Any) -> TaskOutcome | None:
        """Return None if the result was lost with its worker: dask then repeats the task."""
        try:
            if future.status == "finished":
                return TaskOutcome(task, future.result(timeout=CONNECT_S))
            if future.status == "cancelled":
                raise self._lost("the scheduler has forgotten its tasks")
            if future.status != "error":
                return None
            error = future.exception(timeout=CONNECT_S)
        except TimeoutError:
            return None
        if isinstance(error, TimeLimitError):
            return TaskOutcome(task, None, "over time", str(error))
        if type(error).__name__ == "KilledWorker":
            return _killed(task, error.allowed_failures + 1)
        return TaskOutcome(task, None, "failed", f"{type(error).__name__}: {error}")

    def _lost(self, reason: str) -> ReconcileError:
        return ReconcileError(self.address, "", reason, "the same command goes on where this one stopped")


@contextlib.contextmanager
def local_cluster(workers: int, memory: str) -> Iterator[Cluster]:
    """Start single-threaded worker processes on this computer; `memory` bounds each, `auto` is its share."""
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
            dashboard_address="127.0.0.1:0",  # distributed insists on one; it has no routes
            scheduler_kwargs={"dashboard": False, "allowed_failures": 0},
            silence_logs=logging.CRITICAL,
        )
        with cluster, distributed.Client(cluster, timeout=CONNECT_S) as client:
            client.register_plugin(_worker_plugin(distributed))
            yield Cluster(client, cluster.scheduler_address)


@contextlib.contextmanager
def cluster_at(address: str) -> Iterator[Cluster]:
    """Connect to a running cluster. Raises ReconcileError: no scheduler answers, or it has no worker."""
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
        yield Cluster(client, address)


def _libraries() -> tuple[Any, Any]:
    try:
        import dask  # noqa: PLC0415  # an extra of the installation
        import distributed  # noqa: PLC0415  # as above
    except ImportError:
        raise ReconcileError("reconcile fleet", "", "dask is not installed", INSTALL) from None
    return dask, distributed


def _worker_plugin(distributed: Any) -> Any:
    """Return a plugin by which workers ignore Ctrl-C: the process that holds the results ends them."""

    class IgnoreInterrupt(distributed.WorkerPlugin):  # type: ignore[misc]  # distributed has no types
        name = "ignore-interrupt"

        def setup(self, worker: Any) -> None:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            tempfile.tempdir = worker.local_directory  # removed with the cluster, however the worker ends

    return IgnoreInterrupt()


def _killed(task: Any, deaths: int) -> TaskOutcome:
    workers = "worker" if deaths == 1 else "workers"
    reason = f"{deaths} {workers} died while they worked on it: out of memory, or crashed"
    return TaskOutcome(task, None, "killed", reason, deaths)


def _in_worker(work: Callable[[Any], Any], limit_s: float, task: Any) -> Any:
    return run_with_time_limit(partial(work, task), limit_s, _kill_worker, STUCK_GRACE_S)


def _kill_worker() -> None:
    """Kill this process if a nanny restarts it; the scheduler repeats its task elsewhere."""
    from distributed import get_worker  # noqa: PLC0415  # on a worker, which has it

    with contextlib.suppress(ValueError):
        if get_worker().nanny:
            os.kill(os.getpid(), signal.SIGKILL)
