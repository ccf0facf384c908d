"""What the page says to one visitor in passing; everything that lasts stands on the page itself."""

from __future__ import annotations

from typing import Literal

from nicegui import ui

Kind = Literal["positive", "negative", "warning", "info", "ongoing"]


def tell(text: str, kind: Kind = "warning") -> None:
    """Show a sentence for some seconds, above the foot: nothing may lie over STOP."""
    ui.notify(text, type=kind, position="bottom", timeout=6000, multi_line=True, close_button="OK")
