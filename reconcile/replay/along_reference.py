"""Simulates the recording of the nominal plant if its drive closes the position loop.

In CSP the velocity feedforward of a drive sees the set points as steps, one a cycle: the current jumps after
each SYNC and falls until the next, at which it is sampled. The recorded force then lacks the force of a mass
of up to half of the velocity gain times the cycle. Only the drive's own loops, simulated along the recorded
set points, show this.
"""

import math
from typing import Any

import numpy as np

from hil_sim.config import PlantConfig, build_plant
from hil_sim.plant.amplifier import POSITION
from hil_sim.plant.integrate import advance_axis
from kernels.arrays import Array, compiled_layout
from kernels.jit import kernel
from reconcile.recording.first_sample import initial_motion, set_initial_motion
from reconcile.recording.recording import AxisRecording
from reconcile.regression.set_point_jumps import POSITION_MODE
from reconcile.replay.model_along_motion import rounded_like

UNLIMITED_A = 1e9
"""Set point of the current limit: the amplifier's peak current remains."""


def along_reference(recording: AxisRecording, plant: PlantConfig) -> AxisRecording | None:
    """Return the recording with the plant's force and positions, rounded like the measured ones.

    None if the drive did not follow a recorded reference in its position mode, if samples are means of
    several cycles, or if a sample is not a whole number of the plant's substeps.
    """
    substeps = round(recording.period_s / plant.dt_s)
    follows_reference = recording.mode == POSITION_MODE and recording.samples_in_a_mean == 1
    is_whole = substeps >= 1 and math.isclose(substeps * plant.dt_s, recording.period_s, rel_tol=1e-6)
    if not (follows_reference and is_whole) or recording.reference_m is None:
        return None
    built, index = build_plant(plant), list(plant.axes).index(recording.axis)
    params, state, setpoint = built.params[index], built.state[index], built.setpoint[index]
    set_initial_motion(params, state, *initial_motion(recording))
    setpoint["loop"], setpoint["current_limit_a"] = POSITION, UNLIMITED_A
    rows = np.empty((3, len(recording.reference_m)))
    _follow_reference(
        params,
        state,
        setpoint,
        substeps=substeps,
        dt_s=plant.dt_s,
        reference_m=compiled_layout(recording.reference_m),
        rows=rows,
    )
    force_n, motor_m, scale_m = rows
    return recording._replace(
        motor_m=rounded_like(motor_m, recording.motor_m),
        force_n=rounded_like(force_n, recording.force_n),
        scale_m=None if recording.scale_m is None else rounded_like(scale_m, recording.scale_m),
    )


@kernel
def _follow_reference(
    p: Any, s: Any, sp: Any, substeps: int, dt_s: float, reference_m: Array, rows: Array
) -> None:
    """Simulate the drive along `reference_m` (n,); write force, motor and scale to `rows` (3, n)."""
    for k in range(len(reference_m)):
        rows[0, k] = s.current_measured_a * p.mechanics.force_constant_n_a
        rows[1, k] = s.encoder_counts * p.encoder.resolution_m
        rows[2, k] = s.scale_counts * p.scale.resolution_m
        sp.position_m = reference_m[k]
        advance_axis(p, s, sp, substeps, dt_s)
