"""Recordings of a double pendulum under PD control, by the mass matrix of its two absolute angles."""

import math

import numpy as np

from kernels.arrays import Array
from reconcile.recording.recording import AxisRecording

PERIOD_S, G_M_S2 = 1e-3, 9.81
LINK_1_KG, LINK_2_KG, LENGTH_1_M, CENTRE_1_M, CENTRE_2_M = 0.7, 0.6, 0.3, 0.2, 0.15
INERTIA_1, INERTIA_2 = 0.06, 0.03
"""Of each link about its own joint, kg m^2."""
ARM = LINK_2_KG * LENGTH_1_M * CENTRE_2_M
MASSES = {"j1": INERTIA_1 + INERTIA_2 + LINK_2_KG * LENGTH_1_M**2, "j2": INERTIA_2}
"""Moved by each joint, without what turns with the outer one, kg m^2."""
OUTER_WEIGHT = LINK_2_KG * G_M_S2 * CENTRE_2_M
INNER_WEIGHT = G_M_S2 * (LINK_1_KG * CENTRE_1_M + LINK_2_KG * LENGTH_1_M)
COULOMB, VISCOUS = 0.1, 0.02
GAINS = ((60.0, 3.0), (20.0, 1.0))
"""Of position and velocity, by joint, N m/rad and N m s/rad."""


def _reference(rng: np.random.Generator, count: int) -> Array:
    """Position (n,) of some slow sines."""
    time_s = np.arange(count) * PERIOD_S
    sines = [
        rng.uniform(0.1, 0.4) * np.sin(2.0 * math.pi * rng.uniform(0.2, 1.4) * time_s + rng.uniform(0.0, 6.0))
        for _ in range(4)
    ]
    return np.asarray(np.sum(sines, axis=0))


def _accelerations(
    a: float, b: float, va: float, vb: float, torque: tuple[float, float], coupled: float
) -> tuple[float, float]:
    """Angular accelerations of both links, rad/s^2; `coupled` 0 takes the links off each other."""
    friction = [COULOMB * math.tanh(speed / 0.01) + VISCOUS * speed for speed in (va, vb - coupled * va)]
    t1, t2 = torque[0] - friction[0], torque[1] - friction[1]
    arm, turning = coupled * ARM * math.cos(a - b), coupled * ARM * math.sin(a - b)
    first = INERTIA_1 + LINK_2_KG * LENGTH_1_M**2
    f1 = t1 - coupled * t2 - turning * vb**2 - INNER_WEIGHT * math.sin(a)
    f2 = t2 + turning * va**2 - OUTER_WEIGHT * math.sin(b)
    det = first * INERTIA_2 - arm**2
    return (INERTIA_2 * f1 - arm * f2) / det, (first * f2 - arm * f1) / det


def recordings(
    seed: int, *, seconds: float = 8.0, count_rad: float = 1e-5, coupled: bool = True
) -> dict[str, AxisRecording]:
    """One recording of both joints; without coupling each link hangs on a wall of its own."""
    rng, count, link = np.random.default_rng(seed), round(seconds / PERIOD_S), float(coupled)
    wanted = [_reference(rng, count) for _ in GAINS]
    a = b = va = vb = 0.0
    rows = np.empty((count, 4))
    parts = 4  # of a period: the integration's own step
    for k in range(count):
        q, v = (a, b - link * a), (va, vb - link * va)
        torque = tuple(p * (wanted[j][k] - q[j]) - d * v[j] for j, (p, d) in enumerate(GAINS))
        rows[k] = (*q, *torque)
        for _ in range(parts):
            step = PERIOD_S / parts
            aa, ab = _accelerations(a, b, va, vb, (torque[0], torque[1]), link)
            va, vb = va + step * aa, vb + step * ab
            a, b = a + step * va, b + step * vb
    positions = {f"j{j + 1}": np.round(rows[:, j] / count_rad) * count_rad for j in range(2)}
    return {
        name: AxisRecording(
            source=f"run_{seed}.csv",
            axis=name,
            period_s=PERIOD_S,
            time_s=np.arange(count) * PERIOD_S,
            motor_m=positions[name],
            force_n=rows[:, 2 + j] + 0.003 * rng.normal(size=count),
            scale_m=None,
            reference_m=None,
            temperature_k=None,
            others={other: values for other, values in positions.items() if other != name},
        )
        for j, name in enumerate(positions)
    }
