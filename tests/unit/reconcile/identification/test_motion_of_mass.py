"""What swings once a turn by a lead error or an eccentric encoder costs a force, and that is no cogging."""

import math

import numpy as np
import pytest
from known_axis import AXIS, COULOMB_N, COUNT_M, MASS_KG, VISCOUS_N_S_M, T

from hil_sim.physics.sensor import encoder_eccentricity
from hil_sim.physics.transmission import lead_error_periodic
from kernels.arrays import Array
from reconcile.catalogue.kinds import ResidualChannel
from reconcile.diagnosis.axis_diagnosis import DEVIATION_LEAST_GAIN
from reconcile.formats.nominal_axis import ModelEffects
from reconcile.identification.explain import explain
from reconcile.identification.motion_of_mass import MotionOfMass, along_model, motion_of_mass
from reconcile.identification.term_search import TermSearch
from reconcile.recording.recording import AxisRecording
from reconcile.selection.selection_rules import SelectionRules

AMPLITUDE_M, ROTOR_SHARE = 2e-6, 0.4
TIME_S = np.arange(16_000) * T
RAD_M = 2.0 * math.pi / AXIS.lead_m


def recorded(motor_m: Array, scale_m: Array, moved: Array) -> AxisRecording:
    """The force of a mass that moves along `moved` (n,), with noise."""
    velocity_m_s = np.gradient(moved, T)
    force_n = MASS_KG * np.gradient(velocity_m_s, T) + VISCOUS_N_S_M * velocity_m_s
    force_n = (
        force_n + COULOMB_N * np.sign(velocity_m_s) + np.random.default_rng(4).normal(0.0, 0.2, len(moved))
    )
    return AxisRecording(
        source="swing",
        axis="x",
        period_s=T,
        time_s=TIME_S,
        motor_m=np.rint(motor_m / COUNT_M) * COUNT_M,
        force_n=force_n,
        scale_m=np.rint(scale_m / 1e-8) * 1e-8,
        reference_m=None,
        temperature_k=None,
        others={},
    )


def place_m() -> Array:
    """Strokes of 40 mm at up to 60 and 100 mm/s: 12 and 20 swings a second."""
    return 0.02 * np.sin(2.0 * math.pi * np.where(TIME_S < 8.0, 0.5, 0.75) * TIME_S)


def eccentric() -> tuple[AxisRecording, Array]:
    """An eccentric encoder on a rigid axis, and the motion of the mass."""
    moved = place_m()
    return recorded(moved - AMPLITUDE_M * np.sin(RAD_M * moved), moved, moved), moved


def erring_screw() -> AxisRecording:
    """A screw that errs: the rotor follows the encoder, the table the scale."""
    motor = place_m()
    table = motor + AMPLITUDE_M * np.sin(RAD_M * motor)
    return recorded(motor, table, ROTOR_SHARE * motor + (1.0 - ROTOR_SHARE) * table)


def along_mass(recording: AxisRecording) -> MotionOfMass:
    rules = SelectionRules(least_gain=DEVIATION_LEAST_GAIN)
    search = TermSearch([recording], AXIS, ResidualChannel.POSITION_DEVIATION, rules)
    return motion_of_mass([recording], AXIS, explain(search).selected)


def names(recording: AxisRecording) -> list[str]:
    explanation = explain(TermSearch([recording], AXIS, ResidualChannel.FORCE, SelectionRules()))
    return [finding.effect for finding in explanation.findings]


def test_an_eccentric_encoder_swings_the_mass_and_leaves_nothing_to_be_named() -> None:
    recording, moved_m = eccentric()
    assert names(recording)  # without a look at the scale
    found = along_mass(recording)
    assert found.share == pytest.approx(1.0, abs=0.05)
    acceleration_m_s2 = AMPLITUDE_M * (RAD_M * np.gradient(moved_m, T)) ** 2
    assert found.force_n == pytest.approx(
        MASS_KG * np.std(acceleration_m_s2 * np.sin(RAD_M * moved_m)), rel=0.15
    )
    assert found.recordings[0].motor_m == pytest.approx(moved_m, abs=0.05 * AMPLITUDE_M)
    assert names(found.recordings[0]) == []


def test_of_a_screw_that_errs_the_rotor_does_not_swing() -> None:
    found = along_mass(erring_screw())
    assert found.share == pytest.approx(1.0 - ROTOR_SHARE, abs=0.05)
    assert names(found.recordings[0]) == []


def test_without_a_scale_nothing_is_known_of_it() -> None:
    recording = eccentric()[0]._replace(scale_m=None)
    found = motion_of_mass([recording], AXIS, None)
    assert found.recordings == [recording]
    assert (found.share, found.force_n) == (0.0, 0.0)


def test_a_model_with_the_wave_moves_its_mass_by_it() -> None:
    """Of an eccentric encoder all mass follows the scale, of a screw that errs all but the rotor."""
    recording, moved_m = eccentric()
    rotor = AXIS._replace(motor_mass_kg=ROTOR_SHARE * MASS_KG)
    encoder = encoder_eccentricity.Params(amplitude_m=-AMPLITUDE_M, phase_rad=0.0)
    screw = lead_error_periodic.Params(amplitude_m=AMPLITUDE_M, harmonic=1.0, phase_rad=0.0)
    models = (("encoder_eccentricity", encoder, 1.0), ("lead_error_periodic", screw, 1.0 - ROTOR_SHARE))
    for effect, params, share in models:
        axis = rotor._replace(model_effects=ModelEffects({effect: params}, {}))
        by_wave_m = along_model(recording, axis).motor_m - recording.motor_m
        assert by_wave_m == pytest.approx(share * (moved_m - recording.motor_m), abs=0.02 * AMPLITUDE_M)
    assert along_model(recording, rotor) is recording
