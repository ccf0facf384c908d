"""From recordings to a regression problem: kinematics, filtered columns, blocks, normal equations."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from kernels.arrays import Array, Index
from reconcile.catalogue.conversion import ModelTerm
from reconcile.catalogue.kinds import OWN, SHARED, RegressionData, ResidualChannel, ShapeParameters
from reconcile.catalogue.registry import ENTRIES, family, has_levels
from reconcile.catalogue.smooth_terms import PREFIX
from reconcile.catalogue.unnamed_terms import term
from reconcile.nominal_model.nominal_axis import NominalAxis
from reconcile.recording.kinematics import gaussian_width_s, kinematics
from reconcile.recording.recording import AxisRecording
from reconcile.regression.model_presliding import presliding_n
from reconcile.regression.normal_equations import BlockNormalEquations, CandidateTerm
from reconcile.regression.resolution import settled_travel_m
from reconcile.regression.state_filter import StateFilter

BLOCK_S = 0.5
"""Length of a block, s, unless the recordings give fewer than FEWEST_BLOCKS."""
LEAST_CLEAN_HZ = 150.0
"""Corner of the kinematics below which their low pass is applied to both sides of the regression."""
OVERSAMPLING = 4.0
"""Rate of the kept samples over the filter's bandwidth; samples in between add no information."""
FEWEST_BLOCKS = 80
FILTER_HZ = 60.0
"""Bandwidth of the state filter, that of the published figures on EMPS."""
END_S = 0.02
"""Time at the end that is left out, s: the motion that follows it is unknown."""
STICK_S = 1e-3
"""Width of the Gaussian over the force from which the friction of a sticking axis is computed, s."""
BASELINE_PARAMETERS = {
    ResidualChannel.FORCE: ["mass_kg", "viscous_n_s_m", "coulomb_n"],
    ResidualChannel.POSITION_DEVIATION: ["origin_m", "delay_s"],
}
"""Parameters of every model, by channel."""
FREE_IN_EACH_RECORDING = ("origin_m",)
"""Those with a value for each recording, because sensors are re-zeroed."""
SINCE_REVERSAL = PREFIX + "distance_since_reversal"
"""Unnamed term over the distance since the reversal; always a candidate, because presliding shows there."""


class TermColumns(NamedTuple):
    """A term and the columns that it adds."""

    effect: str
    shape_parameters: ShapeParameters
    columns: Callable[[RegressionData, ShapeParameters], Array]
    width: int


class RegressionProblem(NamedTuple):
    """The regression of one residual channel of one axis; arrays by recording."""

    channel: ResidualChannel
    datasets: Sequence[RegressionData]
    equations: BlockNormalEquations
    terms: list[TermColumns]
    used: list[NDArray[np.bool_]]
    """(n,) for each recording: the samples that are fitted and judged."""
    block_of: list[Index]
    """(n,) for each recording: the block that a sample is in."""
    model_terms: Sequence[ModelTerm]
    """Terms that the model has already; their prediction is subtracted from the target."""

    @property
    def baseline_names(self) -> list[str]:
        """Parameters of every model of the channel, which have the first columns."""
        return BASELINE_PARAMETERS[self.channel]

    def target_and_columns(self, recording: int) -> tuple[Array, Array]:
        """Target (n,) and columns (n, c) of a recording, filtered, not normalised."""
        return _target_and_columns(self.datasets[recording], self.channel, self.terms, self.model_terms)


def regression_data(recording: AxisRecording, axis: NominalAxis) -> RegressionData:
    """Compute what columns need of a recording: kinematics, forces of the model, masses."""
    others = {name: kinematics(values, recording.period_s) for name, values in recording.others.items()}
    motion = kinematics(recording.motor_m, recording.period_s)
    law_n = presliding_n(axis.model_effects, axis.coulomb_n, motion, recording.period_s)
    return with_model_force(
        RegressionData(
            period_s=recording.period_s,
            time_s=recording.time_s - recording.time_s[0],
            motion=motion,
            force_n=recording.force_n,
            model_force_n=recording.force_n,
            lead_m=axis.lead_m,
            motor_mass_kg=axis.motor_mass_kg,
            scale_m=recording.scale_m,
            temperature_k=recording.temperature_k,
            others=others,
            presliding_law_n=0.0 if law_n is None else law_n,
        )
    )


def with_model_force(data: RegressionData) -> RegressionData:
    """Set the force of a rigid model, fitted to this recording, and the direction of friction.

    Where the axis sticks, friction balances the measured force: any share of the Coulomb level, and no step.
    """
    m = data.motion
    y, rigid = _target_and_baseline(data, ResidualChannel.FORCE)
    used = _samples_in_use(data, ResidualChannel.FORCE)
    rigid = np.concatenate((rigid, np.ones((len(y), 1))), axis=1)
    (mass_kg, viscous_n_s_m, coulomb_n, offset_n), *_ = np.linalg.lstsq(rigid[used], y[used], rcond=None)
    frictionless_n = mass_kg * m.acceleration_m_s2 + viscous_n_s_m * m.velocity_m_s
    direction = friction_direction(data, frictionless_n + offset_n, max(coulomb_n, 1e-9))
    return data._replace(
        motion=m._replace(direction=direction),
        model_force_n=frictionless_n + coulomb_n * direction + data.presliding_law_n,
    )


def friction_direction(data: RegressionData, frictionless_n: Array, level_n: Array | float) -> Array:
    """Direction of friction (n,): of motion; where the axis sticks, the share of `level_n` that holds it."""
    measured_n = gaussian_filter1d(data.force_n - data.presliding_law_n, STICK_S / data.period_s)
    share = np.clip((measured_n - frictionless_n) / level_n, -1.0, 1.0)
    return np.where(data.motion.moving, data.motion.direction, share)


def predicted_by_model(
    data: RegressionData, channel: ResidualChannel, model_terms: Sequence[ModelTerm]
) -> Array:
    """Prediction of the terms that the model has already (n,), unfiltered."""
    total = np.zeros(len(data.time_s))
    for one in model_terms:
        if of := family(one.effect, channel):
            total += of.columns(data, one.shape_parameters) @ np.array(one.coefficients)
    return total


def regression_problem(
    datasets: Sequence[RegressionData],
    channel: ResidualChannel,
    extra: Sequence[tuple[str, ShapeParameters]] = (),
    *,
    only: bool = False,
    model_terms: Sequence[ModelTerm] = (),
) -> RegressionProblem:
    """Set up the regression of a channel, less what the model predicts already.

    `extra`: further terms (effect, shape parameters); `only`: no terms but these.
    """
    terms = _terms(datasets, channel, extra, only=only)
    used = [_samples_in_use(data, channel) for data in datasets]
    block_of, recording_of_block = _blocks(datasets)
    free = [name in FREE_IN_EACH_RECORDING for name in BASELINE_PARAMETERS[channel]]
    place, candidates = len(free), []
    for effect, shape, _, width in terms:
        places = tuple(range(place, place + width))
        place += width
        variants = _per_recording(effect, width, channel, len(datasets))
        candidates += [CandidateTerm(effect, shape, own, places) for own in variants]
    equations = BlockNormalEquations(free, candidates, recording_of_block)
    for data, counts, block in zip(datasets, used, block_of, strict=True):
        y, columns = _target_and_columns(data, channel, terms, model_terms)
        kept = np.flatnonzero(counts)[:: stride(data.period_s)]
        equations.add(y[kept], columns[kept], block[kept], settled_travel_m(data)[kept])
    equations.normalise()
    return RegressionProblem(channel, datasets, equations, terms, used, block_of, model_terms)


def stride(period_s: float) -> int:
    """Distance of the kept samples, in samples."""
    return max(int(1.0 / (period_s * OVERSAMPLING * FILTER_HZ)), 1)


def _target_and_columns(
    data: RegressionData,
    channel: ResidualChannel,
    terms: Sequence[TermColumns],
    model_terms: Sequence[ModelTerm],
) -> tuple[Array, Array]:
    """Target (n,) and columns (n, c) of a recording, filtered alike."""
    y, base = _target_and_baseline(data, channel)
    low_pass = _low_pass(data)
    if model_terms:
        y = y - low_pass(predicted_by_model(data, channel, model_terms))
    if not terms:
        return y, base
    unfiltered = np.concatenate([one.columns(data, one.shape_parameters) for one in terms], axis=1)
    return y, np.concatenate((base, low_pass(unfiltered)), axis=1)


def _low_pass(data: RegressionData) -> Callable[..., Array]:
    """The state filter; where positions are noisy, after the low pass of their derivatives."""
    state_filter = StateFilter(data.period_s, FILTER_HZ)
    if data.motion.corner_hz >= LEAST_CLEAN_HZ:
        return state_filter
    width = gaussian_width_s(data.motion.corner_hz) / data.period_s
    return lambda signal, derivative=0: state_filter(
        gaussian_filter1d(signal, width, axis=0, mode="nearest"), derivative
    )


def _target_and_baseline(data: RegressionData, channel: ResidualChannel) -> tuple[Array, Array]:
    """Target (n,) and the columns of the baseline parameters (n, k), filtered alike."""
    m = data.motion
    low_pass = _low_pass(data)
    if channel is ResidualChannel.FORCE:
        base = [low_pass(m.position_m, 2), low_pass(m.position_m, 1), low_pass(m.direction)]
        return low_pass(data.force_n - data.presliding_law_n), np.stack(base, axis=1)
    assert data.scale_m is not None  # noqa: S101  # nobody asks for the deviation without a scale
    delayed = low_pass(m.position_m, 1)
    return low_pass(data.scale_m - m.position_m), np.stack((np.ones(len(delayed)), delayed), axis=1)


def _terms(
    datasets: Sequence[RegressionData],
    channel: ResidualChannel,
    extra: Sequence[tuple[str, ShapeParameters]],
    *,
    only: bool,
) -> list[TermColumns]:
    """All terms to try; shape parameters that any recording can resolve are tried on all."""
    terms = []
    for effect in ENTRIES:
        if of := family(effect, channel):
            shapes = dict.fromkeys([] if only else of.shapes(datasets))
            shapes.update(dict.fromkeys(shape for name, shape in extra if name == effect))
            terms += [(effect, shape, of.columns) for shape in shapes]
    if not only:
        extra = [*((SINCE_REVERSAL, shape) for shape in term(SINCE_REVERSAL).shapes(datasets)), *extra]
    unnamed = dict.fromkeys((name, shape) for name, shape in extra if name.startswith(PREFIX))
    terms += [(name, shape, term(name).columns) for name, shape in unnamed]
    widths = [columns(datasets[0], shape).shape[1] for _, shape, columns in terms]
    return [TermColumns(*one, width) for one, width in zip(terms, widths, strict=True) if width > 0]


def _per_recording(effect: str, width: int, channel: ResidualChannel, recordings: int) -> Sequence[bool]:
    """Variants of a term: coefficients shared (False) or free in each recording (True)."""
    of = family(effect, channel)
    if has_levels(effect, width):
        return OWN
    return SHARED if recordings == 1 or of is None else of.per_recording


def _samples_in_use(data: RegressionData, channel: ResidualChannel) -> NDArray[np.bool_]:
    """Samples (n,) after the filter has settled; in the force only those in motion."""
    used = np.ones(len(data.time_s), dtype=np.bool_)
    used[: StateFilter(data.period_s, FILTER_HZ).settled] = False
    used[-math.ceil(END_S / data.period_s) :] = False
    if channel is ResidualChannel.FORCE:
        used &= data.motion.moving
    return used


def _blocks(datasets: Sequence[RegressionData]) -> tuple[list[Index], Index]:
    """Block of each sample, (n,) by recording and numbered throughout, and the recording of each block."""
    total_s = sum(len(data.time_s) * data.period_s for data in datasets)
    length_s = min(BLOCK_S, total_s / FEWEST_BLOCKS)
    block_of, recordings, first = [], [], 0
    for index, data in enumerate(datasets):
        n = len(data.time_s)
        count = max(round(n * data.period_s / length_s), 1)
        block_of.append(first + np.arange(n) * count // n)
        recordings += [index] * count
        first += count
    return block_of, np.array(recordings)
