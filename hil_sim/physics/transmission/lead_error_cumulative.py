"""Cumulative lead error: the lead of every turn deviates by the same ratio.

Law: e = c x.
Source: mismatch catalogue, entry lead_error_cumulative, x (1 + c); e_p of ISO 3408-3 for positioning ball
    screws.
Symbols: e table position minus nominal m; c `relative_error` (um/m in the file); x nominal position m.
Valid: from the machine's zero; a lead that changes along the screw needs a table.
Confused with: thermal_expansion, the same shape -> repeat when warm: a lead error does not drift.
"""

from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.POSITION_ERROR


class Params(NamedTuple):
    """The relative error of the lead."""

    relative_error: Annotated[float, Quantity("", -1e-2, 1e-2, "error per travel c", "um/m")]


NEUTRAL = Params(relative_error=0.0)


@kernel
def error_m(p: Any, position_m: float, _turn_rad_m: float) -> float:
    """Return the error of the table position (m)."""
    return float(p.relative_error * position_m)


@kernel
def slope(p: Any, _position_m: float, _turn_rad_m: float) -> float:
    """Return the derivative of the error by the position."""
    return float(p.relative_error)
