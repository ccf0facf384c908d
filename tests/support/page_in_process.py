"""A page in the process of the test, on the simulated browser of NiceGUI; by default of a stub machine."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any

from nicegui import ElementFilter, ui
from nicegui.testing import User
from stub_link import StubLink

from servo_ctrl.hmi.access.control_right import ControlRight
from servo_ctrl.hmi.access.users import Access, Role
from servo_ctrl.hmi.shell.open_page import OpenPage, PageServices
from servo_ctrl.hmi.shell.parts import notify_unexpected

LIMIT_S = 60.0
BROWSER = "browser"


class PageInProcess:
    """The page of one visitor, who has control; `link` is the machine behind it."""

    def __init__(self, user: User, directory: Path, link: Any = None) -> None:
        self.user, self.link = user, link or StubLink()
        (directory / "programs").mkdir()
        control = ControlRight()
        control.page_opened(BROWSER, "page")
        control.take(BROWSER, "local", "127.0.0.1", 0.0)
        self._services = PageServices(self.link, Access(), control, directory, directory / "programs")

    async def show(self, build: Callable[[OpenPage], None]) -> None:
        """Open the page that `build` makes."""

        @ui.page("/")
        def page() -> None:
            notify_unexpected()
            build(OpenPage(self._services, "local", Role.CONFIGURE, "127.0.0.1", BROWSER))

        await self.user.open("/")

    def release_control(self) -> None:
        """Take the control right from the visitor: nobody has it then."""
        self._services.control.release(BROWSER, 0.0)

    def text(self, mark: str) -> str:
        """Return the text of a label, "" while it is hidden."""
        shown = [label.text for label in self._labels() if mark in label._markers]
        return shown[0] if shown else ""

    def shows(self, text: str) -> bool:
        """Return whether a label contains this text."""
        return any(text in label.text for label in self._labels())

    def _labels(self) -> list[ui.label]:
        assert self.user.client is not None
        with self.user.client.content:
            return [label for label in ElementFilter(kind=ui.label) if label.visible]

    async def until(self, condition: Callable[[], bool], limit_s: float = LIMIT_S) -> None:
        """Let the page's loop run until the condition holds."""
        async with asyncio.timeout(limit_s):
            while not condition():  # noqa: ASYNC110  # a changed text raises no event
                await asyncio.sleep(0.02)
