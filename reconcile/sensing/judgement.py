"""Converts measured properties of channels to findings: which defect, where, how large, what to do."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.formats.column_origin import entry_of
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.recording.recording import AxisRecording
from reconcile.recording.sensor_finding import SensorFinding, Severity
from reconcile.recording.time_column import SLOW_CORNER_SHARE, SLOW_RATE_HZ
from reconcile.sensing.channel import Clip, frozen, is_on_grid, noise, quantum
from reconcile.sensing.delay import Delay
from reconcile.sensing.spectrum import RollOff

UNITS = {"force_n": "N", "force_command_n": "N"}
LEAST_TRAVEL_M = 2e-6
"""Least travel of a recording, m; presliding is recorded within a few micrometres."""
LEAST_TRAVEL_NOISES = 20.0
"""The same as a multiple of the noise of the position."""
LEAST_FROZEN_TRAVEL_M = 200e-6
"""Least travel of the other position, m, while a frozen one is constant; more than any backlash."""
LARGEST_DELAY_SAMPLES, LARGEST_COMMAND_DELAY_SAMPLES = 0.2, 3.0
"""Delays that are reported, samples; a force lags its command by the bus and the current loop."""
LEAST_HOLD_SAMPLES = 1.3
"""Least mean number of samples of a held value for a channel to count as sampled too slowly."""
LEAST_SPEED_SHARE = 0.2
"""Least speed before a clipped position, over the 95th percentile: a slower axis just stopped there."""


class Judge(NamedTuple):
    """Turns measured properties of one recording into findings."""

    recording: AxisRecording
    model: NominalAxis

    def finding(
        self,
        check: str,
        severity: Severity,
        channel: str,
        size: float,
        unit: str,
        message: str,
        remedy: str = "",
        rows: tuple[int, int] | None = None,
    ) -> SensorFinding:
        """Return a finding; `rows`: first and last sample, None for the whole recording."""
        start_s, end_s = (self.at_s(row) for row in rows) if rows else (math.nan, math.nan)
        return SensorFinding(
            check=check,
            severity=severity,
            source=self.recording.source,
            axis=self.recording.axis,
            channel=channel,
            start_s=start_s,
            end_s=end_s,
            size=size,
            unit=unit,
            message=message,
            remedy=remedy,
        )

    def entry(self, channel: str, factor: float, source: str = "") -> str:
        """Return an entry of `--map` that scales a channel, or reads `source` instead, by `factor`."""
        return entry_of(self.recording.origins, self.recording.axis, channel, factor, source)

    def exchanged(self, first: str, second: str) -> str:
        """Return entries of `--map` that exchange two channels."""
        origins, axis = self.recording.origins, self.recording.axis
        pairs = ((first, second), (second, first))
        return ",".join(entry_of(origins, axis, to, 1.0, source) for to, source in pairs)

    def at_s(self, row: int) -> float:
        """Return the time of a sample in the file, s."""
        return self.recording.start_s + float(self.recording.time_s[row])

    def constant(self) -> Iterator[SensorFinding]:
        """Yield findings of channels that do not change."""
        travel_m, swing_n = float(np.ptp(self.recording.motor_m)), float(np.ptp(self.recording.force_n))
        motor_m = self.recording.motor_m
        noise_m = LEAST_TRAVEL_NOISES * noise(motor_m, quantum(motor_m))
        least_m = max(LEAST_TRAVEL_M, 10.0 * (self.model.encoder_resolution_m or 0.0))
        if travel_m < max(least_m, noise_m):
            message = f"the motor moves by {travel_m * 1e6:.3g} um in all: there is no motion to compare"
            remedy = "is it the right column, and is its unit the right one?"
            if travel_m >= least_m:
                jitter_um, travel_um = noise_m / LEAST_TRAVEL_NOISES * 1e6, travel_m * 1e6
                message = f"jitters by {jitter_um:.3g} um RMS, too much for a motion of {travel_um:.3g} um"
                remedy = "does the axis oscillate, or is it the wrong column?"
            yield self.finding(
                "constant", "unusable", "motor_m", size=travel_m, unit="m", message=message, remedy=remedy
            )
        if swing_n == 0.0:
            message = f"the force is {self.recording.force_n[0]:.6g} N throughout"
            remedy = "is it the right column, and was the drive on?"
            yield self.finding(
                "constant", "unusable", "force_n", size=0.0, unit="N", message=message, remedy=remedy
            )
        scale_m = self.recording.scale_m
        if scale_m is not None and np.ptp(scale_m) < 0.01 * travel_m:
            message = (
                f"the scale stands still while the motor moves by {travel_m * 1e3:.4g} mm; it is left out"
            )
            yield self.finding(
                "constant", "warning", "scale_m", size=float(np.ptp(scale_m)), unit="m", message=message
            )

    def rate(self) -> Iterator[SensorFinding]:
        """Yield a finding where the sample rate is too low for much of the physics."""
        rate_hz = 1.0 / self.recording.period_s
        if rate_hz < SLOW_RATE_HZ:
            apart_ms, seen_hz = self.recording.period_s * 1e3, SLOW_CORNER_SHARE * rate_hz
            message = (
                f"its samples are {apart_ms:.3g} ms apart: nothing above {0.5 * rate_hz:.3g} Hz is in them, "
                f"and only what is below {seen_hz:.2g} Hz is explained; presliding, reversals, delays and "
                "ripples at speed may hide"
            )
            remedy = "record at 1 kHz to tell them"
            yield self.finding("rate", "note", "", size=rate_hz, unit="Hz", message=message, remedy=remedy)

    def frozen(self) -> Iterator[SensorFinding]:
        """Yield findings of channels that are constant for a while although the axis moves."""
        motor_m, force_n, scale_m = self.recording.motor_m, self.recording.force_n, self.recording.scale_m
        pairs: list[tuple[str, Array, Array, float]] = []
        if scale_m is not None:
            pairs.append(("scale_m", scale_m, motor_m, LEAST_FROZEN_TRAVEL_M))
            pairs.append(("motor_m", motor_m, scale_m, LEAST_FROZEN_TRAVEL_M))
        if np.mean(np.diff(force_n) == 0.0) < 0.5:
            pairs.append(("force_n", force_n, motor_m, max(self.model.lead_m, 0.1 * float(np.ptp(motor_m)))))
        for channel, values, beside, at_least in pairs:
            if (stretch := frozen(values, beside, at_least)) is None:
                continue
            first, last, travel_m = stretch
            if channel == "force_n" and values[first] in {values.min(), values.max()}:
                continue  # clipped
            span = f"{self.at_s(first):.3f} to {self.at_s(last):.3f} s"
            message = f"does not change from {span} while the axis moves by {travel_m * 1e3:.4g} mm"
            remedy = "cut that stretch out: a sensor or its bus failed"
            yield self.finding(
                "frozen",
                "warning",
                channel,
                size=travel_m,
                unit="m",
                message=message,
                remedy=remedy,
                rows=(first, last),
            )

    def clipped(self, channel: str, clips: Sequence[Clip]) -> Iterator[SensorFinding]:
        """Yield findings of a force at its limit, or of a position that stops abruptly at an extreme."""
        unit = UNITS.get(channel, "m")
        for clip in clips:
            if unit == "m" and not self._stops_abruptly(channel, clip.first):
                continue
            level = f"{clip.level:.6g} N" if unit == "N" else f"{clip.level * 1e3:.6g} mm"
            message = (
                f"{clip.samples} samples are at {level}, its extreme, first at {self.at_s(clip.first):.3f} s"
            )
            remedy = "the true value may be beyond: leave such stretches out, or raise the range"
            yield self.finding(
                "clipped",
                "warning",
                channel,
                size=float(clip.samples),
                unit="samples",
                message=message,
                remedy=remedy,
                rows=(clip.first, clip.last),
            )

    def _stops_abruptly(self, channel: str, row: int) -> bool:
        step_m = np.abs(np.diff(getattr(self.recording, channel)))
        return row > 1 and float(step_m[row - 2]) > LEAST_SPEED_SHARE * float(np.percentile(step_m, 95.0))

    def held(self, channel: str, samples: float) -> Iterator[SensorFinding]:
        """Yield a finding where a channel is sampled too slowly: each value is held for `samples`."""
        if samples >= LEAST_HOLD_SAMPLES:
            new_ms = samples * self.recording.period_s * 1e3
            message = (
                f"each value is repeated, {samples:.3g} samples on average: it is new every {new_ms:.3g} ms"
            )
            remedy = "record it at its own rate or faster; held values are late by half of that"
            yield self.finding(
                "hold", "warning", channel, size=samples, unit="samples", message=message, remedy=remedy
            )

    def resolution(self, channel: str, values: Array, step_m: float) -> Iterator[SensorFinding]:
        """Yield findings where the step of a position differs from the resolution in the model file."""
        stated = {"motor_m": self.model.encoder_resolution_m, "scale_m": self.model.scale_resolution_m}
        stated_m = stated.get(channel)
        if not stated_m or any(finding.check == "jitter" for finding in self.recording.findings):
            return
        if step_m == 0.0 and is_on_grid(values, stated_m):
            return  # in fast motion all distances are of many counts
        stated_um, step_um = stated_m * 1e6, step_m * 1e6
        if step_m == 0.0:
            message = f"its values lie on no grid, although a count is {stated_um:.4g} um: it was treated"
            remedy = "record the counts themselves: what was filtered or rescaled is late or smoothed"
            yield self.finding(
                "resolution", "note", channel, size=0.0, unit="m", message=message, remedy=remedy
            )
        elif abs(step_m / stated_m - 1.0) >= 0.05:
            message = (
                f"it comes in steps of {step_um:.4g} um; by the model file a count is {stated_um:.4g} um"
            )
            remedy = "correct the model file, or record with more digits"
            yield self.finding(
                "resolution", "warning", channel, size=step_m, unit="m", message=message, remedy=remedy
            )

    def filtered(self, channel: str, roll_off: RollOff | None, against: str = "") -> Iterator[SensorFinding]:
        """Yield a finding of a low pass in a channel."""
        if roll_off is None:
            return
        beside = f" against {against}" if against else "; it has no noise of its own above"
        message = (
            f"falls off from about {roll_off.corner_hz:.3g} Hz on, by {-roll_off.fall_db:.2g} dB{beside}"
        )
        remedy = "a low pass makes it late: record it raw, or filter all channels alike"
        severity: Severity = "warning" if channel == "force_n" and against else "note"
        if channel == "scale_m" and against:
            remedy = "the drive train yields (compliance), or the scale was filtered: is it recorded raw?"
        yield self.finding(
            "filter", severity, channel, size=roll_off.corner_hz, unit="Hz", message=message, remedy=remedy
        )

    def delayed(self, delay: Delay | None, damaged: set[str]) -> Iterator[SensorFinding]:
        """Yield findings of a delay against another channel, and of a gain if the force is not `damaged`."""
        if delay is None:
            return
        samples, is_force = delay.late_s / self.recording.period_s, delay.second == "force_n"
        largest = LARGEST_COMMAND_DELAY_SAMPLES if is_force else LARGEST_DELAY_SAMPLES
        if delay.certain and abs(samples) > largest:
            direction = "late" if samples > 0.0 else "early"
            error_ms, late_ms = 2.0 * delay.error_s * 1e3, abs(delay.late_s) * 1e3
            size = f"{late_ms:.3g} ms ({abs(samples):.3g} samples, +-{error_ms:.2g} ms)"
            message = f"is {size} {direction} against {delay.first}"
            severity: Severity = "note" if is_force else "warning"
            remedy = "shift it, or record both latched by the same clock"
            if is_force and samples < 0.0:
                remedy = f"are both exchanged? --map {self.exchanged('force_n', 'force_command_n')}"
            yield self.finding(
                "delay", severity, delay.second, size=delay.late_s, unit="s", message=message, remedy=remedy
            )
        if is_force and "force_n" not in damaged and abs(delay.gain - 1.0) > 0.1:
            message = f"is {delay.gain:.3g} times its command"
            remedy = "check the force constant of the model file"
            yield self.finding(
                "gain", "warning", "force_n", size=delay.gain, unit="1", message=message, remedy=remedy
            )
