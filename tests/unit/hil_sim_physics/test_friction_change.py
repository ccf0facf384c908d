"""How friction changes with time, distance and heat, against closed forms."""

import math

import numpy as np
import pytest
from temperature_step import temperature_after

from hil_sim.physics.friction import friction_ageing, lubrication_loss, temperature_dependent_friction

WARM = temperature_dependent_friction.Params(
    warm_level_share=0.6,
    warm_damping_share=0.3,
    warmth_scale_k=8.0,
    heat_capacity_j_k=400.0,
    resistance_k_w=2.0,
)
DRY = lubrication_loss.Params(start_s=60.0, transition_s=2.0, level_factor=1.8, damping_factor=0.5)
WORN = friction_ageing.Params(level_1_m=2e-5, damping_1_m=-1e-5)


def warm(warmth_k: float) -> tuple[float, float]:
    return temperature_dependent_friction.factors(WARM, temperature_dependent_friction.State(warmth_k), 0.0)


def dry(time_s: float, p: lubrication_loss.Params = DRY) -> tuple[float, float]:
    return lubrication_loss.factors(p, time_s)


def worn(travelled_m: float) -> tuple[float, float]:
    return friction_ageing.factors(WORN, friction_ageing.State(travelled_m), 0.0)


def test_friction_falls_from_cold_to_its_warm_share_by_1_over_e_per_scale() -> None:
    assert warm(0.0) == pytest.approx((1.0, 1.0))
    assert warm(8.0) == pytest.approx((0.6 + 0.4 / math.e, 0.3 + 0.7 / math.e))
    assert warm(300.0) == pytest.approx((0.6, 0.3))


def test_lubricant_warms_and_cools_as_newtons_law() -> None:
    warmth_k, dt_s = 0.0, 0.05
    for _ in range(20_000):
        warmth_k = temperature_after(temperature_dependent_friction, WARM, warmth_k, 6.0, dt_s)
    hot_k = 2.0 * 6.0 * (1.0 - math.exp(-1000.0 / (2.0 * 400.0)))
    assert warmth_k == pytest.approx(hot_k, rel=1e-4)
    for _ in range(20_000):
        warmth_k = temperature_after(temperature_dependent_friction, WARM, warmth_k, 0.0, dt_s)
    assert warmth_k == pytest.approx(hot_k * math.exp(-1000.0 / (2.0 * 400.0)), rel=1e-3)


def test_heat_is_conserved_what_came_in_is_stored_or_has_left() -> None:
    rng = np.random.default_rng(3)
    power_w = rng.uniform(0.0, 20.0, 5000)
    warmth_k, left_j, dt_s = 0.0, 0.0, 0.1
    for watts in power_w:
        left_j += warmth_k / WARM.resistance_k_w * dt_s
        warmth_k = temperature_after(temperature_dependent_friction, WARM, warmth_k, float(watts), dt_s)
    assert WARM.heat_capacity_j_k * warmth_k + left_j == pytest.approx(np.sum(power_w) * dt_s, rel=1e-9)


def test_power_that_presliding_gives_back_does_not_cool_below_the_surroundings() -> None:
    assert temperature_after(temperature_dependent_friction, WARM, 0.0, -1.0, 1e-3) == 0.0


def test_lubrication_is_lost_linearly_within_the_transition_and_stays_lost() -> None:
    assert dry(0.0) == dry(60.0) == (1.0, 1.0)
    assert dry(60.5) == pytest.approx((1.2, 0.875))
    assert dry(62.0) == pytest.approx((1.8, 0.5))
    assert dry(1e6) == pytest.approx((1.8, 0.5))


def test_a_short_transition_is_a_jump() -> None:
    jump = DRY._replace(transition_s=1e-3)
    assert dry(60.0, jump) == (1.0, 1.0)
    assert dry(60.001, jump) == pytest.approx((1.8, 0.5))


def test_friction_grows_or_falls_in_proportion_to_the_distance_and_never_below_none() -> None:
    assert worn(0.0) == (1.0, 1.0)
    assert worn(25e3) == pytest.approx((1.5, 0.75))
    assert worn(200e3) == pytest.approx((5.0, 0.0))
