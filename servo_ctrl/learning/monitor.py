"""Monitors reversals in production: samples the window after each, and decides when learning is due.

The indicators are those of `performance` (Feng et al. 2015, section 5), which takes them from whole arrays.
Whether learning is due is a state with hysteresis and a count of consecutive reversals:

    state     a reversal counts when            after `reversals` in a row
    settled   J > J_required                    due
    due       J < settled_below J_required      settled

Any other reversal resets the count.
"""

import math
from array import array
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, rms
from servo_ctrl.learning.performance import evaluation_m
from servo_ctrl.learning.types import ReversalReport


class DueRule(NamedTuple):
    """When learning becomes due, and when it is settled again."""

    required_m: float
    """J_required."""
    settled_below: float
    """Share of J_required, at most 1."""
    reversals: int
    """Consecutive reversals that change the state."""


class DueState(NamedTuple):
    """State of one axis."""

    due: bool
    in_a_row: int
    """Consecutive reversals that count towards the other state."""


SETTLED = DueState(due=False, in_a_row=0)


def next_due_state(rule: DueRule, state: DueState, evaluation: float) -> DueState:
    """State after one more reversal; `evaluation`: its J, metres."""
    limit_m = rule.required_m * rule.settled_below
    counts = evaluation < limit_m if state.due else evaluation > rule.required_m
    in_a_row = state.in_a_row + 1 if counts else 0
    return DueState(not state.due, 0) if in_a_row >= rule.reversals else DueState(state.due, in_a_row)


class Window:
    """Samples of one axis from a reversal on; `add` once a cycle until the window is full."""

    __slots__ = ("acceleration_m_s2", "contour_m", "cycle", "direction", "error_m", "other_moved")

    def __init__(self, cycle: int, direction: int, acceleration_m_s2: float) -> None:
        self.cycle = cycle
        self.direction = direction
        self.acceleration_m_s2 = acceleration_m_s2
        self.error_m = array("d")
        self.contour_m = array("d")
        self.other_moved = False
        """Whether the other axis moved; if not, the contour error is the tracking error."""

    def add(self, error_m: float, contour_m: float, *, other_moves: bool) -> int:
        """Add the error of the axis and the deviation across the path, m; return the number of samples."""
        self.error_m.append(error_m)
        self.contour_m.append(contour_m)
        self.other_moved = self.other_moved or other_moves
        return len(self.error_m)


def across_m(step_m: tuple[float, float], error_m: tuple[float, float]) -> float:
    """Component of an error normal to a step (not zero), left positive, metres."""
    (step_x, step_y), (error_x, error_y) = step_m, error_m
    return (step_x * error_y - step_y * error_x) / math.hypot(step_x, step_y)


def evaluated(window: Window) -> tuple[ReversalReport, Array] | None:
    """Indicators of a full window and its error trace (positive: lag); None when a sample is missing."""
    error_m = np.frombuffer(window.error_m)
    size_m = np.abs(error_m)
    contour_m = np.abs(np.frombuffer(window.contour_m)) if window.other_moved else size_m
    report = ReversalReport(
        cycle=window.cycle,
        direction=window.direction,
        acceleration_m_s2=window.acceleration_m_s2,
        contour_peak_m=float(contour_m.max()),
        error_peak_m=float(size_m.max()),
        error_rms_m=rms(error_m),
        error_mean_m=evaluation_m(error_m),
    )
    # a missing sample is NaN, and a NaN sample makes every indicator NaN
    if not all(map(math.isfinite, report)):
        return None
    return report, error_m * window.direction
