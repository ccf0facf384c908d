"""From the machine file (mm, ms) to the values that the kernels take (SI, plain floats and ints)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.control.fuzzy_inference import SURFACE_POINTS, surface
from servo_ctrl.control.params import (
    AxisLimits,
    AxisParams,
    BacklashTakeUp,
    DisturbanceObserver,
    Feedforward,
    FrictionPulse,
    FuzzyPd,
    Output,
    PositionLoop,
    SampledDualLoop,
    ScrewError,
    VelocityLoop,
)
from servo_ctrl.motion.profile import MotionLimits

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from servo_ctrl.config.compensation_model import DisturbanceObserverConfig, FrictionCompensationConfig
    from servo_ctrl.config.fuzzy_pd_model import FuzzyPdConfig
    from servo_ctrl.config.model import Limits, MachineConfig
    from servo_ctrl.config.motor_leading_model import SampledDualLoopConfig, ScrewCompensationConfig

MM = 1e-3
"""Metres in a millimetre."""
UM = 1e-6
"""Metres in a micrometre."""
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
            ki_1_s2=float(control.ki_1_s2),
            kd=float(control.kd),
            derivative_blend=filter_blend(float(control.derivative_filter_ms) * 1e-3, period_s),
            scale_feedback=control.feedback == "scale",
        ),
        fuzzy=_fuzzy(config.fuzzy_pd),
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
        screw=ScrewError(enabled=False, table=np.zeros((2, 1))),
        take_up=_take_up(config.screw_compensation),
        sampled=_sampled(config.sampled_dual_loop, limits),
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


def with_screw(
    params: AxisParams, table: NDArray[np.float64] | None, lost_motion_m: float = 0.0
) -> AxisParams:
    """The parameters with another table, (2, n) as in `ScrewError`, and lost motion; None = neither."""
    errors = np.zeros((2, 1)) if table is None else np.ascontiguousarray(table, dtype=np.float64)
    learned = table is not None
    return params._replace(
        screw=ScrewError(enabled=learned, table=errors),
        take_up=params.take_up._replace(enabled=learned, lost_motion_m=float(lost_motion_m)),
    )


def with_sampled(params: AxisParams, enabled: bool) -> AxisParams:
    """The parameters with the sampled dual loop on or off."""
    return params._replace(sampled=params.sampled._replace(enabled=enabled))


def with_fuzzy(params: AxisParams, enabled: bool) -> AxisParams:
    """The parameters with the fuzzy-PD law on, or the PID law."""
    table = surface(SURFACE_POINTS) if enabled else params.fuzzy.surface
    return params._replace(fuzzy=params.fuzzy._replace(enabled=enabled, surface=table))


def _fuzzy(config: FuzzyPdConfig | None) -> FuzzyPd:
    if config is None:
        return FuzzyPd(False, 1.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0, np.zeros((2, 2)))
    return FuzzyPd(
        enabled=config.enabled,
        fine_m=float(config.fine_um) * UM,
        coarse_m=float(config.coarse_um) * UM,
        weight_1_m=float(config.weight_1_mm) / MM,
        error_1_m=float(config.error_gain_1_mm) / MM,
        change_s_m=float(config.change_gain_s_mm) / MM,
        output_m_s=float(config.output_mm_s) * MM,
        ki_1_s2=float(config.ki_1_s2),
        surface=surface(SURFACE_POINTS) if config.enabled else np.zeros((2, 2)),
    )


def _take_up(config: ScrewCompensationConfig | None) -> BacklashTakeUp:
    """Nothing learned yet, hence off: `with_screw` puts the lost motion in."""
    if config is None:
        return BacklashTakeUp(enabled=False, lost_motion_m=0.0, acceleration_m_s2=1.0, jerk_m_s3=1.0)
    return BacklashTakeUp(
        enabled=False,
        lost_motion_m=0.0,
        acceleration_m_s2=float(config.take_up_acceleration_mm_s2) * MM,
        jerk_m_s3=float(config.take_up_jerk_mm_s3) * MM,
    )


def _sampled(config: SampledDualLoopConfig | None, limits: Limits) -> SampledDualLoop:
    if config is None:
        return SampledDualLoop(False, 1.0, 0.0, 0, 0.0, True, 1.0, 1.0)
    return SampledDualLoop(
        enabled=config.enabled,
        settle_s=float(config.settle_ms) * 1e-3,
        tolerance_m=float(config.tolerance_um) * UM,
        corrections=int(config.corrections),
        limit_m=float(config.limit_um) * UM,
        smooth=config.profile == "s_curve",
        acceleration_m_s2=float(config.acceleration_mm_s2 or limits.acceleration_mm_s2) * MM,
        jerk_m_s3=float(config.jerk_mm_s3 or limits.jerk_mm_s3) * MM,
    )


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
