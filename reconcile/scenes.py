"""From recordings to the ledgers of both senses: kinematics, filtered columns, blocks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from reconcile.catalogue.kinds import Scene, Sense
from reconcile.catalogue.registry import ENTRIES, hypotheses
from reconcile.catalogue.temperature_dependent_friction import DRIFT, own_levels
from reconcile.held_presliding import beyond_sharp_n
from reconcile.kinematics import bell_s, kinematics
from reconcile.ledger import Candidate, Ledger
from reconcile.resolution import settled_way_m
from reconcile.smooth_terms import PREFIX
from reconcile.state_filter import StateFilter
from reconcile.strange_terms import term

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Shape
    from reconcile.model_effects_known import Known
    from reconcile.model_file import NominalAxis
    from reconcile.recording import AxisRecording

    Array = NDArray[np.float64]

BLOCK_S = 0.5
CLEAN_HZ = 150.0
OVERSAMPLING = 4.0
"""Filtered samples are kept at so many times the filter's bandwidth: what lies between them says no more."""
FEWEST_BLOCKS = 80
FILTER_HZ = 60.0
"""Bandwidth of both differences: that of the published figures on EMPS."""
END_S = 0.02
"""At the end, where the motion that follows is not known."""
STICK_S = 1e-3
"""Smoothing of the force that tells how much of the friction is used while the axis sticks."""
BASE = {Sense.FORCE: ["mass_kg", "viscous_n_s_m", "coulomb_n"], Sense.DEVIATION: ["origin_m", "delay_s"]}
"""Coefficients of every model."""
OWN = ("origin_m",)
"""Free in each recording: sensors are zeroed anew."""
SHADOW = PREFIX + "distance_since_reversal"
"""Always there: what lives there only is presliding."""


class Difference(NamedTuple):
    """One sense of one axis, ready to be explained."""

    sense: Sense
    scenes: Sequence[Scene]
    ledger: Ledger
    plan: list[Planned]
    used: list[NDArray[np.bool_]]
    """(n,) for each recording: the samples that count."""
    block_of: list[NDArray[np.int64]]
    """(n,) for each recording: the block that a sample is in."""
    base_names: list[str]
    known: Sequence[Known]
    """What the model had already."""

    def sides(self, recording: int) -> tuple[Array, Array]:
        """What is to be explained (n,), and all columns of the ledger (n, c)."""
        return _columns_of(self.scenes[recording], self.sense, self.plan, self.known)


class Planned(NamedTuple):
    """Columns that are in a ledger."""

    effect: str
    shape: Shape
    columns: Callable[[Scene, Shape], Array]
    width: int


def scene_of(recording: AxisRecording, axis: NominalAxis) -> Scene:
    """What the columns need of a recording."""
    others = {name: kinematics(values, recording.period_s) for name, values in recording.others.items()}
    motion = kinematics(recording.motor_m, recording.period_s)
    held_n = beyond_sharp_n(axis.held, axis.coulomb_n, motion, recording.period_s)
    return with_model_force(
        Scene(
            recording.period_s,
            recording.time_s - recording.time_s[0],
            motion,
            recording.force_n,
            recording.force_n,
            axis.lead_m,
            axis.motor_mass_kg,
            recording.scale_m,
            recording.temperature_k,
            others,
            0.0 if held_n is None else held_n,
        )
    )


def with_model_force(scene: Scene) -> Scene:
    """The force that a rigid model with its own best values gives for the motion.

    Where the axis sticks, friction is what holds it: any share of the Coulomb level, and no step.
    """
    m = scene.motion
    y, rigid = _sides(scene, Sense.FORCE)
    used = _used(scene, Sense.FORCE)
    rigid = np.concatenate((rigid, np.ones((len(y), 1))), axis=1)
    (mass_kg, viscous_n_s_m, coulomb_n, offset_n), *_ = np.linalg.lstsq(rigid[used], y[used], rcond=None)
    frictionless_n = mass_kg * m.acceleration_m_s2 + viscous_n_s_m * m.velocity_m_s
    direction = holding(scene, frictionless_n + offset_n, max(coulomb_n, 1e-9))
    return scene._replace(
        motion=m._replace(direction=direction),
        model_force_n=frictionless_n + coulomb_n * direction + scene.held_n,
    )


def holding(scene: Scene, without_n: Array, level_n: Array | float) -> Array:
    """Direction of motion; where the axis sticks, the share of the friction level (n,) that holds it.

    `without_n`: the force of the model without friction.
    """
    measured_n = gaussian_filter1d(scene.force_n - scene.held_n, STICK_S / scene.period_s)
    share = np.clip((measured_n - without_n) / level_n, -1.0, 1.0)
    return np.where(scene.motion.moving, scene.motion.direction, share)


def known_to_the_model(scene: Scene, sense: Sense, known: Sequence[Known]) -> Array:
    """What the model has already of a difference (n,), unfiltered."""
    total = np.zeros(len(scene.time_s))
    for one in known:
        total += hypotheses(one.effect, sense)[0].columns(scene, one.shape) @ np.array(one.coefficients)
    return total


def difference(
    scenes: Sequence[Scene],
    sense: Sense,
    extra: Sequence[tuple[str, Shape]] = (),
    *,
    only: bool = False,
    known: Sequence[Known] = (),
) -> Difference:
    """The ledger of a sense, without what the model knows already.

    `extra`: more shapes to try, by effect; `only`: these and no others.
    """
    plan = _plan(scenes, sense, extra, only=only)
    used = [_used(scene, sense) for scene in scenes]
    block_of, recording_of_block = _blocks(scenes)
    base_names = BASE[sense]
    place, candidates = len(base_names), []
    for effect, shape, _, width in plan:
        places = tuple(range(place, place + width))
        place += width
        candidates += [
            Candidate(effect, shape, own, places) for own in _variants(effect, shape, sense, len(scenes))
        ]
    ledger = Ledger([name in OWN for name in base_names], candidates, recording_of_block)
    for scene, count, block in zip(scenes, used, block_of, strict=True):
        y, wide = _columns_of(scene, sense, plan, known)
        every = np.flatnonzero(count)[:: max(int(1.0 / (scene.period_s * OVERSAMPLING * FILTER_HZ)), 1)]
        ledger.add(y[every], wide[every], block[every], settled_way_m(scene)[every])
    ledger.normalise()
    return Difference(sense, scenes, ledger, plan, used, block_of, base_names, known)


def _columns_of(
    scene: Scene, sense: Sense, plan: Sequence[Planned], known: Sequence[Known]
) -> tuple[Array, Array]:
    """Both sides of a recording, filtered: (n,) and (n, c)."""
    y, base = _sides(scene, sense)
    low_pass = _low_pass(scene)
    if known:
        y = y - low_pass(known_to_the_model(scene, sense, known))
    raw = [one.columns(scene, one.shape) for one in plan]
    return y, np.concatenate([base, low_pass(np.concatenate(raw, axis=1))] if raw else [base], axis=1)


def _low_pass(scene: Scene) -> Callable[..., Array]:
    """The filter of both sides; with noisy positions, behind the bell of their derivatives too."""
    state_filter = StateFilter(scene.period_s, FILTER_HZ)
    if scene.motion.corner_hz >= CLEAN_HZ:
        return state_filter
    width = bell_s(scene.motion.corner_hz) / scene.period_s
    return lambda signal, derivative=0: state_filter(
        gaussian_filter1d(signal, width, axis=0, mode="nearest"), derivative
    )


def _sides(scene: Scene, sense: Sense) -> tuple[Array, Array]:
    """What is to be explained (n,), and the columns of every model (n, k), filtered alike."""
    m = scene.motion
    low_pass = _low_pass(scene)
    if sense is Sense.FORCE:
        base = [low_pass(m.position_m, 2), low_pass(m.position_m, 1), low_pass(m.direction)]
        return low_pass(scene.force_n - scene.held_n), np.stack(base, axis=1)
    assert scene.scale_m is not None  # noqa: S101  # nobody asks for the deviation without a scale
    late = low_pass(m.position_m, 1)
    return low_pass(scene.scale_m - m.position_m), np.stack((np.ones(len(late)), late), axis=1)


def _plan(
    scenes: Sequence[Scene], sense: Sense, extra: Sequence[tuple[str, Shape]], *, only: bool
) -> list[Planned]:
    """Effect, shape and columns of all that is tried; a shape that any recording can tell is tried on all."""
    plan = []
    for effect in ENTRIES:
        for hypothesis in hypotheses(effect, sense)[:1]:
            shapes = dict.fromkeys([] if only else hypothesis.shapes(scenes))
            shapes.update(dict.fromkeys(shape for name, shape in extra if name == effect))
            plan += [(effect, shape, hypothesis.columns) for shape in shapes]
    if not only:
        extra = [*((SHADOW, shape) for shape in term(SHADOW).shapes(scenes)), *extra]
    strange = dict.fromkeys((name, shape) for name, shape in extra if name.startswith(PREFIX))
    plan += [(name, shape, term(name).columns) for name, shape in strange]
    wide = [Planned(*entry, entry[2](scenes[0], entry[1]).shape[1]) for entry in plan]
    return [one for one in wide if one.width > 0]


def _variants(effect: str, shape: Shape, sense: Sense, recordings: int) -> list[bool]:
    """Whether an effect is tried with shared coefficients, with own ones in each recording, or both."""
    if effect.startswith(PREFIX):
        return [False]
    if effect == DRIFT and own_levels(shape):
        return [True]
    kinds = {h.per_recording for h in hypotheses(effect, sense)}
    return [False] if recordings == 1 else sorted(kinds)


def _used(scene: Scene, sense: Sense) -> NDArray[np.bool_]:
    """Not the filter's beginning; in the force, not where the axis sticks: friction may be anything there."""
    used = np.ones(len(scene.time_s), dtype=np.bool_)
    used[: StateFilter(scene.period_s, FILTER_HZ).settled] = False
    used[-math.ceil(END_S / scene.period_s) :] = False
    if sense is Sense.FORCE:
        used &= scene.motion.moving
    return used


def _blocks(scenes: Sequence[Scene]) -> tuple[list[NDArray[np.int64]], NDArray[np.int64]]:
    """Block of each sample, numbered through, and the recording of each block."""
    total_s = sum(len(scene.time_s) * scene.period_s for scene in scenes)
    length_s = min(BLOCK_S, total_s / FEWEST_BLOCKS)
    block_of, recordings, first = [], [], 0
    for index, scene in enumerate(scenes):
        n = len(scene.time_s)
        count = max(round(n * scene.period_s / length_s), 1)
        block_of.append(first + np.arange(n) * count // n)
        recordings += [index] * count
        first += count
    return block_of, np.array(recordings)
