"""Mute node: a drive's CAN controller is off the bus for a while; then it is back and says EMCY 8140h.

Frames that others send to it still arrive: what is lost is what it says.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, NamedTuple

from hil_sim.node import emcy
from hil_sim.physics.quantities import Quantity

if TYPE_CHECKING:
    from hil_sim.faults.struck import Struck


class Params(NamedTuple):
    """How long."""

    duration_s: Annotated[float, Quantity("s", 0.0, 1e6, "until it recovers")] = 0.5


def check(_struck: Struck, _p: Params) -> None:
    """Any drive can have it."""


def begin(struck: Struck, _p: Params) -> None:
    """Off the bus."""
    struck.drive.slave.mute = True


def end(struck: Struck, _p: Params) -> None:
    """Back on it."""
    slave = struck.drive.slave
    slave.mute = False
    slave.emergency.report(emcy.BUS_OFF_RECOVERED, emcy.COMMUNICATION)
