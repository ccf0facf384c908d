import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest

from tests.campaigns.blind.families.interface import Array
from tests.campaigns.blind.families.tilting_table import draw
from tests.campaigns.blind.families.tilting_table.cycles import CYCLES
from tests.campaigns.blind.families.tilting_table.hidden import CONFLICTS
from tests.campaigns.blind.families.tilting_table.loop import notch_of
from tests.campaigns.blind.families.tilting_table.trunnion import Trunnion, advance, worm_level

H = 1.25e-4
SMOOTH = Trunnion(worm_dry=1e-9, seal_dry=1e-9, worm_viscous=0.0, seal_viscous=0.0)


def starting(m: Trunnion, speed: float = 0.0, way: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    return np.array([0.0, speed, 0.0, speed]), np.array([[0.0, way, m.yield_rad]] * 2)


def moved(m: Trunnion, s: np.ndarray, rub: np.ndarray, drive: float, seconds: float) -> np.ndarray:
    """Return angles and speeds (n, 4) after every step."""
    course, carried = [], 0.0
    for k in range(round(seconds / H)):
        carried = advance(m, s, rub, drive, carried, k * H, H, 0.0, 0.0)
        course.append(s.copy())
    return np.array(course)


def test_below_its_yield_the_axis_is_a_spring_and_above_it_slides() -> None:
    m = Trunnion(worm_viscous=600.0, seal_viscous=60.0)
    s, rub = starting(m)
    end = moved(m, s, rub, 20.0, 1.5)[-1]
    assert abs(end[1]) < 1e-6
    held = m.worm_dry / m.yield_rad * rub[0, 0] + m.seal_dry / m.yield_rad * rub[1, 0]
    assert held == pytest.approx(20.0, rel=1e-3)
    s, rub = starting(m)
    end = moved(m, s, rub, 80.0, 1.0)[-1]
    assert end[1] == pytest.approx((80.0 - 50.0) / 660.0, rel=1e-3)


def test_steady_speed_takes_mixed_churned_and_flank_friction() -> None:
    m = Trunnion(mixed=20.0, mixed_rad_s=0.4, churning=30.0, flank=5.0, flank_viscous=8.0, loss=0.02)
    s, rub = starting(m, 0.6, 1.0)
    w = moved(m, s, rub, 130.0, 4.0)[-1, 1]
    carried = m.seal_dry + m.seal_viscous * w
    law = 50.0 + 20.0 * math.exp(-((w / 0.4) ** 1.4)) + 5.0 + 0.02 * carried
    assert law + (40.0 + 5.0 + 8.0) * w + 30.0 * w**2 == pytest.approx(130.0, rel=1e-3)


def test_sliding_stops_where_the_equation_says_and_springs_back_no_further_than_the_yield() -> None:
    m = Trunnion(mesh=1e8)
    s, rub = starting(m, 0.2, 1.0)
    course = moved(m, s, rub, 0.0, 0.5)
    whole, drag = m.shaft + m.table, m.worm_viscous + m.seal_viscous
    way = whole / drag * (0.2 - 50.0 / drag * math.log1p(0.2 * drag / 50.0))  # of J dw/dt = -50 - drag w
    assert course[:, 0].max() == pytest.approx(way, rel=2e-3)
    assert course[:, 0].max() - course[-1, 0] < 2.0 * m.yield_rad


def test_free_of_friction_the_mesh_swings_and_an_unbalance_is_a_pendulum() -> None:
    s, rub = starting(SMOOTH)
    m = SMOOTH._replace(mesh_damper=0.0, mesh=2e5)
    s[0] = 1e-3
    twist = np.diff(moved(m, s, rub, 0.0, 0.5)[:, ::2], axis=1)[:, 0]
    crossings = np.flatnonzero(np.diff(np.sign(twist)))
    expected = math.sqrt(2e5 * (1.0 / m.shaft + 1.0 / m.table))
    assert math.pi / (np.diff(crossings).mean() * H) == pytest.approx(expected, rel=3e-3)
    assert np.abs(twist[-400:]).max() == pytest.approx(1e-3, rel=0.01)
    m = SMOOTH._replace(unbalance=180.0)
    s, rub = starting(SMOOTH)
    s[0] = s[2] = 0.02
    angle = moved(m, s, rub, 0.0, 6.0)[:, 2]
    crossings = np.flatnonzero(np.diff(np.sign(angle)))
    assert math.pi / (np.diff(crossings).mean() * H) == pytest.approx(math.sqrt(180.0 / 20.0), rel=2e-3)


def test_friction_takes_energy_and_gives_none() -> None:
    m = Trunnion(worm_viscous=0.0, seal_viscous=0.0, mixed=15.0)
    s, rub = starting(m, 0.4, 1.0)
    energy, carried = [], 0.0
    for k in range(8000):
        carried = advance(m, s, rub, 0.0, carried, k * H, H, 0.0, 0.0)
        kinetic = 0.5 * m.shaft * s[1] ** 2 + 0.5 * m.table * s[3] ** 2
        energy.append(kinetic + 0.5 * m.mesh * (s[0] - s[2]) ** 2)
    assert energy[-1] < 0.01 * energy[0]
    # what the elements hold elastically may come back, and no more
    assert max(b - a for a, b in pairwise(energy)) < 0.5 * 65.0 * m.yield_rad


def test_inside_the_play_the_table_is_free_and_flanks_stand_apart_by_it() -> None:
    m = Trunnion(play_rad=4e-4, worm_viscous=600.0)
    s, rub = starting(m)
    forth = moved(m, s, rub, 150.0, 0.5)[-1]
    back = moved(m, s, rub, -150.0, 0.5)[-1]
    windup = 2.0 * (m.seal_dry + m.seal_viscous * abs(back[3])) / m.mesh
    assert (forth[0] - forth[2]) - (back[0] - back[2]) == pytest.approx(4e-4 + windup, rel=0.01)


def test_warm_oil_and_a_rubbing_brake_change_the_level_and_a_notch_holds_its_frequency_back() -> None:
    m = Trunnion(oil=1.0, brake=30.0, brake_rad=0.4, brake_width_rad=0.2)
    cold = worm_level(m, -2.0, 0.1, 0.0, 1.0, 0.0)
    assert cold == pytest.approx(40.0)
    assert worm_level(m, -2.0, 0.1, 0.0, 1.0, 1.0) == pytest.approx(40.0 * (0.4 + 0.6 * math.exp(-1.0)))
    assert worm_level(m, 0.4, 0.1, 0.0, 1.0, 0.0) == pytest.approx(70.0)
    b0, b1, b2 = notch_of(150.0, 5e-4)
    for hertz, gain in ((150.0, 0.1 / 0.6), (1e-3, 1.0)):
        z = np.exp(-2j * math.pi * hertz * 5e-4)
        assert abs((b0 + b1 * z + b2 * z**2) / (1.0 + b1 * z + (b0 + b2 - 1.0) * z**2)) == pytest.approx(gain)


@pytest.mark.parametrize("cycle", CYCLES)
def test_a_cycle_stays_in_its_travel_rests_and_agrees_with_its_speeds(cycle: Callable[..., Array]) -> None:
    for seed in range(30):
        x, v, a = cycle(np.random.default_rng(seed), -1.0, 1.4, 0.85, 20_400, 5e-4).T
        assert x.min() > -1.01
        assert x.max() < 1.41
        assert 0.02 < np.abs(v).max() < 0.86
        assert 0.15 < np.mean(np.abs(v) > 1e-9) < 0.95
        assert np.abs(v[:100]).max() < 1e-12
        assert np.abs(v[-100:]).max() < 1e-12
        np.testing.assert_allclose(np.diff(x), v[1:] * 5e-4, atol=1e-12)
        assert np.abs(a).max() < 60.0


def test_about_half_of_the_axes_have_an_encoder_at_the_table_and_conflicts_never_meet() -> None:
    cases = [draw(seed) for seed in range(120)]
    assert 0.4 < sum(case.sound.scale_count > 0.0 for case in cases) / len(cases) < 0.65
    assert not any(pair <= case.names for pair in CONFLICTS for case in cases)
    wrong = [abs(case.nominal.inertia / case.sound.inertia - 1.0) for case in cases]
    assert 0.1 <= min(wrong) < max(wrong) <= 0.3
