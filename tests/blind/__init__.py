"""Blind trials: axes with concealed physics, from other equations than the simulator's and the catalogue's."""

from tests.blind.draws import draw
from tests.blind.recorded import record

__all__ = ["draw", "record"]
