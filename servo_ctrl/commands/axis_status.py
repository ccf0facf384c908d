"""Status of one axis: compensation and monitoring, with the declaration of every field.

A new field needs a line in its type, a line in `FIELDS_OF` and its value where `daemon.handlers` makes the
status. The declared objects are those of axis 1.
"""

import math
from typing import NamedTuple

from servo_ctrl.commands import texts
from servo_ctrl.commands.axis_fields import date, length, number, quantity, switch, version
from servo_ctrl.commands.field import FIELDS_OF, UM_S2, DataType, Entry, Field, PerAxis
from servo_ctrl.commands.learned_status import ScrewStatus, WaveformStatus  # the codecs read the types
from servo_ctrl.learning.types import Learned, ReversalReport  # the same


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
    temperature_degc: float = math.nan
    """Temperature of its guide; NaN if there is none that can be trusted."""

    @property
    def error_mean_m(self) -> float:
        """J of the last reversal; NaN before the first."""
        return math.nan if self.last is None else self.last.error_mean_m

    @property
    def has_temperature(self) -> bool:
        """Whether there is a temperature."""
        return not math.isnan(self.temperature_degc)


FIELDS_OF[AxisStatus] = {
    "compensation_enabled": switch(
        "Compensation enabled", 0x2102, "The switch of one axis, without a selection.", "pulse"
    )._replace(mqtt="compensation"),
    "observer_enabled": switch("Observer enabled", 0x2103, "Likewise.", "observer")._replace(mqtt="observer"),
    "learning_due": Field(
        "Learning due",
        Entry(0x2121, 1, DataType.U8, axis=PerAxis.INDEX),
        "Of axis 1 ... 8: J stays above J_required.",
        label="learning due",
        text=texts.yes_no,
    ),
    "reversals": number("Reversals", 0x2121, 2, 32, "Evaluated since the start.")._replace(label="reversals"),
    "compensation_suspended": Field(
        "Compensation suspended",
        Entry(0x2121, 10, DataType.U8, axis=PerAxis.INDEX),
        "A tuning moves the axis: no compensation acts, whatever is switched on.",
        label="suspended",
        text=texts.yes_no,
    ),
    "temperature_degc": Field(part="has_temperature", digits=1),
    "error_mean_m": Field(local=False),
    "last": Field(mqtt=None),
    "version": version(0x2131, "functions", "functions"),
    "learned_at": date(0x2131)._replace(label="learned at", text=texts.minute),
    "learned": Field(mqtt=None),
    "screw": Field(),
    "waveform": Field(),
}
FIELDS_OF[ReversalReport] = {
    "error_mean_m": length(
        "J in nm", 0x2121, 3, "J, um", "Mean error over the monitoring time, last reversal."
    ),
    "error_peak_m": length("Peak error in nm", 0x2121, 4, "peak, um"),
    "error_rms_m": length("RMS error in nm", 0x2121, 5, "RMS, um"),
    "contour_peak_m": length("Peak contour error in nm", 0x2121, 6, "contour peak, um"),
    "acceleration_m_s2": quantity("Reverse acceleration in um per s2", 0x2121, 7, UM_S2)._replace(
        label="at, mm/s2", text=texts.millimetres
    ),
    "direction": Field(
        "Direction after the reversal",
        Entry(0x2121, 8, DataType.I8, axis=PerAxis.INDEX),
        "1 or -1; 0 = there was no reversal yet.",
        presence=True,
    ),
    "cycle": number(
        "Cycle of the reversal",
        0x2121,
        9,
        32,
        "Read it before and after the others: equal, and they belong together.",
    ),
}
