"""Blind trials: axes with concealed physics, from equations of their own."""

from tests.blind.draws import draw
from tests.blind.recorded import record

__all__ = ["draw", "record"]
