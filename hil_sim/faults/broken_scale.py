"""Broken scale: the reading head stands still while the table moves on.

The node goes on sending what it read last, without an error: a dirty grating, a torn tape. A controller that
closes its loop on the scale pushes the table further and further.
Confused with: slipped_coupling, the same two readings drifting apart -> here the motor follows its force.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from hil_sim.faults.struck import FaultError

if TYPE_CHECKING:
    from hil_sim.faults.struck import Struck


class Params(NamedTuple):
    """Nothing to choose."""


def check(struck: Struck, _p: Params) -> None:
    """Raises FaultError where the axis has no scale."""
    if struck.scale is None:
        raise FaultError(f"axis {struck.name} has no scale")


def begin(struck: Struck, _p: Params) -> None:
    """The head freezes."""
    if struck.scale is not None:
        struck.scale.frozen = True
