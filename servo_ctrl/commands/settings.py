"""The settings that can change while the controller runs, with the declaration of every setting."""

import math
from typing import NamedTuple, get_type_hints

from servo_ctrl.commands.command import Right
from servo_ctrl.commands.field import FIELDS_OF, NM, UM, DataType, Entry, Field, topic_unit
from servo_ctrl.commands.learned_status import LEARNERS
from servo_ctrl.motion.gcode.words import WORK_OFFSETS

OPERATORS = frozenset(
    {
        "feed_override_percent",
        "rapid_override_percent",
        "single_block",
        "optional_stop",
        "step_m",
        "work_offset",
    }
)
"""Settings that need the right to operate; the others need the right to configure."""


class Settings(NamedTuple):
    """Settings; the machine file keeps its values. A new one needs a line here, one below, and a setter."""

    required_m: float
    """J_required, metres."""
    learner: str
    adaptation: bool
    feed_override_percent: float = 100.0
    rapid_override_percent: float = 100.0
    single_block: bool = False
    optional_stop: bool = False
    step_m: float = 1e-4
    work_offset: str = "G54"


FIELDS_OF[Settings] = {
    "required_m": Field(
        "J required in nm",
        Entry(0x2104, 1, DataType.U32, NM, writable=True, low=1, high=10_000_000, default=4000),
        "J_required of the monitoring.",
    ),
    "learner": Field(
        "Learner",
        Entry(0x2104, 2, DataType.U8, names=LEARNERS, writable=True, low=0, high=3, default=0),
        "0 = fast, 1 = paper, 2 = screw, 3 = waveform; for the next run.",
    ),
    "adaptation": Field(
        "Adaptation",
        Entry(0x2104, 3, DataType.U8, writable=True, low=0, high=1),
        "1 = production reversals go on changing what was learned.",
    ),
    "feed_override_percent": Field(
        "Feed override in percent",
        Entry(0x2104, 4, DataType.U8, 1.0, writable=True, low=1, high=150, default=100),
        "Share of the programmed feed at which a program runs: at once, above 100 from its next start.",
    ),
    "rapid_override_percent": Field(
        "Rapid override in percent",
        Entry(0x2104, 5, DataType.U8, 1.0, writable=True, low=1, high=100, default=100),
        "The same for rapid moves (G0).",
    ),
    "single_block": Field(
        "Single block",
        Entry(0x2104, 6, DataType.U8, writable=True, low=0, high=1),
        "1 = a program is held behind every step; one that is started also behind every G-code block.",
    ),
    "optional_stop": Field(
        "Optional stop",
        Entry(0x2104, 7, DataType.U8, writable=True, low=0, high=1),
        "1 = a program that is started is held at M1.",
    ),
    "step_m": Field(
        "Step of a jog in um",
        Entry(0x2104, 8, DataType.U32, UM, writable=True, low=1, high=10_000, default=100),
        "How far the commands step-forward and step-backward move.",
    ),
    "work_offset": Field(
        "Work offset",
        Entry(0x2104, 9, DataType.U8, names=WORK_OFFSETS, writable=True, low=0, high=5, default=0),
        "0 to 5 = G54 to G59: the one that touch-off sets, and that positions are shown in.",
    ),
}


class Setting(NamedTuple):
    """A setting with its names and encodings for clients."""

    name: str
    """Name of the field in `Settings` and on the local socket."""
    key: str
    """Name over MQTT."""
    factor: float
    """Value over MQTT and on the command line, divided by the SI value."""
    kind: type
    entry: Entry

    @property
    def right(self) -> Right:
        """The right needed for a change."""
        return Right.OPERATE if self.name in OPERATORS else Right.CONFIGURE

    @property
    def word(self) -> str:
        """Name on the command line."""
        return self.key.replace("_", "-")

    def objection(self, value: float | str | bool) -> str:
        """Return why a value in SI units is refused, else ""."""
        if type(value) is not self.kind:
            return f"{value} is not a value of {self.name}"
        if self.entry.names and value not in self.entry.names:
            return f'"{value}" is none of {", ".join(self.entry.names)}'
        lowest, highest = self.bounds
        if isinstance(value, float) and not (math.isfinite(value) and lowest <= value <= highest):
            return f"{value:g} is not within {lowest:g} to {highest:g}"
        return ""

    @property
    def bounds(self) -> tuple[float, float]:
        """Lowest and highest value of a quantity, SI."""
        counts_per_unit = round(1.0 / self.entry.unit) if self.entry.unit else 1
        return (self.entry.low or 0) / counts_per_unit, (self.entry.high or 0) / counts_per_unit


SETTINGS = {
    name: Setting(name, *topic_unit(name), get_type_hints(Settings)[name], field.entry)
    for name, field in FIELDS_OF[Settings].items()
    if field.entry is not None
}
