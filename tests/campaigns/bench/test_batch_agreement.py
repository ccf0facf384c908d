"""The C kernel of the benchmark computes what ours computes, for every effect and every mode."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hil_sim.physics.friction import (
    coulomb_friction,
    friction_ageing,
    lubrication_loss,
    presliding_gms,
    presliding_lugre,
    stribeck_friction,
    temperature_dependent_friction,
    viscous_friction,
)
from hil_sim.physics.load import constant_force, structural_mode
from hil_sim.physics.motor import cogging, winding
from hil_sim.physics.registry import EFFECTS
from hil_sim.physics.transmission import (
    backlash,
    drive_compliance,
    lead_error_cumulative,
    lead_error_periodic,
    thermal_expansion,
)
from kernels.quantities import section_of
from servo_ctrl.config.kernel_params import with_observer, with_pulse
from servo_ctrl.control import position_loop
from servo_ctrl.control.compensation import backlash as take_up
from servo_ctrl.control.compensation import fuzzy_pd, sampled_dual_loop, screw_error
from servo_ctrl.control.compensation.fuzzy_inference import surface
from servo_ctrl.control.tick import AxisParams
from tests.campaigns.bench.batch import compile_c, effects_in_c, largest_difference, run_c, run_ours
from tests.campaigns.bench.batch_case import Case, axis_cases, load_case
from twin.axis_rollout import COLUMNS

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")

CYCLES = 1500
FRICTION = {
    "coulomb_friction": coulomb_friction.Params(30.0),
    "stribeck_friction": stribeck_friction.Params(12.0, 0.004),
    "viscous_friction": viscous_friction.Params(200.0),
}
LUGRE = {"presliding_lugre": presliding_lugre.Params(6e6, 3e3)}
GMS = {
    "presliding_gms": presliding_gms.Params(
        share=(0.5, 0.3, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0),
        stiffness_n_m=(8e6, 3e6, 1e6, 0.0, 0.0, 0.0, 0.0, 0.0),
        attraction_n_s=4e3,
        micro_damping_n_s_m=500.0,
    )
}
WARM_UP = {"temperature_dependent_friction": temperature_dependent_friction.Params(0.6, 0.4, 0.1, 1.0, 5.0)}
DRY = {"lubrication_loss": lubrication_loss.Params(0.4, 0.3, 1.8, 0.7)}
WORN = {"friction_ageing": friction_ageing.Params(1.0, -1.0)}
DRIVE_TRAIN = {
    "winding": winding.Params(3.0, 0.01),
    "cogging": cogging.Params(
        (8.0, 24.0, 1.0, 1.0, 1.0, 1.0), (3.0, 1.0, 0.0, 0.0, 0.0, 0.0), (0.1, 0.7, 0.0, 0.0, 0.0, 0.0)
    ),
    "drive_compliance": drive_compliance.Params(1.2e8, 4e3),
    "backlash": backlash.Params(1e-6),
    "lead_error_cumulative": lead_error_cumulative.Params(20e-6),
    "lead_error_periodic": lead_error_periodic.Params(2e-6, 1.0, 0.4),
    "thermal_expansion": thermal_expansion.Params(11.5e-6, -0.2, 293.15, 294.0, 293.15, 900.0, 2.0, 0.6),
    "constant_force": constant_force.Params(15.0),
    "structural_mode": structural_mode.Params(6.0, 45.0, 0.01),
}
SCREW_MM = np.linspace(-5.0, 5.0, 33)
LEADING: dict[str, Any] = {
    "screw": screw_error.Params(
        True, np.stack((1e-3 * SCREW_MM, 4e-6 + 3e-6 * np.sin(SCREW_MM) + 2e-6 * SCREW_MM))
    ),
    "take_up": take_up.Params(True, 6e-6, 0.4, 30.0),
    "sampled": sampled_dual_loop.Params(True, 0.05, 1e-7, 3, 5e-6, True, 0.4, 30.0, 1.0),
}
FUZZY = fuzzy_pd.Params(True, 2e-6, 2e-5, 5e4, 5e4, 30.0, 1.5e-3, 400.0, surface(25))
LAWS: dict[str, tuple[int, dict[str, Any]]] = {
    "pid on the scale": (0, {"position_loop": position_loop.Params(40.0, 150.0, 0.05, 0.3, True)}),
    "fuzzy-PD on the scale": (
        0,
        {"position_loop": position_loop.Params(40.0, 0.0, 0.02, 0.3, True), "fuzzy": FUZZY},
    ),
    "fuzzy-PD on the motor, led": (
        1,
        {"position_loop": position_loop.Params(40.0, 0.0, 0.02, 0.3, False), "fuzzy": FUZZY, **LEADING},
    ),
    "csp, led": (2, LEADING),
    "csp, led by trapezoids": (2, LEADING | {"sampled": LEADING["sampled"]._replace(smooth=False)}),
}
PLANTS = {
    "as the machine file": None,
    "rigid, stick or slide": FRICTION,
    "rigid, LuGre": FRICTION | LUGRE,
    "rigid, LuGre, carrying": FRICTION | LUGRE | {"structural_mode": structural_mode.Params(6.0, 45.0, 0.01)},
    "everything, stick or slide": FRICTION | DRIVE_TRAIN,
    "everything, LuGre": FRICTION | LUGRE | DRIVE_TRAIN,
    "everything, GMS": FRICTION | GMS | DRIVE_TRAIN,
    "rigid, stick or slide, warming up": FRICTION | WARM_UP,
    "rigid, LuGre, running dry": FRICTION | LUGRE | DRY,
    "rigid, GMS, wearing": FRICTION | GMS | WORN,
    "everything, GMS, all changes of friction": FRICTION | GMS | DRIVE_TRAIN | WARM_UP | DRY | WORN,
}


def short_case(effects: dict[str, Any] | None, output: int = 0) -> Case:
    case = load_case()
    plant = case.plant
    if effects is not None:
        axes = {name: axis.model_copy(update={"effects": effects}) for name, axis in plant.axes.items()}
        plant = plant.model_copy(update={"axes": axes})
    return Case(
        case.machine,
        plant,
        {name: params._replace(output=output) for name, params in case.params.items()},
        {name: np.ascontiguousarray(rows[:CYCLES]) for name, rows in case.reference.items()},
    )


def assert_the_same(case: Case, folder: Path) -> None:
    library = compile_c(axis_cases(case)[0], folder)
    ours, theirs = run_ours(case, axis_cases(case)), run_c(library, case, axis_cases(case))
    assert np.ptp(ours[0][:, 2]) > 1e-3  # it has moved
    assert largest_difference(ours, theirs) < 1e-9


@pytest.mark.parametrize("effects", PLANTS.values(), ids=PLANTS.keys())
def test_c_computes_the_same_trajectory(effects: dict[str, Any] | None, tmp_path: Path) -> None:
    assert_the_same(short_case(effects), tmp_path)


@pytest.mark.parametrize("output", [1, 2], ids=["csv", "csp"])
def test_c_computes_the_same_trajectory_with_the_loops_of_the_amplifier(output: int, tmp_path: Path) -> None:
    assert_the_same(short_case(FRICTION | LUGRE | DRIVE_TRAIN, output), tmp_path)


def test_c_computes_the_same_trajectory_with_a_proportional_current_loop(tmp_path: Path) -> None:
    case = short_case(FRICTION | LUGRE | DRIVE_TRAIN, 1)
    gains = {"current_bandwidth_hz": 0.0, "current_gain_v_a": 30.0, "voltage_limit_v": 40.0}
    axes = {
        name: axis.model_copy(update={"amplifier": axis.amplifier._replace(**gains)})
        for name, axis in case.plant.axes.items()
    }
    assert_the_same(case._replace(plant=case.plant.model_copy(update={"axes": axes})), tmp_path)


@pytest.mark.parametrize("columns", [1, 2, 5])
def test_c_computes_the_same_trajectory_with_pulse_and_observer(columns: int, tmp_path: Path) -> None:
    table = np.array(
        [
            np.geomspace(2e-3, 0.2, columns),
            np.linspace(0.06, 0.02, columns),
            np.linspace(3e-4, 3e-3, columns),  # the last ones beyond A_max
            np.linspace(0.05, 0.01, columns),
            np.full(columns, 0.03),
            np.linspace(-3e-4, -1e-4, columns),
        ]
    )
    case = short_case(FRICTION | LUGRE | DRIVE_TRAIN)
    case = case._replace(
        params={
            name: with_observer(with_pulse(params, table), enabled=True)
            for name, params in case.params.items()
        }
    )
    for rows in case.reference.values():  # to and fro, with a command that is not a number in between
        t = np.arange(len(rows)) * 1e-3
        w = 2.0 * np.pi * (0.5 + t)
        rows[:, 0] = 1e-3 * (1.0 - np.cos(w * t))
        rows[:, 1] = np.gradient(rows[:, 0], 1e-3)
        rows[:, 2] = np.gradient(rows[:, 1], 1e-3)
        rows[700:703, 0] = rows[800, 1] = np.nan
    ours = run_ours(case, axis_cases(case))[0]
    pulse_m_s, disturbance_n = ours[:, COLUMNS.index("pulse_m_s")], ours[:, COLUMNS.index("disturbance_n")]
    assert np.count_nonzero(pulse_m_s) > 50
    assert np.ptp(disturbance_n) > 10.0
    assert_the_same(case, tmp_path)


def to_and_fro(rows: np.ndarray) -> None:
    """Three moves with dwells between them, a reversal during one, and commands that are not numbers."""
    t = np.arange(len(rows)) * 1e-3
    rows[:, 0] = np.interp(
        t, [0.1, 0.3, 0.7, 0.8, 0.805, 1.0, 1.2], 1e-3 * np.array([0, 2, 2, 1, 1.01, -1, -1])
    )
    rows[:, 1] = np.gradient(rows[:, 0], 1e-3)
    rows[:, 2] = np.gradient(rows[:, 1], 1e-3)
    rows[750:753, 0] = rows[1100, 1] = np.nan


@pytest.mark.parametrize("law", LAWS)
def test_c_computes_the_same_trajectory_with_every_position_law_and_correction(
    law: str, tmp_path: Path
) -> None:
    output, changes = LAWS[law]
    case = short_case(FRICTION | LUGRE | DRIVE_TRAIN, output)
    changed: dict[str, AxisParams] = {name: p._replace(**changes) for name, p in case.params.items()}
    case = case._replace(params=changed)
    for rows in case.reference.values():
        to_and_fro(rows)
    correction_m = run_ours(case, axis_cases(case))[0][:, COLUMNS.index("correction_m")]
    assert (np.ptp(correction_m) > 5e-6) == ("led" in law)
    assert_the_same(case, tmp_path)


def test_the_agreement_is_tested_with_every_effect_that_c_computes() -> None:
    tested = set().union(*(effects for effects in PLANTS.values() if effects)) | {"encoder", "scale"}
    assert effects_in_c() == tested


def test_c_refuses_by_name_a_plant_with_an_effect_it_would_leave_out(tmp_path: Path) -> None:
    unknown = {section_of(e): e.NEUTRAL for e in EFFECTS if section_of(e) not in effects_in_c()}
    assert len(unknown) > 10
    library = compile_c(axis_cases(short_case(FRICTION))[0], tmp_path)
    for name, neutral in unknown.items():
        case = short_case(FRICTION | {name: neutral})
        with pytest.raises(NotImplementedError, match=name):
            run_c(library, case, axis_cases(case))


def test_a_difference_is_detected() -> None:
    left = np.linspace(-1.0, 1.0, 20).reshape(10, 2)
    right = left.copy()
    right[3, 1] += 1e-6
    assert largest_difference([left], [right]) == pytest.approx(1e-6, rel=1e-6)
    right[3, 1] = np.nan
    assert largest_difference([left], [right]) == np.inf
