"""Motion: pick, edit and check a program; start, hold, resume, abort it; see how far it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

from servo_ctrl.hmi.pages.motion_edit import Editor
from servo_ctrl.hmi.pages.motion_preview import PathPreview
from servo_ctrl.hmi.pages.motion_run import ProgramRun
from servo_ctrl.hmi.parts import when_greeted

if TYPE_CHECKING:
    from collections.abc import Callable

    from servo_ctrl.config.local_messages import Hello
    from servo_ctrl.hmi.bench import Bench, Visitor

TITLE = "Motion"


def build(bench: Bench, visitor: Visitor) -> None:
    """The page's content."""

    def make(hello: Hello) -> Callable[[], None]:
        run = ProgramRun(bench, visitor)
        with ui.element("div").classes("bench-wide bench-turned"):
            preview = PathPreview(bench, visitor)
            Editor(bench, visitor, hello, run, preview)

        def refresh() -> None:
            if bench.link.status is not None:
                run.refresh(bench.link.status)
                preview.refresh()

        return refresh

    when_greeted(bench, make)
