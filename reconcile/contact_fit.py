"""Spring, damper and play by output error: the whole plant along the recordings, until it says what they say.

The cost is the mean logarithm of the squares of short blocks, of motor and scale: what an impact throws off
by chance counts little there, however far. Impacts make it rough, so its lowest place is searched without
slopes: one coordinate after another, by steps that grow where they help and shrink where they do not (Hooke
and Jeeves 1961, exploratory moves). It is searched twice, from the best of a coarse grid, and from beside of
where that ended. Coordinates are those that the recordings tell apart: the damping as a ratio, the play
together with what friction presses into its flanks.

Limit: the stiffness of a flank may end in another valley (with 3 s of bounces two of four were 26 % and 125 %
off, the play by 0.2 % and 4 %), and the interval is that of the valley.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hil_sim.config import build_plant
from reconcile.contact_follower import followed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from hil_sim.config import PlantConfig
    from reconcile.contact_follower import Driven, Followed, Values

    Array = NDArray[np.float64]

PLAY, STIFFNESS = ("backlash", "play_m"), ("drive_compliance", "stiffness_n_m")
DAMPING, COULOMB = ("drive_compliance", "damping_n_s_m"), ("coulomb_friction", "coulomb_n")
SHORT_S = 0.04
"""Blocks whose squares are judged: an impact and its ringing."""
LATE = np.arange(-1.5, 2.01, 0.25)
"""Periods that a force may be late; scanned first, for everything else depends on it."""
LATE_STEP, LATE_FINE = 0.1, 0.002
MOST_RUNS, MOST_BEFORE = 150, 60
"""Of each search; and of one before the grid, for mass and friction come from columns that knew no play."""
GROW, SHRINK = 1.5, 0.4
BESIDE = 0.3
"""Share of the first steps, by which the second search begins beside the end of the first; and of its own."""
WHOLE_S = 0.5
"""Blocks whose errors are taken to have nothing in common, for the intervals."""
LEAST_PLAY_M = 1e-8
Name = tuple[str, str]
NOISE_COST = 2.0 * math.log(2.0)
"""Of sensors that are off by their own noise alone, beside which as much does not count."""
UNMET = 20.0
"""Last steps by which an interval is wider for each unit of the cost above that. On concealed contacts (plays
of 1 to 17 um, 80 to 260 N/um) the stiffness was off by 1.2 % a unit, and its last step is 0.3 %; made by
another integrator, the damping by 6 %.
"""


class Unknown(NamedTuple):
    """A value of the plant that is fitted, by its logarithm."""

    name: Name
    """Section and field of the plant's parameters."""
    start: float
    low: float
    high: float
    step: float
    """First step of the logarithm, and the last one."""
    fine: float
    grid: tuple[float, ...] = (1.0,)
    """Factors of the start that are tried first, each with those of the others."""


class Seen(NamedTuple):
    """One recording; arrays (n,)."""

    driven: Driven
    scale_m: Array
    judged: NDArray[np.bool_]
    """Samples that are fitted."""
    steps_m: tuple[float, float]
    """Of encoder and scale: below their noise nothing is gained."""


class ContactFit(NamedTuple):
    """The lowest place that was found."""

    values: Values
    bounds: dict[tuple[str, str], tuple[float, float]]
    """95 %, by drawing whole blocks anew."""
    late: float
    blocks: Array
    """Squares of motor and scale in each short block, in those of the sensors' steps, multiplied."""
    at_start: Array
    """The same of the values at the start, at the late of their own that is best."""
    at_bound: bool
    """A value lies at the end of what it may be: nothing is to be made of it."""


class _Tried(NamedTuple):
    coordinates: Array
    logarithms: Array
    """Of motor and scale, by short block."""

    @property
    def cost(self) -> float:
        return float(self.logarithms.mean())


class _Search:
    """Values and coordinates of what is fitted."""

    def __init__(
        self, plant: PlantConfig, index: int, unknowns: Sequence[Unknown], seen: Sequence[Seen]
    ) -> None:
        self.plant, self.index, self.unknowns, self.seen = plant, index, unknowns, seen
        self.runs = 0

    def errors(self, coordinates: Array) -> list[Array]:
        """By recording, in the sensors' noise: (2, blocks, samples)."""
        values, late = self.values(coordinates), float(coordinates[-1])
        self.runs += 1
        return [
            short_errors(
                one, followed(build_plant(self.plant), self.index, values, one.driven, late, self.plant.dt_s)
            )
            for one in self.seen
        ]

    def at(self, coordinates: Array) -> _Tried:
        """The cost there."""
        squares = [_squares(errors) for errors in self.errors(coordinates)]
        return _Tried(coordinates, np.concatenate([np.log(one).sum(axis=0) for one in squares]))

    def values(self, coordinates: Array) -> Values:
        """Of the plant."""
        found = {u.name: float(math.exp(x)) for u, x in zip(self.unknowns, coordinates, strict=False)}
        if DAMPING in found and STIFFNESS in found:
            found[DAMPING] *= math.sqrt(found[STIFFNESS])
        if PLAY in found and STIFFNESS in found:
            found[PLAY] = max(found[PLAY] - found.get(COULOMB, 0.0) / found[STIFFNESS], LEAST_PLAY_M)
        return found

    def coordinates(self, values: Values, late: float) -> Array:
        """Of such values; the last one is how late the force is."""
        first = dict(values)
        if DAMPING in values and STIFFNESS in values:
            first[DAMPING] = values[DAMPING] / math.sqrt(values[STIFFNESS])
        if PLAY in values and STIFFNESS in values:
            first[PLAY] = values[PLAY] + values.get(COULOMB, 0.0) / values[STIFFNESS]
        return np.array([*(math.log(first[u.name]) for u in self.unknowns), late])

    def allowed(self, coordinates: Array) -> bool:
        """Whether the values are what they may be."""
        values = self.values(coordinates)
        return all(u.low <= values[u.name] <= u.high for u in self.unknowns)

    def lowest(self, best: _Tried, share: float, most_runs: int, kept: tuple[Name, ...] = ()) -> _Tried:
        """From a place on, by a `share` of the first steps; all but those that are `kept`."""
        steps = share * np.array([0.0 if u.name in kept else u.step for u in self.unknowns] + [LATE_STEP])
        fine = np.array([*(u.fine for u in self.unknowns), LATE_FINE])
        sign = np.ones(len(steps))
        most = self.runs + most_runs
        while self.runs < most and (steps > fine).any():
            for k in np.flatnonzero(steps > 0.5 * fine):
                for towards in (sign[k], -sign[k]):
                    moved = best.coordinates.copy()
                    moved[k] += towards * steps[k]
                    there = self.at(moved) if self.allowed(moved) else None
                    if there is not None and there.cost < best.cost:
                        best, sign[k] = there, towards
                        steps[k] *= GROW
                        break
                else:
                    steps[k] *= SHRINK
        return best


def fitted(plant: PlantConfig, index: int, unknowns: Sequence[Unknown], seen: Sequence[Seen]) -> ContactFit:
    """The `unknowns` of one axis of the plant, which has a drive_compliance, by all that was seen."""
    search = _Search(plant, index, unknowns, seen)
    start = search.coordinates({u.name: u.start for u in unknowns}, 0.0)
    scanned = [search.at(np.append(start[:-1], late)) for late in LATE]
    at_start = min(scanned, key=_cost)
    beside = search.lowest(at_start, 1.0, MOST_BEFORE, (STIFFNESS, DAMPING))
    grid = [
        beside.coordinates + np.append(np.log(factors), 0.0)
        for factors in itertools.product(*(u.grid for u in unknowns))
    ]
    lowest = min((search.at(place) for place in grid if search.allowed(place)), key=_cost)
    first = search.lowest(lowest, 1.0, MOST_RUNS)
    moved = first.coordinates + BESIDE * np.array([*(u.step for u in unknowns), LATE_STEP])
    second = search.lowest(search.at(moved), BESIDE, MOST_RUNS) if search.allowed(moved) else first
    best, other = sorted((first, second), key=_cost)
    values = search.values(best.coordinates)
    return ContactFit(
        values,
        _bounds(search, best, other),
        float(best.coordinates[-1]),
        np.exp(best.logarithms),
        np.exp(at_start.logarithms),
        any(not 1.02 * u.low < values[u.name] < 0.98 * u.high for u in unknowns),
    )


def _cost(tried: _Tried) -> float:
    return tried.cost


def short_errors(one: Seen, run: Followed) -> Array:
    """What motor and scale are off in short blocks that are judged, in their noise: (2, blocks, samples)."""
    length = max(round(SHORT_S / one.driven.period_s), 2)
    count = len(one.judged) // length
    apart_m = one.scale_m - one.driven.motor_m - run.deviation_m
    apart_m = apart_m - apart_m[one.judged].mean()  # where the scale was zeroed nobody knows
    both = np.stack((run.ahead_m, apart_m))[:, : count * length].reshape(2, count, length)
    whole = one.judged[: count * length].reshape(count, length).all(axis=1)
    noise_m = np.array(one.steps_m) / math.sqrt(12.0)
    errors: Array = both[:, whole] / noise_m[:, None, None]
    return errors


def _squares(errors: Array) -> Array:
    """Of short blocks, (2, blocks); what lies below the sensors' steps is no better for it."""
    squares: Array = (errors**2).mean(axis=2) + 1.0
    return squares


def _bounds(search: _Search, best: _Tried, other: _Tried) -> dict[tuple[str, str], tuple[float, float]]:
    """95 %: of least squares with weighted blocks, or as far as the two searches ended apart.

    Where impacts are not met, another place may be as good: wider by what is left above the noise.
    """
    scale = [np.sqrt(_squares(errors))[:, :, None] for errors in search.errors(best.coordinates)]

    def weighted(coordinates: Array) -> Array:
        errors = zip(search.errors(coordinates), scale, strict=True)
        return np.concatenate([one / by for one, by in errors], axis=1)

    steps = np.array([*(2.0 * u.fine for u in search.unknowns), 2.0 * LATE_FINE])
    sides = [(weighted(best.coordinates + h), weighted(best.coordinates - h)) for h in np.diag(steps)]
    slopes = np.stack([(up - down) / (2.0 * h) for (up, down), h in zip(sides, steps, strict=True)])
    by_block = np.einsum("kcbs,cbs->kb", slopes, weighted(best.coordinates))
    edges = np.arange(0, by_block.shape[1], round(WHOLE_S / SHORT_S))
    pulls = np.add.reduceat(by_block, edges, axis=1)
    curvature = np.einsum("icbs,jcbs->ij", slopes, slopes)
    inverse = np.linalg.pinv(curvature, hermitian=True)
    spread = np.sqrt(np.diag(inverse @ pulls @ pulls.T @ inverse))
    unmet = max(best.cost - NOISE_COST, 0.0)
    found = {}
    middle, beside = search.values(best.coordinates), search.values(other.coordinates)
    for k, u in enumerate(search.unknowns):
        half = max(1.96 * float(spread[k]), u.fine, abs(math.log(beside[u.name] / middle[u.name])))
        half += UNMET * u.fine * unmet
        found[u.name] = (middle[u.name] * math.exp(-half), middle[u.name] * math.exp(half))
    return found
