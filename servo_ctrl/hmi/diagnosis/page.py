"""The Reconcile page: diagnoses recordings against a model, and puts the repaired model into use."""

from collections.abc import Awaitable, Callable, Sequence
from functools import partial
from pathlib import Path

from nicegui import run, ui

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.diagnosis.diagnoses import Diagnoses, diagnoses_of
from servo_ctrl.hmi.diagnosis.job_files import FoundRecording, models_in, recordings_below
from servo_ctrl.hmi.diagnosis.result import DiagnosisResult
from servo_ctrl.hmi.languages.controller_messages import diagnosis_text
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.job_view import STATES, JobView
from servo_ctrl.hmi.shell.live_content import Rebuilt, when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import button, card, choice, div, errors_notified, faint, named
from servo_ctrl.hmi.shell.program_jobs import Job, JobState
from servo_ctrl.hmi.shell.units import UnitSystem, duration_text

TITLE = word("Reconcile")
BOX_STYLE = "width: 100%; min-height: 44px; overflow-wrap: anywhere"


def build(page: OpenPage) -> None:
    """Build the content of the page."""
    diagnoses = diagnoses_of(page.services.recordings)
    when_connected(page, lambda hello: [DiagnosisCards(page, hello, diagnoses).refresh])


class DiagnosisCards:
    """The files to choose, the diagnosis that runs or was opened, and its result."""

    def __init__(self, page: OpenPage, hello: Hello, diagnoses: Diagnoses) -> None:
        self._page, self._diagnoses = page, diagnoses
        self._shown: Job | None = None
        self._newest: Job | None = None
        self._shown_result: tuple[str, JobState] | None = None
        with div("bench-wide"):
            with div("bench-column"):
                FilePicker(page, hello, self._start)
            with card(tr("Diagnosis"), "diagnosis"):
                self._build_job()
        self._result = DiagnosisResult(page, hello, diagnoses)

    def _build_job(self) -> None:
        self._view = JobView(tr("Progress of the diagnosis"), diagnosis_text, self._cancel)
        self._others = Rebuilt(div("bench-column").mark("jobs"), self._show_others)

    def refresh(self, _status: MachineStatus | None = None) -> None:
        """Show the progress of the diagnosis, and its result once it has ended."""
        jobs = self._diagnoses.jobs
        if jobs and jobs[-1] is not self._newest:  # a new one is shown to everybody
            self._newest = self._shown = jobs[-1]
        job = self._shown
        self._view.show(job, running=self._diagnoses.running is not None)
        if job is None:
            return
        if (job.key, job.state) != self._shown_result:
            self._shown_result = (job.key, job.state)
            self._others.show([(other, other.state) for other in reversed(jobs) if other is not job])
            self._result.show(job if job.state is JobState.DONE else None)

    def _show_others(self, jobs: Sequence[tuple[Job, JobState]]) -> None:
        for job, state in jobs:
            text = (
                f"{job.started:%Y-%m-%d %H:%M} {tr(STATES[state][0])}, {recordings_text(len(job.subjects))}"
            )
            ui.button(text, on_click=partial(self._open, job)).props("flat align=left dense")

    def _open(self, job: Job) -> None:
        self._shown = job
        self.refresh()

    async def _start(self, recordings: list[Path], model: Path) -> None:
        if self._page.permits(Role.OPERATE):
            with errors_notified("warning"):
                await self._diagnoses.start(recordings, model, self._page.who)
            self.refresh()

    async def _cancel(self) -> None:
        if self._page.permits(Role.OPERATE):
            await self._diagnoses.cancel(self._page.who)


class FilePicker:
    """The card for choosing the files; `start` is called with the recordings and the model."""

    def __init__(
        self, page: OpenPage, hello: Hello, start: Callable[[list[Path], Path], Awaitable[None]]
    ) -> None:
        self._page, self._start = page, start
        self._machine_dir = Path(hello.machine_file).parent
        self._directories = [page.services.recordings]
        if hello.record_dir is not None:
            self._directories.append(Path(hello.record_dir).parent)
        self._boxes: dict[Path, ui.checkbox] = {}
        with card(tr("Recordings and model"), "pick"):
            self._list = div().style("max-height: 260px; overflow: auto").mark("recordings")
            self._list.props("role=group")
            named(self._list, tr("Recordings"))
            with div("bench-row"):
                self._path = ui.input(tr("or a path on the controller")).mark("recording-path")
                self._path.style("flex: 1 1 150px").on("keydown.enter", self._add)
                button(tr("Add"), self._add, "add-recording")
                refresh = ui.button(icon="refresh", on_click=self._search)
                named(refresh.props("flat"), tr("Search for recordings again"))
            self._model = choice(
                [], tr("nominal model"), "model", with_input=True, new_value_mode="add-unique"
            )
            self._model.props["hint"] = tr("or type a path and press Enter")
            with div("bench-row"):
                self._run = button(
                    tr("Run diagnosis"), self._begin, "run-diagnosis", icon="play_arrow", look="unelevated"
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
                faint(tr("No recordings here yet: run with --record, or name a path below."))
            for path, recording in found.items():
                self._add_box(path, recording_text(recording, self._page.units))
                faint(excitation_text(recording)).classes("bench-under-box").mark("recording-tells")
        for path in chosen:
            self._pick(path)
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
        self._pick(Path(text).resolve())
        self._path.set_value("")

    def _pick(self, path: Path) -> None:
        if path not in self._boxes:
            with self._list:
                self._add_box(path, str(path))
        self._boxes[path].set_value(True)

    def _chosen(self) -> list[Path]:
        return [path for path, box in self._boxes.items() if box.value]

    def _show_count(self) -> None:
        number = len(self._chosen())
        self._count.set_text(tr("{recordings} picked", recordings=recordings_text(number)))
        self._run.set_enabled(number > 0)

    async def _begin(self) -> None:
        await self._start(self._chosen(), self._machine_dir / str(self._model.value or "").strip())


def recordings_text(number: int) -> str:
    """Return `1 recording`, `2 recordings`."""
    return tr("1 recording") if number == 1 else tr("{number} recordings", number=number)


LEAST_S = 0.5
"""Bounds a recording from below, seconds; from `reconcile diagnose`, which refuses shorter ones."""
RESTS_M = 1e-4
"""Bounds the travel of an axis at rest, metres; chosen: it is below presliding."""


def recording_text(recording: FoundRecording, units: UnitSystem) -> str:
    """Return name, moment, program, length and the travel of each axis, in one line."""
    travels = (f"{axis.name.upper()} {units.length.with_unit(axis.travel_m)}" for axis in recording.axes)
    parts = (
        recording.name,
        recording.started.replace("T", " ")[:16],
        Path(recording.program).name,
        duration_text(recording.length_s) if recording.length_s else "",
        ", ".join(travels),
    )
    return " \N{MIDDLE DOT} ".join(part for part in parts if part)


def excitation_text(recording: FoundRecording) -> str:
    """Return whether the motions suffice for a diagnosis, or for which axes they do not, and why."""
    if not recording.length_s:
        return f"\N{WARNING SIGN} {tr('no rows, or damaged')}"
    reasons = []
    if recording.length_s < LEAST_S:
        reasons.append(tr("too short: identification needs at least {least:g} s", least=LEAST_S))
    for axis in recording.axes:
        name = axis.name.upper()
        if axis.travel_m < RESTS_M:
            reasons.append(tr("{axis} stands still: it cannot be identified", axis=name))
        elif not axis.both_ways:
            reasons.append(
                tr(
                    "{axis} moves in one direction only: friction and a constant force cannot be separated",
                    axis=name,
                )
            )
    return (
        f"\N{WARNING SIGN} {'; '.join(reasons)}" if reasons else tr("✓ every axis moves in both directions")
    )
