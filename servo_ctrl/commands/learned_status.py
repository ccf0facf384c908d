"""Status of the learned results of one axis: functions, screw table and waveform, with their fields."""

import math
from typing import NamedTuple

from servo_ctrl.commands.axis_fields import date, length, number, quantity, switch, table, version
from servo_ctrl.commands.field import FIELDS_OF, NM, NM_S, UM, UM_S2, US, DataType, Entry, Field, PerAxis
from servo_ctrl.learning.types import Learned

LEARNERS = ("fast", "paper", "screw", "waveform")
"""Learners in the order of their numbers in 2104h:02 and 2131h:03; the first two learn the pulse."""


class ScrewStatus(NamedTuple):
    """Screw compensation of one axis and its learned result; see `learning.screw.ScrewLearned`."""

    enabled: bool = False
    version: int = 0
    """Version of the learned screw in use, 0 = none."""
    learned_at: str = ""
    """Date of that version, ISO 8601, "" without one."""
    points: tuple[tuple[float, float, float], ...] = ()
    """Rows of table position, and error and lost motion there, metres."""
    lost_motion_m: float = math.nan
    spread_m: float = math.nan
    before_m: float = math.nan
    after_m: float = math.nan
    strokes: int = 0
    machine_time_s: float = math.nan

    @property
    def learned(self) -> bool:
        """Whether a version is in use."""
        return bool(self.points)


class WaveformStatus(NamedTuple):
    """Learned waveform of one axis; see `learning.reversal_waveform.WaveformLearned`."""

    enabled: bool = False
    version: int = 0
    """Version of the waveform in use, 0 = none."""
    learned_at: str = ""
    """Date of that version, ISO 8601, "" without one."""
    before_m: float = math.nan
    after_m: float = math.nan
    strokes: int = 0

    @property
    def learned(self) -> bool:
        """A version is in use."""
        return self.version > 0


FIELDS_OF[Learned] = {
    "learner": Field(
        "Learner of the result",
        Entry(0x2131, 3, DataType.U8, axis=PerAxis.INDEX, names=LEARNERS),
        "0 fast, 1 paper, FFh none.",
        presence=True,
    ),
    "before_m": length("J before in nm", 0x2131, 4, "J before, um", "Without compensation."),
    "after_m": length("J after in nm", 0x2131, 5, "J after, um", "With what was learned."),
    "strokes": number("Strokes", 0x2131, 6),
    "machine_time_s": quantity("Machine time in s", 0x2131, 7, 1.0, none=0),
    "spread_m_s2": quantity("Spread of the GRNN in um per s2", 0x2131, 8, UM_S2, none=0)._replace(
        meaning="s; 0 = the amplitudes are joined by lines."
    ),
    "durations": table(
        "Duration function",
        0x2141,
        1,
        meaning="Rows of acceleration um/s², duration us.",
        columns={"acceleration_mm_s2": UM_S2, "duration_ms": US},
        rows=number("Duration points", 0x2131, 9, meaning="Rows of the functions below."),
    ),
    "amplitudes": table(
        "Amplitude function",
        0x2141,
        2,
        meaning="Rows of acceleration um/s², amplitude nm/s.",
        columns={"acceleration_mm_s2": UM_S2, "amplitude_mm_s": NM_S},
        rows=number("Amplitude points", 0x2131, 10),
    ),
    "trailing": table(
        "Trailing function",
        0x2141,
        3,
        meaning="Rows of acceleration um/s², start us, duration us, amplitude nm/s.",
        columns={"acceleration_mm_s2": UM_S2, "start_ms": US, "duration_ms": US, "amplitude_mm_s": NM_S},
        rows=number("Trailing points", 0x2131, 11),
    ),
}
FIELDS_OF[ScrewStatus] = {
    "enabled": switch(
        "Screw compensation enabled", 0x2107, "Screw table and backlash take-up, as 2102h.", "screw"
    ),
    "version": version(0x2151, "learned screw", "screw table"),
    "learned_at": date(0x2151),
    "lost_motion_m": length(
        "Lost motion in nm", 0x2151, 5, "lost motion, um", "Mean over the travel."
    )._replace(part="learned"),
    "before_m": length(
        "J before in nm",
        0x2151,
        3,
        "screw J before, um",
        "Mean deviation of the scale from the command over the travel, without compensation.",
    )._replace(part="learned"),
    "after_m": length("J after in nm", 0x2151, 4, "screw J after, um", "With what was learned.")._replace(
        part="learned"
    ),
    "spread_m": quantity("Spread in nm", 0x2151, 6, NM)._replace(
        meaning="Standard deviation from travel to travel.", mqtt=None, local=False, part="learned"
    ),
    "strokes": number("Travels", 0x2151, 7)._replace(mqtt=None, local=False, part="learned"),
    "machine_time_s": quantity("Machine time in s", 0x2151, 8, 1.0, none=0)._replace(
        mqtt=None, local=False, part="learned"
    ),
    "points": table(
        "Screw errors",
        0x2161,
        1,
        meaning="Rows of position um, error nm, lost motion there nm.",
        columns={"position": UM, "error": NM, "lost_motion": NM},
        rows=number("Nodes", 0x2151, 9, meaning="Rows of the table below."),
    )._replace(mqtt=None),
}
FIELDS_OF[WaveformStatus] = {
    "enabled": switch("Waveform enabled", 0x2108, "Learned waveform, as 2102h.", "waveform"),
    "version": version(0x2171, "learned waveform", "waveform version"),
    "learned_at": date(0x2171),
    "before_m": length(
        "J before in nm", 0x2171, 3, "waveform J before, um", "Without compensation."
    )._replace(part="learned"),
    "after_m": length("J after in nm", 0x2171, 4, "waveform J after, um", "With what was learned.")._replace(
        part="learned"
    ),
    "strokes": number("Strokes", 0x2171, 5)._replace(mqtt=None, local=False, part="learned"),
}
