"""Buttons that are grey where a click would do nothing, with the reason for pointer and screen reader."""

from collections.abc import Iterable

from nicegui import ui
from nicegui.elements.mixins.disableable_element import DisableableElement

from servo_ctrl.commands.command import Command
from servo_ctrl.commands.local_messages import Do
from servo_ctrl.commands.machine_status import MachineStatus
from servo_ctrl.commands.objections import objection
from servo_ctrl.hmi.languages.controller_messages import controller_text
from servo_ctrl.hmi.link.machine_link import NO_CONNECTION
from servo_ctrl.hmi.shell.open_page import OpenPage


def offer(
    page: OpenPage,
    elements: Iterable[DisableableElement],
    status: MachineStatus,
    request: Command | Do,
    *,
    own: str = "",
) -> None:
    """Enable elements, or grey them where a click would be refused, with the reason of the refusal.

    `own` is what speaks against the request on this page alone, in its language.
    """
    reason = own or refusal_reason(page, status, request)
    for element in elements:
        element.set_enabled(not reason)
        explain(element, reason)


def refusal_reason(page: OpenPage, status: MachineStatus, request: Command | Do) -> str:
    """Return why the request would be refused now, in the language of the page; "" if it would not."""
    if isinstance(request, Command):
        reason = page.refusal("command", request.name.lower())
    else:
        reason = page.refusal(request)
    if reason:
        return reason
    return controller_text(objection(status, request) if page.link.connected else NO_CONNECTION)


def explain(element: ui.element, reason: str) -> None:
    """Give a grey element its reason, as tooltip and as description of its name; "" takes it away."""
    if element.props.get("title", "") == reason:
        return
    if reason:
        element.props["title"] = reason
    else:
        element.props.pop("title")
    element.update()
