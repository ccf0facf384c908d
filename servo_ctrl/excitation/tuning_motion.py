"""One motion of a tuning: it measures an axis, tries its setting out, or both."""

from pathlib import Path
from typing import Any, NamedTuple

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.excitation.measuring_motion import measuring_steps, plan_measurement
from servo_ctrl.excitation.proving_motion import proving_steps


class TuningMotion(NamedTuple):
    """What an axis does in one run of a tuning."""

    axis: str
    force_n: float = 0.0
    """Peak of the multisine, N."""
    periods: int = 0
    """Evaluated periods each way; 0 = nothing is measured."""
    trial: bool = False
    """Whether a step of force, a move and a circle follow."""


def motion_steps(motion: TuningMotion, machine: MachineConfig, folder: Path) -> list[dict[str, Any]]:
    """Return the steps of a program file; their samples are written into files of `folder`.

    Raises TuneError where the limits are too close together.
    """
    steps: list[dict[str, Any]] = []
    if motion.periods:
        plan = plan_measurement(machine, motion.axis, motion.force_n, motion.periods)
        steps += measuring_steps(plan, machine, folder)
    if motion.trial:
        steps += proving_steps(machine, motion.axis, folder)
    return steps
