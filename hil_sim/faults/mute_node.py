"""Mute node: a drive's CAN controller is off the bus for a while, then recovers and sends EMCY 8140h.

It still receives; only its own frames are lost.
"""

from typing import Annotated, NamedTuple

from hil_sim.faults.fault_target import FaultTarget
from hil_sim.node import emcy
from kernels.quantities import Quantity


class Params(NamedTuple):
    """Duration of the silence."""

    duration_s: Annotated[float, Quantity("s", 0.0, 1e6, "until it recovers")] = 0.5


def begin(target: FaultTarget, _p: Params) -> None:
    """Stop the node from sending."""
    target.drive.slave.mute = True


def end(target: FaultTarget, _p: Params) -> None:
    """Let the node send again."""
    slave = target.drive.slave
    slave.mute = False
    slave.emergency.report(emcy.BUS_OFF_RECOVERED, emcy.COMMUNICATION)
