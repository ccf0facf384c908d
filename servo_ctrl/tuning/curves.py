"""The curves of a tuning's Bode plots: the plant from force to position, and the loop before and after."""

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.control.axis_loop import loop_of, velocity_loop_of
from servo_ctrl.control.modal_model import grid_hz
from servo_ctrl.files.tuning_files import VELOCITY_LOOP
from servo_ctrl.tuning.frequency_response import Response
from servo_ctrl.tuning.results import TuneResult

FROM_HZ = 0.5
"""Lowest frequency in the pictures of the loop."""
DIGITS = 5
"""Significant digits in the file: far more than a picture shows."""


class ResponseCurve(NamedTuple):
    """A frequency response, (n,) each."""

    name: str
    frequency_hz: Array
    response: Response

    @property
    def magnitude(self) -> Array:
        """|response|, (n,)."""
        return np.asarray(np.abs(self.response))

    @property
    def phase_deg(self) -> Array:
        """Phase, unwrapped, beginning between -360 and 0, (n,)."""
        angle = np.degrees(np.unwrap(np.angle(self.response)))
        if not len(angle):
            return np.asarray(angle)
        return np.asarray(angle - 360.0 * math.ceil(float(angle[0]) / 360.0))


def plant_curves(result: TuneResult) -> tuple[ResponseCurve, ...]:
    """Motor and scale per force, m/N: measured, at the trusted lines, and by the model."""
    response, model = result.response, result.model
    hz = response.frequency_hz
    motor, scale = response.trusted(response.motor_coherence), response.trusted(response.scale_coherence)
    grid = grid_hz(model)
    grid = grid[grid >= hz[0]]
    return (
        ResponseCurve("motor, measured", hz[motor], response.motor[motor]),
        ResponseCurve("motor, model", grid, model.motor(grid)),
        ResponseCurve("scale, measured", hz[scale], response.scale[scale]),
        ResponseCurve("scale, model", grid, model.scale(grid)),
    )


def loop_curves(result: TuneResult) -> tuple[ResponseCurve, ...]:
    """L before, after and as measured with the proposed values (trusted lines); at last the velocity loop."""
    before, after, verified = result.before, result.after, result.verified
    lines = verified.trusted(verified.sensitivity_coherence)
    drawn = (
        ("before", before.plant.frequency_hz, loop_of(before.params, before.plant)),
        ("after", after.plant.frequency_hz, loop_of(after.params, after.plant)),
        ("after, measured", verified.frequency_hz[lines], verified.loop[lines]),
        (VELOCITY_LOOP, after.plant.frequency_hz, velocity_loop_of(after.params, after.plant)),
    )
    return tuple(
        ResponseCurve(name, hz[hz >= FROM_HZ], response[hz >= FROM_HZ]) for name, hz, response in drawn
    )


def document_of(result: TuneResult) -> dict[str, list[dict[str, Any]]]:
    """The curves for JSON: `plant` in m/N and `loop`."""
    return {"plant": _listed(plant_curves(result)), "loop": _listed(loop_curves(result))}


def _listed(curves: Iterable[ResponseCurve]) -> list[dict[str, Any]]:
    return [
        {
            "name": one.name,
            "frequency_hz": _rounded(one.frequency_hz),
            "magnitude": _rounded(one.magnitude),
            "phase_deg": _rounded(one.phase_deg),
        }
        for one in curves
    ]


def _rounded(values: Array) -> list[float]:
    return [float(f"{value:.{DIGITS}g}") for value in values]
