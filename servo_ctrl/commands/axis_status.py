"""Status of one axis: compensation, monitoring and learned results, with the declaration of every field.

A new field needs a line in its type, a line in `FIELDS_OF` and its value where `daemon.handlers` makes the
status. The declared objects are those of axis 1.
"""

import math
from typing import NamedTuple

from servo_ctrl.commands import texts
from servo_ctrl.commands.field import FIELDS_OF, NM, NM_S, UM, UM_S2, US, DataType, Entry, Field, PerAxis
from servo_ctrl.learning.types import Learned, ReversalReport

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


class AxisStatus(NamedTuple):
    """Compensation and monitoring of one axis."""

    name: str
    compensation_enabled: bool
    observer_enabled: bool
    learning_due: bool
    reversals: int
    """Reversals evaluated since the start."""
    last: ReversalReport | None
    version: int
    """Version of the learned functions in use, 0 = none."""
    learned_at: str
    """Date of that version, ISO 8601, "" without one."""
    learned: Learned | None
    screw: ScrewStatus = ScrewStatus()
    waveform: WaveformStatus = WaveformStatus()
    compensation_suspended: bool = False
    """Whether no compensation acts at present, whatever is switched on: a tuning moves the axis."""

    @property
    def error_mean_m(self) -> float:
        """J of the last reversal; NaN before the first."""
        return math.nan if self.last is None else self.last.error_mean_m


def _number(title: str, index: int, subindex: int, bits: int = 16, meaning: str = "") -> Field:
    return Field(title, Entry(index, subindex, DataType[f"U{bits}"], axis=PerAxis.INDEX), meaning)


def _quantity(title: str, index: int, subindex: int, unit: float, none: int | None = None) -> Field:
    return Field(title, Entry(index, subindex, DataType.U32, unit, axis=PerAxis.INDEX, none=none))


def _nm(title: str, index: int, subindex: int, label: str, meaning: str = "") -> Field:
    field = _quantity(title, index, subindex, NM)
    return field._replace(meaning=meaning, label=label, text=texts.micrometres)


def _switch(title: str, index: int, meaning: str, label: str) -> Field:
    entry = Entry(index, 0, DataType.U8, axis=PerAxis.SUBINDEX, writable=True, low=0, high=1)
    return Field(title, entry, meaning, label=label, text=texts.on_off)


def _version(index: int, whose: str, label: str) -> Field:
    field = _number("Version", index, 1, meaning=f"Of the {whose} in use by axis 1 ... 8, 0 = none.")
    return field._replace(label=label, text=texts.version)


def _date(index: int) -> Field:
    return Field("Date", Entry(index, 2, DataType.TEXT, axis=PerAxis.INDEX), "ISO 8601.", null=True)


def _table(
    title: str, index: int, subindex: int, meaning: str, columns: dict[str, float], rows: Field
) -> Field:
    entry = Entry(index, subindex, DataType.TABLE, axis=PerAxis.INDEX, columns=tuple(columns.values()))
    return Field(title, entry, meaning, columns=tuple(columns), rows=rows)


FIELDS_OF[AxisStatus] = {
    "compensation_enabled": _switch(
        "Compensation enabled", 0x2102, "The switch of one axis, without a selection.", "pulse"
    )._replace(mqtt="compensation"),
    "observer_enabled": _switch("Observer enabled", 0x2103, "Likewise.", "observer")._replace(
        mqtt="observer"
    ),
    "learning_due": Field(
        "Learning due",
        Entry(0x2121, 1, DataType.U8, axis=PerAxis.INDEX),
        "Of axis 1 ... 8: J stays above J_required.",
        label="learning due",
        text=texts.yes_no,
    ),
    "reversals": _number("Reversals", 0x2121, 2, 32, "Evaluated since the start.")._replace(
        label="reversals"
    ),
    "compensation_suspended": Field(
        "Compensation suspended",
        Entry(0x2121, 10, DataType.U8, axis=PerAxis.INDEX),
        "A tuning moves the axis: no compensation acts, whatever is switched on.",
        label="suspended",
        text=texts.yes_no,
    ),
    "error_mean_m": Field(local=False),
    "last": Field(mqtt=None),
    "version": _version(0x2131, "functions", "functions"),
    "learned_at": _date(0x2131)._replace(label="learned at", text=texts.minute),
    "learned": Field(mqtt=None),
    "screw": Field(),
    "waveform": Field(),
}
FIELDS_OF[ReversalReport] = {
    "error_mean_m": _nm("J in nm", 0x2121, 3, "J, um", "Mean error over the monitoring time, last reversal."),
    "error_peak_m": _nm("Peak error in nm", 0x2121, 4, "peak, um"),
    "error_rms_m": _nm("RMS error in nm", 0x2121, 5, "RMS, um"),
    "contour_peak_m": _nm("Peak contour error in nm", 0x2121, 6, "contour peak, um"),
    "acceleration_m_s2": _quantity("Reverse acceleration in um per s2", 0x2121, 7, UM_S2)._replace(
        label="at, mm/s2", text=texts.millimetres
    ),
    "direction": Field(
        "Direction after the reversal",
        Entry(0x2121, 8, DataType.I8, axis=PerAxis.INDEX),
        "1 or -1; 0 = there was no reversal yet.",
        presence=True,
    ),
    "cycle": _number(
        "Cycle of the reversal",
        0x2121,
        9,
        32,
        "Read it before and after the others: equal, and they belong together.",
    ),
}
FIELDS_OF[Learned] = {
    "learner": Field(
        "Learner of the result",
        Entry(0x2131, 3, DataType.U8, axis=PerAxis.INDEX, names=LEARNERS),
        "0 fast, 1 paper, FFh none.",
        presence=True,
    ),
    "before_m": _nm("J before in nm", 0x2131, 4, "J before, um", "Without compensation."),
    "after_m": _nm("J after in nm", 0x2131, 5, "J after, um", "With what was learned."),
    "strokes": _number("Strokes", 0x2131, 6),
    "machine_time_s": _quantity("Machine time in s", 0x2131, 7, 1.0, none=0),
    "spread_m_s2": _quantity("Spread of the GRNN in um per s2", 0x2131, 8, UM_S2, none=0)._replace(
        meaning="s; 0 = the amplitudes are joined by lines."
    ),
    "durations": _table(
        "Duration function",
        0x2141,
        1,
        "Rows of acceleration um/s², duration us.",
        {"acceleration_mm_s2": UM_S2, "duration_ms": US},
        _number("Duration points", 0x2131, 9, meaning="Rows of the functions below."),
    ),
    "amplitudes": _table(
        "Amplitude function",
        0x2141,
        2,
        "Rows of acceleration um/s², amplitude nm/s.",
        {"acceleration_mm_s2": UM_S2, "amplitude_mm_s": NM_S},
        _number("Amplitude points", 0x2131, 10),
    ),
    "trailing": _table(
        "Trailing function",
        0x2141,
        3,
        "Rows of acceleration um/s², start us, duration us, amplitude nm/s.",
        {"acceleration_mm_s2": UM_S2, "start_ms": US, "duration_ms": US, "amplitude_mm_s": NM_S},
        _number("Trailing points", 0x2131, 11),
    ),
}
FIELDS_OF[ScrewStatus] = {
    "enabled": _switch(
        "Screw compensation enabled", 0x2107, "Screw table and backlash take-up, as 2102h.", "screw"
    ),
    "version": _version(0x2151, "learned screw", "screw table"),
    "learned_at": _date(0x2151),
    "lost_motion_m": _nm("Lost motion in nm", 0x2151, 5, "lost motion, um", "Mean over the travel.")._replace(
        part="learned"
    ),
    "before_m": _nm(
        "J before in nm",
        0x2151,
        3,
        "screw J before, um",
        "Mean deviation of the scale from the command over the travel, without compensation.",
    )._replace(part="learned"),
    "after_m": _nm("J after in nm", 0x2151, 4, "screw J after, um", "With what was learned.")._replace(
        part="learned"
    ),
    "spread_m": _quantity("Spread in nm", 0x2151, 6, NM)._replace(
        meaning="Standard deviation from travel to travel.", mqtt=None, local=False, part="learned"
    ),
    "strokes": _number("Travels", 0x2151, 7)._replace(mqtt=None, local=False, part="learned"),
    "machine_time_s": _quantity("Machine time in s", 0x2151, 8, 1.0, none=0)._replace(
        mqtt=None, local=False, part="learned"
    ),
    "points": _table(
        "Screw errors",
        0x2161,
        1,
        "Rows of position um, error nm, lost motion there nm.",
        {"position": UM, "error": NM, "lost_motion": NM},
        _number("Nodes", 0x2151, 9, meaning="Rows of the table below."),
    )._replace(mqtt=None),
}
FIELDS_OF[WaveformStatus] = {
    "enabled": _switch("Waveform enabled", 0x2108, "Learned waveform, as 2102h.", "waveform"),
    "version": _version(0x2171, "learned waveform", "waveform version"),
    "learned_at": _date(0x2171),
    "before_m": _nm("J before in nm", 0x2171, 3, "waveform J before, um", "Without compensation.")._replace(
        part="learned"
    ),
    "after_m": _nm("J after in nm", 0x2171, 4, "waveform J after, um", "With what was learned.")._replace(
        part="learned"
    ),
    "strokes": _number("Strokes", 0x2171, 5)._replace(mqtt=None, local=False, part="learned"),
}
