"""What can be changed while the controller runs, with the declaration of every setting."""

import math
from typing import NamedTuple, get_type_hints

from servo_ctrl.commands.axis_status import LEARNERS
from servo_ctrl.commands.field import FIELDS_OF, NM, DataType, Entry, Field, topic_unit


class Settings(NamedTuple):
    """Not written back to the machine file. A new one is a line here, one below, and its setter."""

    required_m: float
    """J_required."""
    learner: str
    adaptation: bool


FIELDS_OF[Settings] = {
    "required_m": Field(
        "J required in nm",
        Entry(0x2104, 1, DataType.U32, NM, writable=True, low=1, high=10_000_000, default=4000),
        "J_required of the monitoring.",
    ),
    "learner": Field(
        "Learner",
        Entry(0x2104, 2, DataType.U8, names=LEARNERS, writable=True, low=0, high=2, default=0),
        "0 = fast, 1 = paper, 2 = screw; for the next run.",
    ),
    "adaptation": Field(
        "Adaptation",
        Entry(0x2104, 3, DataType.U8, writable=True, low=0, high=1),
        "1 = production reversals go on changing what was learned.",
    ),
}


class Setting(NamedTuple):
    """A setting as a client names it."""

    name: str
    """Field of `Settings`, and its name on the local socket."""
    key: str
    """Its name over MQTT."""
    factor: float
    """Value over MQTT and on the command line by the value in SI."""
    kind: type
    entry: Entry

    @property
    def word(self) -> str:
        """Its name on the command line."""
        return self.key.replace("_", "-")

    def objection(self, value: float | str | bool) -> str:
        """What speaks against a value in SI; "" when it can be set."""
        if type(value) is not self.kind:
            return f"{value} is no value of {self.name}"
        if self.entry.names and value not in self.entry.names:
            return f'"{value}" is none of {", ".join(self.entry.names)}'
        lowest, highest = self.bounds
        if isinstance(value, float) and not (math.isfinite(value) and lowest <= value <= highest):
            return f"{value:g} is not within {lowest:g} to {highest:g}"
        return ""

    @property
    def bounds(self) -> tuple[float, float]:
        """Of a quantity, SI."""
        counts_per_unit = round(1.0 / self.entry.unit) if self.entry.unit else 1
        return (self.entry.low or 0) / counts_per_unit, (self.entry.high or 0) / counts_per_unit


SETTINGS = {
    name: Setting(name, *topic_unit(name), get_type_hints(Settings)[name], field.entry)
    for name, field in FIELDS_OF[Settings].items()
    if field.entry is not None
}
