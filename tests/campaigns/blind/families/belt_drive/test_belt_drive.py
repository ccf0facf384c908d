import math

import numpy as np
import pytest

from tests.campaigns.blind.families.belt_drive.axis import Belt, between, friction_level
from tests.campaigns.blind.families.belt_drive.motions import fifth_order


def after(p: Belt, drive_n: float, seconds: float, s: np.ndarray | None = None) -> np.ndarray:
    s = np.zeros(5) if s is None else s
    between(p, s, drive_n, 0.0, 0.0, seconds, 1e-5, 0.0)
    return s


def test_steady_speed_takes_viscous_friction_and_dahls_level() -> None:
    p = Belt(pulley_kg=0.5, carriage_kg=0.5, viscous=30.0, sided_n=3.0)
    s = after(p, 40.0, 0.4)
    assert s[4] == pytest.approx(friction_level(p, s[2], s[3], 0.0), rel=1e-4)
    assert p.viscous * s[3] == pytest.approx(40.0 - 18.0, rel=1e-3)


def test_below_its_level_friction_holds_by_a_few_of_dahls_lengths() -> None:
    p = Belt(viscous=8000.0)
    s = after(p, 0.6 * p.coulomb_n, 1.0)
    assert s[4] == pytest.approx(0.6 * p.coulomb_n, rel=1e-3)
    assert abs(s[3]) < 1e-5
    assert s[2] == pytest.approx(-p.dahl_m * math.log(0.4), rel=0.05)  # the integral of Dahl's equation


def test_carriage_and_pulley_ring_as_the_three_lengths_of_belt_have_it() -> None:
    p = Belt(pulley_kg=2.0, carriage_kg=6.0, damping=0.0, viscous=0.0, coulomb_n=1e-9)
    s, twist = np.array([1e-4, 0.0, 0.0, 0.0, 0.0]), []
    for k in range(4000):
        between(p, s, 0.0, 0.0, k * 1e-4, (k + 1) * 1e-4, 1e-5, 0.0)
        twist.append(s[0] - s[2])
    crossings = np.flatnonzero(np.diff(np.sign(twist)))
    stiff = p.belt_n / p.half_m + p.belt_n / (3.0 * p.half_m)
    expected = math.sqrt(stiff / 1.5)
    assert math.pi / (np.mean(np.diff(crossings)) * 1e-4) == pytest.approx(expected, rel=2e-3)
    assert max(twist[-200:]) == pytest.approx(
        1e-4, rel=0.01
    )  # the pair of formulas neither adds nor takes energy


def test_a_damped_belt_rings_down_by_its_damping_over_twice_the_reduced_mass() -> None:
    p = Belt(pulley_kg=2.0, carriage_kg=6.0, damping=30.0, viscous=0.0, coulomb_n=1e-9)
    s, speeds = np.array([1e-4, 0.0, 0.0, 0.0, 0.0]), []
    for k in range(2000):
        between(p, s, 0.0, 0.0, k * 1e-4, (k + 1) * 1e-4, 1e-5, 0.0)
        speeds.append(abs(s[1] - s[3]))
    size = np.array(speeds)
    peaks = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    rate = np.polyfit(peaks * 1e-4, np.log(size[peaks]), 1)[0]
    assert rate == pytest.approx(-30.0 / (2.0 * 1.5), rel=0.01)


def test_friction_takes_energy_over_a_free_stop() -> None:
    p = Belt(viscous=0.0, damping=0.0)
    s = np.array([0.0, 0.3, 0.0, 0.3, 0.0])
    energies = []
    for k in range(200):
        between(p, s, 0.0, 0.0, k * 1e-3, (k + 1) * 1e-3, 1e-5, 0.0)
        stiff = p.belt_n / (p.half_m + s[2]) + p.belt_n / (3.0 * p.half_m - s[2])
        moving = 0.5 * p.pulley_kg * s[1] ** 2 + 0.5 * p.carriage_kg * s[3] ** 2
        energies.append(moving + 0.5 * stiff * (s[0] - s[2]) ** 2)
    assert energies[100] < 0.6 * energies[0]
    # while it slips in one direction, no step gives energy back
    assert np.diff(energies[:100]).max() < 1e-3 * energies[0]


def test_a_polynomial_move_is_consistent_and_ends_at_rest() -> None:
    move = fifth_order(0.1, 0.5, 1001, 1e-3)
    assert move[-1] == pytest.approx([0.5, 0.0, 0.0], abs=1e-9)
    np.testing.assert_allclose(np.gradient(move[:, 0], 1e-3)[5:-5], move[5:-5, 1], rtol=5e-3, atol=1e-4)
