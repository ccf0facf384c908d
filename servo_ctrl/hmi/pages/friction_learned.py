"""Learned functions on the Friction page: the versions in the store, one of them against the one in use."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import background_tasks, run, ui

from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.config.load import load_machine
from servo_ctrl.hmi.bench import ask
from servo_ctrl.hmi.learned_view import (
    Drawn,
    amplitude_figure,
    before_use,
    duration_figure,
    from_state,
    screw_figure,
    version_rows,
)
from servo_ctrl.hmi.parts import Plot, card, confirmed
from servo_ctrl.telemetry.learned_store import LearnedStore, ScrewStore

if TYPE_CHECKING:
    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.config.local_status import AxisState
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.telemetry.learned_store import VersionEntry

KINDS = {"pulse": "friction pulse", "screw": "screw"}
COLUMNS = (
    ("name", "version", "left"),
    ("gain", "J before and after", "left"),
    ("learned_at", "learned at", "left"),
    ("learner", "learner", "left"),
    ("strokes", "strokes", "right"),
    ("problem", "", "left"),
)
TABLE_CSS = ".bench-versions .q-td { height: 44px; padding: 2px 6px; }"


class Versions:
    """The card of what was learned."""

    def __init__(self, bench: Bench, visitor: Visitor, hello: Hello) -> None:
        self._bench, self._visitor, self._hello = bench, visitor, hello
        self._entries: list[VersionEntry] = []
        self._read: tuple[str, Any, int] = ("", "", 0)
        """Axis, kind and the version in use, as they were read."""
        """Of which axis, kind and version in use the entries are."""
        self._chosen: int | None = None
        ui.add_css(TABLE_CSS)
        names = [axis.name for axis in hello.axes]
        with card("What was learned", "learned"):
            with ui.element("div").classes("bench-row"):
                self._axis = ui.toggle(names, value=names[0]).mark("learned-axis").props("no-caps unelevated")
                self._kind = ui.toggle(KINDS, value="pulse").mark("learned-kind").props("no-caps unelevated")
                ui.space()
                self._back = ui.button("Roll back", icon="undo", on_click=self._roll_back)
                self._back.props("outline").mark("roll-back")
            self._problem = ui.label().classes("bench-note warn").mark("learned-problem")
            columns: list[dict[str, Any]] = [
                {"name": name, "label": label, "field": name, "align": align}
                for name, label, align in COLUMNS
            ]
            self._table = ui.table(rows=[], columns=columns, row_key="version", selection="single")
            self._table.classes("bench-versions").props(
                "flat dense hide-pagination :rows-per-page-options=[0] wrap-cells"
            )
            self._table.mark("versions").on_select(self._choose)
            with ui.element("div").classes("bench-grid"):
                self._left = Plot("duration-plot", "Duration of the pulse over the reverse acceleration")
                self._right = Plot("amplitude-plot", "Amplitude of the pulse over the reverse acceleration")

    def refresh(self) -> None:
        """Read the store where something has changed, and show it."""
        axis = self._state()
        if axis is None:
            return
        in_use = axis.version if self._kind.value == "pulse" else axis.screw.version
        wanted = (axis.name, self._kind.value, in_use)
        if wanted != self._read:
            self._read, self._chosen = wanted, None
            background_tasks.create(self._load(), name="learned versions")
        self._draw(axis)

    def _state(self) -> AxisState | None:
        status = self._bench.link.status
        axes = status.axes if status is not None else ()
        return next((axis for axis in axes if axis.name == self._axis.value), None)

    async def _load(self) -> None:
        wanted, hello = self._read, self._hello
        kind = LearnedStore if self._kind.value == "pulse" else ScrewStore
        try:
            entries = await run.io_bound(_versions, kind, hello, str(self._axis.value)) or []
            problem = ""
        except ServoCtrlError as error:
            entries, problem = [], str(error)
        if wanted != self._read:
            return  # another axis was chosen meanwhile
        self._entries = entries
        in_use = wanted[2]
        nothing = (
            f"Version {in_use} is in use, but there is none in {hello.learned_dir}."
            if in_use
            else "Nothing was learned yet."
        )
        self._problem.set_text(problem or nothing)
        self._problem.set_visibility(not entries)
        self._fill()

    def _fill(self) -> None:
        rows = [
            {**row._asdict(), "name": f"{row.version}{', in use' if row.in_use else ''}"}
            for row in version_rows(self._entries, self._visitor.units)
        ]
        self._table.update_rows(rows)
        self._table.set_visibility(bool(rows))
        self._back.set_enabled(before_use(self._entries) is not None)

    def _choose(self) -> None:
        self._chosen = int(self._table.selected[0]["version"]) if self._table.selected else None

    def _draw(self, axis: AxisState) -> None:
        units, dark = self._visitor.units, self._visitor.dark
        chosen = next((e for e in self._entries if e.version == self._chosen and e.result is not None), None)
        key = (self._read, self._chosen, len(self._entries), units.name, dark)
        if self._kind.value == "screw":
            points = axis.screw.points
            if chosen is not None and chosen.result is not None:
                points = chosen.result.learned.learned().points
            self._left.show(key, lambda: screw_figure(points, units, dark=dark) or {"data": [], "layout": {}})
            self._right.element.set_visibility(False)
            return
        drawn = []
        if axis.learned is not None:
            drawn.append(Drawn(f"version {axis.version}, in use", from_state(axis.learned)))
        if chosen is not None and chosen.result is not None and chosen.version != axis.version:
            drawn.append(Drawn(f"version {chosen.version}", chosen.result.learned.learned()))
        self._right.element.set_visibility(True)
        self._left.show(key, lambda: duration_figure(drawn, units, dark=dark))
        self._right.show(key, lambda: amplitude_figure(drawn, units, dark=dark))

    async def _roll_back(self) -> None:
        axis, target = self._state(), before_use(self._entries)
        if axis is None or target is None:
            return
        kind = str(self._kind.value)
        to = f"version {target}" if target else "none: the axis then runs without"
        details = f"The {KINDS[kind]} in use becomes {to}. Nothing is deleted; it can be learned again."
        if await confirmed(f"Roll back axis {axis.name}?", details, "Roll back"):
            command = "roll_back" if kind == "pulse" else "roll_back_screw"
            await ask(self._bench, self._visitor, "command", command=command, axis=axis.name)


def _versions(kind: type[LearnedStore | ScrewStore], hello: Hello, axis: str) -> list[VersionEntry]:
    """From the disk. Raises ServoCtrlError."""
    return kind(Path(hello.learned_dir), load_machine(hello.machine_file)).versions(axis)
