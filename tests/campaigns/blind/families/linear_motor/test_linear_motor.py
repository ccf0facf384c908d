import math

import numpy as np
import pytest

from tests.campaigns.blind.families.linear_motor.paths import limited
from tests.campaigns.blind.families.linear_motor.slide import Slide, advance, motor_n

H = 1e-4


def test_it_coasts_to_a_stop_in_the_time_of_coulomb_and_viscous_friction_and_stays() -> None:
    p, s = Slide(mass_kg=10.0, viscous=20.0, coulomb_n=5.0), np.array([0.0, 0.5, 0.0, 0.0])
    steps = 0
    while s[1] > 0.0:
        advance(p, s, 0.0, 0.0, H, 0.0)
        steps += 1
    expected = p.mass_kg / p.viscous * math.log(1.0 + p.viscous * 0.5 / p.coulomb_n)
    # the rest within the last step tells the instant of the crossing
    assert steps * H - s[2] == pytest.approx(expected, abs=2e-5)
    held = s[0]
    for _ in range(100):
        advance(p, s, 4.99, 0.0, H, 0.0)
    assert s[0] == held
    assert s[1] == 0.0


def test_steady_speed_takes_every_law_of_friction() -> None:
    p = Slide(mass_kg=2.0, extra_n=3.0, fall_m_s=0.2, forward_n=1.0, drag=8.0)
    s = np.array([0.0, 0.2, 0.0, 0.0])
    for _ in range(40_000):
        advance(p, s, 14.0, 0.0, H, 0.0)
    v = s[1]
    law = p.coulomb_n + 3.0 * math.exp(-((v / 0.2) ** 2)) + 1.0 + p.viscous * v + 8.0 * v**2
    assert law == pytest.approx(14.0, rel=1e-6)


@pytest.mark.parametrize(("rest_s", "moves"), [(0.2, True), (5.0, False)])
def test_breakaway_grows_with_the_logarithm_of_the_rest(rest_s: float, moves: bool) -> None:
    p = Slide(ageing_n=1.0, young_s=0.1)
    s = np.array([0.0, 0.0, rest_s, 0.0])
    force = p.coulomb_n + math.log1p(1.0 / 0.1)  # breakaway after a rest of 1 s
    advance(p, s, force, 0.0, H, 0.0)
    assert (s[1] > 0.0) == moves


def test_friction_takes_energy_at_every_reversal_of_a_shaken_slide() -> None:
    p, s, work = Slide(viscous=0.0), np.zeros(4), 0.0
    for k in range(40_000):
        x, v = s[0], s[1]
        drive = 20.0 * math.sin(2.0 * math.pi * 4.0 * k * H)
        advance(p, s, drive, k * H, H, 0.0)
        work = drive * (s[0] - x) - 0.5 * p.mass_kg * (s[1] ** 2 - v**2)
        assert work > -1e-5
    assert abs(s[0]) < 0.1


def test_dead_zone_iron_and_ripple_act_on_the_current() -> None:
    assert motor_n(Slide(dead_n=2.0), 1.9, 0.0) == 0.0
    assert motor_n(Slide(dead_n=2.0), -5.0, 0.0) == -3.0
    assert motor_n(Slide(iron_n=50.0), 50.0, 0.0) == pytest.approx(50.0 / math.sqrt(2.0))
    assert motor_n(Slide(ripple=0.1, ripples=1.0), 10.0, 0.008) == pytest.approx(11.0)


def test_a_move_keeps_its_limits_and_arrives() -> None:
    way = limited(np.array([0.3]), np.array([0.5]), np.array([0.1]), 4.0, 60.0, 5e-4)
    assert way[-1, 0] == pytest.approx(0.3)
    assert np.abs(way[:, 1]).max() <= 0.5 + 1e-9
    assert np.abs(way[:, 2]).max() <= 4.0 * 1.05
