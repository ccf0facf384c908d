"""What an axis did in its recordings, and so what can be asked of it; and what it never did."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Sense

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene
    from reconcile.explain import Explanation
    from reconcile.model_file import NominalAxis

    Array = NDArray[np.float64]

STEADY_S, STEADY_SHARE, HELD = 0.05, 0.05, 3
"""A speed is steady whose mean changes by no more than such a share in so long; held, if so many times."""
LEAST_REST_S = 0.05
COUNTS = 5.0
"""Of the encoder: a smaller stroke cannot be told."""
HIGH = 0.7
"""Of the largest: high."""


class Recorded(NamedTuple):
    """One axis in all its recordings, SI."""

    lowest_m: float
    highest_m: float
    fastest_m_s: float
    hardest_m_s2: float
    creep_m_s: float
    """Slower is noise."""
    finest_m: float
    """A smaller stroke is noise."""
    longest_s: float
    steady_m_s: tuple[float, ...]
    """Speeds held in both directions, one an octave."""
    strokes_m: tuple[float, ...]
    """From reversal to reversal, rising."""
    reversal_m_s2: tuple[float, ...]
    """Acceleration at the reversals, rising."""
    dwells_s: tuple[float, ...]
    """Rests before a start, rising."""
    starts: tuple[int, int]
    """After a rest, forwards and backwards."""
    hardly_to_hard: float
    """Force at its strongest in that of half the time."""
    fast_and_hard: bool
    """The motor drove with high force at high speed."""
    coasting_s: float
    """In motion with hardly any force."""
    warmed_k: float | None
    """None: no temperature was recorded."""
    has_scale: bool
    others: tuple[str, ...]
    """Axes that moved too."""
    alone: bool
    """While the others stood it moved, and they while it stood."""
    mass_kg: float
    coulomb_n: float
    lead_m: float

    @property
    def travel_m(self) -> float:
        """All the way that was used."""
        return self.highest_m - self.lowest_m


def recorded(of_axis: Sequence[Explanation], axis: NominalAxis) -> Recorded:
    """From the scenes of an axis that was explained."""
    scenes = [rest.scene for rest in of_axis[0].rests]
    base: Mapping[str, float] = next((e.base for e in of_axis if e.sense is Sense.FORCE), {})
    coulomb_n = base.get("coulomb_n", axis.coulomb_n)
    motions = [scene.motion for scene in scenes]
    position_m = np.concatenate([m.position_m for m in motions])
    force_n = np.abs(np.concatenate([scene.force_n for scene in scenes]))
    strongest_n = float(np.percentile(force_n, 99.9))
    velocity_m_s = np.abs(np.concatenate([m.velocity_m_s for m in motions]))
    fastest_m_s = float(np.percentile(velocity_m_s, 99.9))
    acceleration_m_s2 = np.abs(np.concatenate([m.acceleration_m_s2 for m in motions]))
    turns = [np.flatnonzero(np.diff(m.last_direction) != 0.0) for m in motions]
    dwells_s = [_starts(scene) for scene in scenes]
    names = sorted({name for scene in scenes for name, other in scene.others.items() if other.moving.any()})
    warm_k = [scene.temperature_k for scene in scenes]
    kelvin = (
        np.concatenate([t for t in warm_k if t is not None]) if all(t is not None for t in warm_k) else None
    )
    creep_m_s = max(m.creep_m_s for m in motions)
    return Recorded(
        lowest_m=float(position_m.min()),
        highest_m=float(position_m.max()),
        fastest_m_s=fastest_m_s,
        hardest_m_s2=float(np.percentile(acceleration_m_s2, 99.9)),
        creep_m_s=creep_m_s,
        finest_m=COUNTS * (axis.encoder_resolution_m or 0.0),
        longest_s=max(float(scene.time_s[-1]) for scene in scenes),
        steady_m_s=_steady(scenes),
        strokes_m=_rising([np.abs(np.diff(m.position_m[at])) for m, at in zip(motions, turns, strict=True)]),
        reversal_m_s2=_rising(
            [np.abs(m.acceleration_m_s2[at]) for m, at in zip(motions, turns, strict=True)]
        ),
        dwells_s=_rising([np.abs(own) for own in dwells_s]),
        starts=(
            sum(int((own > 0.0).sum()) for own in dwells_s),
            sum(int((own < 0.0).sum()) for own in dwells_s),
        ),
        hardly_to_hard=strongest_n / max(float(np.median(force_n)), 1e-12),
        fast_and_hard=any(
            bool(
                np.any(
                    (scene.force_n * np.sign(scene.motion.velocity_m_s) > HIGH * strongest_n)
                    & (np.abs(scene.motion.velocity_m_s) > HIGH * fastest_m_s)
                )
            )
            for scene in scenes
        ),
        coasting_s=sum(_coasting_s(scene, fastest_m_s, coulomb_n) for scene in scenes),
        warmed_k=None if kelvin is None else float(np.ptp(kelvin)),
        has_scale=any(scene.scale_m is not None for scene in scenes),
        others=tuple(names),
        alone=all(_apart(scenes, name) for name in names),
        mass_kg=base.get("mass_kg", axis.mass_kg),
        coulomb_n=coulomb_n,
        lead_m=axis.lead_m,
    )


def _rising(parts: Sequence[Array]) -> tuple[float, ...]:
    return tuple(float(value) for value in np.sort(np.concatenate(parts)))


def _steady(scenes: Sequence[Scene]) -> tuple[float, ...]:
    """The middle one of the steady speeds of each octave that has them in both directions."""
    seen: dict[int, list[float]] = {}
    for scene in scenes:
        half = max(round(0.5 * STEADY_S / scene.period_s), 1)
        v = scene.motion.velocity_m_s
        halves = v[: len(v) // (2 * half) * 2 * half].reshape(-1, 2, half).mean(axis=2)
        middle, change = halves.mean(axis=1), np.abs(halves[:, 1] - halves[:, 0])
        steady = (change < STEADY_SHARE * np.abs(middle)) & (np.abs(middle) > 2.0 * scene.motion.creep_m_s)
        for speed in middle[steady]:
            seen.setdefault(round(float(np.log2(abs(speed)))), []).append(float(speed))
    held = [
        float(np.median(np.abs(own)))
        for _, own in sorted(seen.items())
        if min(sum(v > 0.0 for v in own), sum(v < 0.0 for v in own)) >= HELD
    ]
    return tuple(held)


def _starts(scene: Scene) -> Array:
    """Rests before each start, with the sign of the motion that followed."""
    m = scene.motion
    first = np.flatnonzero(np.diff(m.moving.astype(np.int8)) > 0) + 1
    rested = first[m.dwell_s[first] >= LEAST_REST_S]
    signed: Array = m.dwell_s[rested] * m.last_direction[rested]
    return signed


def _coasting_s(scene: Scene, fastest_m_s: float, coulomb_n: float) -> float:
    moving = np.abs(scene.motion.velocity_m_s) > 0.05 * fastest_m_s
    return scene.period_s * float(np.count_nonzero(moving & (np.abs(scene.force_n) < 0.3 * coulomb_n)))


def _apart(scenes: Sequence[Scene], name: str) -> bool:
    pairs = [(scene.motion, scene.others[name]) for scene in scenes if name in scene.others]
    own = any(np.any(m.moving & other.resting) for m, other in pairs)
    return own and any(np.any(m.resting & other.moving) for m, other in pairs)
