"""Bode plots of a tuning as plotly figures: magnitude and phase of plant and loop, and the sensitivity."""

import math
from collections.abc import Sequence
from typing import Any

from servo_ctrl.files.tuning_files import VELOCITY_LOOP
from servo_ctrl.hmi.languages.texts import tr, word
from servo_ctrl.hmi.shell.plots import Look, curve, figure, horizontal_line, plot_layout
from servo_ctrl.hmi.tuning.tunings import BodeCurve

NAMES = {
    "motor, measured": word("motor, measured"),
    "motor, model": word("motor, model"),
    "scale, measured": word("scale, measured"),
    "scale, model": word("scale, model"),
    "before": word("before"),
    "after": word("after"),
    "after, measured": word("after, measured"),
    VELOCITY_LOOP: word("velocity loop, after"),
}
DASHES = ("solid", "dash", "dot", "dashdot")
"""Dashes of the curves, which distinguish them without their colours."""
HIGHEST_SENSITIVITY = 5.0
"""Bounds the drawn sensitivity; chosen: that of an unstable loop has no bound."""


def magnitude_figure(curves: Sequence[BodeCurve], unit: str, factor: float, look: Look) -> dict[str, Any]:
    """Return the magnitudes, times `factor`, both axes logarithmic."""
    data = [_drawn(one, number, [factor * y for y in one.magnitude]) for number, one in enumerate(curves)]
    layout = _layout(unit, look)
    layout["yaxis"] |= {"type": "log", "exponentformat": "power"}
    return figure(data, layout, revision=f"magnitude {unit}")


def phase_figure(curves: Sequence[BodeCurve], look: Look) -> dict[str, Any]:
    """Return the phases, with a line at -180 degrees."""
    data = [_drawn(one, number, one.phase_deg) for number, one in enumerate(curves)]
    layout = _layout(tr("degrees"), look) | horizontal_line("\N{MINUS SIGN}180", -180.0, look.theme.ink)
    return figure(data, layout, revision="phase")


def sensitivity_figure(curves: Sequence[BodeCurve], stated_ms: float, look: Look) -> dict[str, Any]:
    """Return |1 / (1 + L)| of the loops, with a line at the stated Ms."""
    data = [
        _drawn(
            one, number, [_sensitivity(*point) for point in zip(one.magnitude, one.phase_deg, strict=False)]
        )
        for number, one in enumerate(curves)
        if one.name != VELOCITY_LOOP
    ]
    label = tr("stated Ms {ms:g}", ms=stated_ms)
    layout = _layout("", look) | horizontal_line(label, stated_ms, look.theme.ink)
    return figure(data, layout, revision="sensitivity")


def _sensitivity(magnitude: float, phase_deg: float) -> float:
    phase = math.radians(phase_deg)
    distance = math.hypot(1.0 + magnitude * math.cos(phase), magnitude * math.sin(phase))
    return min(1.0 / max(distance, 1e-9), HIGHEST_SENSITIVITY)


def _drawn(one: BodeCurve, number: int, values: Sequence[float]) -> dict[str, Any]:
    name = tr(NAMES[one.name]) if one.name in NAMES else one.name
    return curve(name, one.frequency_hz, values, line={"dash": DASHES[number % len(DASHES)], "width": 1.6})


def _layout(y: str, look: Look) -> dict[str, Any]:
    layout = plot_layout(tr("frequency, Hz"), y, look.theme)
    layout["xaxis"] |= {"type": "log", "exponentformat": "power"}
    return layout
