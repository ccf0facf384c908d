"""The reversals of each axis since its compensation was last changed: older ones do not represent it."""

from functools import cache

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.local_messages import Reversal
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.friction.figures import MEDIAN_REVERSALS
from servo_ctrl.hmi.link.machine_link import MachineLink


@cache
def recent_reversals_of(link: MachineLink) -> "RecentReversals":
    """Return the one instance of this link, which observes it from the first call on."""
    recent = RecentReversals(link)
    link.listeners.append(recent.on_status)
    return recent


class RecentReversals:
    """Remembers the newest reversal of each axis before the last change of its compensation."""

    def __init__(self, link: MachineLink) -> None:
        self._link = link
        self._cycles = 0
        self._acting: dict[str, tuple[object, ...]] = {}
        self._before: dict[str, Reversal | None] = {}

    def on_status(self, status: MachineStatus) -> None:
        """Take notice of a change: a switch, another version, or another run of the controller."""
        again = status.cycles < self._cycles
        self._cycles = status.cycles
        for axis in status.axes:
            acting = _acting(axis)
            if again or self._acting.get(axis.name, acting) != acting:
                self._before[axis.name] = next(iter(self._newest_first(axis.name)), None)
            self._acting[axis.name] = acting

    def recent_errors_m(self, axis: str) -> list[float]:
        """J of the last reversals of an axis since that change, the newest last; at most MEDIAN_REVERSALS."""
        found: list[float] = []
        before = self._before.get(axis)
        for reversal in self._newest_first(axis):
            if reversal is before or len(found) == MEDIAN_REVERSALS:
                break
            found.append(reversal.report.error_mean_m)
        return found[::-1]

    def changed(self, axis: str) -> bool:
        """Whether the last reversal of an axis is from before the change."""
        return axis in self._before and not self.recent_errors_m(axis)

    def _newest_first(self, axis: str) -> list[Reversal]:
        return [reversal for reversal in reversed(self._link.reversals) if reversal.axis == axis]


def _acting(axis: AxisStatus) -> tuple[object, ...]:
    return (
        axis.compensation_enabled,
        axis.version,
        axis.observer_enabled,
        axis.screw.enabled,
        axis.screw.version,
        axis.waveform.enabled,
        axis.waveform.version,
    )
