"""The proposal for an axis that contour control couples to another one, against singular values by numpy."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from servo_ctrl.config.contour import sensitivity_peak_of
from servo_ctrl.config.contour_model import ContourControl
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.plant_of_axis import section_of
from servo_ctrl.control.axis_loop import coupled_loop_of, loop_of, rigid_plant
from servo_ctrl.control.modal_model import ModalModel, StructuralMode
from servo_ctrl.tuning import loop as loops
from servo_ctrl.tuning.contour_partner import ContourPartner, partner_of
from servo_ctrl.tuning.frequency_response import FrequencyResponse
from servo_ctrl.tuning.gain_search import EncoderSteps
from servo_ctrl.tuning.proposal import Proposal, propose

PERIOD_S, MASS_KG, CONTOUR_1_S, STATED_MS = 1e-3, 70.0, 50.0, 2.0
COMPLIANT = StructuralMode(260.0, 0.03, 0.3 / MASS_KG, -1.0 / MASS_KG)
"""The drive train: the scale swings against the motor."""


@pytest.fixture
def machine(machines: Path) -> MachineConfig:
    contour = ContourControl(axes=["y", "x"], kp_1_s=CONTOUR_1_S)
    return load_machine(machines / "xy_table").model_copy(update={"contour_control": contour})


def proposal(
    machine: MachineConfig, partner: ContourPartner | None, *modes: StructuralMode
) -> tuple[Proposal, ModalModel]:
    """What is proposed for axis x with these modes."""
    model = ModalModel(PERIOD_S, 1.0 / MASS_KG, 1.0 / MASS_KG, 0.5, 0.0, modes, 0.0)
    hz = np.geomspace(1.0, 450.0, 300)
    ones = np.ones(len(hz))
    measured = FrequencyResponse(hz, model.motor(hz), model.scale(hz), ones + 0j, ones, ones, ones, 8)
    params = axis_params(machine, "x")
    return propose(params, model, measured, STATED_MS, EncoderSteps(0.0, 0.0), partner=partner), model


def peak_by_svd(machine: MachineConfig, found: Proposal, model: ModalModel) -> float:
    """Ms of the proposed x and of y on its mass: L = diag(L) + diag(G) W n n', by numpy."""
    plant = loops.plant_of(model, None, scale_feedback=found.params.position_loop.scale_feedback)
    faster = found.params.position_loop._replace(kp_1_s=found.params.position_loop.kp_1_s + 1.0)
    own = loop_of(found.params, plant)
    more = loop_of(found.params._replace(position_loop=faster), plant)
    law = axis_params(machine, "y")
    other = coupled_loop_of(law, rigid_plant(PERIOD_S, law.feedforward.acceleration_kg, plant.frequency_hz))
    diagonal = np.array([np.diag(one) for one in np.column_stack((own, other.loop))])
    gains = np.array([np.diag(one) for one in np.column_stack((more - own, other.per_gain))])
    peaks = []
    for angle_rad in np.linspace(0.0, 2.0 * math.pi, 25):
        normal = np.array([-math.sin(angle_rad), math.cos(angle_rad)])
        loop = diagonal + CONTOUR_1_S * gains @ np.outer(normal, normal)
        peaks.append(1.0 / np.linalg.svd(np.eye(2) + loop, compute_uv=False)[:, 1].min())
    return float(max(peaks))


def test_the_partner_is_the_other_axis_of_the_coupling(machine: MachineConfig) -> None:
    found = [partner_of(machine, name) for name in ("x", "y")]
    assert [None if one is None else one.name for one in found] == ["y", "x"]
    assert machine.contour_control is not None
    off = machine.contour_control.model_copy(update={"enabled": False})
    assert partner_of(machine.model_copy(update={"contour_control": off}), "x") is None


def test_on_rigid_masses_it_is_the_margin_of_the_machine_file(machine: MachineConfig) -> None:
    partner, section = partner_of(machine, "x"), machine.contour_control
    assert partner is not None
    assert section is not None
    params, mass_kg = axis_params(machine, "x"), axis_params(machine, "x").feedforward.acceleration_kg
    assert (params.velocity_loop.window_samples, params.velocity_loop.filter_blend) == (1, 1.0)
    rigid = ModalModel(PERIOD_S, 1.0 / mass_kg, 1.0 / mass_kg, 0.0, 0.0, (), 0.0)
    plant = loops.plant_of(rigid, None, scale_feedback=False)
    expected = sensitivity_peak_of(machine, section)
    assert expected == pytest.approx(1.96, abs=0.01)
    assert_allclose(partner.on(plant).sensitivity_peak(params), expected, rtol=2e-3)
    without = partner._replace(observers=(False,), laws=partner.laws[:1])
    assert without.on(plant).sensitivity_peak(params) < 0.95 * expected


def test_a_proposal_keeps_the_stated_ms_of_both_coupled_axes(machine: MachineConfig) -> None:
    alone, model = proposal(machine, None, COMPLIANT)
    assert alone.contour is None
    assert peak_by_svd(machine, alone, model) > 1.05 * STATED_MS
    pair, model = proposal(machine, partner_of(machine, "x"), COMPLIANT)
    assert pair.contour is not None
    assert pair.contour.partner == "y"
    assert pair.contour.sensitivity_peak <= STATED_MS
    assert peak_by_svd(machine, pair, model) <= STATED_MS
    assert pair.assessment.margins.sensitivity_peak < alone.assessment.margins.sensitivity_peak
    # compliance counts: the same gains on the rigid mass would have room left
    rigid = model._replace(modes=())
    assert peak_by_svd(machine, pair, rigid) < peak_by_svd(machine, pair, model)


def test_a_partner_that_was_measured_is_in_it_with_its_resonance(machine: MachineConfig) -> None:
    arm = ModalModel(
        PERIOD_S, 1.0 / 89.6, 1.0 / 89.6, 0.0, 0.0, (StructuralMode(40.0, 0.01, 0.0, -0.01),), 0.0
    )
    axis = machine.axes["y"].model_copy(update={"measured_plant": section_of(arm)})
    known = machine.model_copy(update={"axes": {**machine.axes, "y": axis}})
    plain, partner = partner_of(machine, "x"), partner_of(known, "x")
    assert plain is not None
    assert partner is not None
    assert (len(plain.measured), len(partner.measured)) == (0, 1)
    plant = loops.plant_of(arm._replace(modes=()), None, scale_feedback=True, beside=partner.measured)
    params = axis_params(machine, "x")
    assert plain.on(plant).sensitivity_peak(params) < 2.2
    assert partner.on(plant).sensitivity_peak(params) > 2.8
