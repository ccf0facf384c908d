"""Broken scale: the reading head stands still while the table moves on.

The node goes on sending what it read last, without an error: a dirty grating, a torn tape. A controller that
closes its loop on the scale pushes the table further and further.
Confused with: slipped_coupling, the same two readings drifting apart -> here the motor follows its force.
"""

from typing import NamedTuple

from hil_sim.faults.fault_target import FaultError, FaultTarget


class Params(NamedTuple):
    """Nothing to choose."""


def check(target: FaultTarget, _p: Params) -> None:
    """Raises FaultError where the axis has no scale."""
    if target.scale is None:
        raise FaultError(f"axis {target.name} has no scale")


def begin(target: FaultTarget, _p: Params) -> None:
    """The head freezes."""
    if target.scale is not None:
        target.scale.frozen = True
