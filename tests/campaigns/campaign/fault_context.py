"""The context of an injected fault (stand, random numbers, axis, node), and what a fault declares."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from tests.campaigns.campaign.causes import Cause
    from tests.campaigns.campaign.run import Evidence
    from tests.campaigns.campaign.stand import Stand

SILENCING_EVENTS = frozenset({"bus down", "bus off"})
"""Events after which the bus shows no other reaction."""
LOCKSTEP, REALTIME = "lockstep", "realtime"
BOTH = (LOCKSTEP, REALTIME)
DRIVES, SCALES = (1, 2), (11, 12)
NODES = (1, 2, 11, 12)
MOVING = ("running", "jogging", "held", "learning")
POWERED = ("ready", *MOVING, "stopping")
WIRED = ("starting", *POWERED, "standby")
"""States in which the nodes are booted."""
STATES = ("booting", *WIRED)


class FaultContext:
    """The target of a fault: `axis` is 0 or 1, `node` the id of one of its nodes."""

    def __init__(self, stand: Stand, rng: Random) -> None:
        self.stand, self.wire, self.rng = stand, stand.wire, rng
        self.take_axis(rng.randrange(2))
        self.undo: list[Callable[[], None]] = []
        """Functions that restore the stand after the run."""
        self.notes: dict[str, Any] = {}
        """Facts that the fault records for the oracles."""

    def take_axis(self, axis: int) -> None:
        """Select an axis, and one of its nodes."""
        self.axis, self.drive_id = axis, DRIVES[axis]
        self.node = self.rng.choice((DRIVES[axis], SCALES[axis]))

    @property
    def drive(self) -> Any:
        """The simulated drive of the axis."""
        return self.stand.bench._drives.drives[self.axis]

    @property
    def slave(self) -> Any:
        """The simulated node."""
        return next(slave for slave in self.stand.bench.slaves if slave.node_id == self.node)


class Fault(NamedTuple):
    """A fault. `event` names its row of docs/fault_policy.md; None: it must have no consequence.

    `words`: one of them must be in a reported event; empty: no event is required. `blind_s`: time for which
    the machine may continue unchanged because the fault cannot be detected yet.
    """

    name: str
    inject: Callable[[FaultContext], None]
    event: str | None = None
    words: tuple[str, ...] = ()
    states: tuple[str, ...] = STATES
    pacings: tuple[str, ...] = BOTH
    blind_s: float = 0.0
    kills: str = ""
    """"controller" or "nodes": which of them the fault ends."""
    physical: bool = False
    """One axis does not follow its set points, so that the axes need not stop together."""
    also: tuple[str, ...] = ()
    """Other rows of the document that may be detected first."""
    may_stop: bool = False
    """Whether it may stop the machine, without having to."""
    cause: Callable[[Evidence], list[Cause]] | None = None
    """Returns its detectable causes and their cycles; empty: it had no effect. None: detectable at once."""
    while_controlled: bool = False
    """Whether it can be detected only while its axis follows set points."""
    coasts: bool = False
    """Whether an axis in motion loses its power, so that only friction brakes it."""
    knocks: bool = False
    """Whether an axis becomes faster than its set points, and has to brake."""
    changes_frames: bool = False
    """Whether frames do not arrive as they were sent."""
    ticks_after: int = 260
    """Ticks from the fault to the end of the run."""
    broker: bool = False
    """Whether the daemon has an MQTT broker."""
    sdo_timeout_s: float = 5.0
    """SDO timeout of the boot, wall clock: short if a node will not respond."""
    reported_within_cycles: int = 3
    """Cycles within which it must be reported."""
