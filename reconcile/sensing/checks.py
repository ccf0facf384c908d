"""Runs all checks of timing and sensors on the recordings of a diagnosis, before the identification.

Each check is a pure function on arrays in a file of this room; this file applies them and sorts the findings.
"""

from collections.abc import Mapping as ByName
from collections.abc import Sequence
from typing import NamedTuple

from reconcile.errors import ReconcileError
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.formats.rotary_units import sentence_of, unit_of
from reconcile.recording.recording import AxisRecording
from reconcile.recording.sensor_finding import SensorFinding, worst_first
from reconcile.sensing.channel import clips, hold_samples, quantum
from reconcile.sensing.delay import force_delay, scale_delay
from reconcile.sensing.judgement import Judge
from reconcile.sensing.origin import rezeroed
from reconcile.sensing.spectrum import noise_roll_off, transfer_roll_off
from reconcile.sensing.wrong_channels import exchanged_forces
from reconcile.sensing.wrong_units import signs_and_units

CHANNELS = ("motor_m", "force_n", "scale_m", "reference_m", "force_command_n")
SENSORS = CHANNELS[:3]
DAMAGING_CHECKS = ("clipped", "frozen", "hold")


class SensorReport(NamedTuple):
    """Results of all checks; `recordings` are the given ones without unusable scales."""

    recordings: list[AxisRecording]
    findings: list[SensorFinding]


def examine(recordings: Sequence[AxisRecording], model: ByName[str, NominalAxis]) -> SensorReport:
    """Run all checks; the findings, including those of reading, are sorted by severity.

    An unusable recording among good ones of its axis is set aside with a warning.

    Raises:
        ReconcileError: no recording of an axis is usable; its first finding, with its place.

    """
    usable_recordings: list[AxisRecording] = []
    findings: list[SensorFinding] = []
    refused: list[tuple[AxisRecording, list[SensorFinding]]] = []
    exchanged = list(exchanged_forces(recordings))
    if exchanged and len(exchanged) == len({one.source for one in recordings}):
        finding, _ = exchanged[0]
        raise ReconcileError(finding.source, f"axis {finding.axis}", finding.message, finding.remedy)
    for recording in recordings:
        found, usable = _examine_one(recording, model[recording.axis])
        whole = [*recording.findings, *found]
        if any(finding.severity == "unusable" for finding in whole):
            refused.append((recording, whole))
        else:
            usable_recordings.append(usable)
            findings += whole
    good = {recording.axis for recording in usable_recordings}
    for recording, whole in refused:
        # an axis at standstill while another one moved is not a defect
        stood = bool(good) and any(f.check == "constant" and f.channel == "motor_m" for f in whole)
        findings += map(_set_aside, whole) if recording.axis in good or stood else whole
    for axis, nominal in model.items():
        own = [recording for recording in usable_recordings if recording.axis == axis]
        findings += rezeroed(own, nominal.lead_m)
    findings = worst_first(dict.fromkeys(_in_units_of(one, model) for one in findings))
    if findings and findings[0].severity == "unusable":
        first = findings[0]
        where = ", ".join(part for part in (f"axis {first.axis}", first.channel) if part)
        raise ReconcileError(first.source, where, first.message, first.remedy)
    return SensorReport(usable_recordings, findings)


def _in_units_of(finding: SensorFinding, model: ByName[str, NominalAxis]) -> SensorFinding:
    rotary = finding.axis in model and model[finding.axis].rotary
    return finding._replace(
        unit=unit_of(finding.unit, rotary=rotary),
        message=sentence_of(finding.message, rotary=rotary),
        remedy=sentence_of(finding.remedy, rotary=rotary),
    )


def _set_aside(finding: SensorFinding) -> SensorFinding:
    """Return a finding as a warning: its recording is set aside, not the whole diagnosis refused."""
    if finding.severity != "unusable":
        return finding
    return finding._replace(severity="warning", message=f"the recording is set aside: {finding.message}")


def _examine_one(recording: AxisRecording, model: NominalAxis) -> tuple[list[SensorFinding], AxisRecording]:
    usable, found = recording, [*Judge(recording, model).constant()]
    if any(finding.severity == "unusable" for finding in found):
        return found, recording
    if any(finding.channel == "scale_m" for finding in found):
        usable = recording._replace(scale_m=None)
    judge, period_s = Judge(usable, model), usable.period_s
    for name in CHANNELS:
        values = getattr(usable, name)
        if values is None:
            continue
        step = quantum(values)
        found += judge.clipped(name, clips(values, step))
        if name in SENSORS:
            found += judge.held(name, hold_samples(values, step))
            found += judge.resolution(name, values, step)
            found += judge.filtered(name, noise_roll_off(values, step, period_s))
    found += [*judge.rate(), *judge.frozen()]
    damaged = {finding.channel for finding in found if finding.check in DAMAGING_CHECKS}
    motor_m, scale_m = usable.motor_m, usable.scale_m
    force_n, command_n = usable.force_n, usable.force_command_n
    if scale_m is not None:
        found += judge.delayed(scale_delay(motor_m, scale_m, force_n, period_s), damaged)
    if command_n is not None:
        found += judge.delayed(force_delay(command_n, force_n, period_s), damaged)
    if scale_m is not None:
        found += judge.filtered("scale_m", transfer_roll_off(motor_m, scale_m, period_s), "motor_m")
    if command_n is not None:
        found += judge.filtered("force_n", transfer_roll_off(command_n, force_n, period_s), "force_command_n")
    return [*found, *signs_and_units(judge, damaged)], usable
