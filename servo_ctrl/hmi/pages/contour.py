"""Contour: the path in the plane, and the contour error about the circle, compensations side by side."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from nicegui import ui

from servo_ctrl.hmi.capture_frames import Held, Payloads, View, next_frame
from servo_ctrl.hmi.contour_pictures import Look, Pictures
from servo_ctrl.hmi.contour_view import path_options
from servo_ctrl.hmi.contour_watch import axes_of, watch_of
from servo_ctrl.hmi.contour_words import circle_text
from servo_ctrl.hmi.live_chart import LiveChart
from servo_ctrl.hmi.pace import FASTEST_S, next_interval
from servo_ctrl.telemetry.min_max import bucket_rows, min_max

if TYPE_CHECKING:
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.hmi.machine_link import MachineLink
    from servo_ctrl.hmi.row_ring import RowRing

TITLE = "Contour"
PATH_POINTS = 1000
REFRAME_S = 0.5
NEWEST = "newest"
SPANS_S = {2.0: "2 s", 5.0: "5 s", 10.0: "10 s", 20.0: "20 s", 60.0: "60 s"}
FACTORS = {
    0.0: "by the error",
    **{float(k): f"\N{MULTIPLICATION SIGN} {k}" for k in (100, 200, 500, 1000, 2000, 5000, 10000)},
}
PATH_FACTORS = {1.0: "true", **{float(k): f"\N{MULTIPLICATION SIGN} {k}" for k in (100, 500, 1000, 2000)}}
MARGIN, SMALLEST_REACH_M = 1.25, 1e-4
_PAYLOADS: WeakKeyDictionary[MachineLink, Payloads] = WeakKeyDictionary()
_PICTURES: WeakKeyDictionary[MachineLink, Pictures] = WeakKeyDictionary()


def begin(bench: Bench) -> None:
    """From the start of the process the last turns are kept, whether the page is open or not."""
    watch_of(bench.link)
    min_max(np.zeros((1, 1)), np.zeros(1, dtype=np.int64), 1)  # compiled now, not while somebody waits


def build(bench: Bench, visitor: Visitor) -> None:
    """The page's content."""
    begin(bench)
    content = ui.element("div").classes("bench-column")
    contour: Contour | None = None

    async def refresh() -> None:
        nonlocal contour
        axes = axes_of(bench.link)
        if len(axes) >= 2 and (contour is None or contour.axes != axes):
            content.clear()
            with content:
                contour = Contour(bench, visitor, axes)
        elif axes and contour is None:
            waiting.set_text("A contour needs two axes; this machine has one.")
        if contour is not None:
            timer.interval = await contour.refresh()

    with content:
        waiting = ui.label("Waiting for the controller.").classes("bench-faint")
    timer = ui.timer(FASTEST_S, refresh)


class Contour:
    """One open page on one machine."""

    def __init__(self, bench: Bench, visitor: Visitor, axes: tuple[str, ...]) -> None:
        self.axes = axes
        self._bench, self._visitor = bench, visitor
        self._watch = watch_of(bench.link)
        self._payloads = _PAYLOADS.setdefault(bench.link, Payloads())
        self._pictures = _PICTURES.setdefault(bench.link, Pictures(self._watch))
        self._held: Held | None = None
        self._interval_s = FASTEST_S
        self._last_s = time.monotonic()
        self._framed_s = 0.0
        self._path_for: tuple[object, ...] = ()
        self._turns_for: tuple[object, ...] = ()
        self._looks: tuple[object, ...] = ()
        self._listed: dict[Any, str] = {}
        self._reach = (0.0, 0.0, SMALLEST_REACH_M)
        with ui.element("section").classes("bench-card").props('aria-label="Settings of the contour"'):
            with ui.element("div").classes("bench-row"):
                self._circle = self._select(
                    {NEWEST: "the newest"}, NEWEST, "Circle", "contour-circle", "270px"
                )
                self._factor = self._select(FACTORS, 0.0, "Error magnified", "contour-factor", "160px")
                reference = {"program": "programmed", "fitted": "fitted to the table"}
                self._reference = self._select(
                    reference, "program", "About the circle", "contour-reference", "180px"
                )
                self._span = self._select(SPANS_S, 5.0, "Path of the last", "contour-span", "140px")
                self._path_factor = self._select(
                    PATH_FACTORS, 1.0, "Its error", "contour-path-factor", "110px"
                )
                forget = ui.button("Forget turns", on_click=self._watch.forget)
                forget.props("outline data-testid=contour-forget")
            self._about = ui.label().classes("num").props("data-testid=contour-about")
        with ui.element("div").classes("bench-grid"):
            self._path = self._chart("contour-path", "Path of the table", self._lose_path, "1 / 1")
            self._polar = self._chart(
                "contour-polar", "Contour error about the circle", self._lose_turns, "1 / 1"
            )
        self._quadrants = self._chart(
            "contour-quadrants", "Error behind each reversal", self._lose_turns, "2 / 1", "440px"
        )
        with ui.element("section").classes("bench-card").props('aria-label="Quadrant glitches"'):
            ui.label("Quadrant glitches").classes("bench-h")
            self._table = (
                ui.html("", sanitize=False).classes("bench-scroll").props("data-testid=contour-table")
            )

    async def refresh(self) -> float:
        """Send what is new; return when to come again, seconds."""
        now_s = time.monotonic()
        self._interval_s = next_interval(self._interval_s, now_s - self._last_s)
        self._last_s = now_s
        await self._refresh_path()
        await self._refresh_turns()
        return self._interval_s

    async def _refresh_path(self) -> None:
        ring = self._bench.link.rows
        period_s = self._bench.link.hello.period_s if self._bench.link.hello else 1e-3
        span = round(float(self._span.value) / period_s)
        if not ring.end:
            return
        if self._last_s - self._framed_s > REFRAME_S:
            self._framed_s = self._last_s
            self._frame_path(ring, span)
        wanted = (self._reach, self._visitor.units.name, self._visitor.dark)
        if wanted != self._path_for:
            self._path_for = wanted
            first, second, reach_m = self._reach
            names = (self.axes[0], self.axes[1])
            self._path.show(
                *path_options(names, (first, second), reach_m, self._visitor.units, dark=self._visitor.dark)
            )
        if not self._path.ready:
            return
        bucket = bucket_rows(span, PATH_POINTS)
        view = View(self._columns(ring), bucket, -1, float(self._path_factor.value))
        rows_span = max(ring.end - span, ring.first), ring.end

        def rows_from(begin: int, end: int) -> Any:
            first, rows = ring.since(begin)
            return rows[: end - first]

        self._held, frame = next_frame(self._payloads, rows_from, view, rows_span, self._held)
        if frame is not None:
            await self._path.send(frame, 4, 0.0)

    def _columns(self, ring: RowRing) -> tuple[int, ...]:
        """Command and actual position; the scale's where there is one."""
        pair = self.axes[:2]
        newest = ring.since(ring.end - 1)[1][-1]
        seen = [ring.place(f"{axis}.scale_position_m") for axis in pair]
        motors = [ring.place(f"{axis}.motor_position_m") for axis in pair]
        actual = [
            scale if np.isfinite(newest[scale]) else motor for scale, motor in zip(seen, motors, strict=True)
        ]
        return (*(ring.place(f"{axis}.position_command_m") for axis in pair), *actual)

    def _frame_path(self, ring: RowRing, span: int) -> None:
        """What the path chart shows: all of the span, and no more often changed than needed."""
        corners = []
        for axis in self.axes[:2]:
            command_m = ring.column(f"{axis}.position_command_m", ring.end - span)
            command_m = command_m[np.isfinite(command_m)]
            corners.append((command_m.min(), command_m.max()) if len(command_m) else (0.0, 0.0))
        (left, right), (low, high) = corners
        needed = max(right - left, high - low) / 2.0 * MARGIN
        first, second, reach_m = self._reach
        inside = max(abs(left - first), abs(right - first), abs(low - second), abs(high - second)) <= reach_m
        if not inside or needed < 0.5 * reach_m:
            reach_m = max(needed, SMALLEST_REACH_M)
            self._reach = float((left + right) / 2.0), float((low + high) / 2.0), float(reach_m)

    async def _refresh_turns(self) -> None:
        circles, visitor = self._watch.circles(), self._visitor
        chosen = self._circle.value if self._circle.value in circles else (circles[0] if circles else None)
        fitted = self._reference.value == "fitted"
        look = (
            Look(chosen, float(self._factor.value), fitted, self.axes, visitor.units, visitor.dark)
            if chosen
            else None
        )
        wanted = self._watch.version, look
        ready = self._polar.ready, self._quadrants.ready  # each asked every time: it notes a silent browser
        if wanted == self._turns_for or not all(ready):
            return
        self._turns_for = wanted
        self._offer_circles(
            {NEWEST: "the newest"} | {key: circle_text(key, visitor.units) for key in circles}
        )
        picture = self._pictures.picture(look) if look else None
        if picture is None:
            self._table.set_content("")
            self._about.set_text("No whole turn of a circle at constant speed yet.")
            for chart in (self._polar, self._quadrants):
                chart.show({"series": []}, [])
            self._looks = ()
            return
        self._table.set_content(picture.table)
        self._about.set_text(picture.about)
        changed, self._looks = picture.same != self._looks, picture.same
        for chart, part in ((self._polar, picture.polar), (self._quadrants, picture.quadrants)):
            if changed:
                chart.show(*part.drawn)
            await chart.send(part.frame, part.arrays, 0.0)

    def _offer_circles(self, listed: dict[Any, str]) -> None:
        if listed != self._listed:  # setting them is not cheap
            self._listed = listed
            value = self._circle.value if self._circle.value in listed else NEWEST
            self._circle.set_options(listed, value=value)

    def _lose_path(self) -> None:
        self._held = None

    def _lose_turns(self) -> None:
        self._turns_for = ()

    def _select(self, options: dict[Any, str], value: Any, label: str, mark: str, width: str) -> ui.select:
        select = ui.select(options, value=value, label=label).style(f"width: {width}")
        return select.props(f"outlined dense options-dense data-testid={mark}")

    def _chart(self, mark: str, label: str, on_lost: Any, ratio: str, least: str = "0") -> LiveChart:
        with ui.element("section").classes("bench-card"):
            ui.label(label).classes("bench-h")
            chart = LiveChart(on_lost).style(
                f"width: 100%; height: auto; min-height: {least}; aspect-ratio: {ratio}"
            )
        chart.props(f'data-testid={mark} role=img aria-label="{label}"')
        return chart
