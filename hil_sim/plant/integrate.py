"""Advances the axes of a plant by a number of substeps, in place."""

from typing import Any

import numpy as np

from hil_sim.physics.motor import winding
from hil_sim.physics.sensor import encoder
from hil_sim.plant import amplifier, readings, step
from hil_sim.plant.measured_point import measured_point_m
from hil_sim.plant.other_axes import any_force_of_another, see_other_axes
from hil_sim.plant.presence import presence_of
from kernels.jit import kernel

FIRST: Any = np.int64(0)
"""The first substep; for the literal 0 numba compiles the kernel a second time."""


@kernel
def advance(params: Any, state: Any, setpoint: Any, substeps: int, dt_s: float) -> None:
    """Advance `state` (axes, AXIS_STATE) by `substeps` of `dt_s` (s) towards `setpoint` (axes, SETPOINT).

    Position and velocity set points are interpolated linearly over the call. Nothing is random: equal
    arguments give equal bits for every caller.
    """
    if any_force_of_another(params):
        for index in range(substeps):
            for axis in range(len(params)):
                _advance_part(params[axis], state[axis], setpoint[axis], index, index + 1, substeps, dt_s)
            see_other_axes(params, state, dt_s)
    else:
        for axis in range(len(params)):
            advance_axis(params[axis], state[axis], setpoint[axis], substeps, dt_s)
    for axis in range(len(params)):
        p, s = params[axis], state[axis]
        if p.cross_axis_coupling.enabled:  # read again, with all positions of the same instant
            other = int(p.cross_axis_coupling.other)
            s.cross_axis_coupling.other_position_m = measured_point_m(params[other], state[other])
            s.scale_counts = readings.scale_counts(p, s) - s.scale_origin_counts


@kernel
def advance_axis(p: Any, s: Any, sp: Any, substeps: int, dt_s: float) -> None:
    """Advance one axis like `advance`; it sees no motion of the other axes.

    `p`, `s` and `sp` are its AXIS_PARAMS, AXIS_STATE and SETPOINT records.
    """
    _advance_part(p, s, sp, FIRST, substeps, substeps, dt_s)


@kernel
def _advance_part(p: Any, s: Any, sp: Any, first: int, end: int, substeps: int, dt_s: float) -> None:
    """Advance one axis by the substeps from `first` to before `end` of a call of `substeps`."""
    force_constant_n_a = p.mechanics.force_constant_n_a
    resolution_m = p.encoder.resolution_m
    span_s = substeps * dt_s
    has = presence_of(p)
    # constant over the call, and of divisions: computed in each substep they would take a fifth of its time
    decay = winding.decay(p.winding, dt_s) if p.winding.enabled else 0.0
    filter_gain = amplifier.velocity_filter_gain(p.amplifier, dt_s)
    if sp.loop != s.loop:
        amplifier.enter_loop(s, sp, force_constant_n_a)
    for index in range(first, end):
        if sp.loop != amplifier.OFF:
            reference_a = amplifier.current_reference_a(
                p.amplifier,
                s,
                sp,
                resolution_m=resolution_m,
                force_constant_n_a=force_constant_n_a,
                fraction=(index + 1) / substeps,
                dt_s=dt_s,
                span_s=span_s,
            )
            back_emf_v = force_constant_n_a * s.motor_velocity_m_s
            amplifier.drive_current(
                p.amplifier,
                p.winding,
                s,
                reference_a=reference_a,
                back_emf_v=back_emf_v,
                decay=decay,
                dt_s=dt_s,
            )
        step.mechanics_step(p, s, has, dt_s)
        counts = encoder.counts(p.encoder, s.motor_position_m) - s.encoder_origin_counts
        if has.encoder:
            counts = readings.encoder_counts(p, s) - s.encoder_origin_counts
        amplifier.estimate_velocity(s, resolution_m, counts, filter_gain, dt_s)
        s.substeps += 1
        s.time_s = s.substeps * dt_s
    if end < substeps:
        return
    s.position_setpoint_m = sp.position_m
    s.velocity_setpoint_m_s = sp.velocity_m_s
    s.current_measured_a = s.current_a
    if p.scale.enabled:
        s.scale_counts = readings.scale_counts(p, s) - s.scale_origin_counts
