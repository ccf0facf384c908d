"""The card for choosing the recordings and the model of a diagnosis."""

from collections.abc import Awaitable, Callable
from pathlib import Path

from nicegui import run, ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.hmi.diagnosis.job_files import FoundRecording, models_in, recordings_below
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, card, div, faint

Start = Callable[[list[Path], Path], Awaitable[None]]

BOX_STYLE = "width: 100%; min-height: 44px; overflow-wrap: anywhere"


class FilePicker:
    """The card; `start` is called with the chosen recordings and model."""

    def __init__(self, page: OpenPage, hello: Hello, start: Start) -> None:
        self._start = start
        self._machine_dir = Path(hello.machine_file).parent
        self._directories = [page.services.directories.recordings]
        if hello.record_dir is not None:
            self._directories.append(Path(hello.record_dir).parent)
        self._boxes: dict[Path, ui.checkbox] = {}
        with card("Recordings and model", "pick"):
            self._list = ui.element("div").style("max-height: 260px; overflow: auto").mark("recordings")
            self._list.props('role=group aria-label="Recordings"')
            with div("bench-row"):
                self._path = ui.input("or a path on the controller").mark("recording-path")
                self._path.style("flex: 1 1 150px").on("keydown.enter", self._add)
                button("Add", self._add, "add-recording")
                refresh = ui.button(icon="refresh", on_click=self._search)
                refresh.props('flat aria-label="Look for recordings again"')
            self._model = ui.select([], label="nominal model", with_input=True, new_value_mode="add-unique")
            self._model.props('options-dense hint="or type a path and press Enter"').mark("model")
            with div("bench-row"):
                self._run = button(
                    "Run diagnosis", self._begin, "run-diagnosis", icon="play_arrow", look="unelevated"
                )
                self._count = faint().mark("picked")
        ui.timer(0.0, self._search, once=True)

    async def _search(self) -> None:
        found: dict[Path, FoundRecording] = {}
        for directory in self._directories:
            for recording in await run.io_bound(recordings_below, directory) or ():
                found.setdefault(recording.path.resolve(), recording)
        models = await run.io_bound(models_in, self._machine_dir) or []
        chosen = self._chosen()
        self._list.clear()
        self._boxes = {}
        with self._list:
            if not found:
                faint("No recordings here yet: run with --record, or name a path below.")
            for path, recording in found.items():
                moment = recording.started.replace("T", " ")[:16]
                texts = (recording.name, moment, Path(recording.program).name)
                self._add_box(path, " \N{MIDDLE DOT} ".join(text for text in texts if text))
            for path in chosen:
                if path not in self._boxes:
                    self._add_box(path, str(path))
                self._boxes[path].set_value(True)
        names = [path.name for path in models]
        value = self._model.value or (names[0] if names else None)
        self._model.set_options(list(dict.fromkeys([*names, *([value] if value else [])])), value=value)
        self._show_count()

    def _add_box(self, path: Path, text: str) -> None:
        box = ui.checkbox(text, on_change=self._show_count).style(BOX_STYLE)
        self._boxes[path] = box.mark("recording").props(f'data-path="{path.name}"')

    def _add(self) -> None:
        text = str(self._path.value or "").strip()
        if not text:
            return
        path = Path(text).resolve()
        if path not in self._boxes:
            with self._list:
                self._add_box(path, str(path))
        self._boxes[path].set_value(True)
        self._path.set_value("")

    def _chosen(self) -> list[Path]:
        return [path for path, box in self._boxes.items() if box.value]

    def _show_count(self) -> None:
        number = len(self._chosen())
        self._count.set_text(f"{recordings_text(number)} picked")
        self._run.set_enabled(number > 0)

    async def _begin(self) -> None:
        await self._start(self._chosen(), self._machine_dir / str(self._model.value or "").strip())


def recordings_text(number: int) -> str:
    """`1 recording`, `2 recordings`."""
    return f"{number} recording{'' if number == 1 else 's'}"
