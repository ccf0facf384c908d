"""The Contour page: the path in the plane, and the contour error of circles with and without compensation."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from nicegui import ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import ContourStatus, MachineStatus
from servo_ctrl.hmi.charts.frames import ChartContents, ChartView, next_frame, payloads_of
from servo_ctrl.hmi.charts.live_chart import LiveChart, refresh_paced
from servo_ctrl.hmi.contour.options import path_options
from servo_ctrl.hmi.contour.turn_charts import TurnDisplay, circle_text, turn_charts
from servo_ctrl.hmi.contour.turn_store import turn_store_of
from servo_ctrl.hmi.languages.texts import CurrentLanguage, tr, translated, word
from servo_ctrl.hmi.link.row_ring import RowRing
from servo_ctrl.hmi.shell.live_content import Refresh, TextTable, connected_content
from servo_ctrl.hmi.shell.open_page import OpenPage, PageServices
from servo_ctrl.hmi.shell.parts import button, choice, div, faint, panel
from servo_ctrl.hmi.shell.units import UnitSystem
from servo_ctrl.recording.min_max import bucket_rows, min_max

TITLE = word("Contour")
PATH_POINTS = 1000
"""Bounds the points of the path; chosen: about two for each pixel of its length."""
REFRAME_S = 0.5
"""Interval at which the extent of the path is determined, seconds; chosen."""
MARGIN, MIN_REACH_M = 1.25, 1e-4
"""Half width of the path chart over that of the path, and its lower bound, metres; chosen."""
NEWEST = "newest"
SPANS_S = {2.0: "2 s", 5.0: "5 s", 10.0: "10 s", 20.0: "20 s", 60.0: "60 s"}
"""Time spans of the path, seconds, and their labels; chosen."""
FACTORS = {
    0.0: word("by the error"),
    **{float(k): f"\N{MULTIPLICATION SIGN} {k}" for k in (100, 200, 500, 1000, 2000, 5000, 10000)},
}
"""Magnifications of the error about the circle, and their labels; 0: derived from the largest error."""
PATH_FACTORS = {
    1.0: word("true"),
    **{float(k): f"\N{MULTIPLICATION SIGN} {k}" for k in (100, 500, 1000, 2000)},
}
"""Magnifications of the error along the path, and their labels; chosen."""
ABBREVIATIONS_TEXT = word(
    "WTFC, WFC and WDOB are the abbreviations of Feng et al. 2015 for circles without compensation, with the "
    "learned friction compensation, and with the disturbance observer."
)
REFERENCES = {"program": word("programmed"), "fitted": word("fitted to the table")}


def prepare(services: PageServices) -> None:
    """Keep turns from the start of the process on, and compile the decimation before anybody waits for it."""
    turn_store_of(services.link)
    min_max(np.zeros((1, 1)), np.zeros(1, dtype=np.int64), 1)


def build(page: OpenPage) -> None:
    """Build the content of the page; rebuild it when a machine with other axes answers."""

    def make(hello: Hello) -> Refresh:
        if len(hello.axes) < 2:
            faint(tr("A contour needs two axes; this machine has one."))
            return lambda _status: None
        return ContourCharts(page, hello).refresh

    refresh_paced(connected_content(page, make, lambda hello: hello.axes))


class ContourCharts:
    """The settings, charts and table of one open page."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page, self._period_s = page, hello.period_s
        self._plane = hello.axes[0].name, hello.axes[1].name
        self._store = turn_store_of(page.link)
        self._contents: ChartContents | None = None
        self._framed_s = 0.0
        """When the extent of the path was looked at last."""
        self._frame = (0.0, 0.0, MIN_REACH_M)
        """Centre and half width of the path chart, metres."""
        self._path_drawn: tuple[object, ...] = ()
        self._turns_drawn: tuple[object, ...] = ()
        self._shown: tuple[object, ...] = ()
        self._circles: dict[Any, str] = {NEWEST: tr("the newest")}
        with panel(tr("Settings of the contour")):
            with div("bench-row"):
                self._circle = choice(
                    self._circles, tr("Circle"), "contour-circle", "width: 270px", value=NEWEST
                )
                self._factor = choice(
                    translated(FACTORS), tr("Error magnified"), "contour-factor", "width: 160px", value=0.0
                )
                self._reference = choice(
                    translated(REFERENCES),
                    tr("About the circle"),
                    "contour-reference",
                    "width: 180px",
                    value="program",
                )
                self._span = choice(
                    SPANS_S, tr("Path of the last"), "contour-span", "width: 140px", value=5.0
                )
                self._path_factor = choice(
                    translated(PATH_FACTORS),
                    tr("Its error"),
                    "contour-path-factor",
                    "width: 110px",
                    value=1.0,
                )
                button(tr("Discard turns"), self._store.clear, "contour-forget")
            self._description = ui.label().classes("num").mark("contour-about")
            self._coupling = ui.label().classes("num").mark("contour-coupling")
        with div("bench-grid"):
            self._path = _chart("contour-path", tr("Path of the table"), self._resend_path, "1 / 1")
            self._polar = _chart(
                "contour-polar", tr("Contour error about the circle"), self._resend_turns, "1 / 1"
            )
        self._quadrants = _chart(
            "contour-quadrants", tr("Error after each reversal"), self._resend_turns, "2 / 1", "440px"
        )
        with panel(tr("Quadrant glitches")):
            ui.label(tr("Quadrant glitches")).classes("bench-h")
            self._table = TextTable("contour-table", figures=True)
            faint(tr(ABBREVIATIONS_TEXT)).style("font-size: 12px").mark("contour-letters")

    async def refresh(self, status: MachineStatus) -> None:
        """Send what is new to the charts."""
        self._coupling.set_text(coupling_text(status.contour, self._page.units))
        await self._refresh_path()
        await self._refresh_turns()

    async def _refresh_path(self) -> None:
        page, ring = self._page, self._page.link.rows
        span = round(float(self._span.value) / self._period_s)
        if not ring.end:
            return
        now_s = time.monotonic()
        if now_s - self._framed_s > REFRAME_S:
            self._framed_s = now_s
            self._fit_frame(ring, span)
        drawn = (self._frame, page.look)
        if drawn != self._path_drawn:
            self._path_drawn = drawn
            centre_m, reach_m = self._frame[:2], self._frame[2]
            self._path.show(*path_options(self._plane, centre_m, reach_m, page.look))
        if not self._path.ready:
            return
        factor = float(self._path_factor.value)
        view = ChartView(self._columns(ring), bucket_rows(span, PATH_POINTS), -1, factor)
        shown = max(ring.end - span, ring.first), ring.end

        def rows_between(begin: int, end: int) -> Any:
            first, rows = ring.since(begin)
            return rows[: end - first]

        self._contents, frame = next_frame(payloads_of(page.link), rows_between, view, shown, self._contents)
        if frame is not None:
            await self._path.send(frame, 4, 0.0)

    def _columns(self, ring: RowRing) -> tuple[int, ...]:
        """Return the columns of command x, y and actual x, y: of the scale, or else of the motor."""
        commands, actual = [], []
        for axis in self._plane:
            has_scale = np.isfinite(ring.newest(f"{axis}.scale_position_m"))
            commands.append(ring.place(f"{axis}.position_command_m"))
            actual.append(ring.place(f"{axis}.{'scale' if has_scale else 'motor'}_position_m"))
        return (*commands, *actual)

    def _fit_frame(self, ring: RowRing, span: int) -> None:
        """Show another part of the plane when the path leaves it or takes less than half of it."""
        extents = []
        for axis in self._plane:
            command_m = ring.column(f"{axis}.position_command_m", ring.end - span)
            command_m = command_m[np.isfinite(command_m)]
            extents.append((command_m.min(), command_m.max()) if len(command_m) else (0.0, 0.0))
        (left, right), (low, high) = extents
        needed_m = max(right - left, high - low) / 2.0 * MARGIN
        x_m, y_m, reach_m = self._frame
        inside = max(abs(left - x_m), abs(right - x_m), abs(low - y_m), abs(high - y_m)) <= reach_m
        if not inside or needed_m < 0.5 * reach_m:
            reach_m = max(needed_m, MIN_REACH_M)
            self._frame = float((left + right) / 2.0), float((low + high) / 2.0), float(reach_m)

    async def _refresh_turns(self) -> None:
        page, circles = self._page, self._store.circles()
        chosen = self._circle.value if self._circle.value in circles else next(iter(circles), None)
        display = chosen and TurnDisplay(
            circle=chosen,
            factor=float(self._factor.value),
            fitted=self._reference.value == "fitted",
            axes=self._plane,
            look=page.look,
            language=CurrentLanguage.find(),
        )
        wanted = self._store.version, display
        ready = self._polar.ready, self._quadrants.ready  # ask both: asking detects a silent browser
        if wanted == self._turns_drawn or not all(ready):
            return
        self._turns_drawn = wanted
        offered = {NEWEST: tr("the newest")} | {key: circle_text(key, page.units) for key in circles}
        if offered != self._circles:  # setting the options of a list is not cheap
            self._circles = offered
            value = self._circle.value if self._circle.value in offered else NEWEST
            self._circle.set_options(offered, value=value)
        charts = display and turn_charts(self._store, self._store.version, display)
        if charts is None:
            self._table.clear()
            self._description.set_text(tr("No whole turn of a circle at constant speed yet."))
            for chart in (self._polar, self._quadrants):
                chart.show({"series": []}, [])
            self._shown = ()
            return
        self._table.show(charts.rows, charts.head)
        self._description.set_text(charts.description)
        changed, self._shown = charts.drawn_for != self._shown, charts.drawn_for
        for chart, content in ((self._polar, charts.polar), (self._quadrants, charts.quadrants)):
            if changed:
                chart.show(content.options, content.traces)
            await chart.send(content.frame, content.arrays, 0.0)

    def _resend_path(self) -> None:
        self._contents = None

    def _resend_turns(self) -> None:
        self._turns_drawn = ()


def coupling_text(contour: ContourStatus, units: UnitSystem) -> str:
    """Return which axes contour control couples, and their contour error now; "" where it is off."""
    if not contour.axes:
        return ""
    return tr(
        "Contour control couples {axes}: contour error now {error}.",
        axes=", ".join(axis.upper() for axis in contour.axes),
        error=units.error.with_unit(contour.error_m, sign=True),
    )


def _chart(mark: str, label: str, on_lost: Callable[[], None], ratio: str, least: str = "0") -> LiveChart:
    with ui.element("section").classes("bench-card"):
        ui.label(label).classes("bench-h")
        chart = LiveChart(mark, label, on_lost)
    return chart.style(f"width: 100%; height: auto; min-height: {least}; aspect-ratio: {ratio}")
