"""Every effect of the catalogue, simulated in closed loop by the plant, gives its own column.

The plant's law runs under the production controller; what the recording has beside mass and friction is then
the terms that the catalogue makes of the same plant file, with the coefficients that it reads from it.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from concealed_effects import twin_recording
from concealed_machine import motion, write_machine

from reconcile.catalogue.kinds import RegressionData, ResidualChannel
from reconcile.catalogue.registry import CATALOGUE, ENTRIES
from reconcile.formats.nominal_axis import NominalAxis
from reconcile.nominal_model.model_file import load_model
from reconcile.nominal_model.model_terms import terms_of_model
from reconcile.recording.recording import load_recordings
from reconcile.regression.regression_data import regression_data
from reconcile.regression.regression_problem import regression_problem

SPRING = "[axis.NAME.drive_compliance]\nstiffness_n_um = 200.0\ndamping_n_s_m = 5000.0\n"
SECTIONS = {
    "amplifier_dead_zone": "threshold_a = 0.015\n",
    "asymmetric_coulomb_friction": "half_difference_n = 3.0\n",
    "asymmetric_viscous_friction": "half_difference_n_s_m = 50.0\n",
    "backlash": "play_um = 4.0\n" + SPRING,
    "cogging": "harmonic = [4.0]\namplitude_n = [3.0]\nphase_deg = [40.0]\n",
    "constant_force": "force_n = 6.0\n",
    "current_loop_lag": "time_ms = 3.0\n",
    "disturbance_spectrum": "frequency_hz = [3.0, 7.0]\namplitude_n = [3.0, 2.0]\nseed = 4\n",
    "drift_over_time": "first_s = 2.0\nlast_s = 20.0\npoints = 4\nforce_n = [0.0, 6.0, -4.0, 2.0]\n"
    "level_n = [0.0, -3.0, 4.0, 0.0]\n",
    "drive_compliance": "stiffness_n_um = 40.0\ndamping_n_s_m = 2000.0\n",
    "dwell_dependent_breakaway": "growth_n = 8.0\ntime_s = 0.02\nway_um = 30.0\n",
    "change_along_travel": "first_mm = -12.0\nlast_mm = 12.0\npoints = 5\n"
    "mass_kg = [0.0, 6.0, -4.0, 3.0, 8.0]\ndamping_n_s_m = [0.0, 60.0, -20.0, 90.0, 30.0]\n",
    "encoder_eccentricity": "amplitude_um = 3.0\nphase_deg = 60.0\n",
    "force_map": "first_mm = -12.0\nlast_mm = 12.0\npositions = 3\nfirst_mm_s = -60.0\nlast_mm_s = 60.0\n"
    "velocities = 3\nforce_n = [4.0, -3.0, 5.0, 0.0, 2.0, -1.0, -6.0, 3.0, 1.0]\n",
    "force_over_speed": "first_mm_s = -90.0\nlast_mm_s = 90.0\npoints = 5\n"
    "force_n = [-9.0, -1.0, 0.0, 4.0, 1.0]\n",
    "force_table": "first_mm = -12.0\nlast_mm = 12.0\npoints = 5\nforce_n = [0.0, 5.0, -3.0, 2.0, 6.0]\n",
    "friction_over_speed": "first_mm_s = 0.5\nlast_mm_s = 50.0\npoints = 4\nlevel_n = [5.0, 1.0, 0.0, 3.0]\n",
    "friction_table": "first_mm = -12.0\nlast_mm = 12.0\npoints = 5\nlevel_n = [0.0, 5.0, -3.0, 2.0, 6.0]\n",
    "gravity": "amplitude_n = 400.0\nphase_deg = 30.0\nangle_rad_m = 1.0\n",
    "lead_error_cumulative": "relative_error_um_m = 300.0\n",
    "lead_error_periodic": "amplitude_um = 3.0\nharmonic = 1.0\nphase_deg = 60.0\n",
    "load_dependent_friction": "load_share = 0.2\n",
    "periodic_disturbance": "amplitude_n = 3.0\nfrequency_hz = 7.3\nphase_deg = 20.0\n",
    "position_dependent_force": "centre_mm = 0.0\nhalf_travel_mm = 16.0\npower_1_n = 8.0\npower_2_n = 4.0\n",
    "position_dependent_friction": "centre_mm = 0.0\nhalf_travel_mm = 16.0\npower_1_n = 6.0\n",
    "presliding_hysteresis": "level_n = 6.0\nway_um = 20.0\n",
    "presliding_elements": "level_n = 8.0\nshare = [0.5, 0.3, 0.2]\nway_um = [3.0, 20.0, 60.0]\n"
    "exponent = [0.0, 0.0, 2.0]\n",
    "quadratic_viscous_friction": "quadratic_n_s2_m2 = 1500.0\n",
    "relaxation": "damping_n_s_m = 300.0\ntime_s = 0.2\n",
    "scale_cyclic_error": "period_um = 200.0\namplitude_um = 1.0\nphase_deg = 30.0\n",
    "step_in_time": "moment_s = 9.0\nforce_n = 4.0\nlevel_n = 3.0\ndamping_n_s_m = 60.0\nmass_kg = 8.0\n",
    "stribeck_friction": "stribeck_n = 5.0\nstribeck_mm_s = 3.0\n",
    "structural_mode": "mass_kg = 5.0\nfrequency_hz = 20.0\ndamping_ratio = 0.05\n",
    "temperature_dependent_friction": "warm_level_share = 0.1\nwarm_damping_share = 0.1\n"
    "warmth_scale_k = 4.0\nheat_capacity_j_k = 1.0\nresistance_k_w = 6.0\n",
    "thermal_expansion": "expansion_um_m_k = 90.0\nfixed_end_mm = -200.0\nreference_degc = 20.0\n"
    "start_degc = 20.0\nambient_degc = 40.0\nheat_capacity_j_k = 6.0\nresistance_k_w = 1.0\n"
    "heat_share = 0.0\n",
    "torque_constant_saturation": "saturation_a = 0.8\n",
    "torque_ripple": "harmonic = [6.0]\namplitude = [0.15]\nphase_deg = [40.0]\n",
    "transport_delay": "delay_ms = 4.0\n",
    "voltage_saturation": "voltage_limit_v = 27.0\nresistance_ohm = 100.0\n",
}
MOST_LEFT = 0.15
"""Share of the squares that the terms leave beside what the axis without the effect leaves."""
FIRST_ORDER = {
    "dwell_dependent_breakaway": 0.75,
    "temperature_dependent_friction": 0.9,
    "torque_constant_saturation": 0.3,
}
"""The same of laws that the term has to first order only; without a recorded temperature an axis warms at its
mean power, and not piece by piece as it moves."""
ELSEWHERE = {
    "cross_axis_coupling",
    "gravity_of_outer_link",
    "joint_coupling",
    "payload_mass",
    "presliding_gms",
    "presliding_lugre",
}
"""Axes that are coupled need two of them (test_coupled_joint); a mass is the baseline's; the contacts are run
along the motion (test_model_presliding)."""
FIRST_SAMPLE_S = 0.05
"""Time since power-up at which the recording begins."""


def test_every_entry_has_a_section() -> None:
    assert set(CATALOGUE) == {*SECTIONS, *ELSEWHERE}
    assert set(ENTRIES) <= set(CATALOGUE)


class Recorded(NamedTuple):
    """One recording of an axis, and its model."""

    data: RegressionData
    axis: NominalAxis


def recorded(folder: Path, sections: str) -> Recorded:
    """The twin's recording of an axis with these sections, and the axis as its own plant file has it."""
    machine = write_machine(folder, {"x": sections}, motion()[:, None])
    file = twin_recording(machine, machine / "plant.toml", folder / "run.parquet")
    model = load_model(machine)
    [recording] = load_recordings([file], model.axes)
    data = regression_data(recording, model.axes["x"])
    return Recorded(data._replace(time_s=data.time_s + FIRST_SAMPLE_S), model.axes["x"])


def left(of: Recorded, channel: ResidualChannel, *, with_effect: bool) -> float:
    """Sum of squares that mass and friction leave, with the terms of the axis' effects taken off or not."""
    terms = terms_of_model(of.axis, [of.data]) if with_effect else []
    problem = regression_problem([of.data], channel, only=True, model_terms=terms)
    y, base = problem.target_and_columns(0)
    used = problem.used[0]
    fitted, *_ = np.linalg.lstsq(base[used], y[used], rcond=None)
    return float(np.mean((y[used] - base[used] @ fitted) ** 2))


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return recorded(tmp_path_factory.mktemp("bare"), "")


@pytest.mark.parametrize("effect", SECTIONS)
def test_the_plants_effect_is_its_column(effect: str, tmp_path: Path, bare: Recorded) -> None:
    of = recorded(tmp_path, f"[axis.NAME.{effect}]\n{SECTIONS[effect]}")
    [channel] = {one.channel for one in terms_of_model(of.axis, [of.data])}
    floor = left(bare, channel, with_effect=False)
    before, after = (left(of, channel, with_effect=own) - floor for own in (False, True))
    assert before > floor  # else the case proves nothing
    assert after < FIRST_ORDER.get(effect, MOST_LEFT) * before
