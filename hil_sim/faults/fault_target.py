"""What a simulated fault acts on: the nodes of one axis and its records in the plant."""

from typing import Any, NamedTuple

from hil_sim.drive.amplifier_device import Drive
from hil_sim.scale.encoder_device import LinearScale


class FaultError(ValueError):
    """A fault that an axis cannot have, or that cannot be read; the message says why."""


class FaultTarget(NamedTuple):
    """One axis. `params` and `state` are views: the plant reads what is written there."""

    name: str
    drive: Drive
    scale: LinearScale | None
    params: Any
    state: Any
