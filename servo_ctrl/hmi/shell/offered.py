"""Buttons that are grey where a click would do nothing, with the reason for pointer and screen reader."""

from collections.abc import Iterable

from nicegui import ui
from nicegui.elements.mixins.disableable_element import DisableableElement

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.local_messages import Do
from servo_ctrl.hmi.shell.open_page import OpenPage


def offer(
    page: OpenPage,
    elements: Iterable[DisableableElement],
    do: Do,
    command: Command | None = None,
    *,
    possible: bool,
) -> None:
    """Enable elements where the machine can do what they ask for and the visitor may ask for it."""
    refusal = page.refusal(do, command.name.lower() if command else "")
    for element in elements:
        element.set_enabled(possible and not refusal)
        explain(element, refusal)


def explain(element: ui.element, reason: str) -> None:
    """Give a grey element its reason, as tooltip and as description of its name; "" takes it away."""
    if element.props.get("title", "") == reason:
        return
    if reason:
        element.props["title"] = reason
    else:
        element.props.pop("title")
    element.update()
