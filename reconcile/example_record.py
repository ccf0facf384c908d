"""A whole record held out: a model fitted on one recording, its force residual on another.

The residual is the diagnosis' own, behind the same filter. What comes once a turn keeps its amplitude; its
phase is that of the other recording's zero, told by the first seconds, which then do not count. The timing of
the channels may be told by them too, as it belongs to a recording and not to the axis: a stage of its own.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Sense
from reconcile.catalogue.periodic import pair
from reconcile.evidence import Rules, Trial, threshold
from reconcile.replay import ORIGIN_S
from reconcile.scenes import FILTER_HZ, difference, scene_of
from reconcile.selection import TIMING
from reconcile.state_filter import StateFilter

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Shape
    from reconcile.model_file import NominalAxis
    from reconcile.recording import AxisRecording
    from reconcile.scenes import Difference

    Array = NDArray[np.float64]

Effect = tuple[str, "Shape"]
ONCE_A_TURN = ("cogging",)
SHIFTS = 360
ORDERS, ORDERS_EVERY = np.arange(0.2, 4.01, 0.05), 4
"""Cycles a turn of the picture; every fourth sample is enough for it."""


class Stage(NamedTuple):
    """RMS in newtons with the effects up to this one."""

    effect: str
    train_n: float
    heldout_n: float


class Loser(NamedTuple):
    """An effect on top of all that were found, judged as the engine judges, and on the other record."""

    effect: str
    gain: float
    """Share of the squares that it takes from unseen blocks of the record that was fitted."""
    t: float
    needed: float
    """The t that the best of all hypotheses exceeds by chance once in a hundred times."""
    heldout_gain: float
    """Share of the squares that it takes from the other record."""


class Ripple(NamedTuple):
    """What comes once a turn, fitted in one record alone."""

    source: str
    amplitude_n: float
    phase_rad: float


class Orders(NamedTuple):
    """What repeats so many times a turn in one record, beside all effects that do not."""

    source: str
    cycles_1_turn: Array
    share: Array
    """Of the squares that are left without it."""


class TwoRecords:
    """One recording to fit on, another to judge by."""

    def __init__(self, train: AxisRecording, other: AxisRecording, axis: NominalAxis) -> None:
        self._records, self._lead_m = (train, other), axis.lead_m
        self._scenes = [scene_of(recording, axis) for recording in self._records]

    def stages(self, effects: Sequence[Effect]) -> list[Stage]:
        """The model's own values, then one effect after another."""
        both = difference(self._scenes, Sense.FORCE, effects, only=True)
        names = ["values fitted anew", *(effect for effect, _ in effects)]
        stages = [Stage(name, *self._rms(both, effects[:count])) for count, name in enumerate(names)]
        if any(name in TIMING for name, _ in effects):
            stages.append(Stage("timing of each record", *self._rms(both, effects, own_timing=True)))
        return stages

    def loser(self, effect: str, found: Sequence[Effect]) -> Loser:
        """The best shape of an effect that was not taken."""
        wide = difference(self._scenes[:1], Sense.FORCE, found)
        ledger = wide.ledger
        trial = Trial(ledger, np.flatnonzero(ledger.samples > 0))
        chosen = [
            next(c for c in ledger.candidates if (c.effect, c.shape) == one and not c.per_recording)
            for one in found
        ]
        before = trial.unseen(chosen)
        best = max(
            (trial.score(chosen, before, c) for c in ledger.candidates if c.effect == effect),
            key=lambda score: score.gain,
        )
        longer = [*found, (effect, best.candidate.shape)]
        both = difference(self._scenes, Sense.FORCE, longer, only=True)
        without, with_it = self._rms(both, found)[1], self._rms(both, longer)[1]
        needed = threshold(len(ledger.candidates), len(trial.blocks), Rules().false_alarm)
        return Loser(effect, best.gain, best.t, needed, 1.0 - (with_it / without) ** 2)

    def ripples(self, effects: Sequence[Effect]) -> list[Ripple]:
        """The first of what comes once a turn, in each record by itself."""
        both = difference(self._scenes, Sense.FORCE, effects, only=True)
        effect = next(one for one in effects if one[0] in ONCE_A_TURN)
        found = []
        for index, recording in enumerate(self._records):
            theta = self._fitted(both, index, effects)
            a, b = -theta[_places(both, [effect])[-2:]]  # on the table: against what the motor needs
            found.append(Ripple(recording.source, math.hypot(a, b), math.atan2(b, a)))
        return found

    def orders(self, effects: Sequence[Effect]) -> list[Orders]:
        """Each record by itself: one wave after another, beside all effects but those of the turn."""
        both = difference(self._scenes, Sense.FORCE, effects, only=True)
        places = _places(both, [one for one in effects if one[0] not in ONCE_A_TURN])
        found = []
        for index, (recording, scene) in enumerate(zip(self._records, self._scenes, strict=True)):
            low_pass = StateFilter(scene.period_s, FILTER_HZ)
            turn_rad = 2.0 * math.pi / self._lead_m * scene.motion.position_m
            y, columns = both.sides(index)
            used = np.flatnonzero(both.used[index])[::ORDERS_EVERY]
            left, shares = _left(columns[used][:, places], y[used]), []
            for order in ORDERS:
                wave = low_pass(pair(order * turn_rad))
                wide = np.concatenate((columns[used][:, places], wave[used]), axis=1)
                shares.append(1.0 - (_left(wide, y[used]) / left) ** 2)
            found.append(Orders(recording.source, ORDERS, np.array(shares)))
        return found

    def _fitted(self, both: Difference, index: int, effects: Sequence[Effect]) -> Array:
        y, columns = both.sides(index)
        used, places = both.used[index], _places(both, effects)
        theta = np.zeros(columns.shape[1])
        theta[places] = np.linalg.lstsq(columns[used][:, places], y[used], rcond=None)[0]
        return theta

    def _rms(
        self, both: Difference, effects: Sequence[Effect], *, own_timing: bool = False
    ) -> tuple[float, float]:
        theta = self._fitted(both, 0, effects)
        (y, columns), (other_y, other_columns) = both.sides(0), both.sides(1)
        first = self._scenes[1].time_s <= ORIGIN_S
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
        best = min(tried, key=lambda one: _norm(early_y - early_columns @ one))
        train = _norm((y - columns @ theta)[both.used[0]])
        return train, _norm(other_y[late] - other_columns[late] @ best)

    def _shifted(self, both: Difference, theta: Array, shift_m: float) -> Array:
        """Coefficients where the zero lies `shift_m` further on."""
        turned, place = theta.copy(), len(both.base_names)
        for one in both.plan:
            if one.effect in ONCE_A_TURN:
                angle = one.shape[0] * 2.0 * math.pi * shift_m / self._lead_m
                a, b = theta[place], theta[place + 1]
                turned[place] = a * math.cos(angle) - b * math.sin(angle)
                turned[place + 1] = a * math.sin(angle) + b * math.cos(angle)
            place += one.width
        return turned


def _places(both: Difference, effects: Sequence[Effect]) -> list[int]:
    """Columns of the model's own values and of these effects."""
    places, place = list(range(len(both.base_names))), len(both.base_names)
    for one in both.plan:
        if (one.effect, one.shape) in effects:
            places += range(place, place + one.width)
        place += one.width
    return places


def _norm(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _left(columns: Array, y: Array) -> float:
    """RMS that a fit leaves."""
    return _norm(y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0])
