import math

import numpy as np
import pytest

from tests.campaigns.blind.families.ball_screw.axis import ELEMENTS, Screw, advance, level_n, seen, yielded

H = 5e-5


def driven(p: Screw, force_n: float, seconds: float) -> np.ndarray:
    s, slip = np.zeros(4), np.zeros(ELEMENTS)
    for _ in range(round(seconds / H)):
        advance(p, s, slip, force_n, 0.0, 0.0, H)
    return s


def test_steady_speed_takes_viscous_and_yield_force_with_stribecks() -> None:
    p = Screw(rotor_kg=2.0, table_kg=3.0, viscous=100.0, coulomb_n=10.0, rise_n=6.0, rise_m_s=0.05)
    v = driven(p, 20.0, 1.5)[3]
    assert p.viscous * v + level_n(p, v, 0.0, 0.0) == pytest.approx(20.0, abs=1e-3)


def test_below_yield_it_deflects_by_the_springs_and_holds() -> None:
    p = Screw(coulomb_n=10.0, viscous=4000.0)
    early, late = driven(p, 5.0, 0.5), driven(p, 5.0, 1.0)
    assert abs(late[2] - early[2]) < 1e-10
    assert 0.0 < late[2] < 2.0 * p.preslide_m


def test_a_closed_path_of_friction_takes_energy_and_none_before_any_element_slips() -> None:
    def work(size_m: float) -> float:
        p, slip, total, x = Screw(), np.zeros(ELEMENTS), 0.0, 0.0
        # the first quarter loads; a period after that is closed
        for k in range(1, 5001):
            way = size_m * math.sin(2.0 * math.pi * k / 4000) - x
            x += way
            before = float(slip.sum())
            after, _ = yielded(p, slip, 12.0, way, True)
            total += 0.5 * (before + after) * way if k > 1000 else 0.0
        return total

    assert work(5e-6) > 1e-6
    assert work(2e-7) == pytest.approx(0.0, abs=1e-14)


def test_two_masses_ring_at_their_frequency() -> None:
    p = Screw(rotor_kg=4.0, table_kg=6.0, stiffness=1e6, damping=0.0, viscous=0.0, coulomb_n=1e-9)
    s, slip, twist = np.array([1e-4, 0.0, 0.0, 0.0]), np.zeros(ELEMENTS), []
    for _ in range(20_000):
        advance(p, s, slip, 0.0, 0.0, 0.0, 1e-5)
        twist.append(s[0] - s[2])
    crossings = np.flatnonzero(np.diff(np.sign(twist)))
    measured = math.pi / (np.mean(np.diff(crossings)) * 1e-5)
    assert measured == pytest.approx(math.sqrt(1e6 / 2.4), rel=2e-3)


def test_play_lets_the_table_lag_by_half_the_gap() -> None:
    p = Screw(gap_m=2e-5, viscous=600.0)
    s = driven(p, 60.0, 1.0)
    pressed = level_n(p, s[3], s[2], 0.0) / p.stiffness
    assert s[0] - s[2] == pytest.approx(1e-5 + pressed, rel=1e-3)


def test_sensors_show_lead_error_and_counts() -> None:
    p = Screw(stretch=1e-4, encoder_m=1e-6, scale_m=1e-6)
    motor, scale = seen(p, 0.1, 0.1, 0.0, np.zeros(2), False)
    assert (motor, scale) == (0.1, pytest.approx(0.10001))
    assert seen(p, 0.1000004, 0.0, 0.0, np.zeros(2), True)[0] == pytest.approx(0.1, abs=1e-12)
