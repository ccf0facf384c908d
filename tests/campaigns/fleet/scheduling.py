"""A fleet of any size on paper: reconcile's own queue, simulated with task times that were measured.

Workers take the next task of the scheduler's queue at once. The client gathers, keeps and submits one
after the other, with three tasks a worker under way (reconcile/fleet/cluster.py). A worker that is lost
comes back at once and starts its task again.
"""

import heapq
import random
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from reconcile.fleet.cluster import IN_FLIGHT_PER_THREAD, MIN_IN_FLIGHT


class Fleet(NamedTuple):
    """What is run, on what."""

    axes: int
    workers: int
    client_s: float
    """Time of the client for a task: gathering, keeping, submitting."""
    losses_an_hour: float = 0.0
    """Of one worker."""


class Outcome(NamedTuple):
    """What came of it."""

    hours: float
    busy: float
    """Share of the workers' time in which they have a task."""
    client_busy: float
    lost: int


def simulated(fleet: Fleet, measured_s: Sequence[float], seed: int = 1) -> Outcome:
    """Run the fleet; each task takes one of the measured times, drawn again."""
    rng = random.Random(seed)
    drawn = iter(rng.choices(measured_s, k=fleet.axes))
    ends: list[tuple[float, int]] = []
    waiting: deque[float] = deque()
    idle, worked_s, client_free_s, client_s, lost, number = fleet.workers, 0.0, 0.0, 0.0, 0, 0

    def begin(now_s: float, task_s: float) -> None:
        nonlocal worked_s, lost, number
        taken_s = task_s
        while fleet.losses_an_hour and (until_s := rng.expovariate(fleet.losses_an_hour / 3600.0)) < task_s:
            taken_s, lost = taken_s + until_s, lost + 1
        worked_s, number = worked_s + taken_s, number + 1
        heapq.heappush(ends, (now_s + taken_s, number))

    def submit(now_s: float) -> None:
        nonlocal idle
        if (task_s := next(drawn, None)) is None:
            return
        if idle:
            idle -= 1
            begin(now_s, task_s)
        else:
            waiting.append(task_s)

    for _ in range(max(MIN_IN_FLIGHT, IN_FLIGHT_PER_THREAD * fleet.workers)):
        submit(0.0)
    submissions: list[float] = []  # when the client submits the next task
    now_s = 0.0
    while ends or submissions:
        if not ends or (submissions and submissions[0] <= ends[0][0]):
            submit(heapq.heappop(submissions))
            continue
        now_s, _ = heapq.heappop(ends)
        if waiting:
            begin(now_s, waiting.popleft())
        else:
            idle += 1
        client_free_s = max(now_s, client_free_s) + fleet.client_s
        client_s += fleet.client_s
        heapq.heappush(submissions, client_free_s)
    span_s = max(now_s, client_free_s)
    return Outcome(span_s / 3600.0, worked_s / (fleet.workers * span_s), client_s / span_s, lost)
