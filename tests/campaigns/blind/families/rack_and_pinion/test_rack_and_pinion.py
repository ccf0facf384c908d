import math

import pytest

from tests.campaigns.blind.families.rack_and_pinion.lift import Lift, dry_limits_n, stepped

H = 5e-5


def pushed(p: Lift, force_n: float, seconds: float, v: float = 0.0) -> tuple[float, float]:
    x = 0.0
    for _ in range(round(seconds / H)):
        x, v = stepped(p, x, v, force_n, 0.0, 0.0, H)
    return x, v


def test_friction_holds_a_weight_without_any_creep() -> None:
    p = Lift(weight_n=39.9)
    assert pushed(p, 0.0, 2.0) == (0.0, 0.0)
    assert pushed(p, 79.8, 2.0) == (0.0, 0.0)
    assert pushed(p, 80.1, 0.5)[0] > 0.0


def test_lifting_and_lowering_at_a_speed_differ_by_twice_the_friction() -> None:
    p = Lift(weight_n=300.0, mass_kg=10.0, by_load=0.05, up_n=4.0)
    up = pushed(p, 420.0, 3.0)[1]
    law = p.viscous * up + dry_limits_n(p, 0.0, up, 420.0, 0.0)[0]
    assert law == pytest.approx(420.0 - 300.0, rel=1e-6)
    down = pushed(p, 180.0, 3.0)[1]
    assert (
        pytest.approx(p.viscous * down - dry_limits_n(p, 0.0, down, 180.0, 0.0)[1], rel=1e-6) == 180.0 - 300.0
    )


def test_it_coasts_as_far_as_friction_and_weight_let_it() -> None:
    p = Lift(viscous=1e-9, weight_n=30.0)
    x, v = pushed(p, 0.0, 1.0, v=1.0)
    assert v == 0.0  # friction of 40 N holds the weight
    assert x == pytest.approx(0.5 * p.mass_kg / (p.dry_n + p.weight_n), rel=1e-4)


def test_no_step_of_friction_gives_energy() -> None:
    p, x, v = Lift(viscous=0.0, static_n=30.0, rail_n=10.0), 0.0, 0.0
    for k in range(20_000):
        drive = 120.0 * math.sin(12.0 * k * H)
        new_x, new_v = stepped(p, x, v, drive, 0.0, 0.0, H)
        gained = 0.5 * p.mass_kg * (new_v**2 - v**2)
        # in the step that crosses zero speed the impulse is that of one direction
        assert drive * (new_x - x) - gained > -1e-7
        x, v = new_x, new_v


def test_a_hot_gear_rubs_less_and_a_load_more() -> None:
    p = Lift(oil=0.25, by_load=0.1)
    assert dry_limits_n(p, 0.0, 1.0, 0.0, 1.0)[0] == pytest.approx(30.0)
    assert dry_limits_n(p, 0.0, 1.0, -100.0, 0.0)[0] == pytest.approx(50.0)
