"""The loop in z against the compiled law, and proposals."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.control.axis_loop import (
    integrators_of,
    loop_of,
    notch_response,
    on_circle,
    position_law,
    velocity_estimate,
    velocity_law,
)
from servo_ctrl.control.compensation import notch
from servo_ctrl.control.loop_margins import sensitivity_peak
from servo_ctrl.control.modal_model import ModalModel, StructuralMode
from servo_ctrl.control.stability import is_stable
from servo_ctrl.control.tick import AxisParams, axis_tick, initial_state
from servo_ctrl.control.types import AxisSample
from servo_ctrl.tuning import loop as loops
from servo_ctrl.tuning.frequency_response import FrequencyResponse
from servo_ctrl.tuning.gain_search import EncoderSteps
from servo_ctrl.tuning.proposal import assess, propose

PERIOD_S, MASS_KG = 1e-3, 70.0
NO_STEPS = EncoderSteps(0.0, 0.0)


@pytest.fixture
def params(machines: Path) -> AxisParams:
    return axis_params(load_machine(machines / "xy_table"), "x")


def model(*modes: StructuralMode, delay_s: float = 0.0) -> ModalModel:
    return ModalModel(PERIOD_S, 1.0 / MASS_KG, 1.0 / MASS_KG, 0.5, delay_s, modes, 0.0)


def measured(of: ModalModel) -> FrequencyResponse:
    """A measurement without noise."""
    hz = np.geomspace(1.0, 450.0, 300)
    ones = np.ones(len(hz))
    return FrequencyResponse(hz, of.motor(hz), of.scale(hz), ones + 0j, ones, ones, ones, 8)


def test_the_plant_has_no_step_where_the_measurement_begins_or_ends() -> None:
    of = model()
    exact = measured(of)
    real = exact._replace(
        motor=1.3 * np.exp(0.5j) * exact.motor, motor_coherence=np.where(exact.frequency_hz < 3.0, 0.5, 1.0)
    )
    plant = loops.plant_of(of, real, scale_feedback=False)
    ratio = plant.motor / of.motor(plant.frequency_hz)
    inside = (plant.frequency_hz > 3.1) & (plant.frequency_hz < 450.0)
    assert_allclose(ratio[inside], 1.3 * np.exp(0.5j))
    assert_allclose(ratio[[0, -1]], 1.0)
    steps = np.abs(np.diff(np.log(ratio))) / np.diff(np.log(plant.frequency_hz))
    assert steps[plant.frequency_hz[1:] < 450.0].max() < 0.2  # per factor e in frequency


def test_the_law_in_z_is_the_compiled_one(params: AxisParams) -> None:
    p = params._replace(
        notch=notch.biquad(60.0, 0.4, 0.1, PERIOD_S),
        position_loop=params.position_loop._replace(kd=0.1, derivative_blend=0.5, ki_1_s2=30.0),
        velocity_loop=params.velocity_loop._replace(filter_blend=0.6, window_samples=2),
    )
    hz, count = 47.0, 6000
    w = 2.0 * math.pi * hz * PERIOD_S
    state, force = initial_state(0.0), []
    for k in range(count):
        wave_m = 1e-6 * math.sin(w * k)
        state, command = axis_tick(p, state, AxisSample(0.0, 0.0, 0.0, 0.0, wave_m, 0.5 * wave_m, math.nan))
        force.append(command.force_n)
    tail = slice(count - 2000, count)  # whole cycles
    phasor = 2.0 * np.mean(np.array(force)[tail] * np.exp(-1j * w * np.arange(count)[tail])) / 1e-6 * 1j
    z = on_circle(np.array([hz]), PERIOD_S)
    law = velocity_law(p, z) * (0.5 * position_law(p, z) + velocity_estimate(p, z))
    assert_allclose(-notch_response(p.notch, z) * law, phasor, rtol=1e-3)


def test_margins_of_a_rigid_mass_are_those_of_the_linear_analysis(params: AxisParams) -> None:
    rigid = model()._replace(friction_1_s=0.0)
    margins = assess(params, rigid, measured(rigid)).margins
    assert margins.stable
    assert_allclose(margins.sensitivity_peak, sensitivity_peak(params, MASS_KG), rtol=0.01)


@pytest.mark.parametrize("ms", [1.4, 2.0])
def test_a_proposal_keeps_the_stated_ms_and_is_stiffer_where_it_may(params: AxisParams, ms: float) -> None:
    rigid = model(delay_s=1e-3)
    slow = params._replace(velocity_loop=params.velocity_loop._replace(kv_n_s_m=3000.0, ki_n_m=30000.0))
    found = propose(slow, rigid, measured(rigid), ms, NO_STEPS)
    assert found.notch is None
    assert found.assessment.margins.stable
    assert 0.9 * ms < found.assessment.margins.sensitivity_peak < 1.02 * ms
    assert found.assessment.compliance_m_n < assess(slow, rigid, measured(rigid)).compliance_m_n
    assert_allclose(found.acceleration_feedforward_kg, MASS_KG)


def test_a_notch_is_proposed_where_a_mode_of_the_scale_holds_the_gains_down(params: AxisParams) -> None:
    mode = StructuralMode(45.0, 0.003, 0.0004, -0.9 / MASS_KG)  # the scale sees it, the motor hardly
    plant = model(mode)
    assert not assess(params, plant, measured(plant)).margins.stable
    found = propose(params, plant, measured(plant), 2.0, NO_STEPS)
    assert found.assessment.margins.stable
    assert found.assessment.margins.sensitivity_peak < 2.05
    for shift in (0.93, 1.07):
        other = loops.plant_of(plant, None, scale_feedback=True, shift=shift)
        assert is_stable(1.0 + loop_of(found.params, other), integrators_of(found.params))


def test_what_cannot_be_kept_is_refused(params: AxisParams) -> None:
    slow = model(delay_s=0.4)
    with pytest.raises(ValueError, match="no gains keep Ms"):
        propose(params, slow, measured(slow), 1.2, NO_STEPS)
