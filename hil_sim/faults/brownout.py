"""Brown-out: the supply voltage of one amplifier drops; it reports under-voltage and enters fault.

The drive performs its fault reaction (605Eh) and sends EMCY 3220h; a reset succeeds after the supply returns.
"""

from typing import NamedTuple

from hil_sim.faults.fault_target import FaultTarget

UNDER_VOLTAGE = 0x3220
VOLTAGE = 4
"""Voltage bit of the error register (1001h)."""


class Params(NamedTuple):
    """The fault has no parameters."""


def begin(target: FaultTarget, _p: Params) -> None:
    """Make the drive detect the under-voltage."""
    target.drive.fault(UNDER_VOLTAGE, VOLTAGE)
