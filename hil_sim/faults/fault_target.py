"""The target of a simulated fault: the nodes of one axis and its records in the plant."""

from typing import Any, NamedTuple

from hil_sim.drive.amplifier_device import Drive
from hil_sim.scale.encoder_device import LinearScale


class FaultError(ValueError):
    """An axis cannot have a fault, or its text is invalid; the message gives the reason."""


class FaultTarget(NamedTuple):
    """One axis. `params` and `state` are views, so that the plant sees changes."""

    name: str
    drive: Drive
    scale: LinearScale | None
    params: Any
    state: Any
