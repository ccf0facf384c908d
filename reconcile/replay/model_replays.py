"""Closed-loop replay within a diagnosis: nominal and repaired model beside the first recordings.

A replay that fails becomes a note of the verdict; the other findings of the diagnosis do not depend on it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from hil_sim.config import PlantConfig
from reconcile.errors import ReconcileError
from reconcile.identification.explain import Explanation
from reconcile.nominal_model.model_file import NominalModel
from reconcile.recording.recording import AxisRecording
from reconcile.regression.filter_ends import FILTER_HZ
from reconcile.regression.state_filter import StateFilter
from reconcile.replay.controller import Controller
from reconcile.replay.replay import (
    FIXED_TO_SCREW,
    ORIGIN_FIT_S,
    Replay,
    fitted_origin_m,
    plant_of,
    remaining_delay_s,
    replay,
    shortened,
)

HIGH_PASS_S = 0.5
"""Time constant of the high pass on both forces: it removes the unknown initial integral and its drift."""


def controller_mismatch(recording: AxisRecording, controller: Controller) -> float | None:
    """Return the RMS of the recorded force that the controller does not reproduce, over that of the force.

    Its inputs are the recorded positions; no model is involved. A force that it does not reproduce comes from
    another control law or was injected beside it: the replay errors then do not measure the models alone.
    None where it cannot be determined: no reference, sampled more coarsely than the controller, force at its
    limit with an integral, or too short.
    """
    period_s, window = controller.sample_time_s, controller.velocity_samples
    if recording.reference_m is None or recording.period_s > 1.01 * period_s:
        return None
    low_pass = StateFilter(period_s, FILTER_HZ)
    count = math.floor(recording.time_s[-1] / period_s + 1e-6) + 1
    if count < 2 * (window + low_pass.settled):
        return None
    command_n = recording.force_n if recording.force_command_n is None else recording.force_command_n
    instants_s = np.arange(count) * period_s
    motor_m, reference_m, force_n = (
        np.interp(instants_s, recording.time_s, values)
        for values in (recording.motor_m, recording.reference_m, command_n)
    )
    velocity_m_s = (motor_m[window:] - motor_m[:-window]) / (window * period_s)
    error_m_s = controller.position_gain_1_s * (reference_m - motor_m)[window:] - velocity_m_s
    error_m_s += controller.velocity_feedforward * np.gradient(reference_m, period_s)[window:]
    proportional_n, force_n = controller.velocity_gain_n_s_m * error_m_s, force_n[window:]
    if controller.velocity_integral_n_m == 0.0:
        proportional_n = np.clip(proportional_n, -controller.force_limit_n, controller.force_limit_n)
    elif np.abs(force_n).max() >= 0.99 * controller.force_limit_n:
        return None
    high_pass = [1.0, -math.exp(-period_s / HIGH_PASS_S)]
    # an integral behind the high pass is a low pass of its input
    integral_n = lfilter([controller.velocity_integral_n_m * period_s], high_pass, error_m_s)
    expected_n = lfilter([1.0, -1.0], high_pass, proportional_n - proportional_n[0]) + integral_n
    recorded_n = lfilter([1.0, -1.0], high_pass, force_n - force_n[0])
    missed_n, seen_n = (low_pass(one)[low_pass.settled :] for one in (recorded_n - expected_n, recorded_n))
    return float(np.linalg.norm(missed_n) / max(float(np.linalg.norm(seen_n)), 1e-300))


REPLAYED_RECORDINGS, REPLAYED_S = 2, 30.0
"""Recordings of an axis, and seconds of each: enough to judge both models, and a few seconds of work."""
UNSTABLE_FORCE_ERROR = 10.0
"""Force error over the recorded RMS; a stable loop stays far below it for any parameters."""
REPORTED_MISMATCH = 0.1
"""Controller mismatch above which it is reported, as a share of the recorded force; chosen."""


class ControlLoop(NamedTuple):
    """The known controller of an axis, and what the diagnosis identified of its timing and encoder zeros."""

    controller: Controller
    timing_s: float = 0.0
    separate_zeros: bool = False
    """Each recording has its own encoder zero; the repaired model has that of the first."""


class ReplayComparison(NamedTuple):
    """One recording replayed with both models."""

    axis: str
    nominal: Replay
    """Without the identified timing."""
    repaired: Replay
    """With the identified timing."""


class ModelReplays(NamedTuple):
    """The closed-loop replays of a diagnosis."""

    comparisons: list[ReplayComparison]
    notes: list[str]
    """What could not be replayed, and why."""


def replay_models(
    recordings: Sequence[AxisRecording],
    model: NominalModel,
    updates: Mapping[str, Mapping[str, Mapping[str, Any]]],
    loops: Mapping[str, ControlLoop],
) -> ModelReplays:
    """Replay the first recordings of every axis in `loops`; `updates` by axis and section of the model."""
    if not loops:
        return ModelReplays([], [])
    try:
        plants = plant_of(model), plant_of(model, updates)
    except ReconcileError as error:
        return ModelReplays([], [_note(str(error))])
    comparisons: list[ReplayComparison] = []
    notes: list[str] = []
    for axis, loop in loops.items():
        of_axis = [one for one in recordings if one.axis == axis]
        with_reference = [one for one in of_axis if one.reference_m is not None]
        if of_axis and not with_reference:
            notes.append(_note(f"axis {axis} has no reference: name it by --map reference=NAME"))
        for recording in with_reference[:REPLAYED_RECORDINGS]:
            beginning = shortened(recording, recording.time_s <= REPLAYED_S)
            fit_origin = loop.separate_zeros and recording.source != of_axis[0].source
            try:
                comparison = _compare(beginning, plants, loop, fit_origin=fit_origin)
            except ReconcileError as error:
                notes.append(_note(str(error)))
            else:
                comparisons.append(comparison)
                notes += _remarks(beginning, loop.controller, comparison)
    return ModelReplays(comparisons, notes)


def control_loop(controller: Controller, explanations: Sequence[Explanation]) -> ControlLoop:
    """Combine the controller with the timing and encoder zeros of an axis' explanations, the force first."""
    effects = [effect for one in explanations for effect in [*one.findings, *one.minor]]
    separate_zeros = any(
        candidate.effect in FIXED_TO_SCREW and candidate.per_recording
        for effect in effects
        for candidate in effect.candidates
    )
    return ControlLoop(controller, explanations[0].timing_s, separate_zeros)


def replays_json(comparisons: Sequence[ReplayComparison], axis: str) -> list[dict[str, Any]]:
    """Return `fit[axis]["replay"]` of verdict.json."""
    own = [one for one in comparisons if one.axis == axis]
    errors = [(one.nominal.error(), one.repaired.error()) for one in own]
    return [
        {
            "recording": one.nominal.source,
            "force_error": {"before": before.force_relative, "after": after.force_relative},
            "motor_rms_m": {"before": before.motor_rms_m, "after": after.motor_rms_m},
        }
        for one, (before, after) in zip(own, errors, strict=True)
    ]


def _compare(
    recording: AxisRecording, plants: tuple[PlantConfig, PlantConfig], loop: ControlLoop, *, fit_origin: bool
) -> ReplayComparison:
    """Replay with the nominal and the repaired plant. Raises ReconcileError where a loop is unstable."""
    controller = loop.controller
    replays = []
    delays_s = 0.0, remaining_delay_s(loop.timing_s, controller.sample_time_s)
    for plant, delay_s in zip(plants, delays_s, strict=True):
        origin_m = fitted_origin_m(recording, plant, controller, delay_s=delay_s) if fit_origin else 0.0
        replays.append(replay(recording, plant, controller, delay_s=delay_s, origin_m=origin_m))
    travel_m = max(float(np.ptp(recording.motor_m)), plants[0].axes[recording.axis].lead_m)
    for name, one in zip(("nominal", "repaired"), replays, strict=True):
        with np.errstate(over="ignore", invalid="ignore"):
            error = one.error()
        # negated, so that NaN counts as unstable
        if not (error.motor_rms_m <= travel_m and error.force_relative <= UNSTABLE_FORCE_ERROR):
            reason = f"the loop around the {name} model is unstable"
            remedy = f"is axis.{recording.axis}.controller the loop that was recorded?"
            raise ReconcileError(recording.source, f"axis {recording.axis}", reason, remedy)
    return ReplayComparison(recording.axis, *replays)


def _remarks(recording: AxisRecording, controller: Controller, comparison: ReplayComparison) -> list[str]:
    """Return what a reader needs to know to interpret the errors."""
    remarks = []
    if comparison.repaired.origin_m:
        shift_mm = comparison.repaired.origin_m * 1e3
        remarks.append(
            f"its zero was shifted by {shift_mm:.3g} mm, by which its first {ORIGIN_FIT_S:g} s fit best"
        )
    mismatch = controller_mismatch(recording, controller)
    if mismatch is not None and mismatch > REPORTED_MISMATCH:
        remarks.append(
            "fed with the recorded positions, the controller gives a force that is "
            f"{100.0 * mismatch:.0f} % off the recorded one: it is another, or a force acted beside it; the "
            "errors are not the models' alone"
        )
    return [_note(f"{recording.source}: axis {recording.axis}: {one}") for one in remarks]


def _note(why: str) -> str:
    return f"closed-loop replay: {why}"
