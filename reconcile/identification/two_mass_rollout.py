"""The drive train along a recording: hil_sim's mechanics driven by the recorded force, with an observer.

The measured force drives motor and table as a plant file describes them. After each sample a slow observer
corrects both by the error of the motor's position (position, velocity, constant force; three equal poles), so
that they do not drift; the state between motor and table is not corrected. The errors of encoder and scale
against this prediction identify spring, damper and backlash.
Source: innovation form of an output error model, Ljung (1999), section 7.3.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from hil_sim.config import Plant
from hil_sim.plant import step
from hil_sim.plant.measured_point import measured_point_m
from hil_sim.plant.presence import presence_of
from kernels.arrays import Array, compiled_layout
from kernels.jit import kernel
from reconcile.recording.first_sample import set_initial_motion

OBSERVER_HZ = 20.0
"""Bandwidth of the observer: below the springs' resonances, and low enough to suppress the encoder's step."""
MOST_CYCLES_PER_SAMPLE = 0.1
"""Upper bound of the observer's bandwidth, cycles per sample."""

Values = dict[tuple[str, str], float]
"""Parameters by section and field of the plant, SI."""


class DrivingInputs(NamedTuple):
    """The recorded force that drives the model and the motor position that corrects it; arrays (n,)."""

    period_s: float
    force_n: Array
    motor_m: Array


class ModelResponse(NamedTuple):
    """Response of the model; arrays (n,)."""

    ahead_m: Array
    """One-step prediction error of the motor: recorded less predicted position."""
    deviation_m: Array
    """Table at the scale's reading point, less motor."""
    net_n: Array
    """Mean force that accelerated the motor over the period before the sample, less the observer's."""


def respond(
    plant: Plant,
    index: int,
    values: Mapping[tuple[str, str], float],
    driven: DrivingInputs,
    delay_periods: float,
    dt_s: float,
) -> ModelResponse:
    """Simulate one axis, which needs a drive_compliance, along one recording.

    `plant` is modified: `values` replace its own. `delay_periods`: periods from a sample of the force until
    it acts; it is held for one period from there. `dt_s`: the longest substep.
    """
    params, state = plant.params[index], plant.state[index]
    for (section, field), value in values.items():
        params[section][field] = value
    first_m, second_m = driven.motor_m[:2].tolist()
    set_initial_motion(params, state, first_m, (second_m - first_m) / driven.period_s)
    substeps = max(math.ceil(driven.period_s / dt_s - 1e-6), 1)
    pole = math.exp(-2.0 * math.pi * min(OBSERVER_HZ * driven.period_s, MOST_CYCLES_PER_SAMPLE))
    gains = (1.0 - pole**3, 1.5 * (1.0 - pole) ** 2 * (1.0 + pole), (1.0 - pole) ** 3)
    rows, step_s = np.zeros((3, len(driven.motor_m))), driven.period_s / substeps
    force_n, motor_m = compiled_layout(driven.force_n), compiled_layout(driven.motor_m)
    _respond(
        params,
        state,
        substeps=substeps,
        dt_s=step_s,
        delay_periods=delay_periods,
        force_n=force_n,
        motor_m=motor_m,
        gains=gains,
        rows=rows,
    )
    return ModelResponse(*rows)


@kernel
def _respond(
    p: Any,
    s: Any,
    substeps: int,
    dt_s: float,
    delay_periods: float,
    force_n: Array,
    motor_m: Array,
    gains: tuple[float, float, float],
    rows: Array,
) -> None:
    effects_present = presence_of(p)
    period_s, last = substeps * dt_s, len(motor_m) - 1
    mass_kg = p.mechanics.motor_mass_kg + p.mechanics.table_mass_kg
    observer_n = 0.0
    for k in range(1, last + 1):
        before_m_s = s.motor_velocity_m_s
        for j in range(substeps):
            begin = k - 1 + j / substeps - delay_periods
            sample = math.floor(begin)
            acting_n = force_n[min(max(sample, 0), last)]
            # share of the substep in which the next sample acts
            next_share = (begin - sample) * substeps + 1.0 - substeps
            if next_share > 0.0:
                acting_n += next_share * (force_n[min(max(sample + 1, 0), last)] - acting_n)
            s.current_a = (acting_n + observer_n) / p.mechanics.force_constant_n_a
            step.mechanics_step(p, s, effects_present, dt_s)
            s.substeps += 1
            s.time_s = s.substeps * dt_s
        error_m = motor_m[k] - s.motor_position_m
        rows[0, k] = error_m
        rows[1, k] = measured_point_m(p, s) - s.motor_position_m
        rows[2, k] = p.mechanics.motor_mass_kg * (s.motor_velocity_m_s - before_m_s) / period_s - observer_n
        shift_m, correction_m_s = gains[0] * error_m, gains[1] * error_m / period_s
        s.motor_position_m += shift_m
        s.table_position_m += shift_m
        s.carried_position_m += shift_m
        s.motor_velocity_m_s += correction_m_s
        s.table_velocity_m_s += correction_m_s
        s.carried_velocity_m_s += correction_m_s
        observer_n += gains[2] * mass_kg * error_m / period_s**2
