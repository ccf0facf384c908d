"""The verdict on a computer by the lateness of its ticks."""

import sys

import pytest

from servo_ctrl.daemon.run import self_test
from servo_ctrl.daemon.run.self_test import objection, verdict
from servo_ctrl.io.clock import Lateness


def lateness(*late_us: int, punctual: int = 1990) -> Lateness:
    """Of so many ticks in time, and of those that were not."""
    made = Lateness()
    for late in (*[40] * punctual, *late_us):
        made.add(late * 1000)
    return made


def test_ticks_within_the_period_are_held() -> None:
    assert verdict(1.0, lateness(*[990] * 10), 0) == ""


def test_one_tick_of_a_thousand_may_be_late() -> None:
    assert verdict(1.0, lateness(3500, punctual=1999), 3) == ""


@pytest.mark.parametrize(("late_us", "kept_ms"), [(1200, 2), (4000, 5), (19_000, 20)])
def test_the_shortest_period_that_is_kept_is_named(late_us: int, kept_ms: int) -> None:
    text = verdict(1.0, lateness(*[late_us] * 10), 12)
    kept = f"this computer keeps a period of {kept_ms} ms, not 1 ms"
    assert text.startswith(f"{kept}: of 2012 ticks 12 were missed, the latest was served")
    assert "--fifo" in text


def test_a_shorter_cycle_may_have_none() -> None:
    text = verdict(0.25, lateness(*[6000] * 10), 200)
    assert text.startswith("this computer does not keep a period of 0.25 ms:")


def test_a_gap_in_which_axes_would_be_stopped_is_announced_first() -> None:
    assert "stalls for 20 ms and more" in verdict(1.0, lateness(25_000), 24)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="timerfd is Linux")
async def test_the_ticks_of_this_computer_are_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[tuple[float, int]] = []
    monkeypatch.setattr(self_test, "TEST_S", 0.02)
    monkeypatch.setattr(
        self_test, "verdict", lambda ms, seen, missed: judged.append((ms, seen.count + missed)) or "text"
    )
    assert await objection(1_000_000) == "text"
    assert judged[0][0] == 1.0
    assert judged[0][1] > 0
