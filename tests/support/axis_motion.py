"""A feed axis that moves as we say, in closed form: clean recordings to put defects into."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from reconcile.formats.model_axis import BusNodes
from reconcile.recording import AxisRecording

PERIOD_S = 1e-3
COUNT_M, SCALE_COUNT_M = 5e-8, 1e-7
MASS_KG, VISCOUS_N_S_M, COULOMB_N = 60.0, 150.0, 20.0


class Axis(NamedTuple):
    """What the reader knows of an axis."""

    lead_m: float = 10e-3
    force_constant_n_a: float = 270.0
    mass_kg: float = MASS_KG
    encoder_resolution_m: float | None = COUNT_M
    scale_resolution_m: float | None = SCALE_COUNT_M
    bus: BusNodes | None = None


MODEL = {"x": Axis()}


def motion(time_s, amplitude_m=0.02):
    """Position, velocity, acceleration: two sines and a rest at either end."""
    duration_s = time_s[-1]
    inside = np.clip((time_s - 0.3) / (duration_s - 0.6), 0.0, 1.0)
    window = np.sin(np.pi * inside) ** 4
    shape = np.sin(2 * np.pi * 0.7 * time_s) + 0.25 * np.sin(2 * np.pi * 2.3 * time_s + 1.0)
    position_m = amplitude_m * window * shape
    velocity_m_s = np.gradient(position_m, time_s, edge_order=2)
    return position_m, velocity_m_s, np.gradient(velocity_m_s, time_s, edge_order=2)


def quantised(values, step):
    return np.round(values / step) * step


def force_of(velocity_m_s, acceleration_m_s2):
    friction_n = COULOMB_N * np.tanh(velocity_m_s / 1e-4) + VISCOUS_N_S_M * velocity_m_s
    return MASS_KG * acceleration_m_s2 + friction_n


def clean(duration_s=10.0, seed=0, source="clean"):
    """Encoder, scale and force with the noise of real ones; the reference leads by a following error."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(round(duration_s / PERIOD_S)) * PERIOD_S
    position_m, velocity_m_s, acceleration_m_s2 = motion(time_s)
    force_n = force_of(velocity_m_s, acceleration_m_s2)
    noise_m = rng.normal(0.0, 2e-8, (2, len(time_s)))
    return AxisRecording(
        source=source,
        axis="x",
        period_s=PERIOD_S,
        time_s=time_s,
        motor_m=quantised(position_m + noise_m[0], COUNT_M),
        force_n=force_n + rng.normal(0.0, 0.3, len(time_s)),
        scale_m=quantised(position_m - force_n / 100e6 + noise_m[1], SCALE_COUNT_M),
        reference_m=position_m + velocity_m_s / 100.0,
        temperature_k=None,
        others={},
        force_command_n=force_n,
    )
