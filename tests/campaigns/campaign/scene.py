"""What a fault is given to happen in: the stand of the run, chance, and an axis that it happens to."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable
    from random import Random

    from tests.campaigns.campaign.causes import Cause
    from tests.campaigns.campaign.run import Evidence
    from tests.campaigns.campaign.stand import Stand

LOCKSTEP, REALTIME = "lockstep", "realtime"
BOTH = (LOCKSTEP, REALTIME)
DRIVES, SCALES = (1, 2), (11, 12)
NODES = (1, 2, 11, 12)
MOVING = ("running", "jogging", "held", "learning")
POWERED = ("ready", *MOVING, "stopping")
WIRED = ("starting", *POWERED, "standby")
"""The nodes are booted."""
STATES = ("booting", *WIRED)


class Scene:
    """`axis` is 0 or 1, `node` one of the nodes of that axis."""

    def __init__(self, stand: Stand, rng: Random) -> None:
        self.stand, self.wire, self.rng = stand, stand.wire, rng
        self.take_axis(rng.randrange(2))
        self.undo: list[Callable[[], None]] = []
        """Called when the run is over."""
        self.said: dict[str, Any] = {}
        """What the fault wants to be remembered."""

    def take_axis(self, axis: int) -> None:
        """This axis, and one of its nodes."""
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
    """`event` names the row of docs/fault_policy.md, None: nothing is to come of it.

    `words`: one of them must be among the noted events; none: it need not be noted. `blind_s`: how long the
    machine may go on as it was, because whoever could stop it does not know yet.
    """

    name: str
    inject: Callable[[Scene], None]
    event: str | None = None
    words: tuple[str, ...] = ()
    states: tuple[str, ...] = STATES
    pacings: tuple[str, ...] = BOTH
    blind_s: float = 0.0
    kills: str = ""
    """"controller" or "nodes", where one of them is no more."""
    physical: bool = False
    """One axis cannot be led: the others need not stop with it in step."""
    also: tuple[str, ...] = ()
    """Other rows of the document that may be what is seen of it first."""
    may_stop: bool = False
    """It may stop the machine or not, as chance will have it."""
    cause: Callable[[Evidence], list[Cause]] | None = None
    """What there is to be seen of it, and since when; nothing: it never was. Without it: at once."""
    while_led: bool = False
    """It is looked for in an axis that is led, and in no other."""
    coasts: bool = False
    """An axis in motion loses its power, and nothing brakes it."""
    knocks: bool = False
    """An axis is faster than it was led, and has to brake."""
    distorts: bool = False
    """Frames do not arrive as they were sent."""
    watched: int = 260
    """Ticks between the fault and the end of the run."""
    broker: bool = False
    """The daemon has an MQTT broker."""
    sdo_timeout_s: float = 5.0
    """Patience of the boot, wall clock: short where somebody is not going to answer."""
    seen_cycles: int = 3
    """After so many cycles it must have been noted."""
