"""Excitation, spectra and modal model against systems whose transfer functions are known."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import signal

from servo_ctrl.control.modal_model import antiresonances, resonances
from servo_ctrl.excitation import multisine as excitation
from servo_ctrl.tuning.frequency_response import (
    TRUSTED_ERROR,
    FrequencyResponse,
    Measured,
    frequency_response,
)
from servo_ctrl.tuning.modal_fit import fit_modal_model

PERIOD_S = 1e-3
MASS_KG, CARRIED_KG, DAMPING = 40.0, 8.0, 0.02


def plant(mode_hz: float | None) -> signal.StateSpace:
    """Motor mass with friction, and a mass on a spring; force to the positions of both, exactly sampled."""
    if mode_hz is None:
        system = signal.StateSpace([[0, 1], [0, -1.0]], [[0], [1 / MASS_KG]], [[1, 0], [1, 0]], [[0], [0]])
        return system.to_discrete(PERIOD_S)
    w = 2.0 * math.pi * mode_hz
    k, c = CARRIED_KG * w * w, 2.0 * DAMPING * w * CARRIED_KG
    a = [
        [0, 1, 0, 0],
        [-k / MASS_KG, -(c + MASS_KG) / MASS_KG, k / MASS_KG, c / MASS_KG],
        [0, 0, 0, 1],
        [k / CARRIED_KG, c / CARRIED_KG, -k / CARRIED_KG, -c / CARRIED_KG],
    ]
    b, outputs = [[0], [1 / MASS_KG], [0], [0]], [[1, 0, 0, 0], [0, 0, 1, 0]]
    return signal.StateSpace(a, b, outputs, [[0], [0]]).to_discrete(PERIOD_S)


def loop_run(
    mode_hz: float | None, delay: int, noise_m: float, periods: int = 4, friction_n: float = 0.0
) -> list[Measured]:
    """A proportional-derivative loop on the motor holds the plant while the multisine acts.

    `friction_n`: standard deviation of a force that varies slowly, within tenths of a second.
    """
    force = excitation.multisine(PERIOD_S)
    added = 20.0 * np.tile(force.values, periods + 3)
    system, rng = plant(mode_hz), np.random.default_rng(5)
    state, sent, last, friction = np.zeros((system.A.shape[0], 1)), [0.0] * (delay + 1), 0.0, 0.0
    rows = []
    for d in added.tolist():
        motor, scale = (system.C @ state)[:, 0] + noise_m * rng.normal(size=2)
        whole = d - 4e4 * motor - 1.5e3 * (motor - last) / PERIOD_S
        last = motor
        rows.append((d, whole, motor, scale))
        sent.append(whole)
        if friction_n:
            friction = 0.99 * friction + math.sqrt(1.0 - 0.99**2) * friction_n * rng.normal()
        state = system.A @ state + system.B * (sent.pop(0) + friction)
    columns = np.array(rows)[-periods * len(force.values) :].T
    return [Measured(*columns)]


def exact(mode_hz: float | None, frequency_hz: np.ndarray, delay: int) -> np.ndarray:
    """Both outputs, (2, n), with the periods until the force acts."""
    system, z = plant(mode_hz), np.exp(2j * math.pi * frequency_hz * PERIOD_S)
    identity = np.eye(system.A.shape[0])
    values = [(system.C @ np.linalg.solve(one * identity - system.A, system.B))[:, 0] for one in z]
    return np.array(values).T / z ** (delay + 1)


def test_a_multisine_has_its_lines_alone_and_a_low_peak() -> None:
    force = excitation.multisine(PERIOD_S)
    spectrum = np.abs(np.fft.rfft(force.values))
    others = np.ones(len(spectrum), dtype=bool)
    others[force.lines] = False
    assert spectrum[others].max() < 1e-9 * spectrum.max()
    assert np.abs(force.values).max() == 1.0
    assert 1.0 / np.std(force.values) < 3.7  # crest factor; of random phases it is above 4


def test_a_travel_keeps_its_speed_while_the_force_acts() -> None:
    force = excitation.multisine(PERIOD_S)
    one = excitation.travel(force, 7.0, 2, -0.01, 0.2, PERIOD_S)
    assert one.force_n[0] == one.force_n[-1] == 0.0
    acting = np.flatnonzero(one.force_n)
    speed = np.diff(one.position_m) / PERIOD_S
    assert_allclose(speed[acting[0] : acting[-1]], -0.01, rtol=1e-9)
    whole = one.force_n[one.first : one.first + 2 * len(force.values)]
    assert_allclose(whole, 7.0 * np.tile(force.values, 2))


@pytest.mark.parametrize(("mode_hz", "delay"), [(None, 1), (40.0, 0), (120.0, 2)])
def test_feedback_does_not_bias_the_plant(mode_hz: float | None, delay: int) -> None:
    lines = excitation.multisine(PERIOD_S)
    response = frequency_response(loop_run(mode_hz, delay, 0.0), len(lines.values), lines.lines, PERIOD_S)
    motor, scale = exact(mode_hz, response.frequency_hz, delay)
    assert_allclose(response.motor, motor, rtol=5e-3, atol=2e-3 * np.abs(motor).min())
    assert_allclose(response.scale, scale, rtol=5e-3, atol=2e-3 * np.abs(motor).min())
    assert_allclose(response.sensitivity, 1.0 / (1.0 + exact_loop(response, motor)), rtol=5e-3)
    assert response.motor_coherence.min() > 0.999


def exact_loop(response: FrequencyResponse, motor: np.ndarray) -> np.ndarray:
    """L of `loop_run` with this response of the motor."""
    z = np.exp(2j * math.pi * response.frequency_hz * PERIOD_S)
    return np.asarray((4e4 + 1.5e3 * (1.0 - 1.0 / z) / PERIOD_S) * motor)


def test_a_line_whose_force_the_loop_cancels_is_not_trusted() -> None:
    lines = excitation.multisine(PERIOD_S)
    travels = loop_run(None, 1, 0.0, friction_n=0.3)
    response = frequency_response(travels, len(lines.values), lines.lines, PERIOD_S)
    motor, _ = exact(None, response.frequency_hz, 1)
    loop = exact_loop(response, motor)
    low = response.frequency_hz < 3.0
    assert np.abs(np.angle(response.loop / loop, deg=True))[low].max() > 20.0  # noise is taken for a phase
    # the position alone does not tell: it follows the added force there
    force_to_motor = response.motor / motor
    assert np.abs(np.angle(force_to_motor, deg=True))[low].max() > 20.0
    for coherence, error in (
        (response.sensitivity_coherence, response.loop / loop - 1.0),
        (response.motor_coherence, force_to_motor - 1.0),
    ):
        trusted = response.trusted(coherence)
        assert not trusted[low].any()
        assert trusted[(response.frequency_hz > 15.0) & (response.frequency_hz < 60.0)].all()
        assert np.abs(error[trusted]).max() < 3.0 * TRUSTED_ERROR


@pytest.mark.parametrize("mode_hz", [20.0, 160.0])
def test_mass_delay_frequency_and_damping_are_found_through_noise(mode_hz: float) -> None:
    lines = excitation.multisine(PERIOD_S)
    travels = loop_run(mode_hz, 2, 2e-9)
    model = fit_modal_model(frequency_response(travels, len(lines.values), lines.lines, PERIOD_S), PERIOD_S)
    (mode,) = resonances(model)
    free_hz = mode_hz * math.sqrt(1.0 + CARRIED_KG / MASS_KG)
    assert_allclose(mode.frequency_hz, free_hz, rtol=2e-3)
    assert_allclose(mode.damping_ratio, DAMPING * math.sqrt(1.0 + CARRIED_KG / MASS_KG), rtol=0.1)
    (held,) = antiresonances(model)
    assert_allclose(held, (mode_hz, DAMPING), rtol=0.1)
    assert_allclose(held[0], mode_hz, rtol=3e-3)
    assert_allclose(model.mass_kg, MASS_KG + CARRIED_KG, rtol=0.02)
    assert_allclose(model.delay_s, 2 * PERIOD_S, atol=0.05e-3)


def test_an_axis_without_a_resonance_gets_none() -> None:
    lines = excitation.multisine(PERIOD_S)
    travels = loop_run(None, 1, 2e-9)
    model = fit_modal_model(frequency_response(travels, len(lines.values), lines.lines, PERIOD_S), PERIOD_S)
    assert resonances(model) == ()
    assert_allclose(model.mass_kg, MASS_KG, rtol=0.01)


def test_noise_alone_is_refused() -> None:
    lines, rng = excitation.multisine(PERIOD_S), np.random.default_rng(1)
    count = 8 * len(lines.values)
    added = np.tile(lines.values, 8)
    noise = [rng.normal(size=count) for _ in range(2)]
    response = frequency_response([Measured(added, added, *noise)], len(lines.values), lines.lines, PERIOD_S)
    with pytest.raises(ValueError, match="lines are coherent"):
        fit_modal_model(response, PERIOD_S)
