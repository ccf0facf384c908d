"""Who is told what is new: the bus (our status TPDO), the MQTT broker, the page. None may harm the cycle."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

from servo_ctrl.io.can_port import BusError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from servo_ctrl.canopen.node import ControllerNode
    from servo_ctrl.daemon.supervisor_page import PageService
    from servo_ctrl.learning.types import ReversalReport
    from servo_ctrl.telemetry.mqtt import MqttLink


class Announcer:
    """`node`, `link` and `page` are there once they are made."""

    def __init__(self) -> None:
        self.node: ControllerNode | None = None
        self.link: MqttLink | None = None
        self.page: PageService | None = None

    def changed(self) -> None:
        """Something in the status of the desk is not as it was."""
        if self.node is not None:
            with contextlib.suppress(BusError):  # a bus that fails says so by itself
                self.node.announce()
        if self.link is not None:
            self.link.changed()
        if self.page is not None:
            self.page.changed()

    def reversal(self, report: ReversalReport, trace_m: NDArray[np.float64]) -> None:
        """A reversal of production was evaluated; `trace_m` is its error, (n,)."""
        if self.link is not None:
            self.link.reversal(report)
        if self.page is not None:
            self.page.reversal(report, trace_m)

    def recovered(self) -> None:
        """The fault that stopped the machine is over."""
        if self.node is not None:
            with contextlib.suppress(BusError):
                self.node.clear_error()

    def due(self, axis: str, due: bool) -> None:
        """Learning is due, or is so no more."""
        if self.link is not None:
            self.link.due(axis, due)
        self.changed()
