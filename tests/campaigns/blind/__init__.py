"""Generator of blind trials: axes with concealed physics, simulated by equations of its own."""

from tests.campaigns.blind.draws import draw
from tests.campaigns.blind.recorded import record

__all__ = ["draw", "record"]
