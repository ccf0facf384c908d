"""All checks of timing and sensors on the recordings of a diagnosis, before anything is identified.

Each check is a pure function on arrays in a file of this room; here they are applied and findings sorted.
"""

from collections.abc import Mapping as ByName
from collections.abc import Sequence
from typing import NamedTuple

from reconcile.errors import ReconcileError
from reconcile.formats.model_axis import ModelAxis
from reconcile.recording.recording import AxisRecording
from reconcile.recording.sensor_finding import SensorFinding, worst_first
from reconcile.sensing.channel import clips, hold, noise, quantum
from reconcile.sensing.delay import Delay, force_delay, scale_delay
from reconcile.sensing.judgement import Judge
from reconcile.sensing.origin import EncoderOrigin, origins
from reconcile.sensing.spectrum import noise_roll_off, transfer_roll_off

CHANNELS = ("motor_m", "force_n", "scale_m", "reference_m", "force_command_n")
DAMAGING_CHECKS = ("clipped", "frozen", "hold")
SENSORS = ("motor_m", "force_n", "scale_m")


class ChannelFacts(NamedTuple):
    """Measured properties of a channel of one recording."""

    channel: str
    quantum: float
    """Quantisation step, SI; 0 without one."""
    noise_rms: float
    """White noise, SI; at least the quantisation noise."""
    hold_samples: float
    """Samples for which a value is held; 1 without a hold."""


class SensorFacts(NamedTuple):
    """Measured properties of one recording."""

    source: str
    axis: str
    channels: dict[str, ChannelFacts]
    delays: tuple[Delay, ...]


class SensorReport(NamedTuple):
    """Results of all checks; `recordings` are those given, without unusable scales."""

    recordings: list[AxisRecording]
    facts: list[SensorFacts]
    origins: list[EncoderOrigin]
    findings: list[SensorFinding]


def examine(recordings: Sequence[AxisRecording], model: ByName[str, ModelAxis]) -> SensorReport:
    """Run all checks; findings, with those of reading, are sorted by severity.

    Raises:
        ReconcileError: unusable data; the first finding, with its place.

    """
    usable_recordings: list[AxisRecording] = []
    facts: list[SensorFacts] = []
    findings: list[SensorFinding] = []
    for recording in recordings:
        measured, found, usable = _examine_one(recording, model[recording.axis])
        usable_recordings.append(usable)
        facts.append(measured)
        findings += [*recording.findings, *found]
    found_origins: list[EncoderOrigin] = []
    for axis, nominal in model.items():
        own = [recording for recording in usable_recordings if recording.axis == axis]
        found_origins += origins(own, nominal.lead_m) if len(own) > 1 else []
    findings += [origin.finding() for origin in found_origins if origin.moved]
    findings = worst_first(dict.fromkeys(findings))
    if findings and findings[0].severity == "unusable":
        first = findings[0]
        where = ", ".join(part for part in (f"axis {first.axis}", first.channel) if part)
        raise ReconcileError(first.source, where, first.message, first.remedy)
    return SensorReport(usable_recordings, facts, found_origins, findings)


def _examine_one(
    recording: AxisRecording, model: ModelAxis
) -> tuple[SensorFacts, list[SensorFinding], AxisRecording]:
    judge = Judge(recording, model)
    usable, found = recording, judge.constant()
    if any(finding.severity == "unusable" for finding in found):
        return SensorFacts(recording.source, recording.axis, {}, ()), found, recording
    if any(finding.channel == "scale_m" for finding in found):
        usable = recording._replace(scale_m=None)
        judge = Judge(usable, model)
    channels: dict[str, ChannelFacts] = {}
    for name in CHANNELS:
        values = getattr(usable, name)
        if values is None:
            continue
        step = quantum(values)
        held = hold(values, step)
        channels[name] = ChannelFacts(name, step, noise(values, step), held.samples)
        found += judge.clipped(name, clips(values, step))
        if name in SENSORS:
            found += judge.held(name, held)
            found += judge.resolution(name, step)
            found += judge.filtered(name, noise_roll_off(values, step, usable.period_s))
    found += judge.frozen()
    damaged = {finding.channel for finding in found if finding.check in DAMAGING_CHECKS}
    delays = _delays(usable)
    for delay in delays:
        found += judge.delayed(delay, damaged)
    found += _transfer(usable, judge)
    found += judge.signs_and_units(damaged)
    return SensorFacts(recording.source, recording.axis, channels, delays), found, usable


def _delays(recording: AxisRecording) -> tuple[Delay, ...]:
    motor_m, force_n, period_s = recording.motor_m, recording.force_n, recording.period_s
    found: list[Delay | None] = []
    if recording.scale_m is not None:
        found.append(scale_delay(motor_m, recording.scale_m, force_n, period_s))
    if recording.force_command_n is not None:
        found.append(force_delay(recording.force_command_n, force_n, period_s))
    return tuple(delay for delay in found if delay is not None)


def _transfer(recording: AxisRecording, judge: Judge) -> list[SensorFinding]:
    found: list[SensorFinding] = []
    if recording.scale_m is not None:
        roll_off = transfer_roll_off(recording.motor_m, recording.scale_m, recording.period_s)
        found += judge.filtered("scale_m", roll_off, against="motor_m")
    if recording.force_command_n is not None:
        roll_off = transfer_roll_off(recording.force_command_n, recording.force_n, recording.period_s)
        found += judge.filtered("force_n", roll_off, against="force_command_n")
    return found
