"""Fit inertia, viscous and Coulomb friction and an offset by rollouts, as simulators' own tools do.

The axis is simulated from the measured force over short windows, each begun at the measured place and speed,
and the squares of the place's error are made least over the parameters by Gauss-Newton within bounds. The
scheme is that of MuJoCo's system identification: prediction error over rollouts, box bounds, differences for
the Jacobian.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit
from scipy.optimize import least_squares

from kernels.arrays import Array
from reconcile.examples.real.judged import Judged

WINDOW_S = 0.2
CREEP = 0.002
"""Speed over the largest within which friction turns continuously."""
MOST_WINDOWS = 150
"""Of a recording, evenly chosen."""
BOUNDS = ((0.2, 0.0, 0.0, -3.0), (5.0, 10.0, 10.0, 3.0))
"""Of the parameters over what a linear regression gives; of the offset over Coulomb friction where larger."""


@njit(cache=True)
def errors(
    theta: Array,
    force_n: Array,
    place: Array,
    speed: Array,
    starts: Array,
    n: int,
    period_s: float,
    creep: float,
) -> Array:
    """Return the errors of place (windows, n) by semi-implicit Euler."""
    out = np.empty((len(starts), n))
    for row in range(len(starts)):
        k = int(starts[row])
        x, v = place[k], speed[k]
        for i in range(n):
            friction = theta[1] * v + theta[2] * np.tanh(v / creep) + theta[3]
            v += period_s * (force_n[k + i] - friction) / theta[0]
            x += period_s * v
            out[row, i] = x - place[k + i + 1]
    return out


def fitted_rollouts(recordings: Sequence[Judged]) -> dict[str, float]:
    """Return `inertia`, `viscous` and `coulomb` in the files' units."""
    columns = np.concatenate(
        [np.column_stack((r.rigid, np.ones(len(r.rigid))))[r.kept()] for r in recordings]
    )
    force = np.concatenate([r.force_n[r.kept()] for r in recordings])
    begun, *_ = np.linalg.lstsq(columns, force, rcond=None)
    coulomb_n = max(begun[2], 1e-9)
    scale = np.array([begun[0], max(begun[1], 1e-9), coulomb_n, max(abs(begun[3]), coulomb_n)])

    def residuals(share: Array) -> Array:
        parts = []
        for one in recordings:
            motion, period_s = one.data.motion, one.data.period_s
            n = round(WINDOW_S / period_s)
            starts = np.linspace(0, len(motion.position_m) - n - 2, MOST_WINDOWS)
            place, speed = motion.position_m, motion.velocity_m_s
            creep = CREEP * float(np.abs(speed).max())
            off = errors(share * scale, one.data.force_n, place, speed, starts, n, period_s, creep)
            moves = np.abs(speed[starts.astype(np.int64)]) > creep
            parts.append((off[moves] / float(np.ptp(place))).ravel())
        return np.concatenate(parts)

    start = np.clip([1.0, 1.0, 1.0, begun[3] / scale[3]], *np.array(BOUNDS) * 0.999)
    found = least_squares(residuals, start, bounds=BOUNDS, loss="soft_l1", f_scale=1e-4, max_nfev=15)
    inertia, viscous, coulomb, _ = found.x * scale
    return {"inertia": float(inertia), "viscous": float(viscous), "coulomb": float(coulomb)}
