"""The turns that the Contour page keeps while the machine runs: one of each compensation."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from stub_link import BUMP_M, PERIOD_S, RADIUS_M, TURN_S, StubLink

from kernels.arrays import Array
from servo_ctrl.hmi.contour.turn_store import TurnStore
from servo_ctrl.hmi.contour.turns import glitches_m


def searched_as_it_runs(link: StubLink, store: TurnStore) -> Callable[[float], None]:
    """Return what runs the stub for so many seconds, with a status each half second."""
    now_s = 0.0

    def run(seconds: float) -> None:
        nonlocal now_s
        for _ in range(round(2.0 * seconds)):
            link.advance(500)
            now_s += 0.5
            store.on_status(link.status, link.rows, ("x", "y"), now_s)

    return run


def test_the_last_turn_of_each_compensation_is_kept_and_none_across_a_switch(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    link, store = StubLink(), TurnStore()
    run = searched_as_it_runs(link, store)
    run(TURN_S + 0.5)
    (circle,) = store.circles()
    assert circle == (25_000, round(2.0 * math.pi * RADIUS_M / TURN_S * 60e3), 1)
    (first,) = store.turns(circle)
    assert first.compensation == "without"
    assert max(np.abs(glitches_m(first.trace))) == pytest.approx(BUMP_M, rel=0.05)
    observed = [axis._replace(observer_enabled=True) for axis in link.status.axes]
    link.change(axes=tuple(observed))
    made_up = link._rows
    disturbance = link.rows.place("x.disturbance_n")

    def with_observer(begin: int, count: int) -> Array:
        rows = made_up(begin, count)
        rows[:, disturbance] = 1.0
        return rows

    monkeypatch.setattr(link, "_rows", with_observer)
    run(TURN_S - 1.0)
    assert [turn.compensation for turn in store.turns(circle)] == ["without"]
    run(2.0)
    found = store.turns(circle)
    assert [turn.compensation for turn in found] == ["without", "observer"]
    assert (found[1].last_cycle - len(found[1].trace.angle_rad)) * PERIOD_S >= TURN_S - PERIOD_S
    store.clear()
    run(1.0)  # the turn before it is still in the rows
    assert store.circles() == []


def test_a_turn_in_which_the_compensation_was_suspended_is_not_kept() -> None:
    link, store = StubLink(), TurnStore()
    run = searched_as_it_runs(link, store)

    def suspend(*, suspended: bool) -> None:
        x, y = link.status.axes
        link.change(axes=(x._replace(compensation_suspended=suspended), y))

    run(TURN_S + 0.5)
    (circle,) = store.circles()
    (before,) = store.turns(circle)
    version = store.version
    suspend(suspended=True)
    run(2.0 * TURN_S)
    suspend(suspended=False)
    run(TURN_S - 0.5)  # the newest whole turn began while it was suspended
    assert store.version == version
    assert store.turns(circle) == [before]
    run(1.5)
    (after,) = store.turns(circle)
    assert after.last_cycle > before.last_cycle
