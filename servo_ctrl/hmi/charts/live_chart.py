"""An ECharts element that is fed with binary frames, no faster than browser and event loop can handle.

NiceGUI keeps each message for a browser that reconnects, and sends numbers as text: too much for 30 pictures
a second. So the frames go out on the same socket as events of their own and are not kept; a chart that has
missed one reports it and is sent all its points. The browser acknowledges each frame once it is drawn, by an
event of our own too: an event of NiceGUI costs more than the frame.
"""

import json
import math
import time
from collections.abc import Awaitable, Callable, Sequence
from typing import Any

from nicegui import Client, core, ui
from nicegui.elements.echart.echart import EChart
from nicegui.events import GenericEventArguments

from servo_ctrl.hmi.charts.frames import ChartFrame

FRAME_EVENT, DRAWN_EVENT = "live_chart", "live_chart_drawn"
MAX_PENDING = 2
"""Bounds the frames that are sent but not drawn yet; chosen: one in transmission, one being drawn."""
ACKNOWLEDGE_TIMEOUT_S = 2.0
"""Bounds the wait for an acknowledgement, seconds, before all points are sent again; chosen. A tab in the
background and a lost connection do not acknowledge."""
SHORTEST_S = 1.0 / 30.0
"""Bounds the interval of the refreshes from below, seconds; chosen: 30 frames a second."""
LONGEST_S = 0.25
"""Bounds the interval of the refreshes from above, seconds; chosen."""
LATE_RATIO = 1.5
"""Elapsed time over interval above which a refresh counts as late; chosen."""
LENGTHEN, SHORTEN = 1.1, 0.97
"""Factors of the interval after a late and after a punctual refresh; chosen: it settles where one in four
is late."""


class LiveChart(EChart, component="live_chart.js"):
    """A chart whose series are drawn from the arrays of its frames, as the traces of `show` say."""

    def __init__(self, mark: str, label: str, on_lost: Callable[[], None]) -> None:
        """`label` is for screen readers; `on_lost` is called when the next frame has to hold all points."""
        super().__init__({})
        self._props["look"] = '{"options": {}, "traces": []}'
        self._on_lost = on_lost
        self._sent = self._drawn = self._counted = 0
        self._sent_s = 0.0
        self._points = 0
        self._mounted = False
        self.mark(mark).props("role=img")
        self.props["aria-label"] = label
        self.on("lost", self._lose)
        self.on("size", self._on_size)

    def frame_rate(self, since_s: float) -> float:
        """Return the frames per second that were drawn since the last call, `since_s` ago."""
        drawn, self._counted = self._drawn - self._counted, self._drawn
        return drawn / since_s

    @property
    def ready(self) -> bool:
        """Whether another frame may be sent. Asking also detects a browser that has stopped answering."""
        if self._sent > self._drawn and time.monotonic() - self._sent_s > ACKNOWLEDGE_TIMEOUT_S:
            self._lose()
        return self._sent - self._drawn < MAX_PENDING

    def show(self, options: dict[str, Any], traces: list[dict[str, Any]]) -> None:
        """Draw with these ECharts options and traces from now on."""
        # as text: NiceGUI would watch every number of a dictionary for changes, milliseconds for a thousand
        self._props["look"] = json.dumps({"options": options, "traces": traces})
        self.update()

    def show_marks(self, marks: Sequence[tuple[float, str]], panes: int) -> None:
        """Draw vertical lines at these x, each with a short text, through the panes; in place of others."""
        self.run_method("marks", [list(mark) for mark in marks], panes)

    def show_whole(self) -> None:
        """End the zoom."""
        self.run_method("whole")

    async def send(self, frame: ChartFrame, arrays: int, origin: float) -> None:
        """Send one frame of this many arrays; the browser subtracts `origin` from the x values."""
        self._sent += 1
        self._sent_s = time.monotonic()
        header = {
            "id": self.id,
            "number": self._sent,
            "have": self._points,
            "reset": frame.reset,
            "drop": frame.drop,
            "cut": frame.cut,
            "points": frame.points,
            "arrays": arrays,
            "origin": origin,
        }
        self._points = frame.points + (0 if frame.reset else self._points - frame.drop - frame.cut)
        # the header as text: socketio searches every part of anything else for bytes
        await core.sio.emit(FRAME_EVENT, (json.dumps(header), frame.payload), room=self.client.id)

    def on_size(self, handler: Callable[[float], None]) -> None:
        """Call `handler` with the width in pixels."""
        self.on("size", lambda event: handler(number_in(event, "width")))

    def on_pick(self, handler: Callable[[float, bool], None]) -> None:
        """Call `handler` with the x value that was pointed at, and whether the shift key was down."""
        self.on("pick", lambda event: handler(number_in(event, "x"), event.args.get("shift") is True))

    def acknowledge(self, number: int) -> None:
        """Note that the frame of this number was drawn, and all before it."""
        if number <= self._sent:
            self._drawn = max(self._drawn, number)

    def _on_size(self) -> None:
        """Send all points after the first size: it is reported at mounting, and earlier frames were lost."""
        if not self._mounted:
            self._mounted = True
            self._lose()

    def _lose(self) -> None:
        self._drawn = self._sent
        self._on_lost()


def on_drawn(_socket: str, *arguments: object) -> None:
    """Handle the acknowledgement of a browser: page, chart and frame number; ignore anything else."""
    match arguments:
        case (str(page), int(chart), int(number)):
            client = Client.instances.get(page)
            element = client.elements.get(chart) if client is not None else None
            if isinstance(element, LiveChart):
                element.acknowledge(number)


core.sio.on(DRAWN_EVENT, on_drawn)


def number_in(event: GenericEventArguments, name: str) -> float:
    """Return a number that the browser has sent; 0 where it sent anything else."""
    value = event.args.get(name) if isinstance(event.args, dict) else None
    number = float(value) if isinstance(value, int | float) else 0.0
    return number if math.isfinite(number) else 0.0


def next_interval(interval_s: float, elapsed_s: float) -> float:
    """Return the next interval, seconds, after `elapsed_s` since the last refresh instead of `interval_s`."""
    factor = LENGTHEN if elapsed_s > LATE_RATIO * interval_s else SHORTEN
    return min(max(interval_s * factor, SHORTEST_S), LONGEST_S)


def refresh_paced(refresh: Callable[[], Awaitable[None] | None]) -> None:
    """Call `refresh` for as long as the page is open: 30 times a second, less often while the loop lags.

    STOP is handled by the same loop: pictures must not delay it.
    """
    last_s = time.monotonic()

    async def call() -> None:
        nonlocal last_s
        now_s = time.monotonic()
        timer.interval = next_interval(timer.interval, now_s - last_s)
        last_s = now_s
        result = refresh()
        if result is not None:
            await result

    timer = ui.timer(SHORTEST_S, call)
