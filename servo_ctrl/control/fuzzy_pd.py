"""Fuzzy-PD position law: PD for large errors, a fuzzy controller for small ones (Xia et al., section III).

    v = v_PD                        |e| >= e2
    v = a v_PD + (1 - a) v_FZ       e1 < |e| < e2        (10), a of (11)
    v = v_FZ + ki int e dt          |e| <= e1            (12), (16)
    v_FZ = Ku mu(Ke e, Kec de/dt)                        (14), (15), Table I

mu is looked up: the surface of `fuzzy_inference`, bilinear between its points.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from servo_ctrl.control.jit import kernel

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from servo_ctrl.control.params import FuzzyPd


@kernel
def interpolated(surface: NDArray[np.float64], first: float, second: float) -> float:
    """The surface (n, n), n >= 2, over [-1, 1] x [-1, 1]; the inputs are clipped to that."""
    steps = surface.shape[0] - 1
    x = 0.5 * (min(max(first, -1.0), 1.0) + 1.0) * steps
    y = 0.5 * (min(max(second, -1.0), 1.0) + 1.0) * steps
    i, j = max(min(int(x), steps - 1), 0), max(min(int(y), steps - 1), 0)  # 0 at least for a NaN too
    x, y = x - i, y - j
    low = surface[i, j] + y * (surface[i, j + 1] - surface[i, j])
    high = surface[i + 1, j] + y * (surface[i + 1, j + 1] - surface[i + 1, j])
    return float(low + x * (high - low))


@kernel
def pd_share(p: FuzzyPd, error_m: float) -> float:
    """The weight a (11): 0 up to e1, 1 from e2 on."""
    size_m = abs(error_m)
    if size_m <= p.fine_m:
        return 0.0
    if size_m >= p.coarse_m:
        return 1.0
    # (11) with its exponents made negative: the quotient is the same, and nothing overflows on the way
    way, whole = p.weight_1_m * (size_m - p.fine_m), p.weight_1_m * (p.coarse_m - p.fine_m)
    return math.exp(way - whole) * math.expm1(-way) / math.expm1(-whole)


@kernel
def fuzzy_setpoint(p: FuzzyPd, error_m: float, change_m_s: float, pd_m_s: float) -> float:
    """Velocity set point (m/s) without the integral; `change_m_s` is de/dt, `pd_m_s` the PD law's."""
    share = pd_share(p, error_m)
    if share >= 1.0:
        return pd_m_s
    fuzzy_m_s = p.output_m_s * interpolated(p.surface, p.error_1_m * error_m, p.change_s_m * change_m_s)
    return share * pd_m_s + (1.0 - share) * fuzzy_m_s
