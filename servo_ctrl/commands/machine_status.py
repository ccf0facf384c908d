"""Status of the controller: machine, drives and program, with the declaration of every field.

A new field needs a line in its type, a line in `FIELDS_OF` and its value where `daemon.handlers` makes the
status.
"""

import math
from typing import NamedTuple

from servo_ctrl.commands.axis_status import AxisStatus  # the codecs read the types
from servo_ctrl.commands.bus_status import BusStatus, EmcyEntry, EventEntry, NodeStatus
from servo_ctrl.commands.field import AXES, DECIMICRON, FIELDS_OF, NM, DataType, Entry, Field, numbered
from servo_ctrl.commands.learning_status import LearningStatus  # the same
from servo_ctrl.commands.settings import Settings  # the same
from servo_ctrl.commands.stage import Stage

I32, U8, U16, U32, TEXT = DataType.I32, DataType.U8, DataType.U16, DataType.U32, DataType.TEXT


class DriveStatus(NamedTuple):
    """Status of the drive of one axis, by its last inputs."""

    axis: str
    phase: str
    """Phase of its sequence, from `cyclic.drive_phases.PHASE_TEXTS`, such as "servo", "off" or "lost"."""
    state: str
    """State of CiA 402 such as "operation enabled", a value of `cyclic.cia402.DriveState`; "not responding"
    if its TPDOs are no longer received."""
    statusword: int
    error_code: int | None
    """Error code of its last emergency message since it was enabled; None without one or after a reset."""
    homed: bool
    """Whether its homing was completed in this run; False also without a homing method."""
    position_m: float
    """Motor position at the table, relative to home; NaN when missing."""
    ready: bool
    """Whether the axis follows our set points."""
    limits_m: tuple[float, float]
    """Lowest and highest position of the travel (`limits.position_mm`)."""


class WorkOffset(NamedTuple):
    """A work offset, G54 to G59."""

    name: str
    zero_m: tuple[float, ...]
    """Position of its zero relative to home, by axis in machine order."""


class ProgramStatus(NamedTuple):
    """The program of the run and its progress."""

    name: str = ""
    """File name without the directory."""
    step: int = -1
    """Present step of the program, from 0; -1 while it does not run."""
    label: str = ""
    """Label of that step."""
    progress: float = 0.0
    """Completed share of its duration in the last run, 0 to 1; a hold does not count."""
    held: bool = False
    """Whether a feed hold brings the axes to rest on the path, or keeps them there."""
    loaded: bool = False
    """Whether there is a program that can be started."""
    preparing: bool = False
    """Whether a program is being checked or planned."""
    problem: str = ""
    """Why the last attempt to load or start a program failed, else ""."""
    line: int = 0
    """Present line of G-code; 0 without one."""
    held_by: str = ""
    """Why it holds without a command: "single block", or the line of an optional stop."""
    apart: bool = False
    """Whether the present or last motion is a single line of G-code instead of this program."""
    entry: str = ""
    """The modal words in effect at the line where it is entered; "" at its first line."""
    modes: str = ""
    """The modal words in effect for the next single line of G-code."""
    offsets_m: tuple[WorkOffset, ...] = ()
    """The work offsets that were set, and the chosen one."""


class ContourStatus(NamedTuple):
    """Contour control, which couples two axes."""

    axes: tuple[str, ...] = ()
    """The two axes; empty where it is off."""
    error_m: float = math.nan
    """Contour error in the last cycle, positive where the path is left of the table; NaN while the axes stay
    where they were taken over."""

    @property
    def coupled(self) -> str:
        """The two axes in a text such as "x, y"; "" where it is off."""
        return ", ".join(self.axes)


class MachineStatus(NamedTuple):
    """The status of the controller. The fields after `program` go to the page only, but `contour`."""

    stage: Stage
    cycles: int
    """SYNC cycles so far."""
    missed_ticks: int
    learning: LearningStatus
    axes: tuple[AxisStatus, ...]
    settings: Settings
    reason: str = ""
    """Why the machine is stopping, in standby or off; "" while nothing has stopped it."""
    drives: tuple[DriveStatus, ...] = ()
    program: ProgramStatus = ProgramStatus()
    setting_up: bool = False
    """Whether nodes boot again before their drives get power."""
    contour: ContourStatus = ContourStatus()
    time: str = ""
    """When the status was sent, ISO 8601."""
    bus: BusStatus = BusStatus()
    nodes: tuple[NodeStatus, ...] = ()
    emcy: tuple[EmcyEntry, ...] = ()
    """The newest hundred emergency messages, the newest last."""
    events: tuple[EventEntry, ...] = ()
    """The newest hundred events, the newest last."""
    rows_missed: int = 0
    """Rows that this client of the local socket missed because it reads too slowly."""

    @property
    def due_mask(self) -> int:
        """Bit mask of the axes for which learning is due; bit 0 = axis 1."""
        return sum(axis.learning_due << number for number, axis in enumerate(self.axes[:AXES]))

    @property
    def last_axis(self) -> str:
        """The axis that last reversed; "" before the first reversal."""
        cycle_of = {axis.name: axis.last.cycle for axis in self.axes[:AXES] if axis.last is not None}
        return max(cycle_of, key=cycle_of.__getitem__, default="")

    @property
    def last_error_mean_m(self) -> float:
        """J of the last reversal of `last_axis`; NaN before the first."""
        return next((axis.error_mean_m for axis in self.axes if axis.name == self.last_axis), math.nan)


FIELDS_OF[MachineStatus] = {
    "cycles": Field("Cycle counter", Entry(0x2002, 0, U32), "SYNC periods so far.", mqtt="cycle"),
    "missed_ticks": Field(
        "Missed ticks", Entry(0x2003, 0, U32), "Periods without a SYNC, as the computer was late."
    ),
    "stage": Field("Controller state", Entry(0x2000, 0, U8, pdo=1), numbered(Stage)),
    "reason": Field(
        "Reason of the stop", Entry(0x2004, 0, TEXT), "Why the machine is stopping, in standby or off."
    ),
    "due_mask": Field(
        "Learning due bit mask", Entry(0x2113, 1, U8, pdo=3), "Bit 0 = axis 1.", mqtt=None, local=False
    ),
    "last_axis": Field(
        "Axis that last reversed", Entry(0x2113, 2, U8, axis_number=True), mqtt=None, local=False
    ),
    "last_error_mean_m": Field(
        "J of that axis in tenths of um", Entry(0x2113, 3, U16, DECIMICRON, pdo=6), mqtt=None, local=False
    ),
    "learning": Field(),
    "settings": Field(),
    "contour": Field(),
}
FIELDS_OF[ContourStatus] = {
    "coupled": Field(
        "Axes under contour control",
        Entry(0x2006, 0, TEXT),
        'The two axes, such as "x, y"; "" where contour control is off.',
        local=False,
        null=True,
    ),
    "error_m": Field(
        "Contour error in nm",
        Entry(0x2005, 0, I32, NM),
        "Of the axes under contour control, in the last cycle; positive where the path is left of the table.",
    ),
}
