"""From the machine file (mm, ms) to the values that the kernels take (SI, plain floats and ints)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.control.types import (
    AxisLimits,
    AxisParams,
    DisturbanceObserver,
    Feedforward,
    FrictionPulse,
    Output,
    PositionLoop,
    VelocityLoop,
)
from servo_ctrl.motion.profile import MotionLimits

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from servo_ctrl.config.compensation_model import DisturbanceObserverConfig, FrictionCompensationConfig
    from servo_ctrl.config.model import MachineConfig

MM = 1e-3
"""Metres in a millimetre."""
MM_MIN = 1e-3 / 60.0
"""Metres per second in a millimetre per minute."""
_OUTPUT_OF_MODE = {"cst": Output.FORCE, "csv": Output.VELOCITY, "csp": Output.POSITION}


def axis_params(machine: MachineConfig, axis: str) -> AxisParams:
    """What `axis_tick` is given for one axis.

    Every value is made a plain float, int or bool here: numba compiles `axis_tick` anew for each
    combination of types, and the daemon and the batch twin are to share one.
    """
    config = machine.axes[axis]
    control, limits = config.control, config.limits
    period_s = float(machine.period_s)
    return AxisParams(
        period_s=period_s,
        output=int(_OUTPUT_OF_MODE[config.mode]),
        position_loop=PositionLoop(
            kp_1_s=float(control.kp_1_s),
            scale_feedback=control.feedback == "scale",
        ),
        velocity_loop=VelocityLoop(
            kv_n_s_m=float(control.kv_n_s_m),
            ki_n_m=float(control.ki_n_m),
            window_samples=int(control.velocity_window_samples),
            filter_blend=filter_blend(float(control.velocity_filter_ms) * 1e-3, period_s),
        ),
        feedforward=Feedforward(
            velocity=float(control.velocity_feedforward),
            acceleration_kg=float(control.acceleration_feedforward_kg),
        ),
        pulse=_pulse(config.friction_compensation),
        observer=_observer(config.disturbance_observer, period_s),
        limits=AxisLimits(
            velocity_m_s=float(limits.velocity_mm_s) * MM,
            force_n=float(limits.force_n),
            following_error_m=float(limits.following_error_mm) * MM,
        ),
    )


def _pulse(config: FrictionCompensationConfig | None) -> FrictionPulse:
    """Nothing learned yet, hence off: `learned_pulse` puts the functions in."""
    if config is None:
        return FrictionPulse(enabled=False, rise_s=1.0, amplitude_max_m_s=0.0, learned=np.zeros((6, 1)))
    rise_s = float(config.rise_ms) * 1e-3
    amplitude_max_m_s = float(config.acceleration_allowed_mm_s2) * MM * rise_s
    return FrictionPulse(False, rise_s, amplitude_max_m_s, np.zeros((6, 1)))


def with_pulse(params: AxisParams, learned: NDArray[np.float64] | None) -> AxisParams:
    """The parameters with other pulse functions, (6, n) as in `FrictionPulse`; None = no pulse at all."""
    table = np.zeros((6, 1)) if learned is None else np.ascontiguousarray(learned, dtype=np.float64)
    return params._replace(pulse=params.pulse._replace(enabled=learned is not None, learned=table))


def with_observer(params: AxisParams, enabled: bool) -> AxisParams:
    """The parameters with the disturbance observer on or off."""
    return params._replace(observer=params.observer._replace(enabled=enabled))


def _observer(config: DisturbanceObserverConfig | None, period_s: float) -> DisturbanceObserver:
    if config is None:
        return DisturbanceObserver(enabled=False, mass_kg=0.0, viscous_n_s_m=0.0, filter_blend=1.0)
    return DisturbanceObserver(
        enabled=config.enabled,
        mass_kg=float(config.mass_kg),
        viscous_n_s_m=float(config.viscous_n_s_m),
        filter_blend=filter_blend(1.0 / (2.0 * math.pi * float(config.bandwidth_hz)), period_s),
    )


def filter_blend(time_constant_s: float, period_s: float) -> float:
    """Share of the new value in a low pass that matches 1 / (1 + s tau) at the samples; 1 for tau = 0."""
    return 1.0 if time_constant_s == 0.0 else -math.expm1(-period_s / time_constant_s)


def motion_limits(machine: MachineConfig) -> MotionLimits:
    """The limits of all axes, in the order of the machine file."""
    limits = [axis.limits for axis in machine.axes.values()]

    def column(values: list[float], unit: float) -> NDArray[np.float64]:
        return np.array(values, dtype=np.float64) * unit

    return MotionLimits(
        position_min_m=column([limit.position_mm[0] for limit in limits], MM),
        position_max_m=column([limit.position_mm[1] for limit in limits], MM),
        velocity_m_s=column([limit.velocity_mm_s for limit in limits], MM),
        acceleration_m_s2=column([limit.acceleration_mm_s2 for limit in limits], MM),
        jerk_m_s3=column([limit.jerk_mm_s3 for limit in limits], MM),
        force_n=column([limit.force_n for limit in limits], 1.0),
    )
