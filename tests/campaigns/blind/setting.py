"""What the draw of an effect depends on, and its result: a plant with the effect, and the truth."""

import math
from typing import NamedTuple

import numpy as np

from tests.campaigns.blind.case import Planted
from tests.campaigns.blind.motions import Reach
from tests.campaigns.blind.nonlinearities import wave
from tests.campaigns.blind.plant import Plant

Random = np.random.Generator

TURN = 2.0 * math.pi
"""One turn, radians."""


class Setting(NamedTuple):
    """What the size of a drawn effect depends on."""

    lead_m: float
    reach: Reach
    peak_n: float
    """Approximate peak force of its motions."""
    rng: Random


Drawn = tuple["Plant", "Planted"]


def sign(rng: Random) -> float:
    """Draw a sign."""
    return 1.0 if rng.random() < 0.5 else -1.0


def fundamental(skew: float) -> float:
    """Return the amplitude of the first harmonic of `nonlinearities.wave`."""
    angle = np.linspace(0.0, TURN, 720, endpoint=False)
    return float(2.0 * abs(np.mean(wave(angle, skew) * np.exp(-1j * angle))))
