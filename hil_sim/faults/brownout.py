"""Brown-out: the supply of one amplifier gives way; it reports under-voltage and goes into fault.

What the drive does about it is its fault reaction (605Eh); it says EMCY 3220h. `Reset` works once it is over.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from hil_sim.faults.struck import Struck

UNDER_VOLTAGE = 0x3220
VOLTAGE = 4
"""Bit of the error register."""


class Params(NamedTuple):
    """Nothing to choose."""


def check(_struck: Struck, _p: Params) -> None:
    """Any drive can have it."""


def begin(struck: Struck, _p: Params) -> None:
    """The drive notices."""
    struck.drive.fault(UNDER_VOLTAGE, VOLTAGE)
