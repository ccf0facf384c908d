"""The fuzzy-PD law: weights by equation (11) in many digits, lookup against scipy's, integral within e1."""

import math
from decimal import Decimal, localcontext

import numpy as np
import pytest
from compensation_off import NO_FUZZY
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.interpolate import RegularGridInterpolator

from servo_ctrl.control import position_loop
from servo_ctrl.control.compensation import fuzzy_pd
from servo_ctrl.control.compensation.fuzzy_inference import inferred, surface
from servo_ctrl.control.compensation.fuzzy_pd import fuzzy_setpoint, interpolated, pd_share
from servo_ctrl.control.position_loop import velocity_setpoint

T = 1e-3
SURFACE = surface(13)
FUZZY = fuzzy_pd.Params(True, 2e-6, 2e-5, 1e5, 4e4, 20.0, 2e-3, 800.0, SURFACE)
PD = position_loop.Params(50.0, 300.0, 0.04, 0.5, False)
SCALED = st.floats(-1.5, 1.5)


def by_equation_11(size: float, fine: float, coarse: float, weight: float) -> float:
    with localcontext() as context:
        context.prec = 60
        context.Emax, context.Emin = 10**12, -(10**12)
        e, e1, e2 = ((Decimal(weight) * Decimal(value)).exp() for value in (size, fine, coarse))
        return float((e - e1) / (e2 - e1))


@settings(deadline=None, max_examples=200)
@given(st.floats(1e-7, 1e-4), st.floats(1e-7, 1e-2), st.floats(0.0, 1.0), st.floats(1e-3, 1e8))
def test_the_weight_is_that_of_equation_11_however_large_its_exponents(
    fine: float, width: float, share: float, weight: float
) -> None:
    # up to exp(1e6): no double holds that
    coarse = fine + width
    size = fine + share * width
    assume(fine < size < coarse)
    p = FUZZY._replace(fine_m=fine, coarse_m=coarse, weight_1_m=weight)
    expected = by_equation_11(size, fine, coarse, weight)
    # a difference of sizes as doubles has this relative rounding, and the exponent that of its size
    rounding = 4e-16 * (coarse / (size - fine) + coarse / width + weight * width) + 1e-14
    for error in (size, -size):
        assert pd_share(p, error) == pytest.approx(expected, rel=rounding, abs=1e-300)


def test_the_weight_is_0_up_to_e1_and_1_from_e2_on_and_rises_between() -> None:
    sizes = np.linspace(0.0, 3e-5, 400)
    found = np.array([pd_share(FUZZY, float(size)) for size in sizes])
    assert not found[sizes <= 2e-6].any()
    assert (found[sizes >= 2e-5] == 1.0).all()
    assert (np.diff(found[(sizes > 2e-6) & (sizes < 2e-5)]) > 0.0).all()


@settings(deadline=None)
@given(
    st.integers(2, 9).flatmap(lambda n: arrays.arrays(np.float64, (n, n), elements=st.floats(-1.0, 1.0))),
    SCALED,
    SCALED,
)
def test_the_lookup_is_scipys_on_a_regular_grid(table: np.ndarray, first: float, second: float) -> None:
    nodes = np.linspace(-1.0, 1.0, len(table))
    at = np.clip([first, second], -1.0, 1.0)
    expected = RegularGridInterpolator((nodes, nodes), table)(at)[0]
    assert interpolated(table, first, second) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_the_rows_of_the_surface_are_the_error() -> None:
    p = FUZZY._replace(fine_m=1.0, coarse_m=2.0)
    for i, j in np.ndindex(SURFACE.shape):
        error, change = i / 6.0 - 1.0, j / 6.0 - 1.0
        found = fuzzy_setpoint(p, error / 4e4, change / 20.0, 9.0)
        assert found == pytest.approx(2e-3 * inferred(error, change), rel=1e-9, abs=1e-15)
    small_positive, large_negative = 1.0 / 3.0, -1.0
    assert interpolated(SURFACE, small_positive, large_negative) == pytest.approx(0.0, abs=1e-12)  # table I
    assert interpolated(SURFACE, large_negative, small_positive) == pytest.approx(-2.0 / 3.0)


@settings(deadline=None)
@given(st.floats(-5e-5, 5e-5), st.floats(-0.1, 0.1))
def test_the_law_is_as_odd_as_its_surface(error: float, change: float) -> None:
    pd = 50.0 * error + 0.04 * change
    there, back = fuzzy_setpoint(FUZZY, error, change, pd), fuzzy_setpoint(FUZZY, -error, -change, -pd)
    assert there == pytest.approx(-back, rel=1e-9, abs=1e-12)  # table I is odd
    lopsided = FUZZY._replace(surface=SURFACE + 0.1)
    sum_m_s = fuzzy_setpoint(lopsided, error, change, pd) + fuzzy_setpoint(lopsided, -error, -change, -pd)
    share = pd_share(FUZZY, error)
    assert sum_m_s == pytest.approx((1.0 - share) * 2e-3 * 2.0 * 0.1, rel=1e-9, abs=1e-12)


@settings(deadline=None)
@given(st.sampled_from([-1.0, 1.0]), st.floats(-0.1, 0.1), st.sampled_from(["fine_m", "coarse_m"]))
def test_the_law_is_continuous_where_it_changes(sign: float, change: float, edge: str) -> None:
    at = getattr(FUZZY, edge)
    found = []
    for error in (math.nextafter(at, 0.0), at, math.nextafter(at, 1.0)):
        pd = 50.0 * sign * error + 0.04 * change
        found.append(fuzzy_setpoint(FUZZY, sign * error, change, pd))
    assert found == pytest.approx([found[1]] * 3, rel=1e-9, abs=1e-12)


def integrals(errors: list[float], fuzzy: fuzzy_pd.Params) -> list[float]:
    state, found = position_loop.State(0.0, 0.0, 0.0), []
    for error in errors:
        _, state = velocity_setpoint(PD, fuzzy, state, error, 0.0, 1e9, T)
        found.append(state.integral_m_s)
    return found


def test_the_integral_acts_within_e1_only_and_restarts_there() -> None:
    errors = [1e-6] * 5 + [3e-6] * 2 + [-2e-6] * 3 + [1.0]
    step = 800.0 * T
    expected = [1e-6 * step * (k + 1) for k in range(5)] + [0.0] * 2
    expected += [-2e-6 * step * (k + 1) for k in range(3)] + [0.0]
    np.testing.assert_allclose(integrals(errors, FUZZY), expected, rtol=1e-12)


@settings(deadline=None)
@given(st.lists(st.floats(-1e-4, 1e-4), min_size=1, max_size=20))
def test_disabled_it_is_the_pid_law_and_above_e2_the_pd_law(errors: list[float]) -> None:
    pd_only = PD._replace(ki_1_s2=0.0)
    states = [position_loop.State(0.0, 0.0, 0.0)] * 4
    for error in errors:
        laws = ((PD, FUZZY._replace(enabled=False)), (PD, NO_FUZZY), (PD, FUZZY), (pd_only, NO_FUZZY))
        wanted = [0.0] * 4
        for i, (p, fuzzy) in enumerate(laws):
            wanted[i], states[i] = velocity_setpoint(p, fuzzy, states[i], error, 1e-3, 1e9, T)
        assert wanted[0] == wanted[1]
        if abs(error) >= FUZZY.coarse_m:
            assert wanted[2] == wanted[3]
