"""Buttons that are grey without the control right, with the reason, and live with it."""

from nicegui import ui
from page_in_process import PageInProcess

from servo_ctrl.hmi.drive import page as drive

MOVING = ("disable", "home", "step-x-plus", "step-y-minus", "touch-off-x", "clear-offset")
"""What a machine that is ready could do."""


def button(page: PageInProcess, mark: str) -> ui.button:
    [found] = page.user.find(kind=ui.button, marker=mark).elements
    return found


async def test_what_moves_an_axis_or_switches_drives_is_grey_without_control_and_says_why(
    shown_page: PageInProcess,
) -> None:
    await shown_page.show(drive.build)
    await shown_page.until(lambda: all(button(shown_page, mark).enabled for mark in MOVING))
    assert not button(shown_page, "enable").enabled  # the drives are on
    assert not any("title" in button(shown_page, mark).props for mark in (*MOVING, "enable"))

    shown_page.release_control()
    await shown_page.until(lambda: not any(button(shown_page, mark).enabled for mark in MOVING))
    for mark in (*MOVING, "enable"):
        assert button(shown_page, mark).props["title"].startswith("Nobody has control. Take it first")
    [jog] = shown_page.user.find(marker="jog-x-plus").elements
    assert jog.props["aria-disabled"] == "true"
    assert jog.props["title"].startswith("Nobody has control.")
