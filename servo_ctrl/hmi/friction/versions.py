"""The learned versions on the Friction page: those in the store, and one of them against the one in use."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nicegui import background_tasks, run, ui

from servo_ctrl.commands.axis_status import AxisStatus
from servo_ctrl.commands.command import Command
from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.objections import NOTHING_IN_USE
from servo_ctrl.config.load import load_machine
from servo_ctrl.hmi.friction.figures import (
    pulse_figure,
    roll_back_target,
    screw_figure,
    version_rows,
    waveform_figure,
)
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import tr, translated, word
from servo_ctrl.hmi.shell.live_content import Plot
from servo_ctrl.hmi.shell.offered import offer
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, card, confirmed, div, note, problem_text, toggle
from servo_ctrl.learned.store import LearnedStore, ScrewStore, VersionEntry, VersionStore, WaveformStore

KINDS = {"pulse": word("friction pulse"), "screw": word("screw"), "waveform": word("waveform")}
ROLL_BACK = {
    "pulse": Command.ROLL_BACK,
    "screw": Command.ROLL_BACK_SCREW,
    "waveform": Command.ROLL_BACK_WAVEFORM,
}
STORES: Mapping[str, type[VersionStore[Any]]] = {
    "pulse": LearnedStore,
    "screw": ScrewStore,
    "waveform": WaveformStore,
}
COLUMNS = {
    "name": (word("version"), "left"),
    "gain": (word("J before and after"), "left"),
    "learned_at": (word("learned at"), "left"),
    "learner": (word("learner"), "left"),
    "strokes": (word("strokes"), "right"),
    "problem": ("", "left"),
}
"""By field: heading and alignment."""
TABLE_CSS = ".bench-versions .q-td { height: 44px; padding: 2px 6px; }"


class VersionsCard:
    """The card of the learned versions."""

    def __init__(self, page: OpenPage, hello: Hello) -> None:
        self._page, self._hello = page, hello
        self._entries: list[VersionEntry] = []
        self._loaded: tuple[str, str, int] = ("", "", 0)
        """Axis, kind, and the version in use for which the entries were read."""
        self._chosen: int | None = None
        """The version that is drawn beside the one in use."""
        ui.add_css(TABLE_CSS)
        names = [axis.name for axis in hello.axes]
        with card(tr("Learned results"), "learned"):
            with div("bench-row"):
                self._axis = toggle(names, "learned-axis", names[0])
                self._kind = toggle(translated(KINDS), "learned-kind", "pulse")
                ui.space()
                self._roll_back_button = button(tr("Roll back"), self._roll_back, "roll-back", icon="undo")
            self._problem = note("learned-problem")
            columns = [
                {"name": name, "label": tr(label) if label else "", "field": name, "align": align}
                for name, (label, align) in COLUMNS.items()
            ]
            self._table = ui.table(rows=[], columns=columns, row_key="version", selection="single")
            self._table.props("flat dense hide-pagination :rows-per-page-options=[0] wrap-cells")
            self._table.classes("bench-versions").mark("versions").on_select(self._choose)
            with div("bench-grid"):
                self._left = Plot("duration-plot", tr("Duration of the pulse over the reverse acceleration"))
                self._right = Plot(
                    "amplitude-plot", tr("Amplitude of the pulse over the reverse acceleration")
                )

    def refresh(self, status: MachineStatus) -> None:
        """Read the store again where the axis, the kind or the version in use has changed, and draw."""
        axis = next((axis for axis in status.axes if axis.name == self._axis.value), None)
        if axis is None:
            return
        kind = str(self._kind.value)
        wanted = (axis.name, kind, version_in_use(axis, kind))
        if wanted != self._loaded:
            self._loaded, self._chosen = wanted, None
            background_tasks.create(self._load_on_page(), name="learned versions")
        nothing = "" if roll_back_target(self._entries) is not None else NOTHING_IN_USE[ROLL_BACK[kind]]
        offer(self._page, [self._roll_back_button], status, ROLL_BACK[kind], own=controller_text(nothing))
        self._draw(axis)

    async def _load_on_page(self) -> None:
        with self._problem:  # a task has no page of its own, whose language it would know
            await self._load()

    async def _load(self) -> None:
        wanted = axis, kind, in_use = self._loaded
        problem = ""
        try:
            entries = await run.io_bound(versions_of, self._hello, axis, kind) or []
        except Exception as error:  # noqa: BLE001  # a table without a reason would be taken for an empty one
            entries, problem = [], problem_text(error)
        if wanted != self._loaded:
            return  # another axis or kind was chosen meanwhile
        self._entries = entries
        if not entries and not problem:
            missing = tr(
                "Version {version} is in use, but there is none in {place}.",
                version=in_use,
                place=self._hello.learned_dir,
            )
            problem = missing if in_use else tr("Nothing was learned yet.")
        self._problem.set_text(problem)
        self._table.update_rows(version_rows(entries, self._page.units))
        self._table.set_visibility(bool(entries))

    def _choose(self) -> None:
        self._chosen = int(self._table.selected[0]["version"]) if self._table.selected else None

    def _draw(self, axis: AxisStatus) -> None:
        look = self._page.look
        entry = next((e for e in self._entries if e.version == self._chosen), None)
        key = (self._loaded, self._chosen, len(self._entries), look)
        kind = self._kind.value
        self._right.element.set_visibility(kind == "pulse")
        if kind == "waveform":
            shown = entry or next((e for e in self._entries if e.in_use), None)
            self._left.show(key, lambda: waveform_figure(learned_of(shown), self._hello.period_s, look))
            return
        chosen = learned_of(entry)
        if kind == "screw":
            points = axis.screw.points if chosen is None else chosen.points
            self._left.show(key, lambda: screw_figure(points, look))
            return
        functions = {}
        if axis.learned is not None:
            functions[tr("version {version}, in use", version=axis.version)] = axis.learned
        if chosen is not None and self._chosen != axis.version:
            functions[tr("version {version}", version=self._chosen)] = chosen
        self._left.show(key, lambda: pulse_figure(functions, "durations", look))
        self._right.show(key, lambda: pulse_figure(functions, "amplitudes", look))

    async def _roll_back(self) -> None:
        (axis, kind, _), target = self._loaded, roll_back_target(self._entries)
        if target is None:
            return
        after = tr("version {version}", version=target) if target else tr("none: the axis then runs without")
        details = tr(
            "The {kind} in use becomes {after}. Nothing is deleted; it can be learned again.",
            kind=tr(KINDS[kind]),
            after=after,
        )
        if await confirmed(tr("Roll back axis {axis}?", axis=axis), details, tr("Roll back")):
            await self._page.command(ROLL_BACK[kind], axis)


def learned_of(entry: VersionEntry | None) -> Any:
    """Return what a version has learned; None without one, or where it cannot be used."""
    return None if entry is None or entry.result is None else entry.result.learned.learned()


def version_in_use(axis: AxisStatus, kind: str) -> int:
    """Return the version of a kind that acts on an axis, 0 = none."""
    return {"pulse": axis.version, "screw": axis.screw.version, "waveform": axis.waveform.version}[kind]


def versions_of(hello: Hello, axis: str, kind: str) -> list[VersionEntry]:
    """Read the versions of an axis from the disk. Raises ServoCtrlError."""
    return STORES[kind](Path(hello.learned_dir), load_machine(hello.machine_file)).versions(axis)
