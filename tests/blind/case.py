"""A case: an axis, its sensors and its motions, and what is concealed in it."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tests.blind.motions import Reach
    from tests.blind.plant import Loop, Plant

    Array = NDArray[np.float64]


class Planted(NamedTuple):
    """One concealed effect."""

    name: str
    parameters: dict[str, float]
    """In the words of a verdict, only where both mean the same."""
    causes: tuple[str, ...]
    """Which of the simulation's forces are its own; empty: it shows between motor and scale only."""
    deviation: bool = False
    catalogue: bool = True
    also: tuple[str, ...] = ()
    """Names that are true of it too: neither right nor false."""
    alike: tuple[str, ...] = ()
    """Names of its class, which these sensors cannot tell from it: as right as its own."""


class Run(NamedTuple):
    """One recording."""

    motion: str
    duration_s: float
    start_m: float
    """Where in the screw's turn the encoder was zeroed."""
    warm_from: float
    warm_to: float
    """Share of the warming at its beginning and end."""
    seed: int


class Sensing(NamedTuple):
    """What is recorded and how well."""

    has_scale: bool
    has_temperature: bool
    is_command: bool
    """The force is the controller's command; else it is measured as current."""
    period_s: float
    force_noise_n: float
    force_drift_n: float
    force_count_n: float
    motor_noise_m: float
    scale_noise_m: float
    scale_wander_m: float
    as_csv: bool


class Case(NamedTuple):
    """All of it; the plant holds the concealed effects, `sound` is the plant without them."""

    seed: int
    kind: str
    """none, parameters, single, several, foreign"""
    plant: Plant
    sound: Plant
    loop: Loop
    sensing: Sensing
    reach: Reach
    lead_m: float
    control_s: float
    runs: tuple[Run, ...]
    planted: tuple[Planted, ...]
    nominal: str
    """fitted: by least squares on the recordings; sheet: the truth to some per cent; wrong: neither."""
    nominal_factors: tuple[float, float, float]
    production: bool
    warming_k: float
    expansion_1_k: float
    fixed_end_m: float
    towing: bool = False


class Made(NamedTuple):
    """One recording: its columns, and behind it the simulation at the same samples; arrays (n,)."""

    columns: dict[str, Array]
    inside: Array
    """(n, simulate.WIDTH)"""
    wander_m: Array
    growth_m: Array
    start_m: float
