"""Dask behind one file: tasks go in, each comes back once, done or with the reason why not.

What dask gives: a scheduler that hands tasks to workers as they get free, and that gives the task of a worker
that died to another one. What it does not give is here: a bound on every wait and on every task, few tasks
under way at a time, reasons in words, and a local cluster that listens on the loopback interface alone.
"""

from __future__ import annotations

import contextlib
import logging
import os
import queue
import signal
import tempfile
import time
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.errors import ReconcileError
from reconcile.fleet_limit import OverTimeError, bounded

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

ALLOWED_FAILURES = 2
"""Workers of a local cluster that a task may take with it before it is given up: the third is the last."""
GRACE_S = 30.0
"""Beyond the time limit, before a worker that does not come back to Python is ended."""
START_S = 60.0
"""Within it a cluster answers."""
WITHOUT_WORKERS_S = 300.0
"""So long a cluster may be without any worker; they may be restarted, or be given to others."""
ASK_S = 5.0
LEAST_AHEAD, AHEAD = 16, 3
"""Tasks under way, and that for each thread of the cluster: no worker waits, and little is lost by Ctrl-C."""
SINGLE = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
}
CONFIG = {
    # a worker holds the one task that it works on: if it dies, no other is suspected
    "distributed.scheduler.worker-saturation": 1.0,
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    # one that is forked from a process with the libraries starts in a tenth of the time
    "distributed.worker.multiprocessing-method": "forkserver",
    "distributed.nanny.pre-spawn-environ": SINGLE,
    # what is in memory is needed there: above its limit a worker is ended, its task redone
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": 0.95,
}
INSTALL = "pip install 'servo-ctrl[fleet]'"


class Ended(NamedTuple):
    """A task that is over: `value`, or the kind of its failure and why."""

    task: Any
    value: Any
    failure: str = ""
    """Empty, `killed`, `over time` or `failed`."""
    reason: str = ""


class Cluster:
    """A connection to workers."""

    def __init__(self, client: Any, address: str) -> None:
        self._client = client
        self.address = address
        self._ahead = LEAST_AHEAD
        self._asked_s = -ASK_S

    def threads(self) -> int:
        """How many tasks it can work on at a time, now."""
        return sum(self._client.nthreads().values())

    def everywhere(self, function: Callable[[], Any]) -> dict[str, Any]:
        """Its result by worker. Raises ReconcileError naming a worker that has none."""
        # not Client.run: where a worker cannot import the function, that waits for ever
        sent = {
            worker: self._client.submit(function, workers=[worker], pure=False)
            for worker in self._client.nthreads()
        }
        found = {}
        for worker, future in sent.items():
            try:
                found[worker] = future.result(timeout=START_S)
            except Exception as error:  # whatever the worker raised, or could not import
                reason = f"worker {worker} cannot run it: {type(error).__name__}: {error}"
                remedy = "install the same version on the scheduler and on every worker"
                raise ReconcileError(self.address, "", reason, remedy) from error
        return found

    def run(self, work: Callable[[Any], Any], tasks: Iterable[Any], limit_s: float) -> Iterator[Ended]:
        """`work(task)` for each, as they end. Raises ReconcileError where the cluster is lost."""
        ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        under_way: dict[Any, Any] = {}
        waiting = iter(tasks)
        job = partial(_in_worker, work, limit_s)
        try:
            self._send(job, waiting, under_way, ended)
            while under_way:
                future = self._next(ended, limit_s)
                task, _ = under_way[future.key]
                outcome = self._outcome(task, future)
                if outcome is None:
                    future.add_done_callback(ended.put)
                    continue
                del under_way[future.key], future  # the worker may forget the result
                yield outcome
                self._send(job, waiting, under_way, ended)
        finally:
            with contextlib.suppress(Exception):
                self._client.cancel([future for _, future in under_way.values()], force=True)

    def _send(
        self, job: Any, waiting: Iterator[Any], under_way: dict[Any, Any], ended: queue.SimpleQueue[Any]
    ) -> None:
        now_s = time.monotonic()
        if now_s - self._asked_s > ASK_S:  # workers come and go
            self._ahead, self._asked_s = max(LEAST_AHEAD, AHEAD * self.threads()), now_s
        while len(under_way) < self._ahead:
            task = next(waiting, None)
            if task is None:
                return
            future = self._client.submit(job, task, pure=False)
            under_way[future.key] = (task, future)
            future.add_done_callback(ended.put)

    def _next(self, ended: queue.SimpleQueue[Any], limit_s: float) -> Any:
        """The next future that is over, with a bound on the wait."""
        begun_s = alive_s = time.monotonic()
        most_s = (limit_s + GRACE_S) * (ALLOWED_FAILURES + 2) + WITHOUT_WORKERS_S
        while True:
            with contextlib.suppress(queue.Empty):
                return ended.get(timeout=ASK_S)
            now_s = time.monotonic()
            if self._client.status != "running":
                raise self._lost("the connection to the scheduler is lost")
            if self.threads():
                alive_s = now_s
            elif now_s - alive_s > WITHOUT_WORKERS_S:
                raise self._lost(f"there has been no worker for {WITHOUT_WORKERS_S:g} s")
            if now_s - begun_s > most_s:
                raise self._lost(f"nothing has been done for {most_s:g} s")

    def _outcome(self, task: Any, future: Any) -> Ended | None:
        """None where the result was gone with its worker before it came here: the task is under way again."""
        try:
            if future.status == "finished":
                return Ended(task, future.result(timeout=START_S))
            if future.status == "cancelled":
                raise self._lost("the scheduler has forgotten its tasks")
            if future.status != "error":
                return None
            error = future.exception(timeout=START_S)
        except TimeoutError:
            return None
        if isinstance(error, OverTimeError):
            return Ended(task, None, "over time", str(error))
        if type(error).__name__ == "KilledWorker":
            times = error.allowed_failures + 1
            reason = f"{times} workers died while they worked on it: out of memory, or crashed"
            return Ended(task, None, "killed", reason)
        return Ended(task, None, "failed", f"{type(error).__name__}: {error}")

    def _lost(self, reason: str) -> ReconcileError:
        return ReconcileError(self.address, "", reason, "the same command goes on where this one stopped")


@contextlib.contextmanager
def local_cluster(workers: int, memory: str) -> Iterator[Cluster]:
    """So many processes of one thread on this computer; `memory` of each, `auto` is its share of all."""
    dask, distributed = _libraries()
    with (
        tempfile.TemporaryDirectory(prefix="reconcile-workers-") as scratch,
        dask.config.set({**CONFIG, "temporary-directory": scratch}),
    ):
        inside = distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            memory_limit=memory,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",  # it cannot be left out; without routes it has nothing to say
            scheduler_kwargs={"dashboard": False, "allowed_failures": ALLOWED_FAILURES},
            silence_logs=logging.CRITICAL,
        )
        with inside, distributed.Client(inside, timeout=START_S) as client:
            client.register_plugin(_calm(distributed))
            yield Cluster(client, inside.scheduler_address)


@contextlib.contextmanager
def cluster_at(address: str) -> Iterator[Cluster]:
    """A cluster that is there already. Raises ReconcileError where it does not answer, or has no worker."""
    _, distributed = _libraries()
    try:
        client = distributed.Client(address, timeout=START_S, set_as_default=False)
    except (OSError, ValueError) as error:
        remedy = "its address is like tcp://HOST:8786; `dask scheduler` prints it"
        raise ReconcileError(address, "", f"no scheduler answers: {error}", remedy) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=START_S)
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


def _calm(distributed: Any) -> Any:
    """Ctrl-C is for the one that holds the results; workers are ended by it."""

    class Calm(distributed.WorkerPlugin):  # type: ignore[misc]  # distributed has no types
        name = "calm"

        def setup(self, worker: Any) -> None:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            tempfile.tempdir = worker.local_directory  # goes with the cluster, whatever ends the worker

    return Calm()


def _in_worker(work: Callable[[Any], Any], limit_s: float, task: Any) -> Any:
    return bounded(partial(work, task), limit_s, _end_worker, GRACE_S)


def _end_worker() -> None:
    """End this process where somebody starts it anew; its task goes to another one."""
    from distributed import get_worker  # noqa: PLC0415  # on a worker, which has it

    with contextlib.suppress(ValueError):
        if get_worker().nanny:
            os.kill(os.getpid(), signal.SIGKILL)
