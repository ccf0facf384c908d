"""Motion: pick, edit and check a program; start, hold, resume, abort it; see how far it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nicegui import ui

if TYPE_CHECKING:
    from servo_ctrl.hmi.bench import Bench, Visitor

TITLE = "Motion"


def build(bench: Bench, visitor: Visitor) -> None:
    """The page's content."""
    ui.label(f"{bench.link.hello} {visitor.user}")
