"""What a recording says of an axis in a few numbers with physical meaning, each with its own standard error.

An indicator is a coefficient of the engine's own columns (`scenes.difference`): the rigid model's, and those
of some effects of the catalogue at one fixed shape, so that all recordings are measured by the same rod.
Errors are those of the jackknife over stretches of time (Efron and Tibshirani 1993, chapter 11): what the
recording hardly excites gets a wide error, and what only a few of its stretches tell is left out.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Sense
from reconcile.model_effects import model_effects
from reconcile.model_effects_held import held_base
from reconcile.scenes import BASE, difference, scene_of
from reconcile.watch_kinds import KINDS, LEVEL, LOW_SPEED_M_S

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene
    from reconcile.ledger import Candidate, Ledger
    from reconcile.model_file import NominalAxis
    from reconcile.recording import AxisRecording
    from reconcile.scenes import Difference
    from reconcile.watch_kinds import Kind

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

TOGETHER = 2
"""Neighbouring blocks left out at once: slow noise is in both."""
FEWEST = 6.0
"""So many stretches, counted by what they say, must tell of an indicator."""
ALIKE = 1e-5
"""A column of which so little is its own cannot be told from the others."""
LEVEL_REACH = 0.5
"""How far the residual of another motion may lie away for no other reason, natural logarithm."""


class Indicator(NamedTuple):
    """One of one recording; SI."""

    name: str
    value: float
    error: float
    """Standard error, from within the recording."""
    reach: float
    """How far another motion may shift the value by itself: as if all that is left were of one form."""
    worth: float
    """RMS of the force or deviation that one unit of it makes; 0 for the logarithm of a level."""
    model: float | None
    """What the model file says; None where it says nothing of the kind."""


class Measured(NamedTuple):
    """One sense of one axis in one recording."""

    sense: Sense
    indicators: list[Indicator]
    size: float
    """RMS of the force behind the filter; of the deviation less its mean."""
    found: Difference
    theta: list[tuple[list[Candidate], Array]]
    """The model's own values, and those fitted to this recording: candidates and normalised coefficients."""


def measure(pieces: Sequence[AxisRecording], axis: NominalAxis, sense: Sense) -> Measured:
    """The indicators of one recording: of all its `pieces` together."""
    scenes = [scene_of(piece, axis) for piece in pieces]
    known = [one for one in model_effects(axis.held, axis, scenes) if one.sense is sense]
    kinds = KINDS[sense]
    extra = [(kind.effect, kind.shape) for kind in kinds if kind.effect]
    found = difference(scenes, sense, extra, only=True, known=known)
    ledger = found.ledger
    place = {c.effect: c for c in ledger.candidates if not c.per_recording}
    beside = [place[kind.effect] for kind in kinds if kind.effect and kind.beside]
    groups = _groups(ledger)
    indicators = []
    base = _Fit(ledger, beside, groups)
    for kind in kinds:
        fit = base if kind.beside else _Fit(ledger, [*beside, place[kind.effect]], groups)
        columns = (BASE[sense].index(kind.name),) if not kind.effect else place[kind.effect].columns
        one = fit.indicator(kind, columns)
        if one is not None:
            indicators.append(one._replace(model=_nominal(kind, axis)))
    indicators.append(base.level())
    size = math.sqrt(float(base.whole[:, 0, 0].sum()) / base.samples) * float(ledger.unit[0])
    nominal = _nominal_theta(found, axis, base)
    return Measured(sense, indicators, size, found, [([], nominal), (beside, base.theta)])


class _Fit:
    """One least-squares model, and itself without each group of blocks."""

    def __init__(self, ledger: Ledger, chosen: list[Candidate], groups: list[Index]) -> None:
        self._ledger, self._groups = ledger, groups
        self.slots = ledger.slots(chosen)
        parts = np.stack([ledger.totals(group) for group in groups])
        self.whole = parts.sum(axis=0)
        self.samples = int(ledger.samples.sum())
        self.theta = ledger.solve(self.slots, self.whole)
        self._without = ledger.solve(self.slots, self.whole - parts)
        column, active = ledger.places(self.slots)
        shared = active[:, :, None] & active[:, None, :]
        self._products = (parts[..., column[:, None], column] * shared).sum(axis=1)
        squares = ledger.squares(self.slots, self.theta, np.concatenate(groups))
        self._squares = np.add.reduceat(squares, np.cumsum([0, *map(len, groups[:-1])]))
        self._rms = math.sqrt(float(squares.sum()) / self.samples)

    def indicator(self, kind: Kind, columns: tuple[int, ...]) -> Indicator | None:
        """None where the recording does not tell."""
        places = [self.slots.index((column, -1)) for column in columns]
        if not all(self._told(place) for place in places):
            return None
        unit = self._ledger.real(self.slots, np.ones(len(self.slots)))[places] * kind.factor
        own, without = self.theta[places] * unit, self._without[:, places] * unit
        pair = len(places) == 2 and kind.name.startswith("once_a_turn")
        spread = (len(without) - 1.0) / len(without) * ((without - without.mean(axis=0)) ** 2).sum(axis=0)
        own_1 = self._own_share(places[0])
        reach = self._rms * abs(float(unit[0])) / (float(self._ledger.unit[0]) * math.sqrt(own_1))
        worth = float(self._ledger.unit[columns[0] + 1]) / abs(kind.factor)
        if not pair:  # of several columns the first one is meant
            return Indicator(kind.name, float(own[0]), math.sqrt(float(spread[0])), reach, worth, None)
        # a wave of any phase: without what noise alone would make of its square
        noise = float(spread.sum())
        value = math.sqrt(max(float(own @ own) - noise, 0.0))
        return Indicator(kind.name, value, math.sqrt(0.5 * noise), reach, worth, None)

    def level(self) -> Indicator:
        """Of what is left."""
        mean = float(self._squares.mean())
        error = float(np.std(self._squares, ddof=1)) / (mean * math.sqrt(len(self._squares)))
        value = math.log(max(self._rms, 1e-15))
        return Indicator(LEVEL, value, max(0.5 * error, 1e-3), LEVEL_REACH, 0.0, None)

    def _own(self, place: int) -> tuple[Array, float]:
        """What of a column is its own, square by group; and the column's whole square."""
        total = self._products.sum(axis=0)
        others = [k for k in range(len(total)) if k != place]
        direction = np.zeros(len(total))
        direction[place] = 1.0
        if others:
            within = total[np.ix_(others, others)] + 1e-12 * np.trace(total) * np.eye(len(others))
            direction[others] = -np.linalg.solve(within, total[others, place])
        own: Array = np.einsum("i,gij,j->g", direction, self._products, direction)
        return np.maximum(own, 0.0), float(total[place, place])

    def _own_share(self, place: int) -> float:
        """Mean square of what of a normalised column is its own."""
        return max(float(self._own(place)[0].sum()) / self.samples, 1e-12)

    def _told(self, place: int) -> bool:
        own, whole = self._own(place)
        total = float(own.sum())
        if total <= ALIKE * whole or total <= 0.0:
            return False
        return total**2 / float(own @ own) >= FEWEST


def _groups(ledger: Ledger) -> list[Index]:
    """Blocks in pairs of neighbours of one recording, those without samples left out."""
    groups = []
    for recording in range(ledger.recordings):
        own = np.flatnonzero((ledger.recording_of_block == recording) & (ledger.samples > 0))
        groups += [own[first : first + TOGETHER] for first in range(0, len(own), TOGETHER)]
    return groups


def _nominal(kind: Kind, axis: NominalAxis) -> float | None:
    """Coefficients of an effect are beside what the model holds of it: its own value is none of them."""
    return None if kind.effect else held_base(axis.held, axis)[kind.name]


def _nominal_theta(found: Difference, axis: NominalAxis, fit: _Fit) -> Array:
    """The model's own values, normalised; what it cannot know (origins) as fitted."""
    ledger = found.ledger
    slots = ledger.slots([])
    if found.sense is Sense.FORCE:
        given = held_base(axis.held, axis)
        values = np.array([given[found.base_names[column]] for column, _ in slots])
    else:
        fitted = ledger.real(slots, fit.theta[: len(slots)])
        own = np.array([found.base_names[column] == "origin_m" for column, _ in slots])
        values = np.where(own, fitted, 0.0)
    units: Array = ledger.real(slots, np.ones(len(slots)))
    return values / units


def scene_features(scenes: Sequence[Scene]) -> list[float]:
    """What kind of motion it was, (7,): logarithms and shares; 0.3 of any of them is another motion.

    Only of what the controller leads: a machine that has changed makes the same motion.
    """
    velocity = np.concatenate([s.motion.velocity_m_s for s in scenes])
    acceleration = np.concatenate([s.motion.acceleration_m_s2 for s in scenes])
    position = np.concatenate([s.motion.position_m for s in scenes])
    moving = np.concatenate([s.motion.moving for s in scenes])
    speed = np.abs(velocity[moving]) if moving.any() else np.array([1e-9])
    span = float(np.ptp(position)) + 1e-9
    return [
        math.log(float(np.sqrt(np.mean(speed**2))) + 1e-9),
        math.log(float(np.median(speed)) + 1e-9),
        math.log(float(np.std(acceleration)) + 1e-9),
        math.log(span),
        float(np.mean(position)) / span,
        2.0 * float(np.mean(speed < LOW_SPEED_M_S)),
        math.log(float(np.abs(velocity).mean()) + 1e-9),
    ]
