"""Runs tasks on a dask cluster: each ends once, with its result or with the reason why there is none.

dask assigns tasks to free workers. When a worker dies, dask blames all of its tasks; which of them killed it
shows when each is run again alone. This file adds that, a bound on every wait, few tasks in flight, and
reasons in words.
"""

import contextlib
import queue
import time
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from typing import Any, NamedTuple

from reconcile.errors import ReconcileError
from reconcile.fleet.dask_workers import (
    BEGIN_S,
    CONNECT_S,
    STUCK_GRACE_S,
    client_of_local_workers,
    client_of_scheduler,
    run_in_worker,
)
from reconcile.fleet.limit import TimeLimitError

MOST_DEATHS = 3
"""Workers that may die of one task before it counts as killed."""
MAX_WITHOUT_WORKERS_S = 300.0
"""Longest time without workers, which may restart or serve others; then the cluster counts as lost."""
POLL_S = 5.0
MIN_IN_FLIGHT, IN_FLIGHT_PER_THREAD = 16, 3
"""Tasks submitted at a time: no worker idles, and Ctrl-C loses little work."""


class TaskOutcome(NamedTuple):
    """An ended task: its `value`, or the kind of its failure and the reason."""

    task: Any
    value: Any
    failure: str = ""
    """Empty, or `killed`, `over time` or `failed`."""
    reason: str = ""
    deaths: int = 0
    """Workers that died while they held the task."""


class Cluster:
    """A connection to the workers of a dask scheduler."""

    def __init__(self, client: Any, address: str) -> None:
        self._client = client
        self.address = address
        self._in_flight = MIN_IN_FLIGHT
        self._polled_s = -POLL_S

    def threads(self) -> int:
        """Return how many tasks the cluster can run at a time now."""
        return sum(self._client.nthreads().values())

    def run_on_every_worker(self, function: Callable[[], Any]) -> dict[str, Any]:
        """Return the result of `function` by worker. Raises ReconcileError naming a worker without one."""
        # Client.run would wait for ever for a worker that cannot import the function
        sent = {
            worker: self._client.submit(function, workers=[worker], pure=False)
            for worker in self._client.nthreads()
        }
        results = {}
        for worker, future in sent.items():
            try:
                results[worker] = future.result(timeout=BEGIN_S)
            except TimeoutError as error:
                reason = f"worker {worker} has not answered within {BEGIN_S:g} s"
                remedy = "see its log, and whether its computer is overloaded or out of memory"
                raise ReconcileError(self.address, "", reason, remedy) from error
            except Exception as error:  # whatever the worker raised, or could not import
                reason = f"worker {worker} cannot run it: {type(error).__name__}: {error}"
                remedy = "install the same version on the scheduler and on every worker"
                raise ReconcileError(self.address, "", reason, remedy) from error
        return results

    def run(self, work: Callable[[Any], Any], tasks: Iterable[Any], limit_s: float) -> Iterator[TaskOutcome]:
        """Yield the outcome of `work(task)` of each task as it ends. Raises ReconcileError: cluster lost."""
        job = partial(run_in_worker, work, limit_s)
        suspects = []
        for ended in self._run_together(job, iter(tasks), limit_s):
            if ended.deaths:
                suspects.append(ended)
            else:
                yield ended
        for suspect in suspects:
            yield self._run_alone(job, suspect, limit_s)

    def _run_alone(self, job: Any, suspect: TaskOutcome, limit_s: float) -> TaskOutcome:
        """Run a task of a dead worker again, without other tasks that could have killed the worker."""
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
        if now_s - self._polled_s > POLL_S:  # workers join and leave
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
        """Return the next future that ends. Raises ReconcileError: no connection, worker or progress."""
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
        """Return the outcome; None if the result was lost with its worker: dask then repeats the task."""
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
    with client_of_local_workers(workers, memory) as (client, address):
        yield Cluster(client, address)


@contextlib.contextmanager
def cluster_at(address: str) -> Iterator[Cluster]:
    """Connect to a running cluster. Raises ReconcileError: no scheduler answers, or it has no worker."""
    with client_of_scheduler(address) as client:
        yield Cluster(client, address)


def _killed(task: Any, deaths: int) -> TaskOutcome:
    workers = "worker" if deaths == 1 else "workers"
    reason = f"{deaths} {workers} died while they worked on it: out of memory, or crashed"
    return TaskOutcome(task, None, "killed", reason, deaths)
