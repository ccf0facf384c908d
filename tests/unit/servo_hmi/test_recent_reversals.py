"""The median J counts reversals with the compensation that acts now, and no older ones."""

from typing import Any, cast

import pytest
from stub_link import StubLink
from stub_status import FIRST_REVERSAL

from servo_ctrl.commands.local_messages import Reversal
from servo_ctrl.hmi.friction.figures import MEDIAN_REVERSALS
from servo_ctrl.hmi.friction.recent_reversals import RecentReversals


def reversal(axis: str, error_m: float) -> Reversal:
    return Reversal(axis, FIRST_REVERSAL._replace(error_mean_m=error_m), 1e-3, (0.0,))


@pytest.fixture
def link() -> StubLink:
    stub = StubLink()
    stub.reversals.extend(reversal(axis, 9e-6) for axis in "xyxyx")
    return stub


def recent_of(link: StubLink) -> RecentReversals:
    recent = RecentReversals(cast("Any", link))
    link.listeners.append(recent.on_status)
    link.change(cycles=100)
    return recent


@pytest.mark.parametrize(
    "change", [{"version": 3}, {"compensation_enabled": False}, {"observer_enabled": True}]
)
def test_a_version_or_a_switch_restarts_the_count_of_its_axis(link: StubLink, change: dict[str, Any]) -> None:
    recent = recent_of(link)
    assert recent.recent_errors_m("x") == [9e-6] * 3
    assert not recent.changed("x")
    x, y = link.status.axes
    link.change(axes=(x._replace(**change), y))
    assert recent.recent_errors_m("x") == []
    assert recent.changed("x")
    assert recent.recent_errors_m("y") == [9e-6] * 2
    link.reversals.extend(reversal("x", 1e-6 * number) for number in range(MEDIAN_REVERSALS + 2))
    kept_m = [1e-6 * number for number in range(2, MEDIAN_REVERSALS + 2)]
    assert recent.recent_errors_m("x") == pytest.approx(kept_m)
    assert not recent.changed("x")


def test_another_run_of_the_controller_starts_with_empty_rows(link: StubLink) -> None:
    recent = recent_of(link)
    link.change(cycles=5)
    assert recent.recent_errors_m("x") == recent.recent_errors_m("y") == []
    link.reversals.append(reversal("y", 2e-6))
    link.change(cycles=6)
    assert recent.recent_errors_m("y") == [2e-6]
