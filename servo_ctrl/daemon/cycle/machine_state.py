"""The state of a machine controller, its callbacks and the values that others read; see `machine`."""

import math
from collections.abc import Callable, Collection, Sequence

from kernels.arrays import Array
from servo_ctrl.axis.fault_policy import ENDS_THE_RUN, REQUESTS, Event, Reaction, reaction
from servo_ctrl.commands.machine_status import ContourStatus
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.drives import AxisNodes, Drives
from servo_ctrl.daemon.cycle.event_log import EventLog
from servo_ctrl.daemon.cycle.missed_ticks import MissedTicks
from servo_ctrl.daemon.cycle.missing_inputs import MissingInputs, Tolerance
from servo_ctrl.daemon.cycle.stand_by import StandbyNodes
from servo_ctrl.daemon.set_points.reference import Reference
from servo_ctrl.daemon.set_points.set_point_source import SetPointSource
from servo_ctrl.motion.input_shaper import Taps


class Incidents:
    """The events of a machine and their consequences: whether the run failed, why, whether it ends.

    A text that was absent for `again_cycles` cycles is a new event.
    """

    def __init__(self, again_cycles: int) -> None:
        self.log = EventLog(again_cycles)
        self.failed = False
        """Whether an event caused a reaction that no operator or program requested."""
        self.reason = ""
        """The first event with a reaction since the machine was enabled, and a fault during its stop."""
        self.ending = False
        """Whether an event ends the run, even where a stop otherwise ends in standby."""

    def handle(self, stage: Stage, event: Event, text: str, cycle: int) -> Reaction:
        """Log an event; return the reaction of the fault policy."""
        result = reaction(stage, event)
        self.log.add(text, cycle)
        self.ending = self.ending or event in ENDS_THE_RUN
        if result is Reaction.NONE:
            return result
        fault = event not in REQUESTS and not self.failed
        if not self.reason or (stage is Stage.STANDBY and not self.failed):
            self.reason = text
        elif fault:  # a requested stop failed before the axes came to rest
            self.reason += f"; {text}"
        self.failed = self.failed or fault
        return result

    def clear(self) -> None:
        """Clear fault and reason when the machine is enabled again. The log stays."""
        self.failed, self.reason = False, ""


class NodeBoot:
    """The nodes that boot again between Enable and power-on; none at first."""

    def __init__(self) -> None:
        self.nodes: tuple[int, ...] = ()
        """Indices of the nodes that boot now."""
        self.started = False
        """Whether these nodes are configured and started, so that only their inputs are awaited."""
        self._power_requested = False

    def begin(self, nodes: Collection[int]) -> None:
        """Note that these nodes boot and that their drives get power afterwards."""
        self.nodes, self.started, self._power_requested = tuple(nodes), False, True

    def cancel_power(self) -> bool:
        """Leave the power off after the boot, because a stop was requested; return whether that is new."""
        power = bool(self.nodes) and self._power_requested
        self._power_requested = False
        return power

    def end(self) -> bool:
        """Note that the boot is over; return whether the drives still get power."""
        power, self.nodes, self.started = self._power_requested, (), False
        return power


EVENT_AGAIN_S = 1.0
"""A text that was absent this long is a new event; chosen."""
DISTURBANCE_S = 0.1
"""Bounds the time after missed ticks or inputs in which an axis may oscillate because of them; chosen."""
DISTURBANCE_REMARK = "; ticks or TPDOs were missing just before: check computer and bus first"


class MachineState:
    """The state of a machine with the axes `places`; the caller sets the callbacks before `begin`."""

    def __init__(
        self, places: list[AxisNodes], node_names: list[str], period_s: float, tolerance: Tolerance
    ) -> None:
        self.stage = Stage.BOOTING
        self.cycles = 0
        """Periods since the first SYNC, including missed ones."""
        self._period_s = period_s
        self._drives = Drives(places)
        self._incidents = Incidents(round(EVENT_AGAIN_S / period_s))
        self._missing = MissingInputs(len(node_names), tolerance)
        self._boot = NodeBoot()
        self._missed = MissedTicks(period_s, tolerance.per_block)
        self._disturbed_at = -math.inf
        """The last cycle with missed ticks or missing inputs."""
        self._source = SetPointSource([place.stop_acceleration_m_s2 for place in places], period_s)
        self._node_names = node_names
        self._unhomed: list[int] = []
        """Nodes that boot again and whose drives have lost their homes."""
        self._cycle = -1
        self.record: Callable[[list[float]], None] = _ignore
        """Called with the recorded row of each cycle."""
        self.keep_row: Callable[[Array], None] = _ignore
        """Called with the same row in memory, which the next cycle overwrites."""
        self.on_ready: Callable[[], None] = _ignore
        """Called when all axes follow set points."""
        self.on_enable: Callable[[bool], None] = _ignore
        """Called when the drives are switched on from standby, with whether that ends a fault."""
        self.on_rest: Callable[[], None] = _ignore
        """Called when a served machine becomes ready after a program, or enters standby."""
        self.on_stop: Callable[[str], None] = _ignore
        """Called with the text of every event that stops the machine."""
        self.on_fault: Callable[[Event, str], None] = _ignore
        """Called with the first such event that was not requested."""
        self.served = False
        """Whether the axes stay under control after a program, ready for the next one."""
        self.stand_by = False
        """Whether a stop ends in standby instead of off."""
        self.nodes: StandbyNodes | None = None
        """Which nodes can be used again after a stop, for a machine that stands by."""
        self.bus_off = ""
        """Why no frame can be sent at present; "" while the bus is in order."""
        self.completed = False
        """Whether the last program ran to its end."""

    def shape_set_points(self, shapers: Sequence[Taps | None]) -> None:
        """Shape the set points of each axis from now on."""
        self._source.shape(shapers)

    @property
    def failed(self) -> bool:
        """Whether an event that was not requested stopped the machine."""
        return self._incidents.failed

    @property
    def reason(self) -> str:
        """Why the machine stopped, "" while nothing has stopped it."""
        return self._incidents.reason

    @property
    def events(self) -> EventLog:
        """The log of all events."""
        return self._incidents.log

    @property
    def missed_ticks(self) -> int:
        """Periods that had no SYNC."""
        return self._missed.total

    @property
    def missing_inputs(self) -> int:
        """Missing inputs of all nodes together."""
        return self._missing.total

    @property
    def cycles_with_missing_inputs(self) -> int:
        """Cycles in which inputs of any node were missing."""
        return self._missing.cycles

    @property
    def program(self) -> Reference | None:
        """The set-point source that the axes follow, or followed last."""
        return self._source.program

    @property
    def contour(self) -> ContourStatus:
        """Contour control and its error in the last cycle."""
        return self._drives.contour

    @property
    def setting_up(self) -> bool:
        """Whether nodes boot again before their drives get power."""
        return bool(self._boot.nodes)

    def note(self, text: str) -> None:
        """Log an event that needs no reaction."""
        self.events.add(text, self._cycle)

    def age_inputs(self, ages: Callable[[], Sequence[int]]) -> None:
        """Set the function that returns the age in cycles of each axis's inputs; empty when all are new."""
        self._drives.input_ages = ages

    def disturbance_remark(self, cycle: int) -> str:
        """Return a remark for an axis event whose cause may be missed ticks or inputs, else ""."""
        return DISTURBANCE_REMARK if (cycle - self._disturbed_at) * self._period_s <= DISTURBANCE_S else ""

    def set_points_m(self) -> list[float]:
        """Return the present position set points, metres by axis: the start of the next program."""
        return self._source.set_points_m(self._drives.hold_positions_m)

    @property
    def at_a_switch(self) -> str:
        """Which axis at a limit switch prevents a program or learning from starting; "" if none does."""
        return self._drives.at_a_switch

    def follows(self, reference: Reference | None) -> bool:
        """Whether the axes follow this set-point source, uninterrupted."""
        running = self.stage is Stage.RUNNING and not self._source.stopping
        return running and reference is not None and self.program is reference


def _ignore(*_arguments: object) -> None:
    pass
