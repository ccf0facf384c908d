"""Saturation of the torque constant: saturated iron gives less force per ampere.

Law: i' = i / sqrt(1 + (i / Is)^2); for small currents Kt(i) = Kt (1 - i^2 / (2 Is^2)).
Source: mismatch catalogue, entry torque_constant_saturation, Kt(i); the algebraic sigmoid is the usual smooth
    form of a magnetisation curve (chosen).
Symbols: i current A; i' force-producing current at the nominal constant A; Is `saturation_a` current at
    which the force is 29 % lower A.
Valid: up to a few Is. The force rises with the current everywhere.
Confused with: a larger inertia, also less force in strong accelerations -> slow motion under a high load
    shows only saturation; voltage_saturation -> does not occur at rest under a high load.
"""

import math
from typing import Annotated, Any, NamedTuple

from hil_sim.physics.kinds import Kind
from kernels.jit import kernel
from kernels.quantities import Quantity

KIND = Kind.CURRENT_PATH
ORDER = 5  # the iron, last


class Params(NamedTuple):
    """The saturation current."""

    saturation_a: Annotated[float, Quantity("A", 1e-3, 1e9, "current Is at which the force is 29 % lower")]


NEUTRAL = Params(saturation_a=1e9)


@kernel
def force_producing_a(p: Any, current: float, _back_emf_v: float, _dt_s: float) -> float:
    """Return the force-producing current (A) at the nominal constant."""
    ratio = current / p.saturation_a
    return float(current / math.sqrt(1.0 + ratio * ratio))
