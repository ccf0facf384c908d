"""Measurements on the channels of a recording -> findings: what is a defect, where, how large, what to do."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reconcile.sensing_channel import frozen
from reconcile.sensing_finding import Finding
from reconcile.sensing_units import MARGIN, MASS_BAND, factor_meaning, rigid_fit, slope

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from reconcile.formats.model_axis import ModelAxis
    from reconcile.recording import AxisRecording
    from reconcile.sensing_channel import Clip, Hold
    from reconcile.sensing_delay import Delay
    from reconcile.sensing_finding import Severity
    from reconcile.sensing_spectrum import RollOff

    Array = NDArray[np.float64]

UNITS = {"force_n": "N", "force_command_n": "N"}
STILL_M = 20e-6
"""With less travel the motion is not out of the sensor's and the screw's play."""
FROZEN_M = 200e-6
"""More than any backlash."""
LATE, LATE_COMMAND = 0.2, 3.0
"""Samples; the force follows its command over the bus and the current loop."""
SLOPE_NOTED, SLOPE_REFUSED, SLOPE_OF_DAMAGED = 0.005, 0.05, 0.5
UNIT_FACTOR = 20.0
STOPPED_SHARE = 0.2


class Judge(NamedTuple):
    """Makes findings of measurements on one recording."""

    recording: AxisRecording
    model: ModelAxis

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
    ) -> Finding:
        """`rows`: first and last sample; without them it holds throughout."""
        start_s, end_s = (self.at_s(row) for row in rows) if rows else (math.nan, math.nan)
        source, axis = self.recording.source, self.recording.axis
        return Finding(check, severity, source, axis, channel, start_s, end_s, size, unit, message, remedy)

    def at_s(self, row: int) -> float:
        """Time of a sample in the file."""
        return self.recording.start_s + float(self.recording.time_s[row])

    def constant(self) -> list[Finding]:
        """Channels that do not change."""
        travel_m, swing_n = float(np.ptp(self.recording.motor_m)), float(np.ptp(self.recording.force_n))
        found = []
        if travel_m < max(STILL_M, 10.0 * (self.model.encoder_resolution_m or 0.0)):
            message = f"the motor moves by {travel_m * 1e6:.3g} um in all: there is no motion to compare"
            remedy = "is it the right column, and is its unit the right one?"
            found.append(self.finding("constant", "unusable", "motor_m", travel_m, "m", message, remedy))
        if swing_n == 0.0:
            message = f"the force is {self.recording.force_n[0]:.6g} N throughout"
            remedy = "is it the right column, and was the drive on?"
            found.append(self.finding("constant", "unusable", "force_n", 0.0, "N", message, remedy))
        scale_m = self.recording.scale_m
        if scale_m is not None and np.ptp(scale_m) < 0.01 * travel_m:
            message = (
                f"the scale stands still while the motor moves by {travel_m * 1e3:.4g} mm; it is left out"
            )
            way_m = float(np.ptp(scale_m))
            found.append(self.finding("constant", "warning", "scale_m", way_m, "m", message))
        return found

    def frozen(self) -> list[Finding]:
        """Channels that stand still for a while although the axis goes on."""
        recording = self.recording
        pairs: list[tuple[str, Array, Array, float]] = []
        if recording.scale_m is not None:
            pairs += [
                ("scale_m", recording.scale_m, recording.motor_m, FROZEN_M),
                ("motor_m", recording.motor_m, recording.scale_m, FROZEN_M),
            ]
        if np.mean(np.diff(recording.force_n) == 0.0) < 0.5:
            way_m = max(self.model.lead_m, 0.1 * float(np.ptp(recording.motor_m)))
            pairs.append(("force_n", recording.force_n, recording.motor_m, way_m))
        found = []
        for channel, values, beside, at_least in pairs:
            stretch = frozen(values, beside, at_least)
            if stretch is not None:
                first, last, way_m = stretch
                if channel == "force_n" and values[first] in {values.min(), values.max()}:
                    continue  # clipped
                span = f"{self.at_s(first):.3f} to {self.at_s(last):.3f} s"
                message = f"does not change from {span} while the axis moves by {way_m * 1e3:.4g} mm"
                remedy = "cut that stretch out: a sensor or its bus failed"
                rows = (first, last)
                found.append(self.finding("frozen", "warning", channel, way_m, "m", message, remedy, rows))
        return found

    def clipped(self, channel: str, clips: list[Clip]) -> list[Finding]:
        """A force at its limit, or a position that stops dead at an extreme."""
        found = []
        unit = UNITS.get(channel, "m")
        for clip in clips:
            if unit == "m" and not self._stops_dead(channel, clip.first):
                continue
            level = f"{clip.level:.6g} N" if unit == "N" else f"{clip.level * 1e3:.6g} mm"
            message = (
                f"{clip.samples} samples are at {level}, its extreme, first at {self.at_s(clip.first):.3f} s"
            )
            remedy = "the true value may be beyond: leave such stretches out, or raise the range"
            rows = (clip.first, clip.last)
            size = float(clip.samples)
            found.append(self.finding("clipped", "warning", channel, size, "samples", message, remedy, rows))
        return found

    def _stops_dead(self, channel: str, row: int) -> bool:
        values: Array = getattr(self.recording, channel)
        step_m = np.abs(np.diff(values))
        return row > 1 and float(step_m[row - 2]) > STOPPED_SHARE * float(np.percentile(step_m, 95.0))

    def held(self, channel: str, hold: Hold) -> list[Finding]:
        """A channel that is sampled slower than it is recorded."""
        if hold.samples < 1.3:
            return []
        own_ms = hold.samples * self.recording.period_s * 1e3
        message = (
            f"each value is repeated, {hold.samples:.3g} samples on average: it is new every {own_ms:.3g} ms"
        )
        remedy = "record it at its own rate or faster; held values are late by half of that"
        return [self.finding("hold", "warning", channel, hold.samples, "samples", message, remedy)]

    def resolution(self, channel: str, step_m: float) -> list[Finding]:
        """The grid of a position against the resolution in the model file."""
        stated = {"motor_m": self.model.encoder_resolution_m, "scale_m": self.model.scale_resolution_m}
        stated_m = stated.get(channel)
        if not stated_m or any(finding.check == "jitter" for finding in self.recording.findings):
            return []
        if step_m == 0.0:
            message = (
                f"its values lie on no grid, although a count is {stated_m * 1e6:.4g} um: it was treated"
            )
            remedy = "record the counts themselves: what was filtered or rescaled is late or smoothed"
            return [self.finding("resolution", "note", channel, 0.0, "m", message, remedy)]
        if abs(step_m / stated_m - 1.0) < 0.05:
            return []
        step_um, stated_um = step_m * 1e6, stated_m * 1e6
        message = f"it comes in steps of {step_um:.4g} um; by the model file a count is {stated_um:.4g} um"
        remedy = "correct the model file, or record with more digits"
        return [self.finding("resolution", "warning", channel, step_m, "m", message, remedy)]

    def filtered(self, channel: str, roll_off: RollOff | None, against: str = "") -> list[Finding]:
        """A low pass in a channel."""
        if roll_off is None:
            return []
        beside = f" against {against}" if against else "; it has no noise of its own above"
        message = (
            f"falls off from about {roll_off.corner_hz:.3g} Hz on, by {-roll_off.fall_db:.2g} dB{beside}"
        )
        remedy = "a low pass makes it late: record it raw, or filter all channels alike"
        severity: Severity = "warning" if channel == "force_n" and against else "note"
        if channel == "scale_m" and against:
            remedy = "the drive train yields (compliance), or the scale was filtered: is it recorded raw?"
        return [self.finding("filter", severity, channel, roll_off.corner_hz, "Hz", message, remedy)]

    def delayed(self, delay: Delay, damaged: set[str]) -> list[Finding]:
        """A channel that is late against another, or of another size where it is not `damaged`."""
        found = []
        samples = delay.late_s / self.recording.period_s
        force = delay.second == "force_n"
        if delay.certain and abs(samples) > (LATE_COMMAND if force else LATE):
            way = "late" if samples > 0.0 else "early"
            error_ms = 2.0 * delay.error_s * 1e3
            size = f"{abs(delay.late_s) * 1e3:.3g} ms ({abs(samples):.3g} samples, +-{error_ms:.2g} ms)"
            message = f"is {size} {way} against {delay.first}"
            severity: Severity = "note" if force else "warning"
            remedy = "shift it, or record both latched by the same clock"
            found.append(self.finding("delay", severity, delay.second, delay.late_s, "s", message, remedy))
        if force and "force_n" not in damaged and abs(delay.gain - 1.0) > 0.1:
            message = f"is {delay.gain:.3g} times its command"
            remedy = "check the force constant of the model file"
            found.append(self.finding("gain", "warning", "force_n", delay.gain, "1", message, remedy))
        return found

    def signs_and_units(self, damaged: set[str]) -> list[Finding]:
        """Positions against one another, force against acceleration; a `damaged` one may be off a little."""
        return [
            *self._position_slope("scale_m", SLOPE_OF_DAMAGED if "scale_m" in damaged else SLOPE_NOTED),
            *self._position_slope("reference_m", 4.0 * SLOPE_REFUSED),
            *self._force_unit(),
        ]

    def _position_slope(self, channel: str, noted: float) -> list[Finding]:
        other: Array | None = getattr(self.recording, channel)
        ratio = slope(self.recording.motor_m, other, self.recording.period_s) if other is not None else None
        if ratio is None or abs(ratio - 1.0) < noted:
            return []
        refused = abs(ratio - 1.0) > max(SLOPE_REFUSED, noted)
        if channel == "reference_m":  # an axis need not follow it; another unit is far off
            refused = not 1.0 / UNIT_FACTOR < ratio < UNIT_FACTOR
        severity: Severity = "unusable" if refused else "warning"
        if ratio < 0.0:
            message = f"goes the other way than motor_m ({ratio:.4g} m per m)"
            remedy = "turn its sign round: --map ROLE=NAME*-1"
            return [self.finding("sign", severity, channel, ratio, "m/m", message, remedy)]
        message = f"moves by {ratio:.6g} m per metre of motor_m"
        remedy = f"check the lead ({self.model.lead_m * 1e3:.6g} mm), the counts and the unit of each"
        return [self.finding("unit", severity, channel, ratio, "m/m", message, remedy)]

    def _force_unit(self) -> list[Finding]:
        fit = rigid_fit(self.recording.motor_m, self.recording.force_n, self.recording.period_s)
        if fit is None:
            return []
        certain = abs(fit.mass_kg) > MARGIN * fit.error_kg
        if (certain and fit.mass_kg < 0.0) or (not certain and fit.reversed_share > 0.7):
            message = "the force points against the motion that it makes"
            remedy = "turn its sign round: --map force=NAME*-1"
            return [self.finding("sign", "unusable", "force_n", fit.mass_kg, "kg", message, remedy)]
        ratio = fit.mass_kg / self.model.mass_kg
        if not certain or 1.0 / MASS_BAND < ratio < MASS_BAND:
            return []
        meaning = factor_meaning(ratio, self.model)
        severity: Severity = "unusable" if not 1.0 / UNIT_FACTOR < ratio < UNIT_FACTOR else "warning"
        stated_kg = self.model.mass_kg
        message = f"force over acceleration is {fit.mass_kg:.4g} kg; the model file says {stated_kg:.4g} kg"
        remedy = f"perhaps {meaning}" if meaning else "check the units of force and position, and the mass"
        return [self.finding("unit", severity, "force_n", ratio, "1", message, remedy)]
