"""One axis explained: the effects of each difference, and what they are worth on held-out blocks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.catalogue.kinds import Sense
from reconcile.evidence import Rules, Trial, paired, threshold
from reconcile.findings import contest, said
from reconcile.held_presliding import KERNELS
from reconcile.ledger import names
from reconcile.locate_noise import noise_floor
from reconcile.model_effects import model_effects
from reconcile.model_effects_held import held_base
from reconcile.payload import payload
from reconcile.refinement import refined
from reconcile.remainder import remainder
from reconcile.rests import rests, rms
from reconcile.scenes import difference, scene_of
from reconcile.selection import select, select_beside
from reconcile.unexplained import unexplained

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from reconcile.catalogue.kinds import Scene, Shape
    from reconcile.findings import Finding, Rival, Said
    from reconcile.ledger import Candidate, Ledger
    from reconcile.model_effects_known import Known
    from reconcile.model_file import NominalAxis
    from reconcile.recording import AxisRecording
    from reconcile.rests import Rest
    from reconcile.scenes import Difference

    Array = NDArray[np.float64]
    Index = NDArray[np.int64]

HELD_OUT = 4, 4
"""Of every so many stretches the last one is not looked at before the end; and the blocks of a stretch."""


AT_THE_FLOOR = 1.5
"""Noise floors: up to here nothing is left to be explained."""


class Level(NamedTuple):
    """RMS of a difference, SI, on the blocks that were fitted and on those held out."""

    train: float
    heldout: float


class Explanation(NamedTuple):
    """One sense of one axis."""

    sense: Sense
    findings: list[Finding]
    minor: list[Finding]
    """In the model, but too small or too doubtful to be named."""
    before: Level
    """The nominal model, with its own values."""
    refitted: Level
    """Its values fitted anew."""
    after: Level
    base: dict[str, float]
    """The fitted values; of those that each recording has for itself, the first one's."""
    timing: tuple[str, Shape] | None
    """How the lag below a sample was modelled, if there was one."""
    timing_s: float
    """Lag that is below a sample, 0 = none."""
    parameters_matter: bool
    """The nominal values are off by more than chance."""
    rests: list[Rest]
    """By recording."""


def explain(
    recordings: Sequence[AxisRecording], axis: NominalAxis, sense: Sense, rules: Rules
) -> Explanation:
    """All effects of one sense."""
    scenes = [scene_of(recording, axis) for recording in recordings]
    known = [
        one
        for one in model_effects(axis.held, axis, scenes)
        if one.sense is sense and not _in_scene(one, axis)
    ]
    sources = [recording.source for recording in recordings]
    found = _searched(scenes, sense, known, rules)
    strange = [] if _is_noise(found, sources, axis) else unexplained(*found[-2:], found.train, rules)
    told = _told(found)
    if strange:
        beside = _searched(scenes, sense, known, rules, strange, found.chosen)
        now = _told(beside)
        named = {finding.effect for finding in now.findings}
        if "unknown" in named or named >= {finding.effect for finding in told.findings}:
            found, told = beside, now  # else it takes a name away without being worth one
    _, _, train, held, final, chosen_there = found
    base, totals = final.ledger.slots([]), final.ledger.totals(train)
    # how the channels were sampled is nobody's physics: it is in all three levels
    timing = [c for c in chosen_there if told.timing and c.effect == told.timing[0]]
    anew = final.ledger.solve(final.ledger.slots(timing), totals)
    given = _nominal(axis, final, final.ledger.real(base, anew[: len(base)])) / _units(final.ledger, base)
    theta = final.ledger.solve(final.ledger.slots(chosen_there), totals)
    models = [(timing, np.append(given, anew[len(base) :])), (timing, anew), (chosen_there, theta)]
    before, refitted_level, after = (_levels(final.ledger, *model, train, held) for model in models)
    left = rests(final, sources, models, held)
    added = []
    if sense is Sense.FORCE:
        gains = (1.0 - (r / max(b, 1e-300)) ** 2 for b, r in zip(before, refitted_level, strict=True))
        added.append(payload(told.base, axis, *gains))
    if not any(finding.effect == "unknown" for finding in told.findings):
        added.append(
            remainder(
                left,
                sense,
                told.base["mass_kg"].value if sense is Sense.FORCE else axis.mass_kg,
                axis.encoder_resolution_m,
            )
        )
    return Explanation(
        sense,
        told.findings + [finding for finding in added if finding],
        told.minor,
        before,
        refitted_level,
        after,
        {name: estimate.value for name, estimate in told.base.items()},
        told.timing,
        told.timing_s,
        _differ(final.ledger, *models[0], train, rules),
        left,
    )


class _Searched(NamedTuple):
    """What was chosen, where all was tried and where it was refined."""

    chosen: list[Candidate]
    contests: dict[str, tuple[float, list[Rival]]]
    train: Index
    held: Index
    final: Difference
    chosen_there: list[Candidate]


def _told(found: _Searched) -> Said:
    return said(found.final, found.chosen_there, found.contests, found.train, found.held)


def _is_noise(found: _Searched, sources: Sequence[str], axis: NominalAxis) -> bool:
    """Whether the effects leave no more than the noise of the sensors."""
    ledger = found.final.ledger
    theta = ledger.solve(ledger.slots(found.chosen_there), ledger.totals(found.train))
    left = rests(found.final, sources, [(found.chosen_there, theta)] * 3, found.held)
    return rms(left, "after") <= AT_THE_FLOOR * noise_floor(left, found.final.sense, axis.mass_kg).rms


def _searched(
    scenes: Sequence[Scene],
    sense: Sense,
    known: Sequence[Known],
    rules: Rules,
    strange: Sequence[tuple[str, Shape]] = (),
    begun: Sequence[Candidate] | None = None,
) -> _Searched:
    """The effects that are believed beside the terms without a name."""
    wide = difference(scenes, sense, strange, known=known)
    train, held = _split(wide)
    trial = Trial(wide.ledger, train)
    wide.ledger.rows.clear()  # the trial has its own; they are the largest thing there is
    if begun is None:
        chosen = select(trial, rules)
    else:
        own = wide.ledger.by_key
        before, beside = [own[c.key] for c in begun], [own[*one, False] for one in strange]
        chosen = select_beside(trial, rules, before, beside)
    contests = {name: contest(trial, chosen, name) for name in names(chosen)}
    del trial  # before the next large thing is made
    return _Searched(chosen, contests, train, held, *refined(wide, chosen, train))


def _in_scene(one: Known, axis: NominalAxis) -> bool:
    """Whether the scene's own friction law stands for it."""
    return one.effect == "presliding_hysteresis" and not KERNELS.keys().isdisjoint(axis.held.effects)


def _split(wide: Difference) -> tuple[Index, Index]:
    """Blocks to fit on and blocks held out: every fourth stretch of each recording."""
    ledger = wide.ledger
    train, held = [], []
    for recording in range(ledger.recordings):
        own = np.flatnonzero((ledger.recording_of_block == recording) & (ledger.samples > 0))
        stretches, length = HELD_OUT
        apart = np.arange(len(own)) // length % stretches == stretches - 1
        train.append(own[~apart])
        held.append(own[apart])
    return np.concatenate(train), np.concatenate(held)


def _nominal(axis: NominalAxis, final: Difference, fitted: Array) -> Array:
    """The base coefficients as the model has them; what it cannot know (origins) as fitted."""
    if final.sense is Sense.FORCE:
        given = held_base(axis.held, axis)
        return np.array([given[name] for name in final.base_names])
    names_of_slots = [final.base_names[column] for column, _ in final.ledger.slots([])]
    return np.where([name == "origin_m" for name in names_of_slots], fitted, 0.0)


def _units(ledger: Ledger, slots: list[tuple[int, int]]) -> Array:
    """Coefficients of normalised columns times this are those of the columns as given."""
    return ledger.real(slots, np.ones(len(slots)))


def _levels(ledger: Ledger, chosen: list[Candidate], theta: Array, train: Index, held: Index) -> Level:
    slots = ledger.slots(chosen)

    def rms(blocks: Index) -> float:
        count = max(int(ledger.samples[blocks].sum()), 1)
        return math.sqrt(float(ledger.squares(slots, theta, blocks).sum()) / count)

    return Level(rms(train), rms(held))


def _differ(ledger: Ledger, timing: list[Candidate], nominal: Array, train: Index, rules: Rules) -> bool:
    """Whether fitted values predict unseen blocks better than the nominal ones, beyond chance."""
    trial = Trial(ledger, train)
    unseen, given = trial.unseen(timing), trial.given(timing, nominal)
    t = paired(unseen, given)
    gain = 1.0 - float(unseen.sum()) / max(float(given.sum()), 1e-300)
    return t >= threshold(1, len(train), rules.false_alarm) and gain >= rules.least_parameters
