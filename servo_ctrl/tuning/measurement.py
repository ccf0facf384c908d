"""Evaluates a measuring motion: frequency response, and how strongly the axis reacted."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.canopen.scaling import drive_scaling
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.excitation.measuring_motion import Plan, TuneError, travel_label
from servo_ctrl.tuning.frequency_response import FrequencyResponse, Measured, frequency_response

ALIGNMENT_M = 1e-9
"""Bounds the difference between planned and recorded command: more means missed cycles. Chosen."""


def measured_travels(
    plan: Plan, machine: MachineConfig, segments: Sequence[Mapping[str, Array]]
) -> list[Measured]:
    """Return the evaluated periods of each travel, from the recorded columns of its step.

    Raises TuneError where the recording is not the planned motion, or lacks positions.
    """
    config = machine.axes[plan.axis]
    unit_n = drive_scaling(config).newton_per_permille
    measured = []
    for index, (travel, columns) in enumerate(zip(plan.travels, segments, strict=True)):
        command_m = plan.start_m + travel.position_m
        recorded_m = columns[f"{plan.axis}.position_command_m"]
        if len(recorded_m) != len(command_m) or not np.abs(recorded_m - command_m).max() < ALIGNMENT_M:
            raise TuneError(
                f"{travel_label(index)} was not run as planned: cycles were missed, or the run was held; "
                "measure again on a computer that keeps the period"
            )
        stop = travel.first + plan.periods * len(plan.excitation.values)
        rows = slice(travel.first, stop)
        # PDOs carry both forces in whole per mille of the rated torque, each rounded for itself
        added_n = np.rint(travel.force_n[rows] / unit_n) * unit_n
        loop_n = np.rint(columns[f"{plan.axis}.force_command_n"][rows] / unit_n) * unit_n
        motor_m = columns[f"{plan.axis}.motor_position_m"][rows] - command_m[rows]
        scale_m = columns[f"{plan.axis}.scale_position_m"][rows] - command_m[rows]
        if not np.isfinite(motor_m).all():
            raise TuneError(f"{travel_label(index)}: motor positions are missing in the recording")
        if config.scale is None:
            scale_m = motor_m
        elif not np.isfinite(scale_m).all():
            raise TuneError(f"{travel_label(index)}: scale positions are missing in the recording")
        measured.append(Measured(added_n, added_n + loop_n, motor_m, scale_m))
    return measured


def response_of(plan: Plan, machine: MachineConfig, travels: Sequence[Measured]) -> FrequencyResponse:
    """Estimate the frequency response from the travels of a plan."""
    return frequency_response(travels, len(plan.excitation.values), plan.excitation.lines, machine.period_s)


class AxisReaction(NamedTuple):
    """How strongly an axis reacts to the excitation."""

    speed_m_s: float
    """Largest change of speed."""
    position_m: float
    """Largest deviation from the command."""
    force_n: float
    """Largest total force."""


def reaction_to(plan: Plan, machine: MachineConfig, travels: Sequence[Measured]) -> AxisReaction:
    """Return the reaction of the motor at the lines of the excitation only, without friction and drift."""
    count = len(plan.excitation.values)
    periods = np.concatenate([travel.motor_m.reshape(-1, count) for travel in travels])
    spectrum = np.zeros(count // 2 + 1, dtype=np.complex128)
    lines = plan.excitation.lines
    spectrum[lines] = np.fft.rfft(periods.mean(axis=0))[lines]
    rate = 2j * math.pi * np.arange(len(spectrum)) / (count * machine.period_s)
    return AxisReaction(
        speed_m_s=float(np.abs(np.fft.irfft(rate * spectrum, count)).max()),
        position_m=float(np.abs(np.fft.irfft(spectrum, count)).max()),
        force_n=max(float(np.abs(travel.total_n).max()) for travel in travels),
    )
