"""The Motion page: choose, edit and check a program; start, hold, resume and abort it; watch its progress."""

from collections.abc import Callable

from servo_ctrl.commands.local_messages import Hello
from servo_ctrl.hmi.motion.editor import ProgramEditor
from servo_ctrl.hmi.motion.path_preview import PathPreview
from servo_ctrl.hmi.motion.program_run import ProgramRun
from servo_ctrl.hmi.shell.live_content import when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import div

TITLE = "Motion"


def build(page: OpenPage) -> None:
    """Build the content of the page."""

    def make(hello: Hello) -> Callable[[], None]:
        run = ProgramRun(page)
        with div("bench-wide"):
            preview = PathPreview(page)
            ProgramEditor(page, hello, run, preview)

        def refresh() -> None:
            if page.status is not None:
                run.refresh(page.status)
                preview.refresh()

        return refresh

    when_connected(page, make)
