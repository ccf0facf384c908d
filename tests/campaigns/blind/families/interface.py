"""What a family of concealed cases hands over, and how a seed decides what it conceals.

A linear axis is in m, m/s, N and kg, a rotary one in rad, rad/s, N m and kg m². Nothing else is shared by the
families but the grammar of foreign physics, so a bug or a habit of one family stays in that family.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Channels = dict[str, Array]
"""One recording by `CHANNELS`; arrays (n,). Simulated inside and recorded alike."""
CHANNELS = ("time", "motor", "force", "scale", "command", "temperature")
SHARES = {"quiet": 0.18, "single": 0.36, "several": 0.18, "foreign": 0.14, "beside": 0.14}
"""Probability of each kind of a case; chosen: no effect, one, two or three, foreign physics alone, or
beside one."""
ATTEMPTS = 500
"""Bounds the draws of a set of names without conflict; chosen."""


@dataclass(frozen=True)
class Effect:
    """One concealed effect of the catalogue."""

    name: str
    parameters: dict[str, float]
    """True values where the simulation has this quantity; empty: the law has another form here.

    A `harmonic` counts the periods in a turn of the motor, as the product's does, also behind a gear.
    """
    side: Literal["force", "deviation"] = "force"
    """Where it shows: in the motor's force, or between motor and scale."""
    also: tuple[str, ...] = ()
    """True of it too: neither right nor false."""
    alike: tuple[str, ...] = ()
    """Of one class with it for these sensors: naming it is right."""


@dataclass(frozen=True)
class Nominal:
    """What the model file says: of the plant without concealed effects, by a data sheet's accuracy."""

    inertia: float
    viscous: float
    coulomb: float
    motor_count: float
    scale_count: float = 0.0
    lead_m: float = 0.01
    gear_ratio: float = 1.0
    constant_n: float = 0.0
    """A weight that the model file knows."""


Simulate = Callable[[frozenset[str], bool, Sequence[Array] | None], list[Channels]]
"""By names of the effects that act, whether the sensors are noisy, and the foreign force (n,) a recording."""


@dataclass(frozen=True)
class Case:
    """A machine with what it conceals; `simulate` runs it with any part of that left out."""

    family: str
    seed: int
    kind: str
    nominal: Nominal
    sound: Nominal
    """The same quantities as they truly are, without a concealed effect."""
    effects: tuple[Effect, ...]
    simulate: Simulate
    clutter: tuple[str, ...] = ()
    """Small effects of every machine of the family, which may be named or not."""
    rotary: bool = False
    as_csv: bool = False

    @property
    def has_foreign(self) -> bool:
        """Whether physics outside every catalogue is concealed."""
        return self.kind in {"foreign", "beside"}

    @property
    def names(self) -> frozenset[str]:
        """Names of all that is concealed."""
        return frozenset(effect.name for effect in self.effects)


def plan(
    rng: np.random.Generator,
    offered: Sequence[str],
    conflicts: Collection[frozenset[str]],
    kind: str | None = None,
) -> tuple[str, tuple[str, ...]]:
    """Draw the kind of a case (unless given) and the names that it conceals, no two of a conflict.

    Raises:
        ValueError: `kind` is none of `SHARES`, or the conflicts leave too few names.
    """
    if kind is None:
        kind = str(rng.choice(list(SHARES), p=list(SHARES.values())))
    if kind not in SHARES:
        raise ValueError(f"{kind}: give one of {', '.join(SHARES)}")
    count = {"quiet": 0, "single": 1, "foreign": 0, "several": 2 + int(rng.random() < 0.4), "beside": 1}[kind]
    for _ in range(ATTEMPTS):
        names = tuple(str(name) for name in rng.choice(list(offered), size=count, replace=False))
        if not any(pair <= frozenset(names) for pair in conflicts):
            return kind, names
    raise ValueError(f"no {count} of {', '.join(offered)} are without a conflict: offer more")


def sheet(rng: np.random.Generator, sound: Nominal) -> Nominal:
    """Return a data sheet's values: within 10 % of inertia, 25 % of viscous and Coulomb friction."""
    return Nominal(
        **{
            **vars(sound),
            "inertia": sound.inertia * rng.uniform(0.9, 1.1),
            "viscous": sound.viscous * rng.uniform(0.75, 1.25),
            "coulomb": sound.coulomb * rng.uniform(0.75, 1.25),
        }
    )
