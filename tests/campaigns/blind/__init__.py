"""Generator of blind trials: axes with concealed physics, simulated by equations of its own."""

from tests.campaigns.blind.draws import draw
from tests.campaigns.blind.recorded import record
from tests.campaigns.blind.seeds import claim

__all__ = ["claim", "draw", "record"]
