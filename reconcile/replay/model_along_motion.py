"""Simulates the recording of the nominal plant along a measured motion.

hil_sim's mechanics follow the measured motor position under a stiff controller without noise and delay. The
force of this controller includes all of the model: springs, backlash, swinging masses. An effect that a
regression identifies in such a recording is in the model already, or is the regression's misfit of it.
"""

import math
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from hil_sim.config import PlantConfig, build_plant
from hil_sim.plant import readings, step
from hil_sim.plant.measured_point import measured_point_m
from hil_sim.plant.presence import presence_of
from kernels.arrays import Array
from kernels.jit import kernel
from reconcile.recording.first_sample import set_initial_motion
from reconcile.recording.kinematics import finest_corner_hz, smoothed_position
from reconcile.recording.recording import AxisRecording
from reconcile.sensing.channel import quantum

TRACKING_HZ = 400.0
"""Bandwidth of the controller: far above the filter of the residual."""
LONGEST_SUBSTEP_S = 1e-5
"""Bounds the time between force and motion, of which a heavy rotor makes newtons; chosen."""
STIFFEST_CYCLES = 0.05
"""Most cycles of the tracking bandwidth in a substep; chosen."""


def along_motion(recording: AxisRecording, plant: PlantConfig) -> AxisRecording:
    """Return the recording with the plant's force and positions, rounded like the measured ones."""
    built, index = build_plant(plant), list(plant.axes).index(recording.axis)
    params, state = built.params[index], built.state[index]
    period_s = recording.period_s
    corner_hz = finest_corner_hz(recording.motor_m, period_s)
    position_m = smoothed_position(recording.motor_m, period_s, corner_hz)
    spline = CubicSpline(np.arange(len(position_m)) * period_s, position_m)
    track = np.stack([spline(spline.x, derivative) for derivative in range(3)])
    set_initial_motion(params, state, float(track[0, 0]), float(track[1, 0]))
    longest_s = min(plant.dt_s, LONGEST_SUBSTEP_S, STIFFEST_CYCLES / TRACKING_HZ)
    substeps = max(math.ceil(period_s / longest_s - 1e-6), 1)
    moved_kg = float(params["mechanics"]["motor_mass_kg"])
    if not params["drive_compliance"]["enabled"]:
        moved_kg += float(params["mechanics"]["table_mass_kg"])
    natural_rad_s = 2.0 * math.pi * TRACKING_HZ
    gains = (moved_kg, moved_kg * natural_rad_s**2, 2.0 * moved_kg * natural_rad_s)
    rows = np.zeros((3, len(recording.motor_m)))
    _follow_motion(
        params, state, substeps=substeps, dt_s=period_s / substeps, track=track, gains=gains, rows=rows
    )
    scale_m = None
    if recording.scale_m is not None:
        scale_m = rounded_like(rows[1], recording.scale_m)
    return recording._replace(
        motor_m=rounded_like(rows[2], recording.motor_m),
        force_n=rounded_like(rows[0], recording.force_n),
        scale_m=scale_m,
    )


def rounded_like(values: Array, like: Array) -> Array:
    """Return values (n,) rounded to the steps of a measured channel, if it has any."""
    if size := quantum(like):
        rounded: Array = np.rint(values / size) * size
        return rounded
    return values


@kernel
def _follow_motion(
    p: Any, s: Any, substeps: int, dt_s: float, track: Array, gains: tuple[float, float, float], rows: Array
) -> None:
    """Follow `track` (3, n) of position, velocity, acceleration; `rows` (3, n) get force, scale and motor."""
    has = presence_of(p)
    mass_kg, stiffness_n_m, damping_n_s_m = gains
    period_s = substeps * dt_s
    force_n = 0.0
    for k in range(track.shape[1]):
        for j in range(substeps if k > 0 else 0):
            u = j / substeps
            low, high = track[:, k - 1], track[:, k]
            # the cubic between two samples of the spline
            a = low[0] - high[0]
            b = low[1] * period_s
            c = high[1] * period_s
            cubic, square = 2.0 * a + b + c, -3.0 * a - 2.0 * b - c
            position_m = low[0] + u * (b + u * (square + u * cubic))
            velocity_m_s = (b + u * (2.0 * square + 3.0 * u * cubic)) / period_s
            acceleration_m_s2 = low[2] + u * (high[2] - low[2])
            force_n = (
                mass_kg * acceleration_m_s2
                + stiffness_n_m * (position_m - s.motor_position_m)
                + damping_n_s_m * (velocity_m_s - s.motor_velocity_m_s)
            )
            s.current_a = force_n / p.mechanics.force_constant_n_a
            step.mechanics_step(p, s, has, dt_s)
            s.substeps += 1
            s.time_s = s.substeps * dt_s
        rows[0, k] = force_n
        rows[2, k] = s.motor_position_m
        rows[1, k] = measured_point_m(p, s)
        if p.scale.enabled:
            rows[1, k] = readings.scale_counts(p, s) * p.scale.resolution_m
