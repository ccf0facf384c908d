"""The parts of a regression term: residual channel, data of a recording, shape parameters and columns.

A column is the motor's force (ResidualChannel.FORCE, N) or scale less motor (POSITION_DEVIATION, m) for a
coefficient of 1. A term is linear in its coefficients; its nonlinear parameters, the shape parameters, are
scanned.
"""

from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from typing import Any, NamedTuple

from kernels.arrays import Array
from reconcile.recording.kinematics import Kinematics

ShapeParameters = tuple[float, ...]


class ResidualChannel(Enum):
    """The residual in which an effect shows."""

    FORCE = "force"
    POSITION_DEVIATION = "deviation"


class RegressionData(NamedTuple):
    """One axis in one recording, as the columns need it; arrays (n,)."""

    period_s: float
    time_s: Array
    """From the start of the recording."""
    motion: Kinematics
    force_n: Array
    """As measured."""
    model_force_n: Array
    """The model's force for this motion: a coordinate without measurement noise."""
    lead_m: float
    motor_mass_kg: float
    """Mass of the rotor, reduced to the table; 0 = not known."""
    scale_m: Array | None
    temperature_k: Array | None
    others: dict[str, Kinematics]
    """The other axes of the machine."""
    presliding_law_n: Array | float = 0.0
    """Force of a friction law of the model that no column has."""
    load_n: Array | float = 0.0
    """The model's force without friction and rotor, which the drive train transmits."""
    rotary: bool = False
    """The coordinate is an angle: 1 m stands for 1 rad."""
    recorded_force_n: Array | None = None
    """The measured force on the grid of its sensor, where `force_n` has more than that."""
    spring: ShapeParameters = ()
    """Antiresonance (Hz) and damping ratio of the load on a spring behind the motor; empty: rigid."""


class SiParameter(NamedTuple):
    """A parameter in SI."""

    value: float
    unit: str


def no_shape(_datasets: Sequence[RegressionData]) -> list[ShapeParameters]:
    """Return the single, empty shape of a term that is linear in all its parameters."""
    return [()]


SHARED, OWN, EITHER = (False,), (True,), (False, True)
"""Values of `TermFamily.per_recording`."""
IN_A_RECORDING = "_in_a_recording"
"""End of the names of unnamed terms with coefficients of each recording."""


class TermFamily(NamedTuple):
    """The candidate terms of an effect in one residual channel."""

    columns: Callable[[RegressionData, ShapeParameters], Array]
    """(n, k)"""
    shapes: Callable[[Sequence[RegressionData]], list[ShapeParameters]] = no_shape
    """To scan: those that the recordings distinguish; none if they do not excite the effect."""
    channel: ResidualChannel = ResidualChannel.FORCE
    per_recording: tuple[bool, ...] = SHARED
    """Whether each recording has its own coefficients (encoders are re-zeroed); EITHER: both are tried."""
    if_excited: bool = False
    """Tried only if a recording excites it, which ordinary motions do not."""


class UnnamedTerm(NamedTuple):
    """A family of unnamed terms, which are reported as `unknown`."""

    shapes: Callable[[Sequence[RegressionData]], list[ShapeParameters]]
    """To scan."""
    columns: Callable[[RegressionData, ShapeParameters], Array]
    """(n, k)"""
    parameters: Callable[[ShapeParameters, Array], dict[str, SiParameter]]
    """What shape and coefficients mean, SI."""
    finding: Callable[[dict[str, float]], str]
    """What the term shows, as the end of a sentence."""
    equivalent: tuple[str, ...] = ()
    per_recording: tuple[bool, ...] = SHARED
    """As of `TermFamily`."""
    section: str = ""
    """The effect of hil_sim that a plant file writes it as; empty if there is none."""
    to_plant: Callable[[Mapping[str, float]], dict[str, Any]] = lambda _parameters: {}
    """Parameters of that effect from those of the term, SI."""

    def sentence(self, p: dict[str, float]) -> str:
        """Return what an engineer can check; after the first colon is what this term shows."""
        where = f"in recording {p['recording']:.0f}: " if "recording" in p else ""
        return f"something real that no entry of the catalogue explains: {where}{self.finding(p)}"


def continued(grid: Sequence[float], highest: float) -> tuple[float, ...]:
    """Return a rising grid, continued by the ratio of its last two points up to `highest`."""
    points, ratio = [*grid], grid[-1] / grid[-2]
    while points[-1] * ratio <= highest:
        points.append(points[-1] * ratio)
    return tuple(points)
