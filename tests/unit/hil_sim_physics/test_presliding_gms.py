"""GMS against points of the hysteresis calculated by hand (Iwan's model, Masing's rule)."""

import math
from typing import Any

import numpy as np
import pytest

from hil_sim.physics.friction import presliding_gms
from hil_sim.plant.layout import state_record

DT_S = 50e-6
LEVEL_N = 40.0
UM = 1e-6
# element: slips at 10 N after 1 um, at 10 N after 4 um, at 20 N after 20 um
THREE = presliding_gms.Params(
    share=(0.25, 0.25, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0),
    stiffness_n_m=(10e6, 2.5e6, 1e6, 0.0, 0.0, 0.0, 0.0, 0.0),
    attraction_n_s=1e6,
    micro_damping_n_s_m=0.0,
)


def moved(s: Any, distance_m: float, level_n: float = LEVEL_N, p: presliding_gms.Params = THREE) -> float:
    """Force after a slow move."""
    steps = 400
    for _ in range(steps):
        presliding_gms.slide(p, s, distance_m / steps / DT_S, level_n, DT_S)
    force, _ = presliding_gms.force_and_damping(p, s, 0.0, level_n)
    return force


def test_virgin_curve_bends_where_elements_slip() -> None:
    s = state_record(presliding_gms)
    assert moved(s, 1 * UM) == pytest.approx(10.0 + 2.5 + 1.0)
    assert moved(s, 3 * UM) == pytest.approx(10.0 + 10.0 + 4.0)
    assert moved(s, 16 * UM) == pytest.approx(40.0)
    assert moved(s, 80 * UM) == pytest.approx(40.0)


def test_reversal_follows_masings_rule_twice_the_virgin_curve() -> None:
    s = state_record(presliding_gms)
    moved(s, 100 * UM)
    assert moved(s, -2 * UM) == pytest.approx(40.0 - 2.0 * (10.0 + 2.5 + 1.0))
    assert moved(s, -6 * UM) == pytest.approx(40.0 - 2.0 * (10.0 + 10.0 + 4.0))
    assert moved(s, -32 * UM) == pytest.approx(-40.0)


def test_inner_loop_closes_nonlocal_memory() -> None:
    s = state_record(presliding_gms)
    moved(s, 100 * UM)
    outer = moved(s, -8 * UM)
    moved(s, 3 * UM)
    assert moved(s, -3 * UM) == pytest.approx(outer)
    assert moved(s, -32 * UM) == pytest.approx(-40.0)


def test_area_of_the_loop_is_the_energy_lost_by_the_slipping_elements() -> None:
    """Closed loop of +-10 um: an element of force f and reach d loses 4 f (10 um - d), or nothing."""
    s = state_record(presliding_gms)
    amplitude_m = 10 * UM
    phase = np.linspace(0.0, 4.0 * math.pi, 8001)
    position = amplitude_m * np.sin(phase)
    force = [0.0]
    for step in np.diff(position):
        presliding_gms.slide(THREE, s, step / DT_S, LEVEL_N, DT_S)
        force.append(presliding_gms.force_and_damping(THREE, s, 0.0, LEVEL_N)[0])
    loop = slice(4000, None)
    expected = 4.0 * (10.0 * 9e-6 + 10.0 * 6e-6)
    assert np.trapezoid(np.array(force)[loop], position[loop]) == pytest.approx(expected, rel=2e-3)


def test_slipping_element_follows_a_falling_level_with_time_constant_level_over_attraction() -> None:
    one = presliding_gms.Params((1.0,) + (0.0,) * 7, (1e7,) + (0.0,) * 7, 2000.0, 0.0)
    s = state_record(presliding_gms)
    moved(s, 100 * UM, 40.0, one)
    steps = 200
    for _ in range(steps):  # 10 ms at 20 mm/s, the level drops from 40 N to 20 N
        presliding_gms.slide(one, s, 0.02, 20.0, DT_S)
    force, _ = presliding_gms.force_and_damping(one, s, 0.02, 20.0)
    expected = 20.0 + 20.0 * math.exp(-2000.0 / 20.0 * steps * DT_S)
    assert force == pytest.approx(expected, rel=5e-3)


def test_micro_damping_counts_the_sticking_share_alone() -> None:
    damped = THREE._replace(micro_damping_n_s_m=1000.0)
    s = state_record(presliding_gms)
    assert presliding_gms.force_and_damping(damped, s, 0.0, LEVEL_N)[1] == 1000.0
    moved(s, 4.5 * UM)  # two elements slip
    assert presliding_gms.force_and_damping(damped, s, 0.0, LEVEL_N)[1] == 500.0
