"""Calls subscribers when the status changes: the CANopen node, the MQTT link and the page.

All calls are made in the thread of the cycle. A subscriber only notes the change and returns at once.
"""

from collections.abc import Callable

from kernels.arrays import Array
from servo_ctrl.learning.types import ReversalReport


class StatusPublisher:
    """Subscribers append their callbacks to the lists; a list is called in its order."""

    def __init__(self) -> None:
        self.on_change: list[Callable[[], None]] = []
        """Called when a field of the status has changed."""
        self.on_reversal: list[Callable[[str, ReversalReport, Array], None]] = []
        """Called with an axis, the indicators and the error trace (n,) of each reversal in production."""
        self.on_due: list[Callable[[str, bool], None]] = []
        """Called with an axis when its learning becomes due, or is due no more."""
        self.on_recovery: list[Callable[[], None]] = []
        """Called when the fault that stopped the machine is over."""

    def changed(self) -> None:
        """A field of the status has changed."""
        for subscriber in self.on_change:
            subscriber()

    def reversal(self, axis: str, report: ReversalReport, trace_m: Array) -> None:
        """A reversal of an axis was evaluated; `trace_m` is its position error, (n,)."""
        for subscriber in self.on_reversal:
            subscriber(axis, report, trace_m)

    def due(self, axis: str, due: bool) -> None:
        """Learning has become due for an axis, or is due no more; that changes the status too."""
        for subscriber in self.on_due:
            subscriber(axis, due)
        self.changed()

    def recovered(self) -> None:
        """The fault that stopped the machine is over."""
        for subscriber in self.on_recovery:
            subscriber()
