"""From a program file to motion: steps in SI, the check against the limits, and the segments."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from servo_ctrl.config.columns import read_columns
from servo_ctrl.config.errors import ConfigError
from servo_ctrl.config.freeze import MM, MM_MIN, motion_limits
from servo_ctrl.config.model import TORQUE_OFFSET, is_mapped
from servo_ctrl.config.program_model import (
    CircleStep,
    DwellStep,
    MoveStep,
    SamplesStep,
    SineStep,
    SShapeStep,
    step_key,
)
from servo_ctrl.motion.circle import Circle
from servo_ctrl.motion.dwell import Dwell
from servo_ctrl.motion.move import Move
from servo_ctrl.motion.program import segments
from servo_ctrl.motion.samples import Samples
from servo_ctrl.motion.sine import Sine, speed_for_reverse_acceleration
from servo_ctrl.motion.smooth_turning import Turning, usual_ramp_s
from servo_ctrl.motion.trapezoidal import ThereAndBack
from servo_ctrl.motion.violation import first_violation, stop_at_the_end

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.config.program_model import ProgramConfig, StepConfig
    from servo_ctrl.motion.program import Segment, Step
    from servo_ctrl.motion.violation import Violation

_SHOWN_IN = {
    "position": (1e3, "mm"),
    "velocity": (1e3, "mm/s"),
    "acceleration": (1e3, "mm/s^2"),
    "jerk": (1e3, "mm/s^3"),
    "force offset": (1.0, "N"),
}
_TIME_TOLERANCE = 1e-3
"""By how much of a SYNC period the time steps of recorded samples may differ from it."""


def program_steps(program: ProgramConfig, machine: MachineConfig) -> list[Step]:
    """The steps in SI; samples are read from their files here. Raises ConfigError."""
    return [_step(program, index, machine) for index in range(len(program.steps))]


def program_segments(
    steps: Sequence[Step], machine: MachineConfig, start_m: Sequence[float] | NDArray[np.float64]
) -> Iterator[Segment]:
    """The motion from `start_m`, metres per axis in the order of the machine file, lazily."""
    return segments(steps, np.asarray(start_m, dtype=np.float64), motion_limits(machine), machine.period_s)


def check_program(
    program: ProgramConfig,
    machine: MachineConfig,
    start_m: Sequence[float] | NDArray[np.float64] | None = None,
) -> list[Step]:
    """Refuse a program that would leave the limits; else its steps, ready for `program_segments`.

    It is run through from `start_m` (metres per axis, default: all axes at zero), at rest. Raises
    ConfigError that names file, step, axis, value and limit.
    """
    steps = program_steps(program, machine)
    limits = motion_limits(machine)
    start = np.zeros(len(machine.axes)) if start_m is None else np.asarray(start_m, dtype=np.float64)
    # a long rest is judged by a short one
    brief = [
        step._replace(duration_s=min(step.duration_s, 3.0 * machine.period_s))
        if isinstance(step, Dwell)
        else step
        for step in steps
    ]
    commanded = _with_stop(segments(brief, start, limits, machine.period_s))
    violation = first_violation(commanded, start, limits, machine.period_s)
    if violation is not None:
        raise ConfigError(
            program.source, step_key(violation.step, violation.label), _sentence(violation, machine)
        )
    return steps


def _with_stop(program: Iterator[Segment]) -> Iterator[Segment]:
    last = None
    for last in program:  # the last one is wanted behind the loop
        yield last
    if last is not None:
        yield stop_at_the_end(last)


def _sentence(violation: Violation, machine: MachineConfig) -> str:
    axis = list(machine.axes)[violation.axis]
    factor, unit = _SHOWN_IN[violation.quantity]
    return (
        f"axis {axis}: {violation.quantity} {violation.value * factor:.6g} {unit} is beyond the limit "
        f"{violation.limit * factor:.6g} {unit}, {violation.time_s:.3f} s into the step"
    )


def _step(program: ProgramConfig, index: int, machine: MachineConfig) -> Step:
    names = list(machine.axes)
    config = program.steps[index]
    match config:
        case MoveStep():
            allowed = config.acceleration_mm_s2
            return Move(
                config.label,
                tuple(float(config.to_mm.get(name, math.nan)) * MM for name in names),
                config.feed_mm_min * MM_MIN,
                math.inf if allowed is None else allowed * MM,
                config.profile == "trapezoidal",
            )
        case CircleStep():
            radius_m, feed_m_s = config.radius_mm * MM, config.feed_mm_min * MM_MIN
            turning = _turning(program, index, config, feed_m_s / radius_m, config.turns)
            axes = names.index(config.axes[0]), names.index(config.axes[1])
            counterclockwise = config.direction == "ccw"
            return Circle(
                config.label, axes, radius_m, feed_m_s, config.turns, counterclockwise, turning.ramp_s
            )
        case SineStep():
            speed_rad_s = _speed_rad_s(config)
            turning = _turning(program, index, config, speed_rad_s, config.cycles)
            return Sine(
                config.label,
                names.index(config.axis),
                config.amplitude_mm * MM,
                speed_rad_s,
                config.cycles,
                turning.ramp_s,
            )
        case SShapeStep():
            return ThereAndBack(
                config.label,
                names.index(config.axis),
                config.distance_mm * MM,
                config.velocity_mm_s * MM,
                config.acceleration_mm_s2 * MM,
                config.repeats,
            )
        case DwellStep():
            return Dwell(config.label, config.seconds)
        case SamplesStep():
            _refuse_unmapped_offset(program, index, config, machine)
            return _samples(config, machine)


def _refuse_unmapped_offset(
    program: ProgramConfig, index: int, config: SamplesStep, machine: MachineConfig
) -> None:
    for axis in config.force_offset:
        if not is_mapped(machine.axes[axis].drive.rpdo1, TORQUE_OFFSET):
            raise ConfigError(
                program.source,
                f"{step_key(index, config.label)}.force_offset.{axis}",
                f'needs "torque_offset" in axis.{axis}.drive.rpdo1 of {machine.source}',
            )


def _speed_rad_s(config: SineStep) -> float:
    if config.frequency_hz is not None:
        return 2.0 * math.pi * config.frequency_hz
    assert config.reverse_acceleration_mm_s2 is not None  # noqa: S101  # the model takes one of the two
    return speed_for_reverse_acceleration(config.amplitude_mm * MM, config.reverse_acceleration_mm_s2 * MM)


def _turning(
    program: ProgramConfig, index: int, config: StepConfig, speed_rad_s: float, turns: float
) -> Turning:
    ramp_s = getattr(config, "ramp_s", None) or usual_ramp_s(speed_rad_s)
    turning = Turning(speed_rad_s, ramp_s, 2.0 * math.pi * turns)
    if not turning.fits:
        raise ConfigError(
            program.source,
            f"{step_key(index, config.label)}.ramp_s",
            f"two ramps of {ramp_s:.4g} s take {speed_rad_s * ramp_s / (2.0 * math.pi):.4g} turns, "
            f"the step has {turns:g}",
        )
    return turning


def _samples(config: SamplesStep, machine: MachineConfig) -> Samples:
    """The recorded reference on the axes it names; the others rest (NaN)."""
    assert config.file is not None  # noqa: S101  # load_program has put it there
    names = list(machine.axes)
    wanted = [config.time, *config.position.values(), *config.force_offset.values()]
    columns = read_columns(config.file, list(dict.fromkeys(wanted)))
    time_s = columns[config.time]
    if len(time_s) < 2:
        raise ConfigError(config.file, config.time, "two samples at least are needed")
    uneven = np.abs(np.diff(time_s) - machine.period_s) > _TIME_TOLERANCE * machine.period_s
    if uneven.any():
        row = int(np.argmax(uneven))
        raise ConfigError(
            config.file,
            config.time,
            f"step of {time_s[row + 1] - time_s[row]:.6g} s behind row {row + 1} is not the SYNC period "
            f"of {machine.period_s:g} s",
        )
    position_m = np.full((len(time_s), len(names)), np.nan)
    force_offset_n = np.zeros_like(position_m)
    for axis, column in config.position.items():
        position_m[:, names.index(axis)] = columns[column]
    for axis, column in config.force_offset.items():
        gain = config.force_offset_gain.get(axis, 1.0)
        force_offset_n[:, names.index(axis)] = columns[column] * gain
    return Samples(config.label, position_m, force_offset_n)
