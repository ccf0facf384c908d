"""Closed-loop replay within a diagnosis: the nominal and the repaired model beside the first recordings.

A replay that fails is told, and takes nothing from what else was found.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reconcile.errors import ReconcileError
from reconcile.replay import (
    ONCE_A_TURN,
    ORIGIN_S,
    fitted_origin_m,
    plant_of,
    remaining_delay_s,
    replay,
    shortened,
)
from reconcile.replay_match import unmatched

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hil_sim.config import PlantConfig
    from reconcile.explain import Explanation
    from reconcile.model_file import NominalModel
    from reconcile.recording import AxisRecording
    from reconcile.replay import Replay
    from reconcile.replay_controller import Controller

MOST_RECORDINGS, LONGEST_S = 2, 30.0
"""Of each axis, and of each recording: so much is enough to see by."""
UNSTABLE = 10.0
"""Force error, in the RMS of the recorded force, that no wrong value makes in a loop that holds."""


UNMATCHED = 0.1
"""Share of the recorded force; more of it that the controller does not give is told."""


class Loop(NamedTuple):
    """What is known of an axis' loop."""

    controller: Controller
    timing_s: float = 0.0
    """That was found."""
    own_zeros: bool = False
    """The recordings differ in their encoder's zero; the repaired model has that of the first."""


class Replayed(NamedTuple):
    """One recording, by both models."""

    axis: str
    before: Replay
    """The nominal model, without any timing."""
    after: Replay
    """The repaired one, with the timing that was found."""


class Replays(NamedTuple):
    """Of a whole diagnosis."""

    done: list[Replayed]
    notes: list[str]
    """What could not be replayed, and why."""


def replay_models(
    recordings: Sequence[AxisRecording],
    model: NominalModel,
    repairs: Mapping[str, Mapping[str, Mapping[str, Any]]],
    loops: Mapping[str, Loop],
) -> Replays:
    """Every axis whose controller is known."""
    done: list[Replayed] = []
    notes: list[str] = []
    if not loops:
        return Replays(done, notes)
    try:
        plants = plant_of(model), plant_of(model, repairs)
    except ReconcileError as error:
        return Replays(done, [_note(str(error))])
    for axis, loop in loops.items():
        own = [one for one in recordings if one.axis == axis]
        led = [one for one in own if one.reference_m is not None]
        if own and not led:
            notes.append(_note(f"axis {axis} has no reference: name it by --map reference=NAME"))
        for recording in led[:MOST_RECORDINGS]:
            cut = shortened(recording, recording.time_s <= LONGEST_S)
            elsewhere = loop.own_zeros and recording.source != own[0].source
            try:
                done.append(_both(cut, plants, loop, elsewhere=elsewhere))
            except ReconcileError as error:
                notes.append(_note(str(error)))
                continue
            notes += _remarks(cut, loop.controller, done[-1])
    return Replays(done, notes)


def loop_of(controller: Controller, explanations: Sequence[Explanation]) -> Loop:
    """Of an axis that was explained, the force first."""
    found = [finding for one in explanations for finding in [*one.findings, *one.minor]]
    own_zeros = any(
        candidate.effect in ONCE_A_TURN and candidate.per_recording
        for finding in found
        for candidate in finding.candidates
    )
    return Loop(controller, explanations[0].timing_s, own_zeros)


def replays_json(done: Sequence[Replayed], axis: str) -> list[dict[str, Any]]:
    """`fit[axis]["replay"]` of verdict.json."""
    found = []
    for one in done:
        if one.axis != axis:
            continue
        before, after = one.before.error(), one.after.error()
        found.append(
            {
                "recording": one.before.source,
                "force_error": {"before": before.force_relative, "after": after.force_relative},
                "motor_rms_m": {"before": before.motor_rms_m, "after": after.motor_rms_m},
            }
        )
    return found


def _both(
    recording: AxisRecording, plants: tuple[PlantConfig, PlantConfig], loop: Loop, *, elsewhere: bool
) -> Replayed:
    delays_s = 0.0, remaining_delay_s(loop.timing_s, loop.controller.period_s)
    before, after = (
        _one(recording, plant, loop.controller, delay_s, elsewhere=elsewhere)
        for plant, delay_s in zip(plants, delays_s, strict=True)
    )
    way_m = max(float(np.ptp(recording.motor_m)), plants[0].axes[recording.axis].lead_m)
    for name, one in (("nominal", before), ("repaired", after)):
        with np.errstate(over="ignore", invalid="ignore"):
            error = one.error()
        if not (error.motor_rms_m <= way_m and error.force_relative <= UNSTABLE):  # nor is it NaN
            place = f"axis {recording.axis}"
            reason = f"the loop around the {name} model is unstable"
            remedy = f"is axis.{recording.axis}.controller the loop that was recorded?"
            raise ReconcileError(recording.source, place, reason, remedy)
    return Replayed(recording.axis, before, after)


def _one(
    recording: AxisRecording, plant: PlantConfig, controller: Controller, delay_s: float, *, elsewhere: bool
) -> Replay:
    origin_m = fitted_origin_m(recording, plant, controller, delay_s=delay_s) if elsewhere else 0.0
    return replay(recording, plant, controller, delay_s=delay_s, origin_m=origin_m)


def _remarks(recording: AxisRecording, controller: Controller, done: Replayed) -> list[str]:
    """What is to be known beside the errors."""
    said = []
    if done.after.origin_m:
        shift_mm = done.after.origin_m * 1e3
        said.append(f"its zero was shifted by {shift_mm:.3g} mm, by which its first {ORIGIN_S:g} s fit best")
    share = unmatched(recording, controller)
    if share is not None and share > UNMATCHED:
        said.append(
            "fed with the recorded positions, the controller gives a force that is "
            f"{100.0 * share:.0f} % off the recorded one: it is another, or a force acted beside it; the "
            "errors are not the models' alone"
        )
    return [_note(f"{recording.source}: axis {recording.axis}: {one}") for one in said]


def _note(why: str) -> str:
    return f"closed-loop replay: {why}"
