"""Converts learning settings to SI units, and returns the steps of a stroke or a travel."""

import math
from collections.abc import Sequence

from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.control.compensation.learned_waveform import SLIP_M, LearnedWaveformSettings
from servo_ctrl.control.compensation.screw_error import ScrewCompensationSettings
from servo_ctrl.control.compensation.trapezoidal_pulse import FrictionCompensationSettings
from servo_ctrl.control.rest_memory import SPAN_M
from servo_ctrl.control.waveform_table import AHEAD_S
from servo_ctrl.errors import ConfigError
from servo_ctrl.learning.rest_strokes import WAYS
from servo_ctrl.learning.reversal_waveform import SPAN_S, LoopModel
from servo_ctrl.learning.schedule import RAMP_SHARE
from servo_ctrl.learning.screw_travel import RAMP_S, ScrewSettings, nodes_m, run_in_nodes
from servo_ctrl.learning.types import LearningSettings, Stroke
from servo_ctrl.learning.waveform_stroke import LEARNER, WaveformSettings
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.program import Step
from servo_ctrl.motion.sine import Sine, speed_for_reverse_acceleration
from servo_ctrl.units import MM, MM_MIN, UM

APPROACH_M_S = 0.05
"""Bounds the feed of the move to the start; chosen."""
START_TOLERANCE_M = 1e-6
"""Distance from the start below which no move is needed."""
NODES_PER_TURN = 16
"""Default nodes per turn of the screw, with which linear interpolation errs by 2 % of the periodic error."""
NODES_MAX = 5000
"""Bounds the nodes of a table; chosen."""
LIMIT_SHARE = 0.8
"""Share of an axis's limits up to which a waveform is learned; chosen."""


def learning_settings(machine: MachineConfig, axis: str, learner: str | None = None) -> LearningSettings:
    """Return the learning settings of an axis; `learner` overrides the file's. Raises ConfigError."""
    pulse = machine.axes[axis].section(FrictionCompensationSettings)
    if pulse is None:
        key = f"axis.{axis}.friction_compensation"
        raise ConfigError(machine.source, key, "the section is missing: there is no pulse to be learned")
    rise_s = pulse.rise_ms * 1e-3
    amplitude_max_m_s = pulse.acceleration_allowed_mm_s2 * MM * pulse.rise_ms * 1e-3
    return _stroke_settings(machine, learner or machine.learning.learner, rise_s, amplitude_max_m_s)


def waveform_objection(axis: AxisConfig) -> str:
    """Return why an axis cannot learn a waveform, for the key `learned_waveform`; "" if it can."""
    if axis.section(LearnedWaveformSettings) is None:
        return "the section is missing: there is no waveform to be learned"
    if axis.mode != "cst":
        return "is learned in mode cst only: it needs our own velocity loop"
    if not axis.control.acceleration_feedforward_kg or not axis.control.kv_n_s_m:
        return "learning needs control.kv_n_s_m and the moved mass, control.acceleration_feedforward_kg"
    return ""


def waveform_settings(machine: MachineConfig, axis: str) -> WaveformSettings:
    """Return the settings that learn the waveform of an axis. Raises ConfigError if it cannot."""
    if reason := waveform_objection(machine.axes[axis]):
        raise ConfigError(machine.source, f"axis.{axis}.learned_waveform", reason)
    params = axis_params(machine, axis)
    loop = LoopModel(
        mass_kg=params.feedforward.acceleration_kg,
        kp_1_s=params.position_loop.kp_1_s,
        kv_n_s_m=params.velocity_loop.kv_n_s_m,
        ki_n_m=params.velocity_loop.ki_n_m,
        period_s=params.period_s,
        lead_s=params.waveform.lead_s,
        slip_m=SLIP_M,
        ahead_s=AHEAD_S,
        rest_span_m=SPAN_M,
    )
    strokes = _stroke_settings(machine, LEARNER, 0.0, 0.0)
    largest_m_s2 = _largest_reverse_acceleration_m_s2(machine, axis, strokes, AHEAD_S + SPAN_S)
    limit_m_s2 = machine.axes[axis].limits.acceleration_mm_s2 * MM
    return WaveformSettings(strokes, largest_m_s2, limit_m_s2, loop, tuple(machine.learning.rests_s))


def _largest_reverse_acceleration_m_s2(
    machine: MachineConfig, axis: str, strokes: LearningSettings, waveform_s: float
) -> float:
    """Return the largest reverse acceleration of a sine within `LIMIT_SHARE` of the limits.

    Its half cycle lasts at least `waveform_s`.
    """
    limits, radius_m = machine.axes[axis].limits, strokes.radius_m
    velocity_m_s, jerk_m_s3 = LIMIT_SHARE * limits.velocity_mm_s * MM, LIMIT_SHARE * limits.jerk_mm_s3 * MM
    allowed_m_s2: float = min(
        velocity_m_s**2 / radius_m,
        LIMIT_SHARE * limits.acceleration_mm_s2 * MM,
        (jerk_m_s3**2 * radius_m) ** (1.0 / 3.0),
        radius_m * (math.pi / waveform_s) ** 2,
    )
    return max(float(allowed_m_s2), strokes.accelerations_m_s2[-1])


def _stroke_settings(
    machine: MachineConfig, learner: str, rise_s: float, amplitude_max_m_s: float
) -> LearningSettings:
    config = machine.learning
    a_min, a_1, a_2, a_max = (value * MM for value in config.accelerations_mm_s2)
    n_1, n_2, n_3 = config.steps
    return LearningSettings(
        learner=learner,
        accelerations_m_s2=(a_min, a_1, a_2, a_max),
        steps=(n_1, n_2, n_3),
        coarse_steps=config.coarse_steps,
        fine_steps=config.fine_steps,
        initial_share=config.initial_share,
        duration_step_s=config.duration_step_ms * 1e-3,
        duration_reach=config.duration_reach,
        window_durations=config.window_durations,
        trailing=config.trailing,
        radius_m=config.radius_mm * MM,
        amplitude_max_m_s=amplitude_max_m_s,
        rise_s=rise_s,
        window_s=machine.monitoring.window_s,
    )


def stroke_steps(machine: MachineConfig, axis: str, stroke: Stroke, start_m: Sequence[float]) -> list[Step]:
    """Return one sine cycle of an axis about the middle of its travel; `start_m`: positions of all axes.

    If the axis is elsewhere, a move to the middle comes first.
    """
    index = list(machine.axes).index(axis)
    lower_mm, upper_mm = machine.axes[axis].limits.position_mm
    centre_m = 0.5 * (lower_mm + upper_mm) * MM
    radius_m = machine.learning.radius_mm * MM
    speed_rad_s = speed_for_reverse_acceleration(radius_m, stroke.acceleration_m_s2)
    steps: list[Step] = []
    if abs(start_m[index] - centre_m) > START_TOLERANCE_M:
        steps.append(_approach("to the centre", machine, axis, centre_m))
    if stroke.rest_s:
        for way in WAYS:
            to_m = _target_of(machine, axis, centre_m + way * radius_m)
            feed_m_s = radius_m * speed_rad_s
            steps += [
                Move(stroke.stage, to_m, feed_m_s, stroke.acceleration_m_s2, trapezoidal=False),
                Dwell("rest", stroke.rest_s),
            ]
        return steps[:-1]
    ramp_s = RAMP_SHARE * 2.0 * math.pi / speed_rad_s
    return [
        *steps,
        Sine(
            label=stroke.stage,
            axis=index,
            amplitude_m=radius_m,
            speed_rad_s=speed_rad_s,
            cycles=1.0,
            ramp_s=ramp_s,
        ),
    ]


def screw_settings(machine: MachineConfig, axis: str) -> ScrewSettings:
    """Return the settings that learn the screw of an axis. Raises ConfigError without its section."""
    config = machine.axes[axis].section(ScrewCompensationSettings)
    key = f"axis.{axis}.screw_compensation"
    if config is None:
        raise ConfigError(machine.source, key, "the section is missing: there is no screw to be learned")
    lower_mm, upper_mm = machine.axes[axis].limits.position_mm
    settings = ScrewSettings(
        lower_m=lower_mm * MM,
        upper_m=upper_mm * MM,
        step_m=(config.step_mm or machine.axes[axis].transmission.lead_mm / NODES_PER_TURN) * MM,
        travels=config.travels,
        feed_m_s=config.feed_mm_min * MM_MIN,
        dwell_s=config.dwell_s,
        limit_m=config.limit_um * UM,
    )
    nodes = (upper_mm - lower_mm) * MM / settings.step_m
    if nodes > NODES_MAX:
        text = f"{nodes:.0f} nodes over limits.position_mm are more than {NODES_MAX}"
        raise ConfigError(machine.source, f"{key}.step_mm", text)
    if len(nodes_m(settings)) <= 2 * run_in_nodes(settings):
        text = "limits.position_mm leave too short a travel for this distance of nodes and limit_um"
        raise ConfigError(machine.source, f"{key}.step_mm", text)
    return settings


def screw_steps(machine: MachineConfig, axis: str, start_m: Sequence[float]) -> list[Step]:
    """Return one travel up and down over the whole range of an axis; `start_m`: positions of all axes.

    If the axis is elsewhere, a move to the lower end comes first.
    """
    settings = screw_settings(machine, axis)
    ramp_m_s2 = settings.feed_m_s / RAMP_S
    steps: list[Step] = []
    if abs(start_m[list(machine.axes).index(axis)] - settings.lower_m) > START_TOLERANCE_M:
        steps.append(_approach("to the lower end", machine, axis, settings.lower_m))
    for label, end_m in (("up", settings.upper_m), ("down", settings.lower_m)):
        to_m = _target_of(machine, axis, end_m)
        steps += [
            Dwell("rest", settings.dwell_s),
            Move(f"travel {label}", to_m, settings.feed_m_s, ramp_m_s2, trapezoidal=False),
        ]
    return [*steps, Dwell("rest", settings.dwell_s)]


def _approach(label: str, machine: MachineConfig, axis: str, to_m: float) -> Move:
    feed_m_s = min(APPROACH_M_S, machine.axes[axis].limits.velocity_mm_s * MM)
    return Move(label, _target_of(machine, axis, to_m), feed_m_s, math.inf, trapezoidal=False)


def _target_of(machine: MachineConfig, axis: str, to_m: float) -> tuple[float, ...]:
    """Return a target that moves one axis; NaN holds the others."""
    return tuple(to_m if name == axis else math.nan for name in machine.axes)
