"""Learns screw error and lost motion from slow travels there and back: scale minus encoder.

    moving up    d_up(x)   = scale - x = e(x) - b/2
    moving down  d_down(x) = scale - x = e(x) + b/2      ->   b = mean of d_down - d_up, the lost motion

e is the table of `control.compensation.screw_error`, over the table's positions x + e; b is the lost motion
of `control.compensation.backlash`. Where only one direction was read (at the ends, just after the
reversal), the other follows from the lost motion. e is 0 at home, where scale and encoder are set equal.
ISO 230-2: the spread of e is the mean bidirectional deviation M, b the mean reversal value.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.learning.screw_travel import ScrewSettings, ScrewTravel, nodes_m, travel_s
from servo_ctrl.learning.types import Outlook
from servo_ctrl.units import UM

LEARNER = "screw"


class ScrewLearned(NamedTuple):
    """Learned table and lost motion of one screw."""

    points: tuple[tuple[float, float, float], ...]
    """(table position, error e, lost motion there), rising positions."""
    lost_motion_m: float
    """b, mean over the travel."""
    spread_m: float
    """Standard deviation from travel to travel, RMS over the travel."""
    before_m: float
    """J without compensation: mean |scale - command| over the travel in both directions, less its mean."""
    after_m: float
    """J with table and lost motion, likewise."""
    strokes: int
    """Number of travels."""
    machine_time_s: float
    learner: str = LEARNER


def error_table(learned: ScrewLearned) -> Array:
    """(2, n): table positions and errors, as the control law reads them."""
    return np.ascontiguousarray(np.array(learned.points).T[:2])


def learned_screw(travels_m: Sequence[Array], settings: ScrewSettings) -> ScrewLearned:
    """Compute table and lost motion from the `deviations_m` of several travels without compensation.

    `after_m` is NaN until a check. Raises ValueError when the travels cannot be used.
    """
    if len(travels_m) < 2:
        raise ValueError("at least two travels are needed, to separate the error from noise")
    deviation_m = np.array(travels_m)
    spread_m = float(np.sqrt(np.nanmean(np.var(deviation_m, axis=0, ddof=1))))
    up_m, down_m = np.mean(deviation_m, axis=0)
    both = np.isfinite(up_m) & np.isfinite(down_m)
    if not both.any():
        raise ValueError("no position of the travel was read in both directions")
    lost_motion_m = _lost_motion_m(float(np.mean((down_m - up_m)[both])), spread_m)
    error_m = np.nanmean([up_m + 0.5 * lost_motion_m, down_m - 0.5 * lost_motion_m], axis=0)
    nodes = nodes_m(settings)
    error_m -= np.interp(0.0, nodes, error_m)
    positions_m = nodes + error_m
    _check_plausible(error_m, positions_m, lost_motion_m, spread_m, settings)
    local_m = np.where(both, down_m - up_m, lost_motion_m)
    return ScrewLearned(
        points=tuple(zip(positions_m.tolist(), error_m.tolist(), local_m.tolist(), strict=True)),
        lost_motion_m=lost_motion_m,
        spread_m=spread_m,
        before_m=evaluation_m(travels_m),
        after_m=math.nan,
        strokes=len(travels_m),
        machine_time_s=len(travels_m) * travel_s(settings),
    )


def _lost_motion_m(mean_m: float, spread_m: float) -> float:
    """Return the lost motion, at least 0: noise may make that of a stiff drive slightly negative."""
    if mean_m < -spread_m:
        raise ValueError(
            f"the table leads the motor by {-mean_m / UM:.2f} um instead of lagging: scale and encoder "
            "do not count in the same direction, or are not latched at the same instant"
        )
    return max(mean_m, 0.0)


def _check_plausible(
    error_m: Array, positions_m: Array, lost_motion_m: float, spread_m: float, settings: ScrewSettings
) -> None:
    largest_m = float(np.abs(error_m).max()) + 0.5 * lost_motion_m
    if largest_m > settings.limit_m:
        raise ValueError(
            f"the correction would be up to {largest_m / UM:.1f} um, {settings.limit_m / UM:g} um are "
            "allowed; check lead, counts and resolution"
        )
    error_rms_m = float(np.sqrt(np.var(error_m) + 0.25 * lost_motion_m**2))
    if spread_m >= error_rms_m:
        raise ValueError(
            f"the readings differ by {spread_m / UM:.3f} um from travel to travel, and the error is "
            f"{error_rms_m / UM:.3f} um: there is nothing to compensate"
        )
    if not (np.diff(positions_m) > 0.0).all():
        raise ValueError("the error changes faster than the position: scale or encoder is at fault")


def evaluation_m(travels_m: Sequence[Array]) -> float:
    """J, m: mean absolute deviation over nodes and both directions, of the mean travel, minus its mean.

    The subtracted mean depends only on the position at which scale and encoder were set equal.
    """
    mean_m = np.mean(np.array(travels_m), axis=0)
    return float(np.nanmean(np.abs(mean_m - np.nanmean(mean_m))))


class ScrewRun:
    """Learning of one axis: make the travel `stroke`, give `take` its deviations, until `stroke` is None."""

    def __init__(self, settings: ScrewSettings) -> None:
        self.stroke: ScrewTravel | None = ScrewTravel("travel")
        """The next travel to make; None when learning is complete."""
        self.learned: ScrewLearned | None = None
        """Complete when `stroke` is None."""
        self._settings = settings
        self._travels_m: list[Array] = []

    def take(self, travel_m: Array) -> None:
        """Take the `deviations_m` of `stroke`. Raises ValueError when the travels together cannot be used."""
        if self.stroke is None:
            raise ValueError("all travels have been made")
        if self.learned is not None:
            self.learned = self.learned._replace(
                after_m=evaluation_m([travel_m]),
                strokes=self.learned.strokes + 1,
                machine_time_s=self.learned.machine_time_s + travel_s(self._settings),
            )
            self.stroke = None
            return
        self._travels_m.append(travel_m)
        if len(self._travels_m) == self._settings.travels:
            self.learned = learned_screw(self._travels_m, self._settings)
            self.stroke = ScrewTravel("check", error_table(self.learned), self.learned.lost_motion_m)

    @property
    def outlook(self) -> Outlook:
        """Progress of the run."""
        total = self._settings.travels + 1
        stage, done = ("done", total) if self.stroke is None else (self.stroke.stage, len(self._travels_m))
        return Outlook(stage, done, total, remaining_s=(total - done) * travel_s(self._settings))
