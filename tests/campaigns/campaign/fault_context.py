"""The context of an injected fault (stand, random numbers, axis, node), and what a fault declares."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from tests.campaigns.campaign.causes import Cause
    from tests.campaigns.campaign.run import Evidence
    from tests.campaigns.campaign.stand import Stand

SILENCED = frozenset({"bus down", "bus off"})
"""Events behind which nothing is seen of another reaction."""
LOCKSTEP, REALTIME = "lockstep", "realtime"
BOTH = (LOCKSTEP, REALTIME)
DRIVES, SCALES = (1, 2), (11, 12)
NODES = (1, 2, 11, 12)
MOVING = ("running", "jogging", "held", "learning")
POWERED = ("ready", *MOVING, "stopping")
WIRED = ("starting", *POWERED, "standby")
"""The nodes are booted."""
STATES = ("booting", *WIRED)


class FaultContext:
    """`axis` is 0 or 1, `node` one of the nodes of that axis."""

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
        return self.stand.bench._drives[self.axis]

    @property
    def slave(self) -> Any:
        """The simulated node."""
        return next(slave for slave in self.stand.bench.slaves if slave.node_id == self.node)


class Fault(NamedTuple):
    """`event` names the row of docs/fault_policy.md; None: the fault must have no consequence.

    `words`: one of them must be in a noted event; empty: no event is required. `blind_s`: how long the
    machine may continue unchanged because the fault cannot be known yet.
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
    """One axis does not follow its set points: the others need not stop in step with it."""
    also: tuple[str, ...] = ()
    """Other rows of the document that may be detected first."""
    may_stop: bool = False
    """It may or may not stop the machine."""
    cause: Callable[[Evidence], list[Cause]] | None = None
    """Its visible causes and their times; empty: it never acted. Without this function: at once."""
    while_led: bool = False
    """It can be detected only while its axis has set points."""
    coasts: bool = False
    """An axis in motion loses its power, and nothing brakes it."""
    knocks: bool = False
    """An axis is faster than its set points, and has to brake."""
    distorts: bool = False
    """Frames do not arrive as they were sent."""
    watched: int = 260
    """Ticks between the fault and the end of the run."""
    broker: bool = False
    """The daemon has an MQTT broker."""
    sdo_timeout_s: float = 5.0
    """SDO timeout of the boot, wall clock: short where a node is not going to answer."""
    seen_cycles: int = 3
    """Cycles within which it must be noted."""
