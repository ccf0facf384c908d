"""Quantities: declares unit and bounds of every parameter beside the parameter.

A file declares `Params(NamedTuple)` with `Annotated[float, Quantity(...)]` fields in SI units. This one
declaration gives the TOML keys with their units (mm, um, N), the check of the bounds, and the record that the
compiled plant reads.
"""

import math
from types import ModuleType
from typing import Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import DTypeLike

AXIS = "axis"
"""The "unit" of the index of another axis, for which the file has that axis's name."""
# (SI unit, unit in the TOML file) -> factor from the file's number to SI.
FILE_UNITS = {
    ("m", "mm"): 1e-3,
    ("m", "um"): 1e-6,
    ("m/s", "mm/s"): 1e-3,
    ("N/m", "N/um"): 1e6,
    ("V/A", "ohm"): 1.0,
    ("H", "mH"): 1e-3,
    ("rad", "deg"): math.pi / 180.0,
    ("1/K", "um/(m K)"): 1e-6,
    ("1/m", "1/km"): 1e-3,
    ("1/m", "um/m2"): 1e-6,
    ("s", "ms"): 1e-3,
    ("", "um/m"): 1e-6,
    ("", AXIS): 1.0,
    ("K", "degC"): 1.0,  # with the offset of `OFFSETS`
}
OFFSETS = {("K", "degC"): 273.15}


class Quantity(NamedTuple):
    """Unit, inclusive bounds in SI, unit in TOML ("" = SI), and length of a list (0 = a number)."""

    unit: str
    lower: float
    upper: float
    meaning: str
    file_unit: str = ""
    length: int = 0

    def to_si(self, value: float) -> float:
        """Convert a number of the TOML file to SI."""
        key = (self.unit, self.file_unit)
        return value * FILE_UNITS[key] + OFFSETS.get(key, 0.0) if self.file_unit else value

    def from_si(self, value: float) -> float:
        """Convert an SI number to the unit of the TOML file."""
        key = (self.unit, self.file_unit)
        return (value - OFFSETS.get(key, 0.0)) / FILE_UNITS[key] if self.file_unit else value


class Field(NamedTuple):
    """One parameter: its name in the kernel, its key in TOML, its quantity."""

    name: str
    key: str
    quantity: Quantity


def suffix_of(unit: str) -> str:
    """Return a unit as the suffix of a name: "N/um" -> "_n_um", "" -> ""."""
    slug = "".join(c if c.isalnum() else "_" for c in unit.lower())
    words = [word for word in slug.split("_") if word]
    return "".join(f"_{word}" for word in words)


def fields_of(params: type[Any]) -> list[Field]:
    """Return the fields of a `Params` class in order.

    Raises:
        TypeError: a field without a `Quantity`, or whose name does not end in its unit.

    """
    fields = []
    for name, hint in get_type_hints(params, include_extras=True).items():
        found = [item for item in getattr(hint, "__metadata__", ()) if isinstance(item, Quantity)]
        if not found:
            raise TypeError(f"{params.__module__}.{name} declares no Quantity")
        quantity = found[0]
        suffix = suffix_of(quantity.unit)
        if suffix and not name.endswith(suffix):
            raise TypeError(f"{params.__module__}.{name} does not end in its unit {quantity.unit} ({suffix})")
        key = name.removesuffix(suffix) + suffix_of(quantity.file_unit) if quantity.file_unit else name
        fields.append(Field(name, key, quantity))
    return fields


def record_dtype(params: type[Any]) -> np.dtype[Any]:
    """Return the C-aligned record of a `Params` class: `enabled` (0 or 1), then its fields as float64."""
    layout: list[tuple[str, DTypeLike]] = [("enabled", np.int64)]
    for field in fields_of(params):
        length = field.quantity.length
        layout.append((field.name, (np.float64, (length,)) if length else np.float64))
    return np.dtype(layout, align=True)


def section_of(module: ModuleType) -> str:
    """Return the section name of an effect's file, which is also its TOML section and catalogue entry."""
    return module.__name__.rpartition(".")[2]
