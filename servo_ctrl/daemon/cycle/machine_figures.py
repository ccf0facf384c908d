"""What a machine is made of, and what there is to read of it; how it changes is in `machine`."""

import math

from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.cycle.drives import AxisPlace, Drives
from servo_ctrl.daemon.cycle.event_log import EventLog
from servo_ctrl.daemon.cycle.incidents import Incidents
from servo_ctrl.daemon.cycle.missed_ticks import MissedTicks
from servo_ctrl.daemon.cycle.missing_inputs import MissingInputs, Tolerance
from servo_ctrl.daemon.cycle.setting_up import SettingUp
from servo_ctrl.daemon.set_points.reference import Reference
from servo_ctrl.daemon.set_points.set_point_source import SetPointSource

EVENT_AGAIN_S = 1.0
"""The same text after so long without it is another event; chosen."""
DOUBT_S = 0.1
"""So long after ticks or inputs were missing, an axis may still swing because of it; chosen."""
DOUBT = "; ticks or inputs were missing just before: look at computer and bus first"


class MachineFigures:
    """The parts of a machine of these axes."""

    def __init__(self, places: list[AxisPlace], nodes: int, period_s: float, tolerance: Tolerance) -> None:
        self.stage = Stage.BOOTING
        self.cycles = 0
        """Periods since the first SYNC, missed ones too."""
        self._period_s = period_s
        self._drives = Drives(places)
        self._incidents = Incidents(round(EVENT_AGAIN_S / period_s))
        self._missing = MissingInputs(nodes, tolerance)
        self._again = SettingUp()
        self._missed = MissedTicks(period_s, tolerance.in_a_block)
        self._disturbed_at = -math.inf
        """The last cycle before which ticks or inputs were missing."""
        self._source = SetPointSource([place.stop_acceleration_m_s2 for place in places], period_s)

    @property
    def failed(self) -> bool:
        """Something stopped the machine that nobody had asked for."""
        return self._incidents.failed

    @property
    def reason(self) -> str:
        """Why the machine stopped, "" while nothing has."""
        return self._incidents.reason

    @property
    def events(self) -> EventLog:
        """All that was noted."""
        return self._incidents.log

    @property
    def missed_ticks(self) -> int:
        """Periods that had no SYNC."""
        return self._missed.total

    @property
    def missing_inputs(self) -> int:
        """Inputs that did not come, of all nodes."""
        return self._missing.total

    @property
    def program(self) -> Reference | None:
        """What the axes follow, or followed last."""
        return self._source.program

    @property
    def setting_up(self) -> bool:
        """Nodes are booted and configured again, for drives that are to be enabled."""
        return bool(self._again.nodes)

    def doubt(self, cycle: int) -> str:
        """What to add to an event of an axis where missed ticks or inputs may be its cause."""
        return DOUBT if (cycle - self._disturbed_at) * self._period_s <= DOUBT_S else ""

    def set_points_m(self) -> list[float]:
        """Where the axes are led: the start of a program."""
        return self._source.set_points_m(self._drives.hold_positions_m)

    @property
    def at_a_switch(self) -> str:
        """Why no program and no learning may begin: an axis stands at a limit switch; "" where none does."""
        return self._drives.at_a_switch

    def follows(self, reference: Reference | None) -> bool:
        """Whether the axes are led by this, and nothing has interrupted it."""
        running = self.stage is Stage.RUNNING and not self._source.stopping
        return running and reference is not None and self.program is reference
