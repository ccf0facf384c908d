"""What an axis did in its recordings, and so what can be asked of it; and what was never recorded."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Sense

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from reconcile.catalogue.kinds import Scene
    from reconcile.explain import Explanation
    from reconcile.model_file import NominalAxis

COUNTS = 4.0
"""Of the encoder: a smaller stroke cannot be told."""


class Recorded(NamedTuple):
    """One axis in all its recordings, SI."""

    lowest_m: float
    highest_m: float
    begun_m: float
    """Where the first recording begins."""
    fastest_m_s: float
    hardest_m_s2: float
    creep_m_s: float
    """Slower is noise."""
    finest_m: float
    """A smaller stroke is noise."""
    longest_s: float
    warmed_k: float | None
    """None: no temperature was recorded."""
    has_scale: bool
    others: tuple[str, ...]
    """Axes that moved too."""
    alone: bool
    """While the others stood it moved, and they while it stood."""
    mass_kg: float
    viscous_n_s_m: float
    coulomb_n: float
    lead_m: float


def recorded(of_axis: Sequence[Explanation], axis: NominalAxis) -> Recorded:
    """From the scenes of an axis that was explained."""
    scenes = [rest.scene for rest in of_axis[0].rests]
    base: Mapping[str, float] = next((e.base for e in of_axis if e.sense is Sense.FORCE), {})
    motions = [scene.motion for scene in scenes]
    position_m = np.concatenate([m.position_m for m in motions])
    velocity_m_s = np.abs(np.concatenate([m.velocity_m_s for m in motions]))
    acceleration_m_s2 = np.abs(np.concatenate([m.acceleration_m_s2 for m in motions]))
    names = sorted({name for scene in scenes for name, other in scene.others.items() if other.moving.any()})
    warm_k = [scene.temperature_k for scene in scenes if scene.temperature_k is not None]
    return Recorded(
        lowest_m=float(position_m.min()),
        highest_m=float(position_m.max()),
        begun_m=float(position_m[0]),
        fastest_m_s=float(np.percentile(velocity_m_s, 99.9)),
        hardest_m_s2=float(np.percentile(acceleration_m_s2, 99.9)),
        creep_m_s=max(m.creep_m_s for m in motions),
        finest_m=COUNTS * (axis.encoder_resolution_m or 0.0),
        longest_s=max(float(scene.time_s[-1]) for scene in scenes),
        warmed_k=float(np.ptp(np.concatenate(warm_k))) if len(warm_k) == len(scenes) else None,
        has_scale=any(scene.scale_m is not None for scene in scenes),
        others=tuple(names),
        alone=all(_apart(scenes, name) for name in names),
        mass_kg=base.get("mass_kg", axis.mass_kg),
        viscous_n_s_m=base.get("viscous_n_s_m", axis.viscous_n_s_m),
        coulomb_n=base.get("coulomb_n", axis.coulomb_n),
        lead_m=axis.lead_m,
    )


def _apart(scenes: Sequence[Scene], name: str) -> bool:
    pairs = [(scene.motion, scene.others[name]) for scene in scenes if name in scene.others]
    own = any(np.any(m.moving & other.resting) for m, other in pairs)
    return own and any(np.any(m.resting & other.moving) for m, other in pairs)
