"""Calls subscribers when the status changes: the CANopen node, the MQTT link and the page.

The thread of the cycle makes all calls. A subscriber only notes the change and returns at once.
"""

from collections.abc import Callable

from kernels.arrays import Array
from servo_ctrl.learning.types import ReversalReport


class StatusPublisher:
    """Subscribers append their callbacks to the lists; callbacks are called in order."""

    def __init__(self) -> None:
        self.on_change: list[Callable[[], None]] = []
        """Called when a field of the status has changed."""
        self.on_reversal: list[Callable[[str, ReversalReport, Array], None]] = []
        """Called with an axis, the indicators and the error trace (n,) of each reversal in production."""
        self.on_due: list[Callable[[str, bool], None]] = []
        """Called with an axis when its learning becomes due or is no longer due."""
        self.on_recovery: list[Callable[[], None]] = []
        """Called when the fault that stopped the machine is over."""

    def changed(self) -> None:
        """Publish that a field of the status has changed."""
        for subscriber in self.on_change:
            subscriber()

    def reversal(self, axis: str, report: ReversalReport, trace_m: Array) -> None:
        """Publish an evaluated reversal of an axis; `trace_m` is its position error, (n,)."""
        for subscriber in self.on_reversal:
            subscriber(axis, report, trace_m)

    def due(self, axis: str, due: bool) -> None:
        """Publish that learning has become due for an axis or is no longer due, and the changed status."""
        for subscriber in self.on_due:
            subscriber(axis, due)
        self.changed()

    def recovered(self) -> None:
        """Publish that the fault that stopped the machine is over."""
        for subscriber in self.on_recovery:
            subscriber()
