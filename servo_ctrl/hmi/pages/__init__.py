"""The pages of the operator's bench, in the order of their links.

A page is a module with `TITLE` and `build(bench, visitor)`, which makes its content within the frame.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from servo_ctrl.hmi.pages import bus, contour, drive, friction, motion, reconcile, scope

if TYPE_CHECKING:
    from types import ModuleType

__all__ = ["PAGES", "drive", "motion"]

PAGES: dict[str, ModuleType] = {
    "/": drive,
    "/motion": motion,
    "/scope": scope,
    "/contour": contour,
    "/friction": friction,
    "/reconcile": reconcile,
    "/bus": bus,
}
"""By their address."""
