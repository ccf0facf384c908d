"""Tests effects on a held-out record: fits a model on one recording, computes its force residual on another.

The residual is that of the diagnosis, after the same filter. Ripple keeps its amplitude; its phase is
shifted to the encoder zero of the other recording, fitted on its first seconds, which then do not count.
Another stage fits the timing of the channels there too, because it belongs to a recording and not to the
axis.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, rms
from reconcile.catalogue.kinds import ResidualChannel, ShapeParameters
from reconcile.catalogue.periodic import pair
from reconcile.catalogue.registry import TIMING
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.recording.recording import AxisRecording
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import RegressionProblem, regression_problem
from reconcile.regression.state_filter import StateFilter
from reconcile.replay.replay import ORIGIN_FIT_S
from reconcile.selection.block_statistics import bonferroni_threshold
from reconcile.selection.cross_validation import CrossValidation
from reconcile.selection.selection_rules import SelectionRules

Effect = tuple[str, ShapeParameters]
ONCE_A_TURN = ("cogging",)
SHIFTS = 360
"""Encoder zeros tried in a turn: one per degree."""
ORDERS, ORDERS_EVERY = np.arange(0.2, 4.01, 0.05), 4
"""Cycles per turn of the figure, and the thinning of its samples."""


class Stage(NamedTuple):
    """RMS force residual with the effects up to this one."""

    effect: str
    train_n: float
    heldout_n: float


class RejectedEffect(NamedTuple):
    """An effect added to all identified ones, tested as in a diagnosis, and on the other record."""

    effect: str
    gain: float
    """Share of the cross-validated squares that it explains in the fitted record."""
    t: float
    needed: float
    """Threshold of t that the best of all candidate terms exceeds by chance once in a hundred times."""
    heldout_gain: float
    """Share of the squares that it explains in the other record."""


class Ripple(NamedTuple):
    """The first harmonic of a turn, fitted on one record alone."""

    source: str
    amplitude_n: float
    phase_rad: float


class Orders(NamedTuple):
    """Share explained by each order of the turn in one record, with all effects but ripple."""

    source: str
    cycles_1_turn: Array
    share: Array
    """Share of the squared residual without it."""


class TwoRecords:
    """A recording to fit on, and a held-out one."""

    def __init__(self, train: AxisRecording, other: AxisRecording, axis: NominalAxis) -> None:
        self._records, self._lead_m = (train, other), axis.lead_m
        self._datasets = [regression_data(recording, axis) for recording in self._records]

    def stages(self, effects: Sequence[Effect]) -> list[Stage]:
        """Return the residuals with refitted values, then with one effect after another."""
        both = regression_problem(self._datasets, ResidualChannel.FORCE, effects, only=True)
        names = ["refitted values", *(effect for effect, _ in effects)]
        stages = [Stage(name, *self._rms(both, effects[:count])) for count, name in enumerate(names)]
        if any(name in TIMING for name, _ in effects):
            stages.append(Stage("timing of each record", *self._rms(both, effects, own_timing=True)))
        return stages

    def rejected_effect(self, effect: str, found: Sequence[Effect]) -> RejectedEffect:
        """Test the best shape parameters of an effect that was not accepted."""
        wide = regression_problem(self._datasets[:1], ResidualChannel.FORCE, found)
        equations = wide.equations
        validation = CrossValidation(equations, np.flatnonzero(equations.samples > 0))
        of_effect = {(c.effect, c.shape_parameters): c for c in equations.candidates if not c.per_recording}
        chosen = [of_effect[effect_found] for effect_found in found]
        before = validation.cross_validated_squares(chosen)
        best = max(
            (validation.score(chosen, before, c) for c in equations.candidates if c.effect == effect),
            key=lambda score: score.gain,
        )
        longer = [*found, (effect, best.candidate.shape_parameters)]
        both = regression_problem(self._datasets, ResidualChannel.FORCE, longer, only=True)
        without, with_it = self._rms(both, found)[1], self._rms(both, longer)[1]
        false_alarm = SelectionRules().false_alarm
        needed = bonferroni_threshold(len(equations.candidates), len(validation.blocks), false_alarm)
        return RejectedEffect(effect, best.gain, best.log_ratio_t, needed, 1.0 - (with_it / without) ** 2)

    def ripples(self, effects: Sequence[Effect]) -> list[Ripple]:
        """Fit the ripple on each record by itself."""
        both = regression_problem(self._datasets, ResidualChannel.FORCE, effects, only=True)
        effect = next(one for one in effects if one[0] in ONCE_A_TURN)
        found = []
        for index, recording in enumerate(self._records):
            # force on the table: opposite to what the motor needs
            a, b = -self._fitted(both, index, effects)[_places(both, [effect])[-2:]]
            found.append(Ripple(recording.source, math.hypot(a, b), math.atan2(b, a)))
        return found

    def orders(self, effects: Sequence[Effect]) -> list[Orders]:
        """Fit one order after another on each record, beside all effects without ripple."""
        both = regression_problem(self._datasets, ResidualChannel.FORCE, effects, only=True)
        places = _places(both, [one for one in effects if one[0] not in ONCE_A_TURN])
        found = []
        for index, (recording, data) in enumerate(zip(self._records, self._datasets, strict=True)):
            low_pass = StateFilter(data.period_s, FILTER_HZ)
            turn_rad = 2.0 * math.pi / self._lead_m * data.motion.position_m
            y, columns = both.target_and_columns(index)
            used = np.flatnonzero(both.used[index])[::ORDERS_EVERY]
            left, shares = _residual_rms(columns[used][:, places], y[used]), []
            for order in ORDERS:
                wave = low_pass(pair(order * turn_rad))
                wide = np.concatenate((columns[used][:, places], wave[used]), axis=1)
                shares.append(1.0 - (_residual_rms(wide, y[used]) / left) ** 2)
            found.append(Orders(recording.source, ORDERS, np.array(shares)))
        return found

    def _fitted(self, both: RegressionProblem, index: int, effects: Sequence[Effect]) -> Array:
        y, columns = both.target_and_columns(index)
        used, places = both.used[index], _places(both, effects)
        theta = np.zeros(columns.shape[1])
        theta[places] = np.linalg.lstsq(columns[used][:, places], y[used], rcond=None)[0]
        return theta

    def _rms(
        self, both: RegressionProblem, effects: Sequence[Effect], *, own_timing: bool = False
    ) -> tuple[float, float]:
        theta = self._fitted(both, 0, effects)
        (y, columns), (other_y, other_columns) = both.target_and_columns(0), both.target_and_columns(1)
        first = self._datasets[1].time_s <= ORIGIN_FIT_S
        early, late = both.used[1] & first, both.used[1] & ~first
        shifts_m = np.arange(SHIFTS) / SHIFTS * self._lead_m
        if not any(effect in ONCE_A_TURN for effect, _ in effects):
            shifts_m = shifts_m[:1]
        tried = [self._shifted(both, theta, float(shift_m)) for shift_m in shifts_m]
        early_y, early_columns = other_y[early], other_columns[early]
        if own_timing:
            place = _places(both, [one for one in effects if one[0] in TIMING])[-1]
            late_force = early_columns[:, place]
            for one in tried:
                one[place] = 0.0
                one[place] = late_force @ (early_y - early_columns @ one) / (late_force @ late_force)
        best = min(tried, key=lambda one: rms(early_y - early_columns @ one))
        train = rms((y - columns @ theta)[both.used[0]])
        return train, rms(other_y[late] - other_columns[late] @ best)

    def _shifted(self, both: RegressionProblem, theta: Array, shift_m: float) -> Array:
        """Return the coefficients with the encoder zero shifted by `shift_m`."""
        turned, place = theta.copy(), len(both.baseline_names)
        for one in both.terms:
            if one.effect in ONCE_A_TURN:
                angle = one.shape_parameters[0] * 2.0 * math.pi * shift_m / self._lead_m
                a, b = theta[place], theta[place + 1]
                turned[place] = a * math.cos(angle) - b * math.sin(angle)
                turned[place + 1] = a * math.sin(angle) + b * math.cos(angle)
            place += one.width
        return turned


def _places(both: RegressionProblem, effects: Sequence[Effect]) -> list[int]:
    """Return the columns of the base values and of these effects."""
    places, place = list(range(len(both.baseline_names))), len(both.baseline_names)
    for one in both.terms:
        if (one.effect, one.shape_parameters) in effects:
            places += range(place, place + one.width)
        place += one.width
    return places


def _residual_rms(columns: Array, y: Array) -> float:
    """Return the RMS residual of a least-squares fit."""
    return rms(y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0])
