"""A machine and the cycle that drives it, as the other rooms get them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from servo_ctrl.daemon.cycle.cycle import Cycle
    from servo_ctrl.daemon.cycle.machine import Machine


class Assembly(NamedTuple):
    """A machine on a bus, ready for its first SYNC."""

    machine: Machine
    cycle: Cycle
