"""Jammed axis: an obstacle holds the table, and the current rises to its limit.

Law: the Coulomb level becomes `level_n`; with a presliding law the table still yields like a spring.
Confused with: lost lubrication, which raises the level by a factor -> a jam holds against any force.
"""

from typing import Annotated, NamedTuple

from hil_sim.faults.fault_target import FaultTarget
from kernels.quantities import Quantity


class Params(NamedTuple):
    """Holding force of the jam."""

    level_n: Annotated[float, Quantity("N", 0.0, 1e7, "friction level of the jam")] = 1e5


def begin(target: FaultTarget, p: Params) -> None:
    """Hold the table from now on."""
    coulomb = target.params["coulomb_friction"]
    coulomb["enabled"] = 1
    coulomb["coulomb_n"] = p.level_n
