"""Buttons that are grey where a click would be refused say why, in the words of the refusal."""

from collections.abc import Callable

import pytest
from nicegui import ElementFilter, ui
from page_in_process import PageInProcess

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.commands.objections import NOTHING_IN_USE, objection
from servo_ctrl.commands.stage import Stage
from servo_ctrl.hmi.drive import page as drive
from servo_ctrl.hmi.friction import page as friction
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.languages.texts import ENGLISH, CurrentLanguage
from servo_ctrl.hmi.motion import page as motion
from servo_ctrl.hmi.shell.open_page import OpenPage

MOVING = ("disable", "home", "step-x-plus", "step-y-minus", "touch-off-x", "clear-offset")
"""What a machine that is ready could do."""


def button(page: PageInProcess, mark: str) -> ui.button:
    """A button, hidden ones too."""
    assert page.user.client is not None
    with page.user.client.content:
        [found] = ElementFilter(kind=ui.button, marker=mark)
    return found


async def test_what_moves_an_axis_or_switches_drives_is_grey_without_control_and_says_why(
    shown_page: PageInProcess,
) -> None:
    await shown_page.show(drive.build)
    await shown_page.until(lambda: all(button(shown_page, mark).enabled for mark in MOVING))
    assert not button(shown_page, "enable").enabled  # the drives are on
    assert not any("title" in button(shown_page, mark).props for mark in MOVING)
    assert button(shown_page, "enable").props["title"] == "the machine is ready, not in standby"

    shown_page.release_control()
    await shown_page.until(lambda: not any(button(shown_page, mark).enabled for mark in MOVING))
    for mark in (*MOVING, "enable"):
        assert button(shown_page, mark).props["title"].startswith("Nobody has control. Take it first")
    [jog] = shown_page.user.find(marker="jog-x-plus").elements
    assert jog.props["aria-disabled"] == "true"
    assert jog.props["title"].startswith("Nobody has control.")


MOTION = {
    "start": Command.START_PROGRAM,
    "hold": Command.HOLD_PROGRAM,
    "resume": Command.RESUME_PROGRAM,
    "abort": Command.ABORT_PROGRAM,
    "mdi-run": "run_line",
}
FRICTION = {
    f"{verb}-learning": Command[f"{verb.upper()}_LEARNING"] for verb in ("start", "pause", "resume", "abort")
}
PAGES = {motion.build: MOTION, friction.build: FRICTION}


@pytest.mark.parametrize("language", [ENGLISH, "de"])
@pytest.mark.parametrize("build", PAGES)
async def test_buttons_of_motion_and_friction_that_are_grey_have_the_refusal_of_the_machine(
    shown_page: PageInProcess,
    build: Callable[[OpenPage], None],
    language: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(CurrentLanguage, "find", staticmethod(lambda: language))
    link, requests = shown_page.link, PAGES[build]
    await shown_page.show(build)
    idle = link.status.learning
    for stage in (Stage.READY, Stage.STANDBY, Stage.RUNNING):
        for state in (LearningState.IDLE, LearningState.RUNNING, LearningState.PAUSED):
            link.change(stage=stage, learning=idle._replace(state=state))
            said = {mark: controller_text(objection(link.status, one)) for mark, one in requests.items()}
            assert any(said.values())

            def as_said(expected: dict[str, str] = said) -> bool:
                shown = {mark: button(shown_page, mark) for mark in expected}
                return all(
                    element.enabled == (not expected[mark])
                    and element.props.get("title", "") == expected[mark]
                    for mark, element in shown.items()
                )

            await shown_page.until(as_said)
    if language != ENGLISH:
        assert said.items().isdisjoint(
            {mark: objection(link.status, one) for mark, one in requests.items() if said[mark]}.items()
        )


async def test_load_and_roll_back_say_what_is_missing_below_them(shown_page: PageInProcess) -> None:
    await shown_page.show(motion.build)
    nothing = "There is no program below that is checked and within the limits."
    await shown_page.until(lambda: button(shown_page, "load-program").props.get("title") == nothing)
    assert not button(shown_page, "load-program").enabled
    await shown_page.show(friction.build)
    unused = NOTHING_IN_USE[Command.ROLL_BACK]
    await shown_page.until(lambda: button(shown_page, "roll-back").props.get("title") == unused)


async def test_buttons_say_that_the_controller_is_gone(shown_page: PageInProcess) -> None:
    await shown_page.show(motion.build)
    shown_page.link.connected = False
    gone = "there is no connection to the controller"
    await shown_page.until(
        lambda: all(button(shown_page, mark).props.get("title") == gone for mark in ("start", "mdi-run"))
    )
