"""An error that nobody expected: the page says it, and nothing stays as if it were still under way."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any, cast

import pytest
from nicegui import ElementFilter, ui
from nicegui.testing import User
from nicegui.testing.user_simulation import user_simulation
from stub_link import StubLink

from servo_ctrl.hmi.access.control_right import ControlRight
from servo_ctrl.hmi.access.users import Access, Role
from servo_ctrl.hmi.bus import object_browser
from servo_ctrl.hmi.bus import page as bus
from servo_ctrl.hmi.motion import page as motion
from servo_ctrl.hmi.motion.programs import Preview, preview_of
from servo_ctrl.hmi.shell.live_content import when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage, PageServices
from servo_ctrl.hmi.shell.parts import configure_elements, notify_unexpected

LIMIT_S = 60.0
MACHINE = Path(__file__).parents[3] / "machines" / "xy_table" / "controller.toml"
Show = Callable[[Callable[[OpenPage], None]], Any]


@pytest.fixture
async def user() -> AsyncIterator[User]:
    async with user_simulation() as simulated:
        configure_elements()
        yield simulated


@pytest.fixture
def show(user: User, tmp_path: Path) -> Show:
    """Open a page of a ready stub machine: `await show(build)`."""
    (tmp_path / "programs").mkdir()
    (tmp_path / "programs" / "line.ngc").write_text("G1 X1 F600\nM2\n", encoding="utf-8")
    services = PageServices(
        cast("Any", StubLink()), Access(), ControlRight(), tmp_path, tmp_path / "programs"
    )

    async def open_it(build: Callable[[OpenPage], None]) -> None:
        @ui.page("/")
        def page() -> None:
            notify_unexpected()
            build(OpenPage(services, "local", Role.CONFIGURE, "127.0.0.1", "browser"))

        await user.open("/")

    return open_it


async def becomes_true(condition: Callable[[], bool]) -> None:
    """Let the page's loop run until the condition holds."""
    async with asyncio.timeout(LIMIT_S):
        while not condition():  # noqa: ASYNC110  # no event tells of a text that has changed
            await asyncio.sleep(0.02)


def text_of(user: User, mark: str) -> str:
    """The text of a label, "" while it is hidden."""
    assert user.client is not None
    with user.client.content:
        shown = [label.text for label in ElementFilter(kind=ui.label, marker=mark) if label.visible]
    return shown[0] if shown else ""


async def choose_program(user: User) -> None:
    (choice,) = user.find(marker="program-choice").elements
    cast("ui.select", choice).set_value("line.ngc")
    await becomes_true(lambda: text_of(user, "program-verdict") != "")


def broken(*_arguments: object) -> Any:
    raise ZeroDivisionError("the planner divides by nothing")


async def test_a_check_that_fails_unexpectedly_has_a_verdict(
    user: User, show: Show, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(motion, "preview_of", broken)
    await show(motion.build)
    await choose_program(user)
    await becomes_true(lambda: "ZeroDivisionError: the planner" in text_of(user, "program-verdict"))


async def test_a_check_that_takes_its_time_says_so(
    user: User, show: Show, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on = threading.Event()

    def slow(*arguments: Any) -> Preview:
        go_on.wait()
        return preview_of(MACHINE, *arguments[1:])

    monkeypatch.setattr(motion, "preview_of", slow)
    monkeypatch.setattr(motion, "PATIENCE_S", 0.01)
    await show(motion.build)
    await choose_program(user)
    await becomes_true(lambda: text_of(user, "program-verdict").startswith("is being checked, for "))
    go_on.set()
    await becomes_true(lambda: "within the limits" in text_of(user, "program-verdict"))


async def test_a_drive_description_that_cannot_be_read_leaves_no_reading_behind(
    user: User, show: Show, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(object_browser, "load_entries", broken)
    await show(bus.build)
    await becomes_true(lambda: "ZeroDivisionError" in text_of(user, "object-problem"))
    await user.should_not_see("Reading")


async def test_an_error_in_a_card_or_a_click_is_told_once_and_the_other_cards_go_on(
    user: User, show: Show
) -> None:
    refreshed = []

    def build(page: OpenPage) -> None:
        ui.button("break", on_click=broken).mark("break")
        when_connected(page, lambda _hello: [broken, refreshed.append])

    await show(build)
    await becomes_true(lambda: len(refreshed) > 2)
    user.find(marker="break").click()
    await becomes_true(lambda: bool(user.notify.messages))
    assert len([told for told in user.notify.messages if "divides by nothing" in told]) == 1
