"""An error that nobody expected: the page says it, and nothing stays as if it were still under way."""

import threading
from pathlib import Path
from typing import Any, cast

import pytest
from nicegui import ui
from page_in_process import PageInProcess

from servo_ctrl.hmi.bus import object_browser
from servo_ctrl.hmi.bus import page as bus
from servo_ctrl.hmi.motion import page as motion
from servo_ctrl.hmi.motion.programs import Preview, preview_of
from servo_ctrl.hmi.shell.live_content import when_connected
from servo_ctrl.hmi.shell.open_page import OpenPage
from servo_ctrl.hmi.shell.parts import confirmed

MACHINE = Path(__file__).parents[3] / "machines" / "xy_table" / "controller.toml"


async def choose_a_program(page: PageInProcess, directory: Path) -> None:
    (directory / "programs" / "line.ngc").write_text("G1 X1 F600\nM2\n", encoding="utf-8")
    await page.show(motion.build)
    (choice,) = page.user.find(marker="program-choice").elements
    cast("ui.select", choice).set_value("line.ngc")
    await page.until(lambda: page.text("program-verdict") != "")


def broken(*_arguments: object) -> Any:
    raise ZeroDivisionError("the planner divides by nothing")


async def test_a_check_that_fails_unexpectedly_has_a_verdict(
    shown_page: PageInProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(motion, "preview_of", broken)
    await choose_a_program(shown_page, tmp_path)
    await shown_page.until(lambda: "ZeroDivisionError: the planner" in shown_page.text("program-verdict"))


async def test_a_slow_check_reports_its_duration(
    shown_page: PageInProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    go_on = threading.Event()

    def slow(*arguments: Any) -> Preview:
        go_on.wait()
        return preview_of(MACHINE, *arguments[1:])

    monkeypatch.setattr(motion, "preview_of", slow)
    monkeypatch.setattr(motion, "PATIENCE_S", 0.01)
    await choose_a_program(shown_page, tmp_path)
    await shown_page.until(lambda: shown_page.text("program-verdict").startswith("is being checked, for "))
    go_on.set()
    await shown_page.until(lambda: "within the limits" in shown_page.text("program-verdict"))


async def test_a_drive_description_that_cannot_be_read_leaves_no_reading_behind(
    shown_page: PageInProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(object_browser, "load_entries", broken)
    await shown_page.show(bus.build)
    await shown_page.until(lambda: "ZeroDivisionError" in shown_page.text("object-problem"))
    await shown_page.user.should_not_see("Reading")


async def test_an_error_in_a_card_or_a_click_is_reported_once_and_the_other_cards_continue(
    shown_page: PageInProcess,
) -> None:
    refreshed = []

    def build(page: OpenPage) -> None:
        ui.button("break", on_click=broken).mark("break")
        when_connected(page, lambda _hello: [broken, refreshed.append])

    await shown_page.show(build)
    await shown_page.until(lambda: len(refreshed) > 2)
    told = shown_page.user.notify.messages
    shown_page.user.find(marker="break").click()
    await shown_page.until(lambda: bool(told))
    assert len([text for text in told if "divides by nothing" in text]) == 1


async def test_a_page_that_is_closed_under_a_question_answers_no(
    shown_page: PageInProcess, caplog: pytest.LogCaptureFixture
) -> None:
    answers = []

    async def ask() -> None:
        answers.append(await confirmed("Move it?", "It moves.", "Move"))

    await shown_page.show(lambda _page: ui.button("ask", on_click=ask).mark("ask"))
    shown_page.user.find(marker="ask").click()
    await shown_page.user.should_see("Move it?")
    assert shown_page.user.client is not None
    shown_page.user.client.delete()
    await shown_page.until(lambda: answers == [False])
    assert not caplog.records
