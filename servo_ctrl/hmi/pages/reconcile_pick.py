"""Picking recordings and a model for a diagnosis."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import run, ui

from servo_ctrl.hmi.parts import card
from servo_ctrl.hmi.reconcile_job_files import models_beside, recordings_below

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.bench import Bench, Visitor
    from servo_ctrl.hmi.reconcile_job_files import Recorded
    from servo_ctrl.hmi.reconcile_room import Room

    Start = Callable[[list[Path], Path], Awaitable[None]]

BOX_STYLE = "width: 100%; min-height: 44px; overflow-wrap: anywhere"


class Picker:
    """The card with the files; `start` is called with what was picked."""

    def __init__(self, bench: Bench, visitor: Visitor, hello: Hello, room: Room, start: Start) -> None:
        self._visitor, self._room, self._start = visitor, room, start
        self._machine_dir = Path(hello.machine_file).parent
        self._directories = [bench.directories.recordings]
        if hello.record_dir is not None:
            self._directories.append(Path(hello.record_dir).parent)
        self._boxes: dict[Path, ui.checkbox] = {}
        with card("Recordings and model", "pick"):
            self._list = ui.element("div").style("max-height: 260px; overflow: auto").mark("recordings")
            self._list.props('role=group aria-label="Recordings"')
            with ui.element("div").classes("bench-row"):
                self._path = ui.input("or a path on the controller").mark("recording-path")
                self._path.props("outlined dense").style("flex: 1 1 150px").on("keydown.enter", self._add)
                ui.button("Add", on_click=self._add).props("outline").mark("add-recording")
                ui.button(icon="refresh", on_click=self._look).props(
                    'flat aria-label="Look for recordings again"'
                )
            self._model = ui.select([], label="nominal model", with_input=True, new_value_mode="add-unique")
            self._model.props('outlined dense options-dense hint="or type a path and press Enter"').mark(
                "model"
            )
            with ui.element("div").classes("bench-row"):
                self._go = ui.button("Run diagnosis", icon="play_arrow", on_click=self._begin)
                self._go.props("unelevated").mark("run-diagnosis")
                self._picked = ui.label().classes("bench-faint").mark("picked")
        ui.timer(0.0, self._look, once=True)

    async def _look(self) -> None:
        found: dict[Path, Recorded] = {}
        for directory in self._directories:
            for one in await run.io_bound(recordings_below, directory) or ():
                found.setdefault(one.path.resolve(), one)
        models = await run.io_bound(models_beside, self._machine_dir) or []
        chosen = self._chosen()
        self._list.clear()
        self._boxes = {}
        with self._list:
            if not found:
                ui.label("No recordings here yet: run with --record, or name a path below.").classes(
                    "bench-faint"
                )
            for path, one in found.items():
                words = (one.name, one.started.replace("T", " ")[:16], Path(one.program).name)
                self._box(path, " \N{MIDDLE DOT} ".join(word for word in words if word))
            for path in chosen:
                if path not in self._boxes:
                    self._box(path, str(path))
                self._boxes[path].set_value(True)
        names = [path.name for path in models]
        value = self._model.value or (names[0] if names else None)
        self._model.set_options(list(dict.fromkeys([*names, *([value] if value else [])])), value=value)
        self._count()

    def _box(self, path: Path, text: str) -> None:
        box = ui.checkbox(text, on_change=self._count).style(BOX_STYLE)
        box.mark("recording").props(f'data-path="{path.name}"')
        self._boxes[path] = box

    def _add(self) -> None:
        text = str(self._path.value or "").strip()
        if not text:
            return
        path = Path(text).resolve()
        if path not in self._boxes:
            with self._list:
                self._box(path, str(path))
        self._boxes[path].set_value(True)
        self._path.set_value("")

    def _chosen(self) -> list[Path]:
        return [path for path, box in self._boxes.items() if box.value]

    def _count(self) -> None:
        number = len(self._chosen())
        self._picked.set_text(f"{counted(number)} picked")
        self._go.set_enabled(number > 0)

    async def _begin(self) -> None:
        await self._start(self._chosen(), self._machine_dir / str(self._model.value or "").strip())


def counted(number: int) -> str:
    """`1 recording`, `2 recordings`."""
    return f"{number} recording{'' if number == 1 else 's'}"
