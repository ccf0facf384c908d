"""The open loop of an axis, from its measured plant and the exact transfer functions of the control law in z.

    u = -N K (R y + W q),   L = N K (R P_y + W P_q)

K is the proportional-integral velocity law, N the notch, R the position law on the feedback y, W the velocity
estimate from the motor position q. In mode csv the amplifier closes the velocity loop: u is a velocity, and
K and W are absent. L is the loop broken at the set point of the amplifier, where all paths meet, so that one
margin holds for all of them.
"""

import math
from typing import NamedTuple

import numpy as np

from kernels.arrays import Array
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.contour_margin import CoupledLoop
from servo_ctrl.control.loop_margins import observer_paths
from servo_ctrl.control.tick import AxisParams
from servo_ctrl.control.types import Output
from servo_ctrl.tuning.frequency_response import FrequencyResponse, Response
from servo_ctrl.tuning.modal_model import ModalModel

LOWEST_HZ = 0.02
"""Lowest frequency of the grid: far below any crossover. Chosen, as are the numbers below."""
POINTS = 900
MODE_POINTS = np.sinh(np.linspace(-4.0, 4.0, 61)) / 4.0
"""Further points around each mode, in half widths of its peak."""


class Plant(NamedTuple):
    """Responses per set point of the amplifier, on a grid that resolves the modes, (n,) each."""

    frequency_hz: Array
    motor: Response
    feedback: Response
    """Response of the position that the position loop uses: motor or scale."""


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


def grid_hz(model: ModalModel) -> Array:
    """Ascending frequencies up to half the sampling rate, dense around the modes."""
    highest_hz = 0.5 / model.period_s
    parts = [np.geomspace(LOWEST_HZ, highest_hz * (1.0 - 1e-6), POINTS)]
    for mode in model.modes:
        width = max(mode.damping_ratio, 1e-3) * mode.frequency_hz
        parts.append(mode.frequency_hz + width * MODE_POINTS)
    grid = np.unique(np.concatenate(parts))
    return np.asarray(grid[(grid > LOWEST_HZ / 2.0) & (grid < highest_hz)])


def plant_of(
    model: ModalModel, measured: FrequencyResponse | None, *, scale_feedback: bool, shift: float = 1.0
) -> Plant:
    """The plant on the grid: the model, corrected by the measured lines that are trusted.

    `shift`: factor on the frequencies of all modes.
    """
    frequency_hz = grid_hz(model)
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


def position_law(params: AxisParams, z: Response) -> Response:
    """R: velocity set point per position error, 1/s, (n,)."""
    p, period_s = params.position_loop, params.period_s
    change = p.derivative_blend * (1.0 - 1.0 / z) / period_s / (1.0 - (1.0 - p.derivative_blend) / z)
    return np.asarray(p.kp_1_s + p.ki_1_s2 * period_s / (1.0 - 1.0 / z) + p.kd * change)


def velocity_law(params: AxisParams, z: Response) -> Response:
    """K: force per velocity error, N s/m, (n,)."""
    p = params.velocity_loop
    return np.asarray(p.kv_n_s_m + p.ki_n_m * params.period_s / (1.0 - 1.0 / z))


def velocity_estimate(params: AxisParams, z: Response) -> Response:
    """W: estimated velocity per motor position, 1/s, (n,)."""
    p = params.velocity_loop
    difference = (1.0 - z ** (-p.window_samples)) / (p.window_samples * params.period_s)
    return np.asarray(difference * p.filter_blend / (1.0 - (1.0 - p.filter_blend) / z))


def notch_response(p: notch.Params, z: Response) -> Response:
    """N: the notch, (n,)."""
    if not p.enabled:
        return np.ones(len(z), dtype=np.complex128)
    return np.asarray((p.b0 + p.b1 / z + p.b2 / z**2) / (1.0 + p.b1 / z + p.a2 / z**2))


def on_circle(frequency_hz: Array, period_s: float) -> Response:
    """Z on the unit circle at these frequencies, (n,)."""
    return np.asarray(np.exp(2j * math.pi * frequency_hz * period_s))


def loop_of(params: AxisParams, plant: Plant) -> Response:
    """L on the grid of the plant, (n,)."""
    z = on_circle(plant.frequency_hz, params.period_s)
    paths = position_law(params, z) * plant.feedback
    if params.output == int(Output.FORCE):
        paths = velocity_law(params, z) * (paths + velocity_estimate(params, z) * plant.motor)
    return np.asarray(notch_response(params.notch, z) * paths)


def coupled_loop_of(params: AxisParams, plant: Plant) -> CoupledLoop:
    """What contour control meets in a cst axis: L, with the observer where it is on, and G = N K P_y."""
    z = on_circle(plant.frequency_hz, params.period_s)
    filtered = notch_response(params.notch, z)
    per_gain = filtered * velocity_law(params, z) * plant.feedback
    model, recall = observer_paths(params, z)
    own = 1.0 - filtered * recall
    loop = loop_of(params, plant) + filtered * model * plant.motor
    return CoupledLoop(np.asarray(loop / own), np.asarray(per_gain / own))


def velocity_loop_of(params: AxisParams, plant: Plant) -> Response:
    """The velocity loop alone, with the position loop open, (n,)."""
    z = on_circle(plant.frequency_hz, params.period_s)
    inner = velocity_law(params, z) * velocity_estimate(params, z) * plant.motor
    return np.asarray(notch_response(params.notch, z) * inner)


def is_stable(loop: Response) -> bool:
    """Apply the Nyquist criterion to a loop whose only unstable poles are integrators.

    From the lowest frequency to half the sampling rate, the angle of 1 + L must turn from that of the
    integrators to 0. The grid must begin where |L| is large, and be dense enough not to miss a turn.
    """
    angle = np.angle(1.0 + loop)
    turned = float(np.sum((np.diff(angle) + math.pi) % (2.0 * math.pi) - math.pi))
    start = float(angle[0]) if angle[0] <= 0.0 else float(angle[0]) - 2.0 * math.pi
    return abs(start + turned) < 0.5 * math.pi


def margins_of(loop: Response, frequency_hz: Array) -> Margins:
    """Margins of a loop on its grid."""
    sensitivity = 1.0 / np.abs(1.0 + loop)
    peak = int(np.argmax(sensitivity))
    size, angle = np.abs(loop), np.degrees(np.angle(loop))
    crossings = np.flatnonzero((size[:-1] >= 1.0) != (size[1:] >= 1.0))
    phase = min((180.0 - abs(float(angle[k])) for k in crossings), default=180.0)
    imag = loop.imag
    on_axis = np.flatnonzero((imag[:-1] * imag[1:] < 0.0) & (loop.real[:-1] < 0.0) & (size[:-1] < 1.0))
    gain = float(np.max(size[on_axis])) if len(on_axis) else 0.0
    return Margins(
        stable=is_stable(loop),
        sensitivity_peak=float(sensitivity[peak]),
        peak_hz=float(frequency_hz[peak]),
        phase_margin_deg=phase,
        gain_margin_db=math.inf if gain == 0.0 else -20.0 * math.log10(gain),
        crossover_hz=float(frequency_hz[crossings[-1]]) if len(crossings) else 0.0,
    )
