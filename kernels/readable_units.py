"""SI quantities in units of a size that people read: 8.4e-9 m/N is 8.4 nm/N."""

import math

UNIT_LADDERS = {
    "m": ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm"), (1e-9, "nm")),
    "s": ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")),
    "m/s": ((1.0, "m/s"), (1e-3, "mm/s"), (1e-6, "µm/s")),
    "m/N": ((1e-3, "mm/N"), (1e-6, "µm/N"), (1e-9, "nm/N")),
    "N/m": ((1e6, "N/µm"), (1e3, "N/mm"), (1.0, "N/m")),
    "m/s^2": ((1.0, "m/s²"), (1e-3, "mm/s²")),
    "rad": ((1.0, "rad"), (1e-3, "mrad"), (1e-6, "µrad")),
    "rad/s": ((1.0, "rad/s"), (1e-3, "mrad/s")),
    "rad/(N m)": ((1.0, "rad/(N m)"), (1e-3, "mrad/(N m)"), (1e-6, "µrad/(N m)"), (1e-9, "nrad/(N m)")),
    "rad/s^2": ((1.0, "rad/s²"), (1e-3, "mrad/s²")),
}
"""SI unit -> display units with their size, the largest first."""
SUPERSCRIPTS = str.maketrans({"^": "", "2": "²"})


def display_unit(unit: str, size: float) -> tuple[float, str]:
    """Return the divisor from SI to a readable unit for a value of this `size`, and that unit."""
    ladder = UNIT_LADDERS.get(unit)
    if ladder is None:
        return 1.0, unit.translate(SUPERSCRIPTS)
    size = abs(size) if math.isfinite(size) else 0.0
    for factor, name in ladder:
        if size >= factor * (1.0 - 1e-9):
            return factor, name
    return ladder[-1] if size > 0.0 else ladder[0]
