"""Closed-loop replay within a diagnosis: the nominal and the repaired model beside the first recordings.

A replay that fails is told, and takes nothing from what else was found.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from reconcile.errors import ReconcileError
from reconcile.replay import plant_of, remaining_delay_s, replay, shortened

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hil_sim.config import PlantConfig
    from reconcile.model_file import NominalModel
    from reconcile.recording import AxisRecording
    from reconcile.replay import Replay
    from reconcile.replay_controller import Controller

MOST_RECORDINGS, LONGEST_S = 2, 30.0
"""Of each axis, and of each recording: so much is enough to see by."""
UNSTABLE = 10.0
"""Force error, in the RMS of the recorded force, that no wrong value makes in a loop that holds."""


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
    controllers: Mapping[str, Controller],
    timings_s: Mapping[str, float],
) -> Replays:
    """Every axis with a known controller; `timings_s`: what was found, by axis.

    All recordings have the zero of the model: it was fitted to them together.
    """
    done: list[Replayed] = []
    notes: list[str] = []
    if not controllers:
        return Replays(done, notes)
    try:
        plants = plant_of(model), plant_of(model, repairs)
    except ReconcileError as error:
        return Replays(done, [_not_replayed(str(error))])
    for axis, controller in controllers.items():
        own = [one for one in recordings if one.axis == axis]
        led = [one for one in own if one.reference_m is not None]
        if own and not led:
            notes.append(_not_replayed(f"axis {axis} has no reference: name it by --map reference=NAME"))
        for recording in led[:MOST_RECORDINGS]:
            cut = shortened(recording, recording.time_s <= LONGEST_S)
            try:
                done.append(_both(cut, plants, controller, timings_s.get(axis, 0.0)))
            except ReconcileError as error:
                notes.append(_not_replayed(str(error)))
    return Replays(done, notes)


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
    recording: AxisRecording,
    plants: tuple[PlantConfig, PlantConfig],
    controller: Controller,
    timing_s: float,
) -> Replayed:
    delay_s = remaining_delay_s(timing_s, controller.period_s)
    before = replay(recording, plants[0], controller)
    after = replay(recording, plants[1], controller, delay_s=delay_s)
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


def _not_replayed(why: str) -> str:
    return f"closed-loop replay: {why}"
