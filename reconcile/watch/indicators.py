"""Condenses a recording into indicators of an axis: physical quantities, each with its standard error.

An indicator is a coefficient of the regression of a diagnosis: of the rigid model, or of an effect of the
catalogue at fixed shape parameters, so that all recordings are comparable. Errors come from a block jackknife
(Efron and Tibshirani 1993, chapter 11): a quantity that the recording hardly excites gets a wide error, and
one that only a few blocks determine is omitted.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array, Index, rms
from reconcile.catalogue.entry import IndicatorKind
from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.registry import ENTRIES
from reconcile.catalogue.stribeck_friction import LOW_SPEED_M_S
from reconcile.formats.nominal_axis import NominalAxis, baseline_parameters
from reconcile.nominal_model.model_terms import terms_of_model
from reconcile.recording.recording import AxisRecording
from reconcile.regression.candidate_term import CandidateTerm
from reconcile.regression.normal_equations import BlockNormalEquations
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import BASELINE_PARAMETERS, regression_problem

JACKKNIFE_BLOCKS = 2
"""Neighbouring blocks that the jackknife omits together, because slow noise correlates them."""
MIN_EFFECTIVE_GROUPS = 6.0
"""Least effective number of groups that determine an indicator, weighted by their information."""
MIN_INDEPENDENT_SHARE = 1e-5
"""Least share of a column's square that is orthogonal to the other columns."""
LEVEL_SPREAD = 0.5
"""Standard deviation of the log residual level between different motions."""

RIGID_MODEL = (
    IndicatorKind(name="mass_kg", unit="kg", words="moved mass", beside=True),
    IndicatorKind(name="viscous_n_s_m", unit="N s/m", words="viscous friction", beside=True),
    IndicatorKind(name="coulomb_n", unit="N", words="Coulomb friction", beside=True),
)
"""Coefficients of the rigid model."""


def _of_effects(channel: ResidualChannel) -> tuple[IndicatorKind, ...]:
    """Return the indicators of the catalogue: first those that are fitted together, then by rank."""
    entries = sorted((e for e in ENTRIES.values() if e.family(channel)), key=lambda entry: entry.rank)
    found = [indicator._replace(effect=entry.name) for entry in entries for indicator in entry.indicators]
    own = [indicator for indicator in found if indicator.channel in {None, channel}]
    return tuple(sorted(own, key=lambda indicator: not indicator.beside))


INDICATORS = {
    ResidualChannel.FORCE: RIGID_MODEL + _of_effects(ResidualChannel.FORCE),
    ResidualChannel.POSITION_DEVIATION: _of_effects(ResidualChannel.POSITION_DEVIATION),
}
RESIDUAL_LEVEL = "residual"
"""Name of the residual level: the natural logarithm of the residual's RMS in N or m."""
RESIDUAL_WORDS = {
    ResidualChannel.FORCE: "force that nothing explains",
    ResidualChannel.POSITION_DEVIATION: "deviation that nothing explains",
}


class Indicator(NamedTuple):
    """One indicator of one recording; SI."""

    name: str
    value: float
    error: float
    """Standard error, from within the recording."""
    motion_spread: float
    """By how much another motion may shift the value: as if the whole residual had the form of its column."""
    rms_per_unit: float
    """RMS force or deviation of one unit of the indicator; 0 for the residual level."""
    model: float | None = None
    """Value in the model file; None where it has none."""


class MeasuredIndicators(NamedTuple):
    """The indicators of one channel of one axis in one recording."""

    channel: ResidualChannel
    indicators: list[Indicator]
    size: float
    """RMS of the filtered force, or of the deviation less its mean."""
    datasets: Sequence[RegressionData]
    """Regression data of the pieces of the recording."""


def measure(
    pieces: Sequence[AxisRecording], axis: NominalAxis, channel: ResidualChannel
) -> MeasuredIndicators:
    """Return the indicators of one recording from all its `pieces` together."""
    datasets = [regression_data(piece, axis) for piece in pieces]
    model_terms = [one for one in terms_of_model(axis, datasets) if one.channel is channel]
    kinds = INDICATORS[channel]
    extra = [(kind.effect, kind.shape_parameters) for kind in kinds if kind.effect]
    equations = regression_problem(datasets, channel, extra, only=True, model_terms=model_terms).equations
    term_of = {c.effect: c for c in equations.candidates if not c.per_recording}
    beside = [term_of[kind.effect] for kind in kinds if kind.effect and kind.beside]
    groups = _groups(equations)
    indicators = []
    base = _Fit(equations, beside, groups)
    for kind in kinds:
        fit = base if kind.beside else _Fit(equations, [*beside, term_of[kind.effect]], groups)
        if kind.effect:
            one = fit.indicator(kind, term_of[kind.effect].columns)
        else:
            one = fit.indicator(kind, (BASELINE_PARAMETERS[channel].index(kind.name),))
        if one is not None:
            indicators.append(one._replace(model=_nominal(kind, axis)))
    indicators.append(base.level())
    size = math.sqrt(float(base.whole[:, 0, 0].sum()) / base.samples) * float(equations.unit[0])
    return MeasuredIndicators(channel, indicators, size, datasets)


class _Fit:
    """A least-squares fit, and the jackknife fits that omit one group of blocks each."""

    def __init__(
        self, equations: BlockNormalEquations, chosen: list[CandidateTerm], groups: list[Index]
    ) -> None:
        self._equations = equations
        self.slots = equations.slots(chosen)
        parts = np.stack([equations.totals(group) for group in groups])
        self.whole = parts.sum(axis=0)
        self.samples = int(equations.samples.sum())
        self.theta = equations.solve(self.slots, self.whole)
        self._without = equations.solve(self.slots, self.whole - parts)
        column, active = equations.places(self.slots)
        shared = active[:, :, None] & active[:, None, :]
        self._products = (parts[..., column[:, None], column] * shared).sum(axis=1)
        squares = equations.squares(self.slots, self.theta, np.concatenate(groups))
        self._squares = np.add.reduceat(squares, np.cumsum([0, *map(len, groups[:-1])]))
        self._rms = math.sqrt(float(squares.sum()) / self.samples)

    def indicator(self, kind: IndicatorKind, columns: tuple[int, ...]) -> Indicator | None:
        """Return an indicator; None if the recording does not determine it."""
        places = [self.slots.index((column, -1)) for column in columns]
        if not all(self._is_determined(place) for place in places):
            return None
        scale = self._equations.unit
        unit = self._equations.denormalised(self.slots, np.ones(len(self.slots)))[places] * kind.factor
        own, without = self.theta[places] * unit, self._without[:, places] * unit
        spread = (len(without) - 1.0) / len(without) * ((without - without.mean(axis=0)) ** 2).sum(axis=0)
        # of several columns the first is the indicator
        value, error = float(own[0]), math.sqrt(float(spread[0]))
        if len(places) == 2 and kind.name.startswith("once_a_turn"):
            # amplitude of a wave of any phase, less the bias that noise adds to its square
            noise = float(spread.sum())
            value, error = math.sqrt(max(float(own @ own) - noise, 0.0)), math.sqrt(0.5 * noise)
        # mean square of the independent part of the normalised column
        independent = max(float(self._independent_squares(places[0])[0].sum()) / self.samples, 1e-12)
        motion_spread = self._rms * abs(float(unit[0])) / (float(scale[0]) * math.sqrt(independent))
        rms_per_unit = float(scale[columns[0] + 1]) / abs(kind.factor)
        return Indicator(kind.name, value, error, motion_spread, rms_per_unit)

    def level(self) -> Indicator:
        """Return the indicator of the residual level."""
        mean = float(self._squares.mean())
        error = float(np.std(self._squares, ddof=1)) / (mean * math.sqrt(len(self._squares)))
        value = math.log(max(self._rms, 1e-15))
        return Indicator(RESIDUAL_LEVEL, value, max(0.5 * error, 1e-3), LEVEL_SPREAD, rms_per_unit=0.0)

    def _independent_squares(self, place: int) -> tuple[Array, float]:
        """Return the squares by group of a column's part orthogonal to the others, and its whole square."""
        total = self._products.sum(axis=0)
        others = [k for k in range(len(total)) if k != place]
        direction = np.zeros(len(total))
        direction[place] = 1.0
        if others:
            within = total[np.ix_(others, others)] + 1e-12 * np.trace(total) * np.eye(len(others))
            direction[others] = -np.linalg.solve(within, total[others, place])
        squares: Array = np.einsum("i,gij,j->g", direction, self._products, direction)
        return np.maximum(squares, 0.0), float(total[place, place])

    def _is_determined(self, place: int) -> bool:
        squares, whole = self._independent_squares(place)
        total = float(squares.sum())
        if total <= MIN_INDEPENDENT_SHARE * whole or total <= 0.0:
            return False
        return total**2 / float(squares @ squares) >= MIN_EFFECTIVE_GROUPS


def _groups(equations: BlockNormalEquations) -> list[Index]:
    """Return the blocks with samples in groups of neighbours of one recording."""
    groups = []
    for recording in range(equations.recordings):
        own = np.flatnonzero((equations.recording_of_block == recording) & (equations.samples > 0))
        groups += [own[first : first + JACKKNIFE_BLOCKS] for first in range(0, len(own), JACKKNIFE_BLOCKS)]
    return groups


def _nominal(kind: IndicatorKind, axis: NominalAxis) -> float | None:
    """Return the value of the model; None for an effect, whose coefficient adds to its model effect."""
    return None if kind.effect else baseline_parameters(axis)[kind.name]


def motion_features(datasets: Sequence[RegressionData]) -> list[float]:
    """Return features (7,) of a motion: logarithms and shares, of which 0.3 is another kind of motion.

    They use commanded quantities only, so that a machine that has changed makes the same motion.
    """
    velocity = np.concatenate([s.motion.velocity_m_s for s in datasets])
    acceleration = np.concatenate([s.motion.acceleration_m_s2 for s in datasets])
    position = np.concatenate([s.motion.position_m for s in datasets])
    moving = np.concatenate([s.motion.moving for s in datasets])
    speed = np.abs(velocity[moving]) if moving.any() else np.array([1e-9])
    span = float(np.ptp(position)) + 1e-9
    return [
        math.log(rms(speed) + 1e-9),
        math.log(float(np.median(speed)) + 1e-9),
        math.log(float(np.std(acceleration)) + 1e-9),
        math.log(span),
        float(np.mean(position)) / span,
        2.0 * float(np.mean(speed < LOW_SPEED_M_S)),
        math.log(float(np.abs(velocity).mean()) + 1e-9),
    ]
