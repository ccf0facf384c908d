"""What an entry of the catalogue looks like to the engine.

Each effect is one module, named as in hil_sim and in the catalogue. It has

    HYPOTHESES   the senses in which it shows, each with its shapes and columns
    parameters   what the fitted coefficients mean, in SI
    sentence     what an engineer can check
    possible     where it is there: which coefficients nature has
    SYSTEMATIC   where it is there: by parameter, how far below and above its value, as shares of it, the
                 truth may lie though the interval of the blocks is narrow (of the others: registry.py)

Columns are forces that the motor needs per unit (Sense.FORCE, newtons), or scale less motor (Sense.DEVIATION,
metres). They are linear in the coefficients; what is not linear is the shape, and is scanned.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray

    from reconcile.kinematics import Kinematics

    Array = NDArray[np.float64]

Shape = tuple[float, ...]


class Sense(Enum):
    """In which of the differences an effect shows."""

    FORCE = "force"
    DEVIATION = "deviation"


class Scene(NamedTuple):
    """One axis in one recording, as the columns need it; arrays (n,)."""

    period_s: float
    time_s: Array
    """From the start of the recording."""
    motion: Kinematics
    force_n: Array
    """As measured."""
    model_force_n: Array
    """What the model gives for this motion: a coordinate free of the noise that is to be explained."""
    lead_m: float
    motor_mass_kg: float
    """Of what turns in front of the drive train, at the table; 0 = not known."""
    scale_m: Array | None
    temperature_k: Array | None
    others: dict[str, Kinematics]
    """The other axes of the machine."""
    held_n: Array | float = 0.0
    """Force of a friction law that the model holds and that no column has."""


class Hypothesis(NamedTuple):
    """How an effect would show in one sense."""

    sense: Sense
    shapes: Callable[[Sequence[Scene]], list[Shape]]
    """The shapes to scan; the recordings tell what can be told apart."""
    columns: Callable[[Scene, Shape], Array]
    """(n, k)"""
    per_recording: bool = False
    """The coefficients are free in each recording: encoders are zeroed anew."""


class Parameter(NamedTuple):
    """A parameter in SI."""

    value: float
    unit: str


class Meaning(Protocol):
    """What an entry says of its coefficients."""

    EQUIVALENT: Sequence[str]

    def parameters(self, shape: Shape, coefficients: Array) -> dict[str, Parameter]:
        """In SI."""

    def sentence(self, p: dict[str, float]) -> str:
        """What an engineer can check."""
