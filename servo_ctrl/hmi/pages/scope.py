"""Scope: any channels of the recording, live, triggered, measured and kept."""

from __future__ import annotations

import asyncio
import time
from datetime import UTC, datetime
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from nicegui import ui

from servo_ctrl.hmi.access import Role
from servo_ctrl.hmi.capture_controls import Fields, first_choices
from servo_ctrl.hmi.capture_files import save_capture
from servo_ctrl.hmi.capture_frames import Payloads
from servo_ctrl.hmi.capture_look import Look, scope_options
from servo_ctrl.hmi.capture_readings import Readings
from servo_ctrl.hmi.capture_scales import Scales
from servo_ctrl.hmi.capture_stream import ScopeStream, rows_missing
from servo_ctrl.hmi.live_chart import LiveChart
from servo_ctrl.hmi.notices import tell
from servo_ctrl.hmi.pace import FASTEST_S, next_interval
from servo_ctrl.hmi.parts import may
from servo_ctrl.telemetry.recorder import RecordingError

if TYPE_CHECKING:
    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.hmi.machine_link import MachineLink

TITLE = "Scope"
READINGS_S = 0.2
STOPS = frozenset({"stopping", "quick_stopping"})
_PAYLOADS: WeakKeyDictionary[MachineLink, Payloads] = WeakKeyDictionary()


def build(bench: Bench, visitor: Visitor) -> None:
    """The page's content."""
    content = ui.element("div").classes("bench-column")
    scope: Scope | None = None

    async def refresh() -> None:
        nonlocal scope
        hello = bench.link.hello
        if hello is None:
            return
        if scope is None or scope.hello.channels != hello.channels:
            content.clear()
            with content:
                scope = Scope(bench, visitor, hello)
        timer.interval = await scope.refresh()

    with content:
        ui.label("Waiting for the controller.").classes("bench-faint")
    timer = ui.timer(FASTEST_S, refresh)


class Scope:
    """One open scope on one machine."""

    def __init__(self, bench: Bench, visitor: Visitor, hello: Hello) -> None:
        self.hello = hello
        self._bench, self._visitor = bench, visitor
        self._choices = first_choices(hello)
        self._stream = ScopeStream(_PAYLOADS.setdefault(bench.link, Payloads()))
        self._interval_s = FASTEST_S
        self._last_s = self._read_s = time.monotonic()
        self._drawn_for: tuple[object, ...] = ()
        self._stage = ""
        self._saving = False
        with ui.element("section").classes("bench-card").props('aria-label="Settings of the scope"'):
            self._fields = Fields(hello, self._choices, self._changed)
            with ui.element("div").classes("bench-row"):
                self._hold = ui.button("Hold", icon="pause", on_click=self._toggle_hold)
                self._hold.props("unelevated data-testid=scope-hold")
                self._arm = ui.button("Arm", icon="adjust", on_click=self._rearm)
                self._arm.props("outline data-testid=scope-arm")
                self._save = ui.button("Save what is seen", icon="save", on_click=self._keep)
                self._save.props("outline data-testid=scope-save")
                self._state = (
                    ui.label().classes("bench-pill calm").props("data-testid=scope-state role=status")
                )
                self._rate = ui.label().classes("bench-faint num").props("data-testid=scope-rate")
        with ui.element("section").classes("bench-card").props('aria-label="Scope"'):
            self._chart = LiveChart(self._stream.resend)
            self._chart.style("width: 100%; height: max(360px, 58vh); touch-action: pan-y")
            self._chart.props('data-testid=scope-chart role=img aria-label="Channels over time"')
            self._gap = ui.label().classes("bench-note warn").props("data-testid=scope-gap")
            self._saved = ui.element("div").classes("bench-row")
        with ui.element("section").classes("bench-card").props('aria-label="Cursors and scales"'):
            self._readings = Readings(self._choices, hello.period_s, lambda: self._changed("look"))
            self._scales = Scales(self._choices, lambda: self._changed("look"))
        self._chart.on_size(self._stream.set_width)
        self._chart.on_pick(self._pick)
        self._changed("capture")

    async def refresh(self) -> float:
        """Send what is new; return when to come again, seconds."""
        now_s = time.monotonic()
        self._interval_s = next_interval(self._interval_s, now_s - self._last_s)
        self._last_s = now_s
        self._redraw()
        self._look_for_stops()
        if self._chart.ready:
            frame = self._stream.frame(self._bench.link.rows)
            if frame is not None:
                await self._chart.send(frame, 1 + len(self._stream.columns), self._origin())
        if now_s - self._read_s >= READINGS_S:
            self._rate.set_text(f"{self._chart.rate(now_s - self._read_s):.0f} pictures/s")
            self._read_s = now_s
            self._show_readings()
        return self._interval_s

    def _origin(self) -> int:
        picture = self._stream.capture.shown
        return picture.origin if picture is not None else 0

    def _changed(self, what: str) -> None:
        if what == "capture":
            choices = self._choices
            self._fields.refresh()
            self._stream.settings = choices.settings(self.hello.period_s)
            self._stream.trigger = choices.trigger(self.hello, self._visitor.units)
            self._stream.arm(self._bench.link.rows)
            self._readings.rescale()
        self._drawn_for = ()

    def _redraw(self) -> None:
        """Draw the chart anew where something but its data has changed."""
        visitor, choices = self._visitor, self._choices
        wanted = (visitor.units.name, visitor.dark)
        if self._drawn_for == wanted:
            return
        if self._drawn_for and self._drawn_for[0] != wanted[0]:
            choices.fixed.clear()  # they were in the other unit
            self._stream.trigger = choices.trigger(self.hello, visitor.units)
        self._drawn_for = wanted
        traces = choices.traces(self.hello, visitor.units)
        level = (choices.source, choices.level) if choices.kind in {"rising", "falling"} else None
        look = Look(choices.span_s, choices.before_s(), choices.cursors, visitor.dark, level)
        self._stream.columns = tuple(trace.place for trace in traces)
        self._chart.show(*scope_options(traces, look, self.hello.period_s))
        self._fields.show_unit(visitor.units)
        self._scales.show(traces)

    def _look_for_stops(self) -> None:
        """A stop of the machine is a fault to the trigger, whether a drive reports one or not."""
        status = self._bench.link.status
        stage = status.stage if status is not None else ""
        if stage in STOPS and self._stage not in STOPS:
            self._stream.stop_seen(self._bench.link.rows)
        self._stage = stage

    def _show_readings(self) -> None:
        stream, ring = self._stream, self._bench.link.rows
        traces = self._choices.traces(self.hello, self._visitor.units)
        rows = stream.rows(ring)
        self._readings.refresh(rows, self._origin(), traces)
        missing = rows_missing(rows, ring.place("cycle"))
        self._gap.set_visibility(missing > 0)
        self._gap.set_text(f"{missing} cycles of this picture have no row: time is too short by them.")
        word, tone = stream.state()
        self._state.set_text(word)
        self._state.classes(tone, remove="calm good warn")
        self._hold.set_text("Go on" if stream.hold else "Hold")
        self._hold.props(f"icon={'play_arrow' if stream.hold else 'pause'}")
        self._arm.set_visibility(not stream.settings.free)

    def _toggle_hold(self) -> None:
        self._stream.toggle_hold(self._bench.link.rows)
        self._show_readings()

    def _rearm(self) -> None:
        self._stream.arm(self._bench.link.rows)
        self._show_readings()

    def _pick(self, x: float, other: bool) -> None:
        self._readings.pick(x, other)

    async def _keep(self) -> None:
        bench, visitor = self._bench, self._visitor
        if self._saving or not may(bench, visitor, Role.OPERATE):  # it writes on the controller's disk
            return
        rows = self._stream.rows(bench.link.rows)
        traces = self._choices.traces(self.hello, visitor.units)
        self._saving = True
        try:
            directory = await asyncio.to_thread(
                save_capture,
                bench.directories.recordings,
                self.hello,
                rows,
                traces,
                self._origin(),
                datetime.now(UTC),
            )
        except RecordingError as error:
            tell(str(error), "negative")
            return
        finally:
            self._saving = False
        self._saved.clear()
        with self._saved:
            ui.label(f"Saved in {directory}").props("data-testid=scope-saved")
            for file in sorted(directory.iterdir()):
                button = ui.button(
                    file.name, icon="download", on_click=lambda file=file: ui.download.file(file)
                )
                button.props(f"flat data-testid=scope-download-{file.suffix[1:]}")
