"""Limit switch: it closes where it should not, a chip in it or a broken wire.

The drive sees it in 60FDh (bit 0 negative, bit 1 positive side), brakes, and goes no further to that side.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, NamedTuple

from hil_sim.physics.quantities import Quantity

if TYPE_CHECKING:
    from hil_sim.faults.struck import Struck


class Params(NamedTuple):
    """Which of the two."""

    side: Annotated[float, Quantity("", -1.0, 1.0, "positive or negative switch")] = 1.0


def check(_struck: Struck, _p: Params) -> None:
    """Every axis has both."""


def begin(struck: Struck, p: Params) -> None:
    """It closes and stays closed."""
    struck.drive.port.close_switch(positive=p.side > 0.0)
