"""Work offsets G54 to G59 on disk: one TOML file a machine, replaced as a whole.

format = 1
[offset_mm.G54]
x = 12.5
y = -3.0
"""

import math
from collections.abc import Mapping
from pathlib import Path

from servo_ctrl.config.file_format import format_problem
from servo_ctrl.config.load import read_toml
from servo_ctrl.errors import ConfigError
from servo_ctrl.files.toml_text import toml_text
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.motion.gcode.words import WORK_OFFSETS
from servo_ctrl.units import MM

OFFSETS_FILE = "work_offsets.toml"
Offsets = dict[str, dict[str, float]]
"""Position of the zero in metres from home, by name and axis."""


def read_offsets(directory: Path, axes: Mapping[str, tuple[float, float]]) -> Offsets:
    """Read the offsets that are set; empty without a file. `axes`: travels, m. Raises ConfigError."""
    path = directory / OFFSETS_FILE
    if not path.exists():
        return {}
    document = read_toml(path)
    if problem := format_problem(document.pop("format", None)):
        raise ConfigError(path, "format", problem)
    tables = document.pop("offset_mm", {})
    if document or not isinstance(tables, dict):
        raise ConfigError(path, next(iter(document), "offset_mm"), "unknown key")
    offsets: Offsets = {}
    for name, values in tables.items():
        key = f"offset_mm.{name}"
        if name not in WORK_OFFSETS or not isinstance(values, dict):
            raise ConfigError(path, key, f"is none of {', '.join(WORK_OFFSETS)}")
        for axis, value in values.items():
            if axis not in axes:
                raise ConfigError(
                    path, f"{key}.{axis}", f"the machine has no such axis, only {', '.join(axes)}"
                )
            if type(value) not in {int, float} or not within_reach(value * MM, axes[axis]):
                raise ConfigError(
                    path, f"{key}.{axis}", f"{value!r} is not a zero within reach of the travel"
                )
        offsets[name] = {axis: value * MM for axis, value in values.items()}
    return offsets


def write_offsets(directory: Path, offsets: Mapping[str, Mapping[str, float]]) -> None:
    """Write the offsets. Raises OSError."""
    directory.mkdir(parents=True, exist_ok=True)
    tables = {
        name: {axis: round(zero_m / MM, 9) for axis, zero_m in zeros_m.items()}
        for name, zeros_m in offsets.items()
    }
    write_text_whole(directory / OFFSETS_FILE, toml_text({"format": 1, "offset_mm": tables}))


def within_reach(zero_m: float, travel_m: tuple[float, float]) -> bool:
    """Whether a zero is finite and at most one travel length beyond the travel."""
    lowest_m, highest_m = travel_m
    length_m = highest_m - lowest_m
    return math.isfinite(zero_m) and lowest_m - length_m <= zero_m <= highest_m + length_m
