"""Converts the steps of a program file to motion: millimetres to metres, columns to samples."""

import math
from pathlib import Path

import numpy as np

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.node_model import TORQUE_OFFSET, is_mapped
from servo_ctrl.config.part_program import PartProgram
from servo_ctrl.config.program_model import (
    CircleStep,
    DwellStep,
    MoveStep,
    ProgramConfig,
    SamplesStep,
    SineStep,
    SShapeStep,
    StepConfig,
    step_key,
)
from servo_ctrl.errors import ConfigError
from servo_ctrl.files.columns import read_columns
from servo_ctrl.motion.circle import Circle
from servo_ctrl.motion.move import Dwell, Move
from servo_ctrl.motion.program import Step
from servo_ctrl.motion.samples import Samples
from servo_ctrl.motion.sine import Sine, speed_for_reverse_acceleration
from servo_ctrl.motion.smooth_turning import Turning, usual_ramp_s
from servo_ctrl.motion.trapezoidal import ThereAndBack
from servo_ctrl.units import MM, MM_MIN

_TIME_TOLERANCE = 1e-3
"""Tolerance of the time steps of recorded samples, as a share of the SYNC period."""


def program_steps(program: ProgramConfig, machine: MachineConfig) -> list[Step]:
    """Convert the steps to SI and read samples from their files. Raises ConfigError."""
    if isinstance(program, PartProgram):
        return list(program.motion)
    return [
        _step(config, machine, program.source, step_key(index, config.label))
        for index, config in enumerate(program.steps)
    ]


def _step(config: StepConfig, machine: MachineConfig, source: Path, key: str) -> Step:
    """Convert one step; `key` names it in messages."""
    names = list(machine.axes)
    match config:
        case MoveStep():
            limit_mm_s2 = config.acceleration_mm_s2
            return Move(
                config.label,
                tuple(float(config.to_mm.get(name, math.nan)) * MM for name in names),
                config.feed_mm_min * MM_MIN,
                math.inf if limit_mm_s2 is None else limit_mm_s2 * MM,
                config.profile == "trapezoidal",
            )
        case CircleStep():
            radius_m, feed_m_s = config.radius_mm * MM, config.feed_mm_min * MM_MIN
            first, second = map(names.index, config.axes)
            return Circle(
                label=config.label,
                axes=(first, second),
                radius_m=radius_m,
                feed_m_s=feed_m_s,
                turns=config.turns,
                counterclockwise=config.direction == "ccw",
                ramp_s=_ramp_s(
                    config, machine, source, key, speed_rad_s=feed_m_s / radius_m, turns=config.turns
                ),
            )
        case SineStep():
            speed_rad_s = _speed_rad_s(config)
            return Sine(
                label=config.label,
                axis=names.index(config.axis),
                amplitude_m=config.amplitude_mm * MM,
                speed_rad_s=speed_rad_s,
                cycles=config.cycles,
                ramp_s=_ramp_s(config, machine, source, key, speed_rad_s=speed_rad_s, turns=config.cycles),
            )
        case SShapeStep():
            return ThereAndBack(
                label=config.label,
                axis=names.index(config.axis),
                distance_m=config.distance_mm * MM,
                speed_m_s=config.velocity_mm_s * MM,
                acceleration_m_s2=config.acceleration_mm_s2 * MM,
                repeats=config.repeats,
            )
        case DwellStep():
            return Dwell(config.label, config.seconds)
        case SamplesStep():
            for axis in config.force_offset:
                if not is_mapped(machine.axes[axis].drive.sent, TORQUE_OFFSET):
                    reason = f'needs "torque_offset" in axis.{axis}.drive.rpdo1 of {machine.source}'
                    raise ConfigError(source, f"{key}.force_offset.{axis}", reason)
            return _samples(config, machine)


def _speed_rad_s(config: SineStep) -> float:
    if config.frequency_hz is not None:
        return 2.0 * math.pi * config.frequency_hz
    assert config.reverse_acceleration_mm_s2 is not None  # noqa: S101  # `SineStep` requires one of the two
    return speed_for_reverse_acceleration(config.amplitude_mm * MM, config.reverse_acceleration_mm_s2 * MM)


def _ramp_s(
    config: CircleStep | SineStep,
    machine: MachineConfig,
    source: Path,
    key: str,
    *,
    speed_rad_s: float,
    turns: float,
) -> float:
    """Return the time of the ramp at either end. Raises ConfigError if it is too short or two do not fit."""
    ramp_s = config.ramp_s or usual_ramp_s(speed_rad_s)
    reason = ""
    if ramp_s < machine.period_s:
        # samples would not resolve the ramp, so the limit check would miss it
        reason = f"{ramp_s:.4g} s is shorter than the SYNC period of {machine.period_s:g} s"
    elif not Turning(speed_rad_s, ramp_s, 2.0 * math.pi * turns).fits:
        two_ramps = f"{speed_rad_s * ramp_s / (2.0 * math.pi):.4g} turns"
        reason = f"two ramps of {ramp_s:.4g} s take {two_ramps}, the step has {turns:g}"
    if reason:
        raise ConfigError(source, f"{key}.ramp_s", reason)
    return ramp_s


def _samples(config: SamplesStep, machine: MachineConfig) -> Samples:
    """Read recorded set points of the named axes; the others are NaN and hold."""
    assert config.file is not None  # noqa: S101  # load_program has set it
    names = list(machine.axes)
    column_names = [config.time, *config.position.values(), *config.force_offset.values()]
    columns = read_columns(config.file, list(dict.fromkeys(column_names)))
    time_s = columns[config.time]
    if len(time_s) < 2:
        raise ConfigError(config.file, config.time, "at least two samples are needed")
    uneven = np.abs(np.diff(time_s) - machine.period_s) > _TIME_TOLERANCE * machine.period_s
    if uneven.any():
        row = int(np.argmax(uneven))
        step = f"step of {time_s[row + 1] - time_s[row]:.6g} s behind row {row + 1}"
        reason = f"{step} is not the SYNC period of {machine.period_s:g} s"
        raise ConfigError(config.file, config.time, reason)
    position_m = np.full((len(time_s), len(names)), np.nan)
    force_offset_n = np.zeros_like(position_m)
    for axis, column in config.position.items():
        position_m[:, names.index(axis)] = columns[column]
    for axis, column in config.force_offset.items():
        gain = config.force_offset_gain.get(axis, 1.0)
        force_offset_n[:, names.index(axis)] = columns[column] * gain
    return Samples(config.label, position_m, force_offset_n)
