"""The measured plant of an axis, and the margins of the loop that it closes (`control.axis_loop`)."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.control.axis_loop import Plant, Response
from servo_ctrl.control.modal_model import ModalModel, grid_hz, with_modes
from servo_ctrl.control.stability import is_stable
from servo_ctrl.tuning.frequency_response import FrequencyResponse


class Margins(NamedTuple):
    """Robustness of a loop."""

    stable: bool
    """By the Nyquist criterion."""
    sensitivity_peak: float
    """Ms: largest |1 / (1 + L)|."""
    peak_hz: float
    phase_margin_deg: float
    """The least of all crossovers."""
    gain_margin_db: float
    """By how much the gain may grow; infinite where the phase never crosses -180 degrees."""
    crossover_hz: float
    """The highest one."""


def plant_of(
    model: ModalModel,
    measured: FrequencyResponse | None,
    *,
    scale_feedback: bool,
    shift: float = 1.0,
    beside: Sequence[ModalModel] = (),
) -> Plant:
    """The plant on the grid: the model, corrected by the measured lines that are trusted.

    `shift`: factor on the frequencies of all modes. `beside`: further models whose modes the grid resolves.
    """
    frequency_hz = with_modes(grid_hz(model), beside)
    motor, scale = model.motor(frequency_hz, shift), model.scale(frequency_hz, shift)
    if measured is not None:
        motor = motor * _correction(
            frequency_hz,
            measured,
            measured.motor / model.motor(measured.frequency_hz),
            measured.motor_coherence,
        )
        scale = scale * _correction(
            frequency_hz,
            measured,
            measured.scale / model.scale(measured.frequency_hz),
            measured.scale_coherence,
        )
    return Plant(frequency_hz, motor, scale if scale_feedback else motor)


def _correction(
    frequency_hz: Array, measured: FrequencyResponse, ratio: Response, coherence: Array
) -> Response:
    """Factor on the model, (n,): `ratio`, measured over model, interpolated over the trusted lines.

    Beyond them it fades to 1 at either end of the grid: a step there would be one of the loop, too.
    """
    good = measured.trusted(coherence) & (np.abs(np.log(np.abs(ratio))) < math.log(2.0))
    if good.sum() < 2:
        return np.ones(len(frequency_hz), dtype=np.complex128)
    at = np.log([frequency_hz[0], *measured.frequency_hz[good], frequency_hz[-1]])
    size = np.interp(np.log(frequency_hz), at, [0.0, *np.log(np.abs(ratio[good])), 0.0])
    angle = np.interp(np.log(frequency_hz), at, [0.0, *np.angle(ratio[good]), 0.0])
    return np.asarray(np.exp(size + 1j * angle))


def margins_of(loop: Response, frequency_hz: Array, integrators: int) -> Margins:
    """Margins of a loop on its grid, with so many integrators."""
    sensitivity = 1.0 / np.abs(1.0 + loop)
    peak = int(np.argmax(sensitivity))
    size, angle = np.abs(loop), np.degrees(np.angle(loop))
    crossings = np.flatnonzero((size[:-1] >= 1.0) != (size[1:] >= 1.0))
    phase = min((180.0 - abs(float(angle[k])) for k in crossings), default=180.0)
    imag = loop.imag
    on_axis = np.flatnonzero((imag[:-1] * imag[1:] < 0.0) & (loop.real[:-1] < 0.0) & (size[:-1] < 1.0))
    gain = float(np.max(size[on_axis])) if len(on_axis) else 0.0
    return Margins(
        stable=is_stable(1.0 + loop, integrators),
        sensitivity_peak=float(sensitivity[peak]),
        peak_hz=float(frequency_hz[peak]),
        phase_margin_deg=phase,
        gain_margin_db=math.inf if gain == 0.0 else -20.0 * math.log10(gain),
        crossover_hz=float(frequency_hz[crossings[-1]]) if len(crossings) else 0.0,
    )
