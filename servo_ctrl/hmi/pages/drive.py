"""Drive: what the axes do and are, switching them on and off, homing, jogging, and faults with what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

if TYPE_CHECKING:
    from servo_ctrl.hmi.bench import Bench, Visitor

TITLE = "Drive"


def build(bench: Bench, visitor: Visitor) -> None:
    """The page's content."""
    ui.label(f"{bench.link.hello} {visitor.user}")
