"""The line of a recording in the list: when, program, length, axes, and whether a diagnosis can use it."""

from pathlib import Path

from servo_ctrl.hmi.diagnosis.job_files import FoundRecording
from servo_ctrl.hmi.languages.texts import tr
from servo_ctrl.hmi.shell.units import UnitSystem, duration_text

LEAST_S = 0.5
"""Bounds a recording from below, seconds; from `reconcile diagnose`, which refuses shorter ones."""
RESTS_M = 1e-4
"""Bounds the travel of an axis at rest, metres; chosen: it is below presliding."""


def recording_text(recording: FoundRecording, units: UnitSystem) -> str:
    """Return name, moment, program, length and the travel of each axis, in one line."""
    travels = (f"{axis.name.upper()} {units.length.with_unit(axis.travel_m)}" for axis in recording.axes)
    parts = (
        recording.name,
        recording.started.replace("T", " ")[:16],
        Path(recording.program).name,
        duration_text(recording.length_s) if recording.length_s else "",
        ", ".join(travels),
    )
    return " \N{MIDDLE DOT} ".join(part for part in parts if part)


def excitation_text(recording: FoundRecording) -> str:
    """Return whether the motions suffice for a diagnosis, or for which axes they do not, and why."""
    if not recording.length_s:
        return f"\N{WARNING SIGN} {tr('no rows, or damaged')}"
    reasons = []
    if recording.length_s < LEAST_S:
        reasons.append(tr("too short: identification needs at least {least:g} s", least=LEAST_S))
    for axis in recording.axes:
        name = axis.name.upper()
        if axis.travel_m < RESTS_M:
            reasons.append(tr("{axis} stands still: it cannot be identified", axis=name))
        elif not axis.both_ways:
            reasons.append(
                tr(
                    "{axis} moves in one direction only: friction and a constant force cannot be separated",
                    axis=name,
                )
            )
    return (
        f"\N{WARNING SIGN} {'; '.join(reasons)}" if reasons else tr("✓ every axis moves in both directions")
    )
