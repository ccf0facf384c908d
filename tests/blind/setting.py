"""What an effect is drawn from, and what is drawn: a plant that has it, and the truth about it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tests.blind.simulate import wave

if TYPE_CHECKING:
    from tests.blind.case import Planted
    from tests.blind.motions import Reach
    from tests.blind.plant import Plant

    Random = np.random.Generator

TURN = 2.0 * math.pi


class Setting(NamedTuple):
    """What the size of an effect depends on."""

    lead_m: float
    reach: Reach
    peak_n: float
    """The strongest force of its motions, about."""
    rng: Random


Drawn = tuple["Plant", "Planted"]


def sign(rng: Random) -> float:
    """One of the two."""
    return 1.0 if rng.random() < 0.5 else -1.0


def fundamental(skew: float) -> float:
    """Amplitude of the first harmonic of `simulate.wave`."""
    angle = np.linspace(0.0, TURN, 720, endpoint=False)
    return float(2.0 * abs(np.mean(wave(angle, skew) * np.exp(-1j * angle))))
