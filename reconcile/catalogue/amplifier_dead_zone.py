"""Amplifier dead zone: no force below a threshold of the command."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from reconcile.catalogue.kinds import Hypothesis, Parameter, Sense

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape

    Array = NDArray[np.float64]

SHARES = (0.5, 1.0, 2.0, 4.0)


def _shapes(scenes: Sequence[Scene]) -> list[Shape]:
    typical_n = float(np.median(np.abs(np.concatenate([scene.model_force_n for scene in scenes]))))
    return [(share * 0.25 * typical_n,) for share in SHARES if typical_n > 0.0]


def _columns(scene: Scene, shape: Shape) -> Array:
    return np.clip(scene.model_force_n / shape[0], -1.0, 1.0)[:, None]


HYPOTHESES = [Hypothesis(Sense.FORCE, _shapes, _columns)]
EQUIVALENT = ()


def possible(coefficients: Array) -> bool:
    """Force is lost, not won."""
    return bool(coefficients[0] > 0.0)


def parameters(shape: Shape, coefficients: Array) -> dict[str, Parameter]:
    """The force that is lost beyond the threshold."""
    return {"threshold_n": Parameter(float(coefficients[0]), "N"), "width_n": Parameter(shape[0], "N")}


def sentence(p: dict[str, float]) -> str:
    """What can be checked."""
    return (
        f"about {p['threshold_n']:.2f} N of the commanded force are lost whenever its sign is clear, "
        "changing over at "
        "zero force and not at zero speed: a dead zone of the amplifier"
    )
