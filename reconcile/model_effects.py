"""The effects that a model holds already, as shapes and coefficients of the catalogue: `repairs` inversely.

What no entry has columns for is left out: structural_mode, friction_ageing, lubrication_loss, the inductance
of a winding, the bow of a guide, the ripple of position_dependent_friction, damping of drive_compliance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from reconcile.model_effects_held import held_base
from reconcile.model_effects_known import Asked, Known
from reconcile.model_effects_laws import LAWS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from reconcile.catalogue.kinds import Scene, Sense, Shape
    from reconcile.model_effects_held import Held
    from reconcile.model_file import NominalAxis


def model_effects(held: Held, axis: NominalAxis, scenes: Sequence[Scene]) -> list[Known]:
    """Each with its coefficients for these recordings; drifts are those of the first one, as in the repairs.

    Forces and ways are the model's own. What differs by recording (an encoder that is zeroed anew, when a
    disturbance began) is taken as if the recordings had the model's zero.
    """
    base = held_base(held, axis)
    sums: dict[tuple[str, Shape, Sense], tuple[float, ...]] = {}
    for effect, params in held.effects.items():
        if effect not in LAWS:
            continue
        for one in LAWS[effect](Asked(params, held.effects, held.other, axis, base, scenes)):
            same = one.effect, one.shape, one.sense
            before = sums.get(same, (0.0,) * len(one.coefficients))
            sums[same] = tuple(a + b for a, b in zip(before, one.coefficients, strict=True))
    return [
        Known(effect, shape, coefficients, sense)
        for (effect, shape, sense), coefficients in sums.items()
        if any(coefficients)
    ]
