"""Broken scale: the position value stays constant while the table moves.

The node continues to send its last reading without an error, as with a dirty grating or a torn tape. A
controller that closes its loop on the scale drives the table away.
Confused with: slipped_coupling, where the readings also drift apart -> here the motor follows its force.
"""

from typing import NamedTuple

from hil_sim.faults.fault_target import FaultError, FaultTarget


class Params(NamedTuple):
    """The fault has no parameters."""


def check(target: FaultTarget, _p: Params) -> None:
    """Raise FaultError if the axis has no scale."""
    if target.scale is None:
        raise FaultError(f"axis {target.name} has no scale")


def begin(target: FaultTarget, _p: Params) -> None:
    """Freeze the reading."""
    if target.scale is not None:
        target.scale.frozen = True
