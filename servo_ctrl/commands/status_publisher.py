"""Tells subscribers that the status has changed: the bus, the MQTT link and the page, which it does not know.

Its calls are made in the thread of the cycle. A subscriber only notes what it was told and returns at once.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from servo_ctrl.learning.types import ReversalReport


class StatusPublisher:
    """Subscribers append their callbacks to the lists; a list is called in its order."""

    def __init__(self) -> None:
        self.on_change: list[Callable[[], None]] = []
        """Called when a field of the status has changed."""
        self.on_reversal: list[Callable[[str, ReversalReport, NDArray[np.float64]], None]] = []
        """Called with an axis, the indicators and the error trace (n,) of each reversal in production."""
        self.on_due: list[Callable[[str, bool], None]] = []
        """Called with an axis when its learning becomes due, or is due no more."""
        self.on_recovery: list[Callable[[], None]] = []
        """Called when the fault that stopped the machine is over."""

    def changed(self) -> None:
        """Tell that a field of the status has changed."""
        for tell in self.on_change:
            tell()

    def reversal(self, axis: str, report: ReversalReport, trace_m: NDArray[np.float64]) -> None:
        """Tell the indicators of a reversal of an axis; `trace_m` is its position error, (n,)."""
        for tell in self.on_reversal:
            tell(axis, report, trace_m)

    def due(self, axis: str, due: bool) -> None:
        """Tell whether learning is due for an axis, which changes the status too."""
        for tell in self.on_due:
            tell(axis, due)
        self.changed()

    def recovered(self) -> None:
        """Tell that the fault which stopped the machine is over."""
        for tell in self.on_recovery:
            tell()
