import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.campaigns.blind.families.robot_joint.joint import Joint, bristle_level, kutta, relaxed

H = 1e-4


def moved(j: Joint, torque: float, seconds: float, s: np.ndarray | None = None) -> tuple[np.ndarray, float]:
    s, z = np.zeros(4) if s is None else s, 0.0
    for k in range(round(seconds / H)):
        z = relaxed(j, z, s[0], s[1], 0.0, 0.5 * H)
        kutta(j, s, torque, z, 0.0, k * H, H, 0.0)
        z = relaxed(j, z, s[0], s[1], 0.0, 0.5 * H)
    return s, z


def test_bristles_relax_as_their_equation_however_stiff() -> None:
    j = Joint(extra=2.0)
    stiff, w = j.dry / j.bristle_rad, 0.3
    level = bristle_level(j, 0.0, w, 0.0)
    equation = solve_ivp(
        lambda _t, z: w - stiff * abs(w) / level * z, (0.0, 2e-4), [1e-5], rtol=1e-9, atol=1e-15
    )
    assert relaxed(j, 1e-5, 0.0, w, 0.0, 2e-4) == pytest.approx(equation.y[0, -1], rel=1e-6)
    assert relaxed(j, 1e-5, 0.0, w, 0.0, 10.0) == pytest.approx(level / stiff)


def test_steady_speed_takes_viscous_and_stribeck_friction() -> None:
    j = Joint(rotor=0.1, link=0.2, extra=2.0, extra_rad_s=0.8, churn=1.5)
    w = moved(j, 12.0, 2.0)[0][1]
    law = 5.0 + 2.0 * math.exp(-((w / 0.8) ** 2)) + j.viscous * w + 1.5 * w**2
    assert law == pytest.approx(12.0, rel=1e-3)


def test_below_breakaway_bristles_hold() -> None:
    j = Joint(rotor=0.05, link=0.05, viscous=60.0)
    s, z = moved(j, 3.0, 1.0)
    assert abs(s[1]) < 1e-6
    assert j.dry / j.bristle_rad * z == pytest.approx(3.0, rel=1e-3)
    assert s[0] < 3.0 * j.bristle_rad


def test_a_hanging_link_swings_as_a_pendulum() -> None:
    j = Joint(rotor=0.3, link=0.7, viscous=0.0, dry=1e-9, hanging=9.0)
    s, angles = np.array([0.02, 0.0, 0.02, 0.0]), []
    for k in range(40_000):
        kutta(j, s, 0.0, 0.0, 0.0, k * H, H, 0.0)
        angles.append(s[2])
    crossings = np.flatnonzero(np.diff(np.sign(angles)))
    assert math.pi / (np.mean(np.diff(crossings)) * H) == pytest.approx(3.0, rel=2e-3)
    assert max(angles[-25_000:]) == pytest.approx(0.02, rel=0.01)


def test_friction_takes_the_energy_of_a_free_joint() -> None:
    j = Joint(damper=0.0)
    s, z, energy = np.array([0.0, 1.0, 0.0, 1.0]), 0.0, []
    for k in range(4000):
        z = relaxed(j, z, s[0], s[1], 0.0, 0.5 * H)
        kutta(j, s, 0.0, z, 0.0, k * H, H, 0.0)
        z = relaxed(j, z, s[0], s[1], 0.0, 0.5 * H)
        twist = s[0] - s[2]
        stored = (
            0.5 * j.spring * twist**2 + 0.25 * j.hardening * twist**4 + 0.5 * j.dry / j.bristle_rad * z**2
        )
        energy.append(0.5 * j.rotor * s[1] ** 2 + 0.5 * j.link * s[3] ** 2 + stored)
    assert energy[-1] < 0.05 * energy[0]
    assert np.diff(energy).max() < 1e-3 * energy[0]
