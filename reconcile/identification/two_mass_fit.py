"""Output-error fit of spring, damper and backlash: the whole plant is simulated along the recordings.

The cost is the mean log square error of short blocks of motor and scale, so that a mistimed impact has little
weight. Impacts make it rough, so the search uses no gradients: coordinate steps that grow on success and
shrink on failure (Hooke and Jeeves 1961, exploratory moves). It runs twice, from the best point of a coarse
grid and from beside its result. Coordinates are those that the recordings separate: damping over the root of
stiffness, and the gap plus the flank deflection under friction.

Limit: the stiffness of a flank may end in a local minimum (with 3 s of bounces two of four were 26 % and 125
% off, the gap by 0.2 % and 4 %), and the interval is that of the minimum.
"""

import itertools
import math
import operator
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hil_sim.config import PlantConfig, build_plant
from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.identification.two_mass_recording import SHORT_BLOCK_S, TwoMassRecording, short_block_errors
from reconcile.identification.two_mass_rollout import Values, respond

PLAY, STIFFNESS = ("backlash", "play_m"), ("drive_compliance", "stiffness_n_m")
DAMPING, COULOMB = ("drive_compliance", "damping_n_s_m"), ("coulomb_friction", "coulomb_n")
DELAYS_SCANNED = np.arange(-1.5, 2.01, 0.25)
"""Delays of the force, in periods; scanned first, because every parameter depends on them."""
DELAY_STEP, DELAY_FINE_STEP = 0.1, 0.002
MOST_SIMULATIONS, MOST_BEFORE_GRID = 150, 60
"""Simulations of a search, and of that before the grid, which corrects mass and friction for the gap."""
GROW, SHRINK = 1.5, 0.4
"""Factors on a step after a success and after a failure; chosen."""
RESTART_SHARE = 0.3
"""Of the second search: offset of its start from the first result, and its first steps, both over the first
steps of the first search. Chosen."""
INDEPENDENT_BLOCK_S = 0.5
"""Length of blocks with independent errors, s, for the intervals."""
LEAST_PLAY_M = 1e-8
"""Least gap of the simulated backlash; chosen."""
Name = tuple[str, str]
COST_OF_NOISE = 2.0 * math.log(2.0)
"""Cost of errors that equal the sensors' quantisation noise."""
STEPS_PER_EXCESS_COST = 20.0
"""Widening of an interval in last steps, per unit of cost above COST_OF_NOISE. Calibrated on concealed
contacts (gaps of 1 to 17 um, 80 to 260 N/um): the stiffness was off by 1.2 % a unit, and its last step is
0.3 %; with another integrator, the damping by 6 %.
"""


class FreeParameter(NamedTuple):
    """A parameter of the plant, fitted as its logarithm."""

    name: Name
    """Section and field of the plant's parameters."""
    start: float
    low: float
    high: float
    step: float
    """First step of the logarithm; `fine` is the last one."""
    fine: float
    grid: tuple[float, ...] = (1.0,)
    """Factors of the start in the coarse grid."""


class TwoMassFit(NamedTuple):
    """The best result of both searches."""

    values: Values
    bounds: dict[Name, tuple[float, float]]
    """95 % intervals."""
    delay_periods: float
    blocks: Array
    """Product of the squares of motor and scale in each short block, in quantisation variances."""
    at_start: Array
    """The same product for the starting values at their best delay."""
    at_bound: bool
    """A value lies at a bound: the fit is not used."""


class _Evaluation(NamedTuple):
    coordinates: Array
    logarithms: Array
    """Log squares of motor plus scale, by short block."""

    @property
    def cost(self) -> float:
        return float(self.logarithms.mean())


COST = operator.attrgetter("cost")


class _Search:
    """Cost function and coordinate search."""

    def __init__(
        self,
        plant: PlantConfig,
        index: int,
        free_parameters: Sequence[FreeParameter],
        recordings: Sequence[TwoMassRecording],
    ) -> None:
        self.plant, self.index = plant, index
        self.free_parameters, self.recordings = free_parameters, recordings
        self.runs = 0

    def errors(self, coordinates: Array) -> list[Array]:
        """Return the errors by recording, in units of sensor noise (2, blocks, samples)."""
        values, delay_periods, dt_s = self.values(coordinates), float(coordinates[-1]), self.plant.dt_s
        self.runs += 1
        by_recording = []
        for one in self.recordings:
            plant = build_plant(self.plant)
            run = respond(
                plant, self.index, values=values, driven=one.driven, delay_periods=delay_periods, dt_s=dt_s
            )
            by_recording.append(short_block_errors(one, run))
        return by_recording

    def at(self, coordinates: Array) -> _Evaluation:
        """Evaluate the cost at a point."""
        squares = [_squares(errors) for errors in self.errors(coordinates)]
        return _Evaluation(coordinates, np.concatenate([np.log(one).sum(axis=0) for one in squares]))

    def values(self, coordinates: Array) -> Values:
        """Return the plant parameters of a point."""
        values = {
            free.name: float(math.exp(x)) for free, x in zip(self.free_parameters, coordinates, strict=False)
        }
        if DAMPING in values and STIFFNESS in values:
            values[DAMPING] *= math.sqrt(values[STIFFNESS])
        if PLAY in values and STIFFNESS in values:
            values[PLAY] = max(values[PLAY] - values.get(COULOMB, 0.0) / values[STIFFNESS], LEAST_PLAY_M)
        return values

    def coordinates(self, values: Values, delay_periods: float) -> Array:
        """Point of plant parameters; its last coordinate is the delay of the force."""
        first = dict(values)
        if DAMPING in values and STIFFNESS in values:
            first[DAMPING] = values[DAMPING] / math.sqrt(values[STIFFNESS])
        if PLAY in values and STIFFNESS in values:
            first[PLAY] = values[PLAY] + values.get(COULOMB, 0.0) / values[STIFFNESS]
        return np.array([*(math.log(first[free.name]) for free in self.free_parameters), delay_periods])

    def allowed(self, coordinates: Array) -> bool:
        """Whether all parameters are within their bounds."""
        values = self.values(coordinates)
        return all(free.low <= values[free.name] <= free.high for free in self.free_parameters)

    def minimise(
        self, best: _Evaluation, share: float, most_runs: int, kept: tuple[Name, ...] = ()
    ) -> _Evaluation:
        """Search from a point with a `share` of the first steps; parameters in `kept` are fixed."""
        first = [0.0 if free.name in kept else free.step for free in self.free_parameters]
        steps = share * np.array([*first, DELAY_STEP])
        fine = np.array([*(free.fine for free in self.free_parameters), DELAY_FINE_STEP])
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


def fit_two_mass(
    plant: PlantConfig,
    index: int,
    free_parameters: Sequence[FreeParameter],
    recordings: Sequence[TwoMassRecording],
) -> TwoMassFit:
    """Fit the free parameters of one axis of the plant, which has a drive_compliance, to all recordings."""
    search = _Search(plant, index, free_parameters, recordings)
    start = search.coordinates({free.name: free.start for free in free_parameters}, 0.0)
    scanned = [search.at(np.append(start[:-1], delay_periods)) for delay_periods in DELAYS_SCANNED]
    at_start = min(scanned, key=COST)
    beside = search.minimise(at_start, 1.0, MOST_BEFORE_GRID, (STIFFNESS, DAMPING))
    grid = [
        beside.coordinates + np.append(np.log(factors), 0.0)
        for factors in itertools.product(*(free.grid for free in free_parameters))
    ]
    allowed = [place for place in grid if search.allowed(place)]
    if not allowed:
        reason = "its spring is beyond what the substeps or the plant's bounds allow"
        raise ReconcileError("", "drive_compliance", reason, "shorten plant.substep_us")
    coarse = min((search.at(place) for place in allowed), key=COST)
    first = second = search.minimise(coarse, 1.0, MOST_SIMULATIONS)
    moved = first.coordinates + RESTART_SHARE * np.array(
        [*(free.step for free in free_parameters), DELAY_STEP]
    )
    if search.allowed(moved):
        second = search.minimise(search.at(moved), RESTART_SHARE, MOST_SIMULATIONS)
    best, other = sorted((first, second), key=COST)
    values = search.values(best.coordinates)
    return TwoMassFit(
        values=values,
        bounds=_bounds(search, best, other),
        delay_periods=float(best.coordinates[-1]),
        blocks=np.exp(best.logarithms),
        at_start=np.exp(at_start.logarithms),
        at_bound=any(not 1.02 * free.low < values[free.name] < 0.98 * free.high for free in free_parameters),
    )


def _squares(errors: Array) -> Array:
    """Mean squares of short blocks, (2, blocks); plus 1, so that errors below the noise gain nothing."""
    squares: Array = (errors**2).mean(axis=2) + 1.0
    return squares


def _bounds(search: _Search, best: _Evaluation, other: _Evaluation) -> dict[Name, tuple[float, float]]:
    """95 % intervals of weighted least squares, at least as wide as the two searches' results are apart.

    Widened by the cost above the noise, because where impacts are not reproduced other minima may be as good.
    """
    scale = [np.sqrt(_squares(errors))[:, :, None] for errors in search.errors(best.coordinates)]

    def weighted(coordinates: Array) -> Array:
        errors = zip(search.errors(coordinates), scale, strict=True)
        return np.concatenate([one / by for one, by in errors], axis=1)

    steps = np.array([*(2.0 * free.fine for free in search.free_parameters), 2.0 * DELAY_FINE_STEP])
    sides = [(weighted(best.coordinates + h), weighted(best.coordinates - h)) for h in np.diag(steps)]
    slopes = np.stack([(up - down) / (2.0 * h) for (up, down), h in zip(sides, steps, strict=True)])
    by_block = np.einsum("kcbs,cbs->kb", slopes, weighted(best.coordinates))
    edges = np.arange(0, by_block.shape[1], round(INDEPENDENT_BLOCK_S / SHORT_BLOCK_S))
    pulls = np.add.reduceat(by_block, edges, axis=1)
    curvature = np.einsum("icbs,jcbs->ij", slopes, slopes)
    inverse = np.linalg.pinv(curvature, hermitian=True)
    spread = np.sqrt(np.diag(inverse @ pulls @ pulls.T @ inverse))
    excess_cost = max(best.cost - COST_OF_NOISE, 0.0)
    bounds = {}
    middle, beside = search.values(best.coordinates), search.values(other.coordinates)
    for k, free in enumerate(search.free_parameters):
        half = max(1.96 * float(spread[k]), free.fine, abs(math.log(beside[free.name] / middle[free.name])))
        half += STEPS_PER_EXCESS_COST * free.fine * excess_cost
        bounds[free.name] = (middle[free.name] * math.exp(-half), middle[free.name] * math.exp(half))
    return bounds
