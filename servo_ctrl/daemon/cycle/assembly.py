"""A machine and the cycle that drives it, as the other rooms get them."""

from typing import NamedTuple

from servo_ctrl.daemon.cycle.cycle import Cycle
from servo_ctrl.daemon.cycle.machine import Machine


class Assembly(NamedTuple):
    """A machine on a bus, ready for its first SYNC."""

    machine: Machine
    cycle: Cycle
