"""State of the axes between cycles, declared once: `axis_step` changes it, Python only reads it.

Positions in metres at the table, relative to home.
"""

import math
from collections.abc import Sequence as Several
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.arrays import Array
from kernels.record_layout import Pool, record_type, store
from servo_ctrl.control.axis_record import AxisRecord
from servo_ctrl.control.set_point_counts import SetPointUnits
from servo_ctrl.control.signs import SupervisionLimits
from servo_ctrl.control.tick import AxisParams, initial_state
from servo_ctrl.cyclic.drive_phases import UNKNOWN_MODE
from servo_ctrl.cyclic.sequence_state import Route, Sequence, begin
from servo_ctrl.cyclic.supervision import AT_REST, BRAKE_BEGINS, Braking, Counts


class InputPlace(NamedTuple):
    """Position of an object in the input bytes and its size in bytes; size 0 where no TPDO maps it."""

    input: int
    start: int
    size: int
    signed: bool


class Wiring(NamedTuple):
    """Sources of the inputs of an axis, and their units."""

    drive: int
    """Index of the drive's first TPDO among the inputs."""
    further: int
    """Index of its further TPDOs that come with every SYNC."""
    further_count: int
    scale: int
    """Index of the scale's TPDO, -1 without one."""
    statusword: InputPlace
    position: InputPlace
    current: InputPlace
    mode_shown: InputPlace
    scale_position: InputPlace
    metre_per_count: float
    ampere_per_permille: float
    newton_per_ampere: float
    scale_metre_per_count: float


class AxisBounds(NamedTuple):
    """Travel limits of the axis, and what counts as standstill."""

    lowest_m: float
    highest_m: float
    return_overshoot_m: float
    """Overshoot that is allowed to an axis on its way back from beyond its limits."""
    standstill_step_m: float
    """Largest travel in a period that counts as standstill."""


class Inputs(NamedTuple):
    """Inputs of the last cycle; NaN where none arrived."""

    statusword: int
    """The drive's last one."""
    counts: int
    """The drive's last position, in its own unit."""
    motor_m: float
    previous_motor_m: float
    scale_m: float
    current_a: float
    scale_raw_m: float
    scale_offset_m: float
    """Added to the scale's reading, so that it equalled the motor encoder's when control began."""
    current_held_a: float
    """From an event-driven TPDO: valid until the next one."""
    mode_shown: int
    """Modes of operation display (6061h), `sequence.UNKNOWN_MODE` where the drive does not send it."""


NO_INPUTS = Inputs(
    statusword=0,
    counts=0,
    motor_m=math.nan,
    previous_motor_m=math.nan,
    scale_m=math.nan,
    current_a=math.nan,
    scale_raw_m=math.nan,
    scale_offset_m=math.nan,
    current_held_a=math.nan,
    mode_shown=UNKNOWN_MODE,
)


class CycleRecord(NamedTuple):
    """One axis."""

    law: AxisRecord
    route: Route
    wiring: Wiring
    bounds: AxisBounds
    inputs: Inputs
    sequence: Sequence
    counts: Counts
    braking: Braking
    complete: bool
    """Whether all inputs of this cycle have arrived."""
    engaged: bool
    """Whether our loops control the axis."""
    homed: bool
    """Whether its homing has ended."""
    power_allowed: bool
    """Whether a drive without power may be switched on now."""
    input_age: int
    """Age in cycles that the last inputs may have, because so many arrived late."""
    hold_m: float
    """Position at which control of the axis began; its set point until a program runs."""
    last_m: float
    """The last motor position that arrived."""
    periods_without_input: int
    """Periods since then."""
    correction_m: float
    """Of the last command."""
    allowed_excursion_m: float
    """How far beyond its limits the axis may be: control began there, and it returns."""
    braked_m: float
    """Position in the last cycle that its drive braked, NaN before."""
    controlword: int
    sent_mode: int
    """Modes of operation (6060h) that is sent."""
    problem: int
    """A `sequence.Problem`."""
    found: int
    """Bits of `axis_step`: faults that supervision found in this cycle."""
    violation_m: float
    """Position at which it was found beyond its limits."""


class AxisParts(NamedTuple):
    """Constants of an axis."""

    params: AxisParams
    units: SetPointUnits
    limits: SupervisionLimits
    route: Route
    wiring: Wiring
    bounds: AxisBounds


def cycle_records(parts: Several[AxisParts]) -> tuple[NDArray[Any], Pool, Array]:
    """Records (n,) of axes before control begins, the pool of their tables, and the memory of supervision.

    The memory is (n, cycles, 2): what `supervision.supervise` keeps of each axis.
    """
    axes = np.zeros(len(parts), record_type(CycleRecord))
    law = axes["law"]
    store(law["units"], [part.units for part in parts])
    store(law["limits"], [part.limits for part in parts])
    store(law["state"], [initial_state(0.0) for _ in parts])
    for name in ("route", "wiring", "bounds"):
        store(axes[name], [getattr(part, name) for part in parts])
    store(axes["sequence"], [begin(part.route) for part in parts])
    for name, value in (("inputs", NO_INPUTS), ("counts", AT_REST), ("braking", BRAKE_BEGINS)):
        store(axes[name], [value] * len(parts))
    axes["power_allowed"] = True
    axes["braked_m"] = math.nan
    kept = np.zeros((len(parts), max(part.limits.runaway_cycles for part in parts) + 1, 2))
    return axes, store(law["params"], [part.params for part in parts]), kept
