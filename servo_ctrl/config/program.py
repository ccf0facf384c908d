"""Checks a program against the machine's limits, and yields its segments."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.config.kernel_params import motion_limits
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program_model import LONGEST_STEP_S, ProgramConfig, step_key
from servo_ctrl.config.steps import program_steps
from servo_ctrl.errors import ConfigError
from servo_ctrl.motion.gcode.blocks import line_key
from servo_ctrl.motion.move import Dwell
from servo_ctrl.motion.path.path_move import PathMove, plan_path
from servo_ctrl.motion.profile import MotionLimits, Profile
from servo_ctrl.motion.program import Segment, Step, plan_step, sample_count, segments
from servo_ctrl.motion.violation import Violation, first_violation, stop_at_the_end

StartPosition = Sequence[float] | Array


class CheckedSteps(NamedTuple):
    """Duration and planned paths of steps that respect the limits."""

    cycles: int
    """Duration in SYNC periods."""
    paths: dict[int, Profile]
    """Planned paths by the index of the step, for `motion.program.segments` from the same start."""


REPORTED_UNITS = {
    "position": (1e3, "mm"),
    "velocity": (1e3, "mm/s"),
    "acceleration": (1e3, "mm/s^2"),
    "jerk": (1e3, "mm/s^3"),
    "force offset": (1.0, "N"),
}
"""By quantity: the factor from SI and the unit in which a violation is reported."""


def program_segments(
    steps: Sequence[Step], machine: MachineConfig, start_m: StartPosition
) -> Iterator[Segment]:
    """Yield the motion from `start_m`, metres by axis in the order of the machine file."""
    return segments(steps, np.asarray(start_m, dtype=np.float64), motion_limits(machine), machine.period_s)


def check_program(
    program: ProgramConfig, machine: MachineConfig, start_m: StartPosition | None = None
) -> list[Step]:
    """Check a program against the limits; return its steps for `program_segments`.

    The check starts at rest at `start_m` (metres by axis, default 0). Raises ConfigError with file, step,
    axis, value and limit.
    """
    steps = program_steps(program, machine)
    check_steps(steps, program.source, machine, start_m)
    return steps


def check_steps(
    steps: Sequence[Step], source: Path, machine: MachineConfig, start_m: StartPosition | None = None
) -> CheckedSteps:
    """Check steps against the limits, like `check_program`.

    In a path (G-code) the error names the line instead of the step.
    """
    limits, period_s = motion_limits(machine), machine.period_s
    start = np.zeros(len(machine.axes)) if start_m is None else np.asarray(start_m, dtype=np.float64)
    cycles, position_m = 0, start
    starts_m, paths = [], {}
    with np.errstate(all="ignore"):  # an overflow exceeds a limit and so becomes a violation
        for index, step in enumerate(steps):
            profile = plan_step(step, position_m, limits, period_s)
            starts_m.append(position_m)
            if isinstance(step, PathMove):
                paths[index] = profile
            if not profile.duration_s <= LONGEST_STEP_S:
                reason = f"would take {profile.duration_s:.6g} s; a step may take {LONGEST_STEP_S:g} s"
                key = step_key(index, step.label)
                if isinstance(step, PathMove):
                    key = line_key(step.elements[0].line)
                raise ConfigError(source, key, reason)
            cycles += sample_count(profile.duration_s, period_s)
            position_m = profile.end_m
        # all samples of a dwell are equal, so three suffice for the check
        shortened = [
            step._replace(duration_s=min(step.duration_s, 3.0 * period_s))
            if isinstance(step, Dwell)
            else step
            for step in steps
        ]
        commanded = _with_stop(segments(shortened, start, limits, period_s, planned=paths))
        violation = first_violation(commanded, start, limits, period_s)
    if violation is not None:
        step = steps[violation.step]
        if isinstance(step, PathMove):
            key, name = _line_of(violation, step, starts_m[violation.step], limits, period_s), step.label
        else:
            key, name = step_key(violation.step, violation.label), "the step"
        raise ConfigError(source, key, _violation_text(violation, machine, name))
    return CheckedSteps(cycles, paths)


def _line_of(
    violation: Violation, step: PathMove, start_m: Array, limits: MotionLimits, period_s: float
) -> str:
    """Return the line at which a path violates a limit; for position limits the first line beyond."""
    plan = plan_path(step, start_m, limits, period_s)
    duration_s = plan.profile.duration_s
    time_s = np.array([min(violation.time_s, duration_s)])
    if violation.quantity == "position":
        sampled_s = np.minimum(np.arange(1, round(violation.time_s / period_s) + 1) * period_s, duration_s)
        position_m = plan.profile.at(sampled_s).position_m[:, violation.axis]
        beyond = np.abs(position_m - violation.value) < abs(violation.value - violation.limit)
        time_s = sampled_s[beyond][:1] if beyond.any() else time_s
    return line_key(step.elements[int(plan.element_at(time_s)[0])].line)


def _with_stop(program: Iterator[Segment]) -> Iterator[Segment]:
    last = None
    for last in program:  # the loop variable is used after the loop
        yield last
    if last is not None:
        yield stop_at_the_end(last)


def _violation_text(violation: Violation, machine: MachineConfig, name: str) -> str:
    axis = list(machine.axes)[violation.axis]
    factor, unit = REPORTED_UNITS[violation.quantity]
    reached = f"{violation.quantity} {violation.value * factor:.6g} {unit}"
    limit = f"{violation.limit * factor:.6g} {unit}"
    return f"axis {axis}: {reached} is beyond the limit {limit}, {violation.time_s:.3f} s into {name}"
