"""The Motion page: choose, edit and check a program; start, hold, resume and abort it; watch its progress."""

import asyncio
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from nicegui import ui

from servo_ctrl.commands.local_messages import Hello, ProgramText
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.config.part_program import ReadingOptions
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.motion.line_card import LineCard
from servo_ctrl.hmi.motion.path_preview import PathPreview
from servo_ctrl.hmi.motion.program_run import ProgramRun
from servo_ctrl.hmi.motion.programs import (
    Preview,
    is_part_program_name,
    preview_of,
    programs_in,
    read_program,
    save_program,
)
from servo_ctrl.hmi.motion.step_form import StepForm
from servo_ctrl.hmi.shell.live_content import when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import (
    CROSS,
    add_tooltip,
    button,
    card,
    choice,
    confirmed,
    div,
    errors_notified,
    faint,
    named,
    note,
    notify,
    problem_text,
)

TITLE = word("Motion")
_ONE_CHECK = asyncio.Semaphore(1)
"""Limits the process to one check of a program at a time, because STOP is served by the same process."""
PATIENCE_S = 3.0
"""Duration of a check from which the page shows the elapsed time, seconds; chosen."""


def build(page: OpenPage) -> None:
    """Build the content of the page."""

    def make(hello: Hello) -> Sequence[Callable[[MachineStatus], None]]:
        run = ProgramRun(page)
        with div("bench-wide"):
            with div("bench-column"):
                preview = PathPreview(page)
                line = LineCard(page)
            ProgramEditor(page, hello, run, preview)
        return run.refresh, preview.refresh, line.refresh

    when_connected(page, make)


class ProgramEditor:
    """The card of the program that is being edited, as a form or as text; each change is checked."""

    def __init__(self, page: OpenPage, hello: Hello, run: ProgramRun, preview: PathPreview) -> None:
        self._page, self._run, self._preview = page, run, preview
        self._axes = [axis.name for axis in hello.axes]
        self._machine_file = Path(hello.machine_file)
        self._directory = page.services.programs or self._machine_file.parent / "programs"
        self._name, self._text = "", ""
        self._checks = 0
        """Number of the newest check; an older one must not show its result."""
        with card(tr("Program"), "editor"):
            self._choice = choice(
                [], tr("from the programs directory"), "program-choice", on_change=self._open
            )
            self._verdict = note("program-verdict", "").props("role=status aria-live=polite")
            with ui.tabs().props("dense no-caps align=left") as tabs:
                as_form = ui.tab("form", tr("Form")).mark("tab-form")
                as_text = ui.tab("text", tr("Text")).mark("tab-text")
            self._tabs, self._as_text = tabs, as_text
            with ui.tab_panels(tabs, value=as_form, animated=False).classes("bench-panels"):
                with ui.tab_panel(as_form):
                    self._form = StepForm([axis.name for axis in hello.axes], self._form_changed)
                    self._no_form = faint(tr("Pick a program, or write one as text."))
                with ui.tab_panel(as_text):
                    self._area = ui.textarea().mark("program-text").style("width: 100%")
                    named(self._area.props("outlined rows=24 spellcheck=false"), tr("Program text"))
                    self._area.on("change", self._text_changed)
                    self._entry = ui.number(tr("enter at line"), value=1, min=1, precision=0).mark(
                        "first-line"
                    )
                    self._entry.on("change", self._text_changed)
                    add_tooltip(
                        self._entry,
                        tr(
                            "Run from there, with what the lines before have set. The axes go first, "
                            "straight, to where the line before ends."
                        ),
                    )
            with div("bench-row"):
                self._save_name = ui.input(tr("save as")).mark("save-name").style("flex: 1 1 160px")
                button(tr("Save"), self._save, "save-program", icon="save")
        self._list_programs(first=True)

    def _list_programs(self, *, first: bool = False) -> None:
        names = programs_in(self._directory)
        status = self._page.link.status
        running = status.program.name if status else ""
        chosen = running if first and running in names else self._name
        self._choice.set_options(names, value=chosen if chosen in names else None)

    async def _open(self) -> None:
        name = self._choice.value
        if name is None or name == self._name:
            return
        with errors_notified():
            text = await asyncio.to_thread(read_program, self._directory, name)
            self._name = name
            self._save_name.set_value(name)
            self._area.set_value(text)
            self._entry.set_value(1)
            await self._text_changed()

    async def _text_changed(self) -> None:
        text = self._area.value or ""
        has_form = self._form.show(text)
        self._no_form.set_text(tr("This program can be edited as text only."))
        self._no_form.set_visibility(not has_form)
        self._entry.set_visibility(is_part_program_name(self._name))
        if not has_form:
            self._tabs.set_value(self._as_text)
        await self._check(text)

    async def _form_changed(self, text: str) -> None:
        self._area.set_value(text)
        await self._check(text)

    async def _check(self, text: str) -> None:
        """Check a text in a thread and show the verdict, unless a newer check has started."""
        self._text = text
        self._checks += 1
        number, name = self._checks, self._name or "program.toml"
        first_line = int(self._entry.value or 1) if is_part_program_name(name) else 1
        reading = self._reading(first_line)
        self._run.offer(None)
        self._show_verdict(tr("is being checked …"))

        async def check() -> Preview | None:
            async with _ONE_CHECK:
                if number != self._checks:
                    return None
                return await asyncio.to_thread(preview_of, self._machine_file, name, text, reading)

        preview, problem = None, ""
        try:
            preview = await self._awaited(asyncio.create_task(check()), number)
        except Exception as error:  # noqa: BLE001  # any error ends the check, and the verdict shows it
            problem = problem_text(error)
        if number != self._checks:
            return
        self._preview.show(preview)
        if preview is None:
            self._show_verdict(f"{CROSS} {problem}", "bad")
            return
        self._run.offer(ProgramText(name=name, text=text, first_line=first_line))
        self._show_verdict(
            tr("✓ {name}: within the limits, from home{entry}", name=name, entry=self._entered(preview))
        )

    async def _awaited(self, check: asyncio.Task[Preview | None], number: int) -> Preview | None:
        """Wait for a check; show the time that a long one has taken, unless a newer one has started."""
        began_s = time.monotonic()
        while not (await asyncio.wait({check}, timeout=PATIENCE_S))[0]:
            if number == self._checks:
                elapsed_s = time.monotonic() - began_s
                self._show_verdict(tr("is being checked, for {elapsed_s:.0f} s …", elapsed_s=elapsed_s))
        return await check

    def _reading(self, first_line: int) -> ReadingOptions:
        """Return what the controller will read a part program with, as far as the page knows."""
        status = self._page.link.status
        offsets = status.program.offsets_m if status is not None else ()
        zeros = {offset.name: dict(zip(self._axes, offset.zero_m, strict=False)) for offset in offsets}
        return ReadingOptions(work_offsets_m=zeros, first_line=max(first_line, 1))

    def _entered(self, preview: Preview) -> str:
        if preview.entry is None:
            return ""
        length = self._page.units.length
        places = zip(self._axes, preview.entry.position_m, strict=False)
        where = ", ".join(f"{axis} {length.with_unit(at_m)}" for axis, at_m in places)
        entry = preview.entry
        return tr(
            ". Enters at line {line} with {words}; goes first, straight, to {where}",
            line=entry.line,
            words=entry.words,
            where=where,
        )

    def _show_verdict(self, verdict: str, tone: str = "") -> None:
        self._verdict.set_text(verdict)
        self._verdict.classes(tone, remove="" if tone else "bad")

    async def _save(self) -> None:
        name = (self._save_name.value or "").strip()
        if not self._page.permits(Role.OPERATE):
            return
        exists = name in programs_in(self._directory)
        if exists and not await confirmed(
            tr("Replace {name}?", name=name), tr("The file of that name is lost."), tr("Replace")
        ):
            return
        with errors_notified():
            await asyncio.to_thread(save_program, self._directory, name, self._text)
            self._name = name
            self._list_programs()
            notify(tr("{name} is saved.", name=name), "positive")
            await self._check(self._text)
