"""What is found of an axis in a cycle, over its record: travel, runaway, saturation, sensors that disagree.

`axis_step` calls these. Findings are bits of the record's `found`; `axis.axis_watch` turns them into events.
"""

import math
from typing import Any

from kernels.arrays import Array
from kernels.jit import kernel
from kernels.records import read, write
from servo_ctrl.control.signs import DISAGREE, SupervisionLimits
from servo_ctrl.cyclic.supervision import AT_REST, BRAKE_BEGINS, Braking, Counts, supervise
from servo_ctrl.cyclic.supervision import supervise_braking as _supervise_braking

BEYOND, RUNAWAY_BRAKED, FOLLOWING_ERROR, BAD_COMMAND = 32, 64, 128, 256
"""Bits of what was found, beside those of `supervision`: beyond the limits of travel; faster although braked;
two of the law's `Status`."""


@kernel
def begin_watch(axis: Any, at_m: float) -> None:
    """Restart the supervision, as the axis is taken over here, or given up."""
    write(axis["counts"], AT_REST)
    write(axis["braking"], BRAKE_BEGINS)
    axis["braked_m"] = math.nan
    out_m = excursion_m(axis["bounds"], at_m)
    axis["allowed_excursion_m"] = out_m + axis["bounds"]["return_overshoot_m"] if out_m > 0.0 else 0.0


@kernel
def excursion_m(bounds: Any, at_m: float) -> float:
    """How far a position is beyond the limits of travel (m), negative within them."""
    out_m: float = max(bounds["lowest_m"] - at_m, at_m - bounds["highest_m"])
    return out_m


@kernel
def check_travel(axis: Any, at_m: float) -> None:
    """Find a position beyond the limits; an axis that was taken over there may be led back."""
    bounds = axis["bounds"]
    if bounds["lowest_m"] <= at_m <= bounds["highest_m"]:
        return
    out_m = excursion_m(bounds, at_m)
    if out_m > axis["allowed_excursion_m"]:
        axis["found"] |= BEYOND
        axis["violation_m"] = at_m
    else:
        axis["allowed_excursion_m"] = min(axis["allowed_excursion_m"], out_m + bounds["return_overshoot_m"])


@kernel
def judge(axis: Any, kept: Array) -> None:
    """Judge one cycle of an axis that we lead by the signs of its tick, none in nearly every one."""
    law = axis["law"]
    if not law["signs"]:
        write(axis["counts"], AT_REST)
        return
    limits, sample, command = read(law["limits"], SupervisionLimits), law["sample"], law["command"]
    push_n = command["force_n"] if math.isnan(sample["motor_force_n"]) else sample["motor_force_n"]
    counts, finding = supervise(
        limits,
        read(axis["counts"], Counts),
        kept,
        law["signs"],
        push_n,
        command["motor_velocity_m_s"],
        command["position_error_m"],
    )
    write(axis["counts"], counts)
    if finding & DISAGREE:  # of different cycles they differ by the travel between them
        deviation_m = sample["motor_position_m"] - command["correction_m"] - sample["scale_position_m"]
        travel_m = abs(command["motor_velocity_m_s"]) * axis["route"]["period_s"] * axis["input_age"]
        if abs(deviation_m) <= limits.deviation_m + travel_m:
            finding &= ~DISAGREE
    axis["found"] |= finding


@kernel
def supervise_braking(axis: Any) -> None:
    """Judge one cycle of an axis that its drive brakes; a missing position is left out."""
    velocity_m_s = (axis["inputs"]["motor_m"] - axis["braked_m"]) / axis["route"]["period_s"]
    axis["braked_m"] = axis["inputs"]["motor_m"]
    if math.isnan(velocity_m_s):
        return
    limits = read(axis["law"]["limits"], SupervisionLimits)
    braking, runs_away = _supervise_braking(limits, read(axis["braking"], Braking), velocity_m_s)
    write(axis["braking"], braking)
    if runs_away:
        axis["found"] |= RUNAWAY_BRAKED
