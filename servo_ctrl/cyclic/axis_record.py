"""What lies in memory of the axes from cycle to cycle, declared once; `axis_step` works on it, Python looks.

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
    """Where an object lies among the inputs, and the bytes of its TPDO; of no size where it is not mapped."""

    input: int
    start: int
    size: int
    signed: bool


class Wiring(NamedTuple):
    """Where the inputs of an axis come from and what they stand for."""

    drive: int
    """Place of the drive's first TPDO among the inputs."""
    further: int
    """That of the next ones which come with every SYNC."""
    further_count: int
    scale: int
    """That of the scale's, -1 without one."""
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
    """Where the axis may be, and how far it moves in a cycle that is called rest."""

    lowest_m: float
    highest_m: float
    swing_m: float
    """So much farther out may an axis swing that is led back from beyond its limits."""
    slow_m: float


class Inputs(NamedTuple):
    """Of the last cycle. NaN where they did not come."""

    statusword: int
    """Of the drive, as it came last."""
    counts: int
    """Position of the drive in its own unit, as it came last."""
    motor_m: float
    previous_motor_m: float
    scale_m: float
    current_a: float
    scale_raw_m: float
    scale_offset_m: float
    """With it the scale reads, where the axis was taken over, what the motor encoder reads there."""
    current_held_a: float
    """Of a TPDO that comes at a change: it holds until the next one."""
    mode_shown: int
    """Mode of operation that the drive is in (6061h), `sequence.UNKNOWN_MODE` where it does not tell."""


NOTHING_CAME = Inputs(
    0, 0, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan, math.nan, UNKNOWN_MODE
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
    whole: bool
    """All inputs of this cycle have come."""
    engaged: bool
    """Our loop leads the axis."""
    homed: bool
    """Its homing has come to its end."""
    power_allowed: bool
    """Whether a drive that is without power may get it yet."""
    input_age: int
    """How many cycles old the last inputs may be, as many came late."""
    hold_m: float
    """Where the axis was taken over; its set point until a program runs."""
    last_m: float
    """The last motor position that came."""
    periods_without: int
    """Periods since then."""
    correction_m: float
    """Of the last command."""
    led_back_m: float
    """So far beyond its limits may an axis be that was taken over there."""
    braked_m: float
    """Position in the last cycle that its drive braked, NaN before."""
    controlword: int
    sent_mode: int
    """Mode of operation that goes out."""
    problem: int
    """A `sequence.Problem`."""
    found: int
    """Bits of `axis_step`: what supervision has found in this cycle."""
    beyond_m: float
    """Where it was found beyond its limits."""


class AxisParts(NamedTuple):
    """What an axis is made of."""

    params: AxisParams
    units: SetPointUnits
    limits: SupervisionLimits
    route: Route
    wiring: Wiring
    bounds: AxisBounds


def cycle_records(parts: Several[AxisParts]) -> tuple[NDArray[Any], Pool, Array]:
    """Records (n,) of axes that are not led yet, the pool of their tables, and room for supervision.

    The room is (n, cycles, 2): what `supervision.supervise` keeps of each axis.
    """
    axes = np.zeros(len(parts), record_type(CycleRecord))
    law = axes["law"]
    store(law["units"], [part.units for part in parts])
    store(law["limits"], [part.limits for part in parts])
    store(law["state"], [initial_state(0.0) for _ in parts])
    for name in ("route", "wiring", "bounds"):
        store(axes[name], [getattr(part, name) for part in parts])
    store(axes["sequence"], [begin(part.route) for part in parts])
    for name, value in (("inputs", NOTHING_CAME), ("counts", AT_REST), ("braking", BRAKE_BEGINS)):
        store(axes[name], [value] * len(parts))
    axes["power_allowed"] = True
    axes["braked_m"] = math.nan
    kept = np.zeros((len(parts), max(part.limits.runaway_cycles for part in parts) + 1, 2))
    return axes, store(law["params"], [part.params for part in parts]), kept
