"""A force of the wrong sign inverts mass and friction; the coupling force of another axis does not."""

import numpy as np
import pytest

from reconcile.sensing.units import rigid_columns, rigid_fit

T, N = 2e-3, 10_000


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_friction_distinguishes_a_wrong_sign_from_a_coupling(sign: float) -> None:
    t = np.arange(N) * T
    x = np.sin(2.0 * t) + 0.3 * np.sin(5.0 * t)
    v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
    coupled_n = sign * (-3.0 * a + 0.8 * v + 2.0 * np.sign(v))
    columns = rigid_columns(x, coupled_n, T)
    assert columns is not None
    fit = rigid_fit(columns)
    assert fit.mass_kg * sign < 0.0
    assert fit.friction_w * sign > 0.0
