"""A feed axis whose motion is a formula: clean recordings, to which tests add defects."""

from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.formats.nominal_axis import BusNodes
from reconcile.recording.recording import AxisRecording

PERIOD_S = 1e-3
COUNT_M, SCALE_COUNT_M = 5e-8, 1e-7
MASS_KG, VISCOUS_N_S_M, COULOMB_N = 60.0, 150.0, 20.0
STIFFNESS_N_M = 100e6


class Axis(NamedTuple):
    """Properties of an axis that a reader of recordings needs."""

    lead_m: float = 10e-3
    force_constant_n_a: float = 270.0
    mass_kg: float = MASS_KG
    encoder_resolution_m: float | None = COUNT_M
    scale_resolution_m: float | None = SCALE_COUNT_M
    bus: BusNodes | None = None
    rotary: bool = False


class Motion(NamedTuple):
    """Motion of the motor, and the force that it needs."""

    time_s: Array
    position_m: Array
    velocity_m_s: Array
    force_n: Array


def motion(time_s: Array) -> Motion:
    """Return the motion at times (s): two sines with an envelope, at standstill at both ends."""
    inside = np.clip((time_s - 0.3) / (time_s[-1] - 0.6), 0.0, 1.0)
    shape = np.sin(2 * np.pi * 0.7 * time_s) + 0.25 * np.sin(2 * np.pi * 2.3 * time_s + 1.0)
    position_m = 0.02 * np.sin(np.pi * inside) ** 4 * shape
    velocity_m_s = np.gradient(position_m, time_s)
    friction_n = COULOMB_N * np.tanh(velocity_m_s / 1e-4) + VISCOUS_N_S_M * velocity_m_s
    force_n = MASS_KG * np.gradient(velocity_m_s, time_s) + friction_n
    return Motion(time_s, position_m, velocity_m_s, force_n)


def counted(values: Array, step: float) -> Array:
    """Return the values rounded to the resolution of an encoder."""
    return np.round(values / step) * step


def held(values: Array, samples: float) -> Array:
    """Return the channel as if it were updated only every `samples` samples."""
    latest = np.floor(np.arange(len(values)) / samples + 1e-9) * samples
    return values[np.ceil(latest - 1e-9).astype(np.intp)]


def clean(duration_s: float = 8.0, seed: int = 0, source: str = "clean") -> AxisRecording:
    """Return encoder, scale and force with realistic noise; the reference leads by a following error."""
    rng = np.random.default_rng(seed)
    moved = motion(np.arange(round(duration_s / PERIOD_S)) * PERIOD_S)
    noise_m = rng.normal(0.0, 2e-8, (2, len(moved.time_s)))
    return AxisRecording(
        source=source,
        axis="x",
        period_s=PERIOD_S,
        time_s=moved.time_s,
        motor_m=counted(moved.position_m + noise_m[0], COUNT_M),
        force_n=moved.force_n + rng.normal(0.0, 0.3, len(moved.time_s)),
        scale_m=counted(moved.position_m - moved.force_n / STIFFNESS_N_M + noise_m[1], SCALE_COUNT_M),
        reference_m=moved.position_m + moved.velocity_m_s / 100.0,
        temperature_k=None,
        others={},
        force_command_n=moved.force_n,
    )
