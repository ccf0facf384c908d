"""The drive train along a recording: hil_sim's own mechanics under the recorded force, held to the motor.

The measured force drives motor and table as a plant file has them. After each sample a slow observer moves
both by what the motor's position was off (position, velocity, and a force that stays; three equal poles), so
that nothing drifts; what lies between motor and table is left to itself. What the encoder says beyond that
prediction, and the scale beyond the table, tells spring, damper and play.
Source: innovation form of an output error, Ljung (1999), section 7.3.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numba
import numpy as np

from hil_sim.plant import step
from hil_sim.plant.measured_point import measured_point_m
from hil_sim.plant.presence import presence_of
from reconcile.replay_start import set_off

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from hil_sim.config import Plant

    Array = NDArray[np.float64]

OBSERVER_HZ = 20.0
"""Slower than what springs do; above it the encoder's step would matter more than that of the force."""
MOST_PER_SAMPLE = 0.1
"""Of the observer's bandwidth, cycles per sample."""

Values = dict[tuple[str, str], float]
"""By section and field of the plant's parameters, SI."""


class Driven(NamedTuple):
    """What drives an axis, and what it is held to; arrays (n,)."""

    period_s: float
    force_n: Array
    motor_m: Array


class Followed(NamedTuple):
    """What the model says at each sample; arrays (n,)."""

    ahead_m: Array
    """Motor as recorded less motor as predicted from the sample before."""
    deviation_m: Array
    """Table, where the scale reads it, less motor."""
    net_n: Array
    """Force that accelerates the motor, its mean over the period before the sample, less the observer's."""


def followed(
    plant: Plant,
    index: int,
    values: Mapping[tuple[str, str], float],
    driven: Driven,
    late: float,
    dt_s: float,
) -> Followed:
    """One axis along one recording. It needs a drive_compliance.

    `plant` is changed: `values` take the place of its own. `late`: periods from a sample of the force until
    it acts; it is held for a period from there on. `dt_s`: the longest substep.
    """
    params, state = plant.params[index], plant.state[index]
    for (section, field), value in values.items():
        params[section][field] = value
    set_off(
        params,
        state,
        float(driven.motor_m[0]),
        float(driven.motor_m[1] - driven.motor_m[0]) / driven.period_s,
    )
    substeps = max(math.ceil(driven.period_s / dt_s - 1e-6), 1)
    pole = math.exp(-2.0 * math.pi * min(OBSERVER_HZ * driven.period_s, MOST_PER_SAMPLE))
    gains = (1.0 - pole**3, 1.5 * (1.0 - pole) ** 2 * (1.0 + pole), (1.0 - pole) ** 3)
    rows = np.zeros((3, len(driven.motor_m)))
    _follow(
        params, state, substeps, driven.period_s / substeps, late, driven.force_n, driven.motor_m, gains, rows
    )
    return Followed(*rows)


@numba.njit(error_model="numpy")  # not cached on disk: numba would not see a change in hil_sim's kernels
def _follow(
    p: Any,
    s: Any,
    substeps: int,
    dt_s: float,
    late: float,
    force_n: Array,
    motor_m: Array,
    gains: tuple[float, float, float],
    rows: Array,
) -> None:
    has = presence_of(p)
    period_s, last = substeps * dt_s, len(motor_m) - 1
    mass_kg = p.mechanics.motor_mass_kg + p.mechanics.table_mass_kg
    held_n = 0.0
    for k in range(1, last + 1):
        before_m_s = s.motor_velocity_m_s
        for j in range(substeps):
            begin = k - 1 + j / substeps - late
            sample = math.floor(begin)
            acting_n = force_n[min(max(sample, 0), last)]
            over = (begin - sample) * substeps + 1.0 - substeps  # the next sample's share of this substep
            if over > 0.0:
                acting_n += over * (force_n[min(max(sample + 1, 0), last)] - acting_n)
            s.current_a = (acting_n + held_n) / p.mechanics.force_constant_n_a
            step.mechanics_step(p, s, has, dt_s)
            s.substeps += 1
            s.time_s = s.substeps * dt_s
        off_m = motor_m[k] - s.motor_position_m
        rows[0, k] = off_m
        rows[1, k] = measured_point_m(p, s) - s.motor_position_m
        rows[2, k] = p.mechanics.motor_mass_kg * (s.motor_velocity_m_s - before_m_s) / period_s - held_n
        shift_m, push_m_s = gains[0] * off_m, gains[1] * off_m / period_s
        s.motor_position_m += shift_m
        s.table_position_m += shift_m
        s.carried_position_m += shift_m
        s.motor_velocity_m_s += push_m_s
        s.table_velocity_m_s += push_m_s
        s.carried_velocity_m_s += push_m_s
        held_n += gains[2] * mass_kg * off_m / period_s**2
