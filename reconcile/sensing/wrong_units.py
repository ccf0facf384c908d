"""Findings of signs and units: one position against another, force against acceleration."""

from collections.abc import Iterator

from kernels.arrays import Array
from reconcile.recording.sensor_finding import SensorFinding, Severity
from reconcile.sensing.judgement import Judge
from reconcile.sensing.units import (
    LARGEST_MASS_RATIO,
    LEAST_STANDARD_ERRORS,
    factor_meanings,
    lateness,
    rigid_columns,
    rigid_fit,
    slope,
)
from reconcile.sensing.wrong_channels import exchanged_position, is_unsigned

SLOPE_NOTED, SLOPE_REFUSED, SLOPE_OF_DAMAGED = 0.005, 0.2, 0.5
"""Deviations from a slope of 1 between two positions: reported, refused, reported for a damaged channel."""
LEAST_UNIT_FACTOR = 20.0
"""Least factor at which a wrong unit is certain."""
LEAST_LEAD_SAMPLES = 3.0
"""Least lead of a motor over its command to be reported, samples: a bus may delay by two."""
MOST_REVERSED = 0.7
"""Least share of the power against the motion to be reported."""
SURE_RESIDUAL = 0.3
"""Largest residual share of the variance of the force for which a negative mass is a wrong sign: a passive
joint that the gravity of other joints moves has a larger one.
"""
LEAST_LEAD_ERRORS = 5.0
"""The same in standard errors."""
NAMED_MEANINGS = 2
"""Most explanations of a factor in a message."""


def signs_and_units(judge: Judge, damaged: set[str]) -> Iterator[SensorFinding]:
    """Check positions against each other, and the force against the motion; more tolerant where `damaged`."""
    yield from _position_slope(judge, "scale_m", SLOPE_OF_DAMAGED if "scale_m" in damaged else SLOPE_NOTED)
    yield from _position_slope(judge, "reference_m", SLOPE_REFUSED)
    yield from _ahead_of_command(judge)
    yield from _force(judge)


def _position_slope(judge: Judge, channel: str, noted: float) -> Iterator[SensorFinding]:
    recording = judge.recording
    other: Array | None = getattr(recording, channel)
    ratio = slope(recording.motor_m, other, recording.period_s) if other is not None else None
    if ratio is None or abs(ratio - 1.0) < noted:
        return
    refused = abs(ratio - 1.0) > max(SLOPE_REFUSED, noted)
    if channel == "reference_m":  # an axis need not follow it; another unit is far off
        refused = _is_another_unit(ratio)
    severity: Severity = "unusable" if refused else "warning"
    if ratio < 0.0:
        message = f"goes the other way than motor_m ({ratio:.4g} m per m)"
        remedy = _turned(judge, channel)
        yield judge.finding("sign", severity, channel, size=ratio, unit="m/m", message=message, remedy=remedy)
        return
    message = f"moves by {ratio:.6g} m per metre of motor_m"
    remedy = f"check the lead ({judge.model.lead_m * 1e3:.6g} mm), the counts and the unit of each"
    if refused:
        remedy += f": --map {judge.entry(channel, 1.0 / ratio)} if the motor is right"
    yield judge.finding("unit", severity, channel, size=ratio, unit="m/m", message=message, remedy=remedy)


def _ahead_of_command(judge: Judge) -> Iterator[SensorFinding]:
    """Yield a finding where the motor moves before its command."""
    recording = judge.recording
    if recording.reference_m is None:
        return
    late_s, error_s = lateness(recording.reference_m, recording.motor_m, recording.period_s)
    if late_s > -max(LEAST_LEAD_SAMPLES * recording.period_s, LEAST_LEAD_ERRORS * error_s):
        return
    message = f"moves {-late_s * 1e3:.3g} ms before its command does"
    remedy = (
        f"are command and actual position exchanged? --map {judge.exchanged('motor_m', 'reference_m')}; "
        "or the command was recorded late"
    )
    yield judge.finding(
        "exchanged", "warning", "motor_m", size=late_s, unit="s", message=message, remedy=remedy
    )


def _force(judge: Judge) -> Iterator[SensorFinding]:
    recording, model = judge.recording, judge.model
    columns = rigid_columns(recording.motor_m, recording.force_n, recording.period_s)
    if columns is None:
        return
    factor = exchanged_position(recording, model.mass_kg)
    if factor is not None:
        message = "position and force are exchanged: what was read as the position pushes the other"
        first = judge.entry("motor_m", factor, "force_n")
        remedy = f"map each to its column: --map {first},{judge.entry('force_n', 1.0 / factor, 'motor_m')}"
        yield judge.finding(
            "exchanged", "unusable", "motor_m", size=factor, unit="1", message=message, remedy=remedy
        )
        return
    if is_unsigned(columns):
        message = "the force has no sign, though the axis is driven both ways: it is a magnitude"
        unused = ", ".join(recording.ignored) or "none"
        remedy = (
            "map the signed current or torque: --map "
            f"{judge.entry('force_n', 1.0).partition('=')[0]}=NAME (columns not used: {unused})"
        )
        yield judge.finding(
            "unsigned", "unusable", "force_n", size=0.0, unit="", message=message, remedy=remedy
        )
        return
    fit = rigid_fit(columns)
    certain = abs(fit.mass_kg) > LEAST_STANDARD_ERRORS * fit.error_kg
    # friction dissipates: a negative mass beside a positive friction is another misfit than a turned sign
    drives = fit.friction_w < 0.0
    if drives and ((certain and fit.mass_kg < 0.0) or (not certain and fit.reversed_share > MOST_REVERSED)):
        sure = certain and fit.residual_share < SURE_RESIDUAL
        message = f"the force {'points' if sure else 'seems to point'} against the motion that it makes"
        remedy = _turned(judge, "force_n")
        if not sure:
            remedy += ", unless another axis or a load drives this one"
        sign_severity: Severity = "unusable" if sure else "warning"
        yield judge.finding(
            "sign", sign_severity, "force_n", size=fit.mass_kg, unit="kg", message=message, remedy=remedy
        )
        return
    ratio = fit.mass_kg / model.mass_kg
    if certain and fit.mass_kg > 0.0 and not 1.0 / LARGEST_MASS_RATIO < ratio < LARGEST_MASS_RATIO:
        travel_m = float(recording.motor_m.max() - recording.motor_m.min())
        meanings = factor_meanings(ratio, model, travel_m)[:NAMED_MEANINGS]
        severity: Severity = "unusable" if meanings and _is_another_unit(ratio) else "warning"
        message = (
            f"force over acceleration is {fit.mass_kg:.4g} kg; the model file says {model.mass_kg:.4g} kg"
        )
        remedies = [f"{one.words} (--map {judge.entry(one.channel, one.to_si)})" for one in meanings]
        remedy = "check the units of force and position, and the mass"
        if remedies:
            remedy = f"perhaps {', or '.join(remedies)}"
        yield judge.finding("unit", severity, "force_n", size=ratio, unit="1", message=message, remedy=remedy)


def _is_another_unit(ratio: float) -> bool:
    return not 1.0 / LEAST_UNIT_FACTOR < ratio < LEAST_UNIT_FACTOR


def _turned(judge: Judge, channel: str) -> str:
    return f"turn its sign round: --map {judge.entry(channel, -1.0)}"
