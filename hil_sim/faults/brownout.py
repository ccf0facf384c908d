"""Brown-out: the supply voltage of one amplifier drops; it reports under-voltage and goes into fault.

The drive performs its fault reaction (605Eh) and sends EMCY 3220h; a reset works once the supply is back.
"""

from typing import NamedTuple

from hil_sim.faults.fault_target import FaultTarget

UNDER_VOLTAGE = 0x3220
VOLTAGE = 4
"""Bit of the error register."""


class Params(NamedTuple):
    """Nothing to choose."""


def begin(target: FaultTarget, _p: Params) -> None:
    """The drive detects the under-voltage."""
    target.drive.fault(UNDER_VOLTAGE, VOLTAGE)
