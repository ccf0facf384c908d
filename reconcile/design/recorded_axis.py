"""Summarises the recordings of an axis: its range of motion, its sensors, and what they lack."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.identification.explain import Explanation

MIN_STROKE_COUNTS = 4.0
"""Least stroke in encoder counts; the shape of a smaller one is lost in quantisation."""


class RecordedAxis(NamedTuple):
    """One axis in all its recordings, SI; velocity and acceleration are 99.9 % quantiles."""

    min_position_m: float
    max_position_m: float
    initial_position_m: float
    """Position at the beginning of the first recording."""
    max_velocity_m_s: float
    max_acceleration_m_s2: float
    velocity_threshold_m_s: float
    """Slower motion is noise."""
    min_stroke_m: float
    """A smaller stroke is noise."""
    longest_recording_s: float
    temperature_range_k: float | None
    """None: no temperature was recorded."""
    has_scale: bool
    other_axes: tuple[str, ...]
    """Axes that moved in the same recordings."""
    moved_alone: bool
    """Each other axis was recorded in motion with this one at standstill, and the other way round."""
    mass_kg: float
    viscous_n_s_m: float
    coulomb_n: float
    lead_m: float


def recorded_axis(of_axis: Sequence[Explanation], axis: NominalAxis) -> RecordedAxis:
    """Summarise an axis from its explanations; parameters that were not fitted are the model's."""
    datasets = [residual.data for residual in of_axis[0].residuals]
    base: Mapping[str, float] = next((e.base for e in of_axis if e.channel is ResidualChannel.FORCE), {})
    motions = [data.motion for data in datasets]
    position_m = np.concatenate([m.position_m for m in motions])
    velocity_m_s = np.abs(np.concatenate([m.velocity_m_s for m in motions]))
    acceleration_m_s2 = np.abs(np.concatenate([m.acceleration_m_s2 for m in motions]))
    names = sorted({name for data in datasets for name, other in data.others.items() if other.moving.any()})
    warm_k = [data.temperature_k for data in datasets if data.temperature_k is not None]
    return RecordedAxis(
        min_position_m=float(position_m.min()),
        max_position_m=float(position_m.max()),
        initial_position_m=float(position_m[0]),
        max_velocity_m_s=float(np.percentile(velocity_m_s, 99.9)),
        max_acceleration_m_s2=float(np.percentile(acceleration_m_s2, 99.9)),
        velocity_threshold_m_s=max(m.velocity_threshold_m_s for m in motions),
        min_stroke_m=MIN_STROKE_COUNTS * (axis.encoder_resolution_m or 0.0),
        longest_recording_s=max(float(data.time_s[-1]) for data in datasets),
        temperature_range_k=float(np.ptp(np.concatenate(warm_k))) if len(warm_k) == len(datasets) else None,
        has_scale=any(data.scale_m is not None for data in datasets),
        other_axes=tuple(names),
        moved_alone=all(_moved_apart(datasets, name) for name in names),
        mass_kg=base.get("mass_kg", axis.mass_kg),
        viscous_n_s_m=base.get("viscous_n_s_m", axis.viscous_n_s_m),
        coulomb_n=base.get("coulomb_n", axis.coulomb_n),
        lead_m=axis.lead_m,
    )


def _moved_apart(datasets: Sequence[RegressionData], name: str) -> bool:
    pairs = [(data.motion, data.others[name]) for data in datasets if name in data.others]
    own = any(np.any(m.moving & other.standing_still) for m, other in pairs)
    return own and any(np.any(m.standing_still & other.moving) for m, other in pairs)
