"""From the machine file to learning: its settings in SI, and the motion of a stroke."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from servo_ctrl.config.errors import ConfigError
from servo_ctrl.config.freeze import MM
from servo_ctrl.learning.schedule import RAMP_SHARE
from servo_ctrl.learning.types import LearningSettings
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.sine import Sine, speed_for_reverse_acceleration

if TYPE_CHECKING:
    from collections.abc import Sequence

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.learning.types import Stroke
    from servo_ctrl.motion.program import Step

APPROACH_M_S = 0.05
ARRIVED_M = 1e-6


def learning_settings(machine: MachineConfig, axis: str, learner: str | None = None) -> LearningSettings:
    """How to learn this axis; `learner` overrides the file's. Raises ConfigError without a pulse to learn."""
    config, pulse = machine.learning, machine.axes[axis].friction_compensation
    if pulse is None:
        key = f"axis.{axis}.friction_compensation"
        raise ConfigError(machine.source, key, "the section is missing: there is no pulse to be learned")
    a_min, a_1, a_2, a_max = (value * MM for value in config.accelerations_mm_s2)
    n_1, n_2, n_3 = config.steps
    return LearningSettings(
        learner=learner or config.learner,
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
        amplitude_max_m_s=pulse.acceleration_allowed_mm_s2 * MM * pulse.rise_ms * 1e-3,
        rise_s=pulse.rise_ms * 1e-3,
        window_s=machine.monitoring.window_s,
    )


def stroke_steps(machine: MachineConfig, axis: str, stroke: Stroke, start_m: Sequence[float]) -> list[Step]:
    """One sine cycle of one axis about the middle of its travel, from wherever the axes stand (metres).

    A move to the middle comes first where the axis is elsewhere.
    """
    index = list(machine.axes).index(axis)
    lower_mm, upper_mm = machine.axes[axis].limits.position_mm
    centre_m = 0.5 * (lower_mm + upper_mm) * MM
    radius_m = machine.learning.radius_mm * MM
    speed_rad_s = speed_for_reverse_acceleration(radius_m, stroke.acceleration_m_s2)
    steps: list[Step] = []
    if abs(start_m[index] - centre_m) > ARRIVED_M:
        to_m = tuple(centre_m if i == index else math.nan for i in range(len(machine.axes)))
        feed_m_s = min(APPROACH_M_S, machine.axes[axis].limits.velocity_mm_s * MM)
        steps.append(Move("to the centre", to_m, feed_m_s, math.inf, trapezoidal=False))
    ramp_s = RAMP_SHARE * 2.0 * math.pi / speed_rad_s
    steps.append(Sine(stroke.stage, index, radius_m, speed_rad_s, 1.0, ramp_s))
    return steps
