"""The measuring motion of an axis as steps of a program.

The axis travels through the middle of its limits, there and back, at a speed high enough that the excitation
does not reverse it.
"""

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.config.model import AxisConfig, MachineConfig
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.excitation.multisine import Multisine, Travel, multisine, travel, travel_time_s
from servo_ctrl.units import MM

SPEED_M_S, SPEED_SHARE = 0.01, 0.2
"""Speed of a travel, and its largest share of the speed limit. Chosen, as are the numbers below."""
TRAVEL_SHARE = 0.8
"""Largest length of a travel, as a share of the distance between the position limits."""
APPROACH_SPEED_SHARE = 0.2
"""Speed of the move to the start, as a share of the speed limit."""
START_DWELL_S = 1.0
"""Dwell at the start, in which an oscillation of the axis at rest shows."""
LARGEST_FORCE_SHARE = 0.15
"""Largest added force of a measurement, as a share of the force limit."""
TRAVEL_PAUSE_S = 0.3
"""Dwell between two travels."""


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
        each = travel(
            excitation,
            amplitude_n=amplitude_n,
            periods=periods,
            speed_m_s=direction * speed_m_s,
            ramp_s=ramp_s,
            period_s=period_s,
        )
        travels.append(each._replace(position_m=at_m + each.position_m))
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
    """Return the duration of a raised-cosine ramp within half the limits of acceleration and jerk, s."""
    by_acceleration = math.pi * speed_m_s / (config.limits.acceleration_mm_s2 * MM)
    by_jerk = math.pi * math.sqrt(speed_m_s / (config.limits.jerk_mm_s3 * MM))
    return max(0.1, by_acceleration, by_jerk)


def measuring_steps(plan: Plan, machine: MachineConfig, folder: Path) -> list[dict[str, Any]]:
    """Return the steps of a program file; their samples are written into files of `folder`."""
    limits = machine.axes[plan.axis].limits
    feed = APPROACH_SPEED_SHARE * limits.velocity_mm_s * 60.0
    steps: list[dict[str, Any]] = [
        {
            "kind": "move",
            "label": "to the start",
            "to_mm": {plan.axis: plan.start_m / MM},
            "feed_mm_min": feed,
        },
        {"kind": "dwell", "label": "rest", "seconds": START_DWELL_S},
    ]
    for index, each in enumerate(plan.travels):
        label = travel_label(index)
        steps.append(
            samples_step(
                plan.axis,
                label,
                position_m=plan.start_m + each.position_m,
                force_n=each.force_n,
                period_s=machine.period_s,
                folder=folder,
            )
        )
        steps.append({"kind": "dwell", "label": f"after {label}", "seconds": TRAVEL_PAUSE_S})
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
    """Return the label of a travel in program and recording, from 0."""
    return f"travel {index + 1}"
