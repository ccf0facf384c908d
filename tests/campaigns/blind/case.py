"""A case: an axis with its controller, sensors, motions and concealed effects."""

from typing import NamedTuple

from tests.campaigns.blind.arrays import Array
from tests.campaigns.blind.motions import Reach
from tests.campaigns.blind.plant import Loop, Plant


class Planted(NamedTuple):
    """One concealed effect."""

    name: str
    parameters: dict[str, float]
    """True values under the names of a verdict, where both mean the same quantity."""
    causes: tuple[str, ...]
    """Causes of the simulation that belong to it; empty: it shows only between motor and scale."""
    deviation: bool = False
    catalogue: bool = True
    also: tuple[str, ...] = ()
    """Effects that are also true of it: naming them is neither right nor false."""
    alike: tuple[str, ...] = ()
    """Effects of its class, which these sensors cannot separate from it: naming them is right."""


class Run(NamedTuple):
    """One recording."""

    motion: str
    duration_s: float
    start_m: float
    """Position of the encoder's zero within the turn of the screw."""
    warm_from: float
    warm_to: float
    """Share of the temperature rise at beginning and end."""
    seed: int


class Sensing(NamedTuple):
    """Which channels are recorded, and their noise."""

    has_scale: bool
    has_temperature: bool
    is_command: bool
    """The recorded force is the controller's command; else the measured current."""
    period_s: float
    force_noise_n: float
    force_drift_n: float
    force_count_n: float
    motor_noise_m: float
    scale_noise_m: float
    scale_wander_m: float
    as_csv: bool


class Case(NamedTuple):
    """A whole case; `plant` holds the concealed effects, `sound` is the plant without them."""

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
    """fitted: least squares on the recordings; sheet: within some per cent of the truth; wrong: neither."""
    nominal_factors: tuple[float, float, float]
    production: bool
    warming_k: float
    expansion_1_k: float
    fixed_end_m: float
    towing: bool = False


class SimulatedRecording(NamedTuple):
    """One recording: its columns, and the simulation's variables at the same samples; arrays (n,)."""

    columns: dict[str, Array]
    inside: Array
    """(n, record.WIDTH)"""
    wander_m: Array
    growth_m: Array
    start_m: float
