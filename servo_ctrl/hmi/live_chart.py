"""A chart that is fed with binary frames beside the library's own messages, no faster than it is drawn.

NiceGUI keeps what it sends for a browser that comes back, and sends numbers as text: too much for thirty
pictures a second. So frames go out on the same socket, under a name of their own, and are forgotten; a chart
that misses one says so and is sent everything. A browser that draws slowly is sent fewer. That a frame was
drawn comes by a name of our own as well: an event of the library costs more than the frame.
"""

from __future__ import annotations

import json
import math
import time
from typing import TYPE_CHECKING, Any

from nicegui import Client, core
from nicegui.elements.echart.echart import EChart

if TYPE_CHECKING:
    from collections.abc import Callable

    from nicegui.events import GenericEventArguments

    from servo_ctrl.hmi.capture_frames import Frame

EVENT, DRAWN = "live_chart", "live_chart_drawn"
UNDER_WAY_AT_MOST = 2
"""Frames that were sent and are not drawn yet."""
SILENCE_S = 2.0
"""So long without an acknowledgement (a tab in the background, a lost connection), and all is sent anew."""


class LiveChart(EChart, component="live_chart.js"):
    """`traces` tell what is drawn of a frame's arrays: id of the series, x and y (places), fx and fy."""

    def __init__(self, on_lost: Callable[[], None]) -> None:
        """`on_lost` is called when the next frame has to be a whole one."""
        super().__init__({})
        self._props["look"] = '{"options": {}, "traces": []}'
        self._on_lost = on_lost
        self._sent = self._drawn = self._counted = 0
        self._sent_s = 0.0
        self._have = 0
        self._there = False
        self.on("lost", self._lose)
        self.on("size", self._on_size)

    def rate(self, since_s: float) -> float:
        """Frames a second that were drawn since the last call, `since_s` ago."""
        drawn, self._counted = self._drawn - self._counted, self._drawn
        return drawn / since_s

    @property
    def ready(self) -> bool:
        """Another frame may go; after a long silence all has to be sent anew."""
        if self._sent > self._drawn and time.monotonic() - self._sent_s > SILENCE_S:
            self._lose()
        return self._sent - self._drawn < UNDER_WAY_AT_MOST

    def show(self, options: dict[str, Any], traces: list[dict[str, Any]]) -> None:
        """Draw with these ECharts options from now on."""
        # as text: the library would watch every number of it for changes, at milliseconds a thousand
        self._props["look"] = json.dumps({"options": options, "traces": traces})
        self.update()

    async def send(self, frame: Frame, arrays: int, origin: float) -> None:
        """One frame; `origin` is taken off the x values."""
        self._sent += 1
        self._sent_s = time.monotonic()
        header = {
            "id": self.id,
            "number": self._sent,
            "have": self._have,
            "reset": frame.reset,
            "drop": frame.drop,
            "cut": frame.cut,
            "points": frame.points,
            "arrays": arrays,
            "origin": origin,
        }
        self._have = frame.points + (0 if frame.reset else self._have - frame.drop - frame.cut)
        # as text: each part of anything else would be looked at for bytes in it
        await core.sio.emit(EVENT, (json.dumps(header), frame.payload), room=self.client.id)

    def on_size(self, handler: Callable[[float], None]) -> None:
        """Call `handler` with the width in pixels."""
        self.on("size", lambda event: handler(number_of(event, "width")))

    def on_pick(self, handler: Callable[[float, bool], None]) -> None:
        """Call `handler` with the x value that was pointed at, and whether the shift key was down."""
        self.on("pick", lambda event: handler(number_of(event, "x"), event.args.get("shift") is True))

    def note_drawn(self, number: int) -> None:
        """The frame of this number was drawn, and those before it."""
        if number <= self._sent:
            self._drawn = max(self._drawn, number)

    def _on_size(self) -> None:
        """The first size comes when the chart is there: what was sent before has met nobody."""
        if not self._there:
            self._there = True
            self._lose()

    def _lose(self) -> None:
        self._drawn = self._sent
        self._on_lost()


def on_drawn(_socket: str, *told: object) -> None:
    """A browser has drawn: its page, the chart, the frame's number; anything else is nothing."""
    match told:
        case (str(page), int(chart), int(number)):
            client = Client.instances.get(page)
            element = client.elements.get(chart) if client is not None else None
            if isinstance(element, LiveChart):
                element.note_drawn(number)


core.sio.on(DRAWN, on_drawn)


def number_of(event: GenericEventArguments, name: str) -> float:
    """A number that a browser has sent; 0 where it sent anything else."""
    value = event.args.get(name) if isinstance(event.args, dict) else None
    number = float(value) if isinstance(value, int | float) else 0.0
    return number if math.isfinite(number) else 0.0
