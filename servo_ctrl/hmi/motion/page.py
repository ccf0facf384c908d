"""The Motion page: choose, edit and check a program; start, hold, resume and abort it; watch its progress."""

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path

from nicegui import ui

from servo_ctrl.commands.local_messages import Hello, ProgramText
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.hmi.access.users import Role
from servo_ctrl.hmi.motion.path_preview import PathPreview
from servo_ctrl.hmi.motion.program_run import ProgramRun
from servo_ctrl.hmi.motion.programs import preview_of, programs_in, read_program, save_program
from servo_ctrl.hmi.motion.step_form import StepForm
from servo_ctrl.hmi.shell.live_content import when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import (
    CHECK,
    CROSS,
    ELLIPSIS,
    button,
    card,
    choice,
    confirmed,
    div,
    errors_notified,
    faint,
    note,
    notify,
)

TITLE = "Motion"
_ONE_CHECK = asyncio.Semaphore(1)
"""The process checks one program at a time: STOP must not wait behind ten of them."""


def build(page: OpenPage) -> None:
    """Build the content of the page."""

    def make(hello: Hello) -> Sequence[Callable[[MachineStatus], None]]:
        run = ProgramRun(page)
        with div("bench-wide"):
            preview = PathPreview(page)
            ProgramEditor(page, hello, run, preview)
        return run.refresh, preview.refresh

    when_connected(page, make)


class ProgramEditor:
    """The card of the program that is being edited, as a form or as text; each change is checked."""

    def __init__(self, page: OpenPage, hello: Hello, run: ProgramRun, preview: PathPreview) -> None:
        self._page, self._run, self._preview = page, run, preview
        self._machine_file = Path(hello.machine_file)
        self._directory = page.services.programs or self._machine_file.parent / "programs"
        self._name, self._text = "", ""
        self._checks = 0
        """Number of the newest check; an older one must not show its result."""
        with card("Program", "editor"):
            self._choice = choice([], "from the programs directory", "program-choice", on_change=self._open)
            self._verdict = note("program-verdict", "").props("role=status aria-live=polite")
            with ui.tabs().props("dense no-caps align=left") as tabs:
                as_form = ui.tab("Form").mark("tab-form")
                as_text = ui.tab("Text").mark("tab-text")
            self._tabs, self._as_text = tabs, as_text
            with ui.tab_panels(tabs, value=as_form, animated=False).classes("bench-panels"):
                with ui.tab_panel(as_form):
                    self._form = StepForm([axis.name for axis in hello.axes], self._form_changed)
                    self._no_form = faint("This program can be edited as text only.")
                with ui.tab_panel(as_text):
                    self._area = ui.textarea().mark("program-text").style("width: 100%")
                    self._area.props('outlined rows=24 spellcheck=false aria-label="Program text"')
                    self._area.on("change", self._text_changed)
            with div("bench-row"):
                self._save_name = ui.input("save as").mark("save-name").style("flex: 1 1 160px")
                button("Save", self._save, "save-program", icon="save")
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
            await self._text_changed()

    async def _text_changed(self) -> None:
        text = self._area.value or ""
        has_form = self._form.show(text)
        self._no_form.set_visibility(not has_form)
        if not has_form:
            self._tabs.set_value(self._as_text)
        await self._check(text)

    async def _form_changed(self, text: str) -> None:
        self._area.set_value(text)
        await self._check(text)

    async def _check(self, text: str) -> None:
        """Check a text in a thread and show the verdict, unless a later check has begun meanwhile."""
        self._text = text
        self._checks += 1
        number, name = self._checks, self._name or "program.toml"
        self._run.offer(None)
        self._show_verdict(f"is being checked {ELLIPSIS}")
        async with _ONE_CHECK:
            if number != self._checks:
                return
            try:
                preview = await asyncio.to_thread(preview_of, self._machine_file, name, text)
            except ServoCtrlError as error:
                if number == self._checks:
                    self._preview.show(None)
                    self._show_verdict(f"{CROSS} {error}", "bad")
                return
        if number == self._checks:
            self._preview.show(preview)
            self._run.offer(ProgramText(name=name, text=text))
            self._show_verdict(f"{CHECK} {name}: within the limits, from home")

    def _show_verdict(self, verdict: str, tone: str = "") -> None:
        self._verdict.set_text(verdict)
        self._verdict.classes(tone, remove="" if tone else "bad")

    async def _save(self) -> None:
        name = (self._save_name.value or "").strip()
        if not self._page.permits(Role.OPERATE):
            return
        exists = name in programs_in(self._directory)
        if exists and not await confirmed(f"Replace {name}?", "The file of that name is lost.", "Replace"):
            return
        with errors_notified():
            await asyncio.to_thread(save_program, self._directory, name, self._text)
            self._name = name
            self._list_programs()
            notify(f"{name} is saved.", "positive")
            await self._check(self._text)
