"""The measuring motion of an axis as steps of a program, and the evaluation of its recording.

The axis travels through the middle of its limits, there and back, at a speed high enough that the excitation
does not reverse it.
"""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.canopen.scaling import drive_scaling
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.tuning.excitation import Multisine, Travel, multisine, travel, travel_time_s
from servo_ctrl.tuning.frequency_response import FrequencyResponse, Measured, frequency_response
from servo_ctrl.units import MM

SPEED_M_S, SPEED_SHARE = 0.01, 0.2
"""Speed of a travel, and its largest share of the speed limit. Chosen, as are the numbers below."""
TRAVEL_SHARE = 0.8
"""Largest length of a travel, as a share of the distance between the position limits."""
TO_START_SHARE = 0.2
"""Speed of the move to the start, as a share of the speed limit."""
REST_S = 1.0
"""Dwell at the start, in which the session sees whether the axis oscillates at rest."""
BETWEEN_S = 0.3
"""Dwell between two travels."""
ALIGNMENT_M = 1e-9
"""Largest difference between planned and recorded command: more means that cycles were missed."""


class TuneError(ServoCtrlError):
    """An axis that cannot be tuned; the message says why, and what to do."""


class Plan(NamedTuple):
    """Travels of one measurement, one after the other."""

    axis: str
    start_m: float
    speed_m_s: float
    excitation: Multisine
    periods: int
    amplitude_n: float
    travels: tuple[Travel, ...]
    """Their positions are relative to `start_m`."""


def plan_measurement(machine: MachineConfig, axis: str, amplitude_n: float, periods: int) -> Plan:
    """Plan a travel there and back with `periods` evaluated periods each.

    `amplitude_n`: peak of the multisine. Raises TuneError where the limits are too close together.
    """
    config, period_s = machine.axes[axis], machine.period_s
    limits = config.limits
    low_m, high_m = (edge * MM for edge in limits.position_mm)
    speed_m_s = min(SPEED_M_S, SPEED_SHARE * limits.velocity_mm_s * MM)
    ramp_s = _ramp_s(config, speed_m_s)
    length_m = speed_m_s * travel_time_s(periods, ramp_s, period_s)
    longest_m = TRAVEL_SHARE * (high_m - low_m)
    if length_m > longest_m:
        speed_m_s *= longest_m / length_m
        length_m = longest_m
    count_m = config.transmission.lead_mm * MM / config.drive.counts_per_rev
    if speed_m_s < 20.0 * count_m:
        raise TuneError(
            f"axis {axis}: its limits leave room for {speed_m_s * 1e3:.3g} mm/s only, which the encoder does "
            "not resolve"
        )
    excitation, travels, at_m = multisine(period_s), [], 0.0
    for direction in (1.0, -1.0):
        one = travel(excitation, amplitude_n, periods, direction * speed_m_s, ramp_s, period_s)
        travels.append(one._replace(position_m=at_m + one.position_m))
        at_m = float(travels[-1].position_m[-1])
    start_m = 0.5 * (low_m + high_m) - 0.5 * length_m
    return Plan(
        axis=axis,
        start_m=start_m,
        speed_m_s=speed_m_s,
        excitation=excitation,
        periods=periods,
        amplitude_n=amplitude_n,
        travels=tuple(travels),
    )


def _ramp_s(config: AxisConfig, speed_m_s: float) -> float:
    """Duration of a raised-cosine ramp within half the limits of acceleration and jerk, s."""
    by_acceleration = math.pi * speed_m_s / (config.limits.acceleration_mm_s2 * MM)
    by_jerk = math.pi * math.sqrt(speed_m_s / (config.limits.jerk_mm_s3 * MM))
    return max(0.1, by_acceleration, by_jerk)


def measuring_steps(plan: Plan, machine: MachineConfig, folder: Path) -> list[dict[str, Any]]:
    """Return the steps of a program file; their samples are written into files of `folder`."""
    limits = machine.axes[plan.axis].limits
    feed = TO_START_SHARE * limits.velocity_mm_s * 60.0
    steps: list[dict[str, Any]] = [
        {
            "kind": "move",
            "label": "to the start",
            "to_mm": {plan.axis: plan.start_m / MM},
            "feed_mm_min": feed,
        },
        {"kind": "dwell", "label": "rest", "seconds": REST_S},
    ]
    for index, one in enumerate(plan.travels):
        label = travel_label(index)
        steps.append(
            samples_step(
                plan.axis, label, plan.start_m + one.position_m, one.force_n, machine.period_s, folder
            )
        )
        steps.append({"kind": "dwell", "label": f"after {label}", "seconds": BETWEEN_S})
    return steps


def samples_step(
    axis: str, label: str, position_m: Array, force_n: Array, period_s: float, folder: Path
) -> dict[str, Any]:
    """Write samples, (n,) each, into a file of `folder`, and return the step of a program that runs them."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{label.replace(' ', '_')}.npz"
    time_s = np.arange(len(position_m)) * period_s
    np.savez(file, time_s=time_s, position_m=position_m, force_n=force_n)
    return {
        "kind": "samples",
        "label": label,
        "file": file,
        "position": {axis: "position_m"},
        "force_offset": {axis: "force_n"},
    }


def travel_label(index: int) -> str:
    """Label of a travel in program and recording, from 0."""
    return f"travel {index + 1}"


def measured_travels(
    plan: Plan, machine: MachineConfig, segments: Sequence[Mapping[str, Array]]
) -> list[Measured]:
    """Return the evaluated periods of each travel, from the recorded columns of its step.

    Raises TuneError where the recording is not the planned motion, or lacks positions.
    """
    config = machine.axes[plan.axis]
    unit_n = drive_scaling(config).newton_per_permille
    measured = []
    for index, (one, columns) in enumerate(zip(plan.travels, segments, strict=True)):
        command_m = plan.start_m + one.position_m
        recorded_m = columns[f"{plan.axis}.position_command_m"]
        if len(recorded_m) != len(command_m) or not np.abs(recorded_m - command_m).max() < ALIGNMENT_M:
            raise TuneError(
                f"{travel_label(index)} was not run as planned: cycles were missed, or the run was held; "
                "measure again on a computer that keeps the period"
            )
        stop = one.first + plan.periods * len(plan.excitation.values)
        rows = slice(one.first, stop)
        # PDOs carry both forces in whole per mille of the rated torque, each rounded for itself
        added_n = np.rint(one.force_n[rows] / unit_n) * unit_n
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
    """Reaction of the motor, at the lines of the excitation only: friction and drift do not count."""
    count = len(plan.excitation.values)
    periods = np.concatenate([one.motor_m.reshape(-1, count) for one in travels])
    spectrum = np.zeros(count // 2 + 1, dtype=np.complex128)
    lines = plan.excitation.lines
    spectrum[lines] = np.fft.rfft(periods.mean(axis=0))[lines]
    rate = 2j * math.pi * np.arange(len(spectrum)) / (count * machine.period_s)
    return AxisReaction(
        speed_m_s=float(np.abs(np.fft.irfft(rate * spectrum, count)).max()),
        position_m=float(np.abs(np.fft.irfft(spectrum, count)).max()),
        force_n=max(float(np.abs(one.total_n).max()) for one in travels),
    )
