"""Data sheets of the axes of a new machine: prompts and input parsing; `machine_files` writes the files."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, get_type_hints

from servo_ctrl.errors import ConfigError

PEAK_RESERVE = 1.2
"""Ratio of the simulated drive's peak current to the current of the force limit; chosen."""
CONTROLLER_NODE_ID = 127
"""Node id of the controller."""


class AxisSheet(NamedTuple):
    """Data sheet of one axis, with the names and units of the files."""

    name: str
    drive: int
    lead_mm: float
    mass_kg: float
    travel_mm: tuple[float, float]
    scale: int = 0
    """Node id of a linear scale; 0 = none, so that the motor encoder is the feedback."""
    inertia_kg_cm2: float = 0.6
    velocity_mm_s: float = 200.0
    acceleration_mm_s2: float = 2000.0
    force_n: float = 600.0
    counts_per_rev: int = 1048576
    rated_torque_mnm: int = 640
    rated_current_ma: int = 1500
    torque_constant_nm_a: float = 0.43

    @property
    def moving_mass_kg(self) -> float:
        """Mass of table and load, plus the rotating inertia referred to the table."""
        turn_1_m = 2.0 * math.pi / (self.lead_mm * 1e-3)
        return self.mass_kg + self.inertia_kg_cm2 * 1e-4 * turn_1_m**2

    @property
    def peak_current_a(self) -> float:
        """The current of the force limit, with a reserve; at least the rated current."""
        force_per_a = self.torque_constant_nm_a * 2.0 * math.pi / (self.lead_mm * 1e-3)
        return max(PEAK_RESERVE * self.force_n / force_per_a, self.rated_current_ma * 1e-3)


PROMPTS = {
    "drive": "node id of the drive",
    "scale": "node id of its linear scale, 0 = none",
    "lead_mm": "lead of the screw, mm",
    "mass_kg": "mass of the table with its load, kg",
    "inertia_kg_cm2": "inertia of motor, coupling and screw, kg cm^2",
    "travel_mm": "travel from home, mm, as -100..100",
    "velocity_mm_s": "greatest velocity, mm/s",
    "acceleration_mm_s2": "greatest acceleration, mm/s^2",
    "force_n": "greatest force at the table, N",
    "counts_per_rev": "counts of the motor's encoder a turn",
    "rated_torque_mnm": "rated torque of the motor, mN m",
    "rated_current_ma": "rated current of the motor, mA",
    "torque_constant_nm_a": "torque constant of the motor, N m/A",
}
"""The prompt for each key of an axis, in order; tests compare the keys with AxisSheet."""
_TYPES = get_type_hints(AxisSheet)


def read_value(key: str, text: str) -> float | int | tuple[float, float]:
    """Return the value of one key from its input text. Raises ValueError with the expected form."""
    text = text.strip().replace(",", ".")
    if _TYPES[key] is int:
        if not text.isdigit():
            raise ValueError(f"{PROMPTS[key]}: expected a whole number, not {text!r}")
        return int(text)
    if _TYPES[key] is float:
        return _positive(key, text)
    low, dots, high = text.partition("..")
    try:
        travel_mm = float(low), float(high)
    except ValueError:
        travel_mm = math.nan, math.nan
    if not dots or not -math.inf < travel_mm[0] < travel_mm[1] < math.inf:
        raise ValueError(f"{PROMPTS[key]}: expected the lower end, two dots, the upper end, not {text!r}")
    return travel_mm


def _positive(key: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0.0 < number < math.inf:
        raise ValueError(f"{PROMPTS[key]}: expected a number above 0, not {text!r}")
    return number


def read_axis(text: str) -> AxisSheet:
    """Read an axis from a text like `x drive=1 scale=11 lead_mm=10 mass_kg=45 travel_mm=-100..100`.

    Raises ValueError with the reason.
    """
    name, *pairs = text.split() or [""]
    if not name.isidentifier():
        raise ValueError(f"{text!r}: expected the name of an axis first, as x")
    values = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if key not in PROMPTS or not equals:
            raise ValueError(f"axis {name}: {pair!r} is not one of {', '.join(f'{k}=' for k in PROMPTS)}")
        values[key] = read_value(key, value)
    if missing := [key for key in AxisSheet._fields[1:5] if key not in values]:
        raise ValueError(f"axis {name}: {', '.join(missing)} missing")
    return AxisSheet(name, **values)  # type: ignore[arg-type]  # `read_value` has checked each by its key


def check_ids(axes: Sequence[AxisSheet], where: Path) -> None:
    """Raise ConfigError if names or node ids occur twice, or an id is out of range."""
    if len({axis.name for axis in axes}) < len(axes):
        raise ConfigError(where, "axis", "a name occurs twice")
    ids = [CONTROLLER_NODE_ID, *(axis.drive for axis in axes), *(axis.scale for axis in axes if axis.scale)]
    for node_id in ids:
        if not 1 <= node_id <= 127:
            raise ConfigError(where, "node_id", f"{node_id}: node ids are 1 to 127")
        if ids.count(node_id) > 1:
            remark = " (127 is the controller's own)" if node_id == CONTROLLER_NODE_ID else ""
            raise ConfigError(where, "node_id", f"{node_id} is given twice{remark}")
