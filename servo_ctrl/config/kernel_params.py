"""Converts the machine file (mm, ms) to the parameters of the kernels (SI, plain floats and ints)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from kernels.arrays import Array
from servo_ctrl.config.law_sections import SECTIONS
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.control import position_loop, velocity_loop
from servo_ctrl.control.compensation import feedforward, learned_waveform, screw_error
from servo_ctrl.control.compensation.fuzzy_inference import SURFACE_POINTS, surface
from servo_ctrl.control.limits import AxisLimits
from servo_ctrl.control.section import AxisFacts, filter_blend
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.control.types import Output
from servo_ctrl.motion.input_shaper import Taps, taps
from servo_ctrl.motion.profile import MotionLimits
from servo_ctrl.units import MM

_OUTPUT_OF_MODE = {"cst": Output.FORCE, "csv": Output.VELOCITY, "csp": Output.POSITION}


def axis_params(machine: MachineConfig, axis: str) -> AxisParams:
    """Return the parameters of `axis_tick` for one axis.

    Every value becomes a plain float, int or bool, because numba compiles `axis_tick` again for each
    combination of types, and the daemon and the batch twin share one.
    """
    config = machine.axes[axis]
    control, limits = config.control, config.limits
    period_s = float(machine.period_s)
    return AxisParams(
        period_s=period_s,
        output=int(_OUTPUT_OF_MODE[config.mode]),
        position_loop=position_loop.Params(
            kp_1_s=float(control.kp_1_s),
            ki_1_s2=float(control.ki_1_s2),
            kd=float(control.kd),
            derivative_blend=filter_blend(float(control.derivative_filter_ms) * 1e-3, period_s),
            scale_feedback=control.feedback == "scale",
        ),
        velocity_loop=velocity_loop.Params(
            kv_n_s_m=float(control.kv_n_s_m),
            ki_n_m=float(control.ki_n_m),
            window_samples=int(control.velocity_window_samples),
            filter_blend=filter_blend(float(control.velocity_filter_ms) * 1e-3, period_s),
        ),
        feedforward=feedforward.Params(
            velocity=float(control.velocity_feedforward),
            acceleration_kg=float(control.acceleration_feedforward_kg),
        ),
        limits=AxisLimits(
            velocity_m_s=float(limits.velocity_mm_s) * MM,
            force_n=float(limits.force_n),
            following_error_m=float(limits.following_error_mm) * MM,
        ),
        **_sections_of(config, period_s),
    )


def _sections_of(config: AxisConfig, period_s: float) -> dict[str, Any]:
    """Return the parameters of the parts of the law with a section of their own, by field of `AxisParams`."""
    axis = AxisFacts(
        period_s=period_s,
        acceleration_m_s2=float(config.limits.acceleration_mm_s2) * MM,
        jerk_m_s3=float(config.limits.jerk_mm_s3) * MM,
    )
    params = {}
    for field, section in SECTIONS.items():
        settings = config.section(section.settings)
        params[field] = section.neutral if settings is None else section.params(settings, axis)
    return params


def with_pulse(params: AxisParams, learned: Array | None) -> AxisParams:
    """Return parameters with these pulse functions, (6, n), see `trapezoidal_pulse`; None = no pulse."""
    table = np.zeros((6, 1)) if learned is None else np.ascontiguousarray(learned, dtype=np.float64)
    return params._replace(pulse=params.pulse._replace(enabled=learned is not None, learned=table))


def with_waveform(
    params: AxisParams,
    friction: Sequence[float] | None,
    waves: Array | None = None,
    rests: Array | None = None,
) -> AxisParams:
    """Return parameters with this learned force, see `learned_waveform`; None = no force."""
    neutral = learned_waveform.NEUTRAL
    return params._replace(
        waveform=params.waveform._replace(
            enabled=friction is not None,
            friction=neutral.friction
            if friction is None
            else learned_waveform.Friction(*map(float, friction)),
            waves=neutral.waves if waves is None else np.ascontiguousarray(waves, dtype=np.float64),
            rests=neutral.rests if rests is None else np.ascontiguousarray(rests, dtype=np.float64),
        )
    )


def with_observer(params: AxisParams, enabled: bool) -> AxisParams:
    """Return parameters with the disturbance observer on or off."""
    return params._replace(observer=params.observer._replace(enabled=enabled))


def with_screw(params: AxisParams, table: Array | None, lost_motion_m: float = 0.0) -> AxisParams:
    """Return parameters with this table, (2, n), see `screw_error`, and lost motion; None = neither."""
    errors = np.zeros((2, 1)) if table is None else np.ascontiguousarray(table, dtype=np.float64)
    learned = table is not None
    return params._replace(
        screw=screw_error.Params(enabled=learned, table=errors),
        take_up=params.take_up._replace(enabled=learned, lost_motion_m=float(lost_motion_m)),
    )


def with_sampled_dual_loop(params: AxisParams, enabled: bool) -> AxisParams:
    """Return parameters with the sampled dual loop on or off."""
    return params._replace(sampled=params.sampled._replace(enabled=enabled))


def with_fuzzy(params: AxisParams, enabled: bool) -> AxisParams:
    """Return parameters with the fuzzy-PD law, or with the PID law."""
    table = surface(SURFACE_POINTS) if enabled else params.fuzzy.surface
    return params._replace(fuzzy=params.fuzzy._replace(enabled=enabled, surface=table))


def input_shaper(machine: MachineConfig, axis: str) -> Taps | None:
    """Return the impulses of an axis's input shaper; None without one."""
    config = machine.axes[axis].input_shaper
    if config is None:
        return None
    return taps(config.kind, float(config.frequency_hz), float(config.damping_ratio), machine.period_s)


def motion_limits(machine: MachineConfig) -> MotionLimits:
    """Return the limits of all axes, in the order of the machine file."""
    limits = [axis.limits for axis in machine.axes.values()]

    def column(values: list[float], unit: float) -> Array:
        return np.array(values, dtype=np.float64) * unit

    return MotionLimits(
        position_min_m=column([limit.position_mm[0] for limit in limits], MM),
        position_max_m=column([limit.position_mm[1] for limit in limits], MM),
        velocity_m_s=column([limit.velocity_mm_s for limit in limits], MM),
        acceleration_m_s2=column([limit.acceleration_mm_s2 for limit in limits], MM),
        jerk_m_s3=column([limit.jerk_mm_s3 for limit in limits], MM),
        force_n=column([limit.force_n for limit in limits], 1.0),
    )
