"""Status of the controller: machine, drives and program, with the declaration of every field.

A new field is a line in its type and one below it, and its value where `daemon.handlers` makes the status.
"""

import math
from typing import NamedTuple

from servo_ctrl.commands.axis_status import AxisStatus  # the codecs read the types
from servo_ctrl.commands.bus_status import BusStatus, EmcyEntry, EventEntry, NodeStatus
from servo_ctrl.commands.field import AXES, DECIMICRON, FIELDS_OF, DataType, Entry, Field, numbered
from servo_ctrl.commands.learning_status import LearningStatus  # the same
from servo_ctrl.commands.settings import Settings  # the same
from servo_ctrl.commands.stage import Stage

U8, U16, U32, TEXT = DataType.U8, DataType.U16, DataType.U32, DataType.TEXT


class DriveStatus(NamedTuple):
    """The drive of one axis, by its last inputs."""

    axis: str
    phase: str
    """Of its sequence: a value of `axis.drive.Phase`, as "servo", "off" or "lost"."""
    state: str
    """Of the power stage, CiA 402, as "operation enabled"; a value of `cyclic.cia402.DriveState`, or "not
    heard" where its inputs do not come any more."""
    statusword: int
    error_code: int | None
    """Of its last emergency message that was no reset, since it was enabled; None without one."""
    homed: bool
    """Its homing has come to its end in this run; False also where it has no homing method."""
    position_m: float
    """Motor position at the table, relative to home; NaN when it did not come."""
    ready: bool
    """Our loop leads the axis."""
    limits_m: tuple[float, float]
    """Of the travel (`limits.position_mm`), lowest and highest."""


class WorkOffset(NamedTuple):
    """A work offset, G54 to G59."""

    name: str
    zero_m: tuple[float, ...]
    """Where its zero is, per axis in machine order, relative to home."""


class ProgramStatus(NamedTuple):
    """The program of the run and how far it is."""

    name: str = ""
    """Its file, without the directory."""
    step: int = -1
    """Of the program, from 0; -1 while it does not run."""
    label: str = ""
    """Of that step."""
    progress: float = 0.0
    """Share of its time that was run, the last time, 0 to 1; a hold does not count."""
    held: bool = False
    """A feed hold was asked for: the axes come to rest on the path, or rest there."""
    loaded: bool = False
    """There is a program that can be started."""
    preparing: bool = False
    """One is being checked, or is about to start."""
    problem: str = ""
    """Why the last one that was to be loaded or started was not; "" when it was."""
    line: int = 0
    """Of G-code: the one under way; 0 where there is none."""
    held_by: str = ""
    """Why it is held where nobody asked for it then: "single block", or the line of an optional stop."""
    apart: bool = False
    """What runs, or ran last, was a single line of G-code, not this program."""
    entry: str = ""
    """The modal words that hold where it is entered at a line behind its first; "" at the first."""
    modes: str = ""
    """The modal words that hold for the next single line of G-code."""
    offsets_m: tuple[WorkOffset, ...] = ()
    """The work offsets that are set."""


class MachineStatus(NamedTuple):
    """Everything readable. What follows `program` is known to the page only."""

    stage: Stage
    cycles: int
    """SYNC cycles so far."""
    missed_ticks: int
    learning: LearningStatus
    axes: tuple[AxisStatus, ...]
    settings: Settings
    reason: str = ""
    """Why the machine is stopping, in standby or off; "" while nothing stopped it."""
    drives: tuple[DriveStatus, ...] = ()
    program: ProgramStatus = ProgramStatus()
    setting_up: bool = False
    """Nodes are booted and configured again, for drives that are to be enabled."""
    time: str = ""
    """When it was sent, ISO 8601."""
    bus: BusStatus = BusStatus()
    nodes: tuple[NodeStatus, ...] = ()
    emcy: tuple[EmcyEntry, ...] = ()
    """The newest hundred, the newest last."""
    events: tuple[EventEntry, ...] = ()
    """Likewise."""
    rows_missed: int = 0
    """By this client of the local socket: it reads too slowly."""

    @property
    def due_mask(self) -> int:
        """Bit 0 = learning is due for axis 1."""
        return sum(axis.learning_due << number for number, axis in enumerate(self.axes[:AXES]))

    @property
    def last_axis(self) -> str:
        """The axis that last reversed; "" before the first reversal."""
        cycle_of = {axis.name: axis.last.cycle for axis in self.axes[:AXES] if axis.last is not None}
        return max(cycle_of, key=cycle_of.__getitem__, default="")

    @property
    def last_error_mean_m(self) -> float:
        """J of that axis."""
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
}
