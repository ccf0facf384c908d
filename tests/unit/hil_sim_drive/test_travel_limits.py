"""Travel limits without a drive: clipping, braking distance, limit switches."""

import math
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from in_process_nodes import IDEAL_AXIS

from hil_sim.config import build_plant, load_plant
from hil_sim.drive.axis_port import TORQUE_REVERSED, VELOCITY_REVERSED, AxisPort
from hil_sim.drive.drive_objects import DriveObjects
from hil_sim.drive.travel_limits import TravelLimits

CONFIG = load_plant(IDEAL_AXIS)
PLANT = build_plant(CONFIG)
LOW, HIGH = -1000, 3000
DT_S = 1e-3


def limits(position: float = 0.0, position_change_sign: int = 1, torque_side: int = 1) -> TravelLimits:
    objects: Any = DriveObjects()
    objects.min_position_limit, objects.max_position_limit = LOW, HIGH
    port = AxisPort(CONFIG.axes["x"], PLANT, 0, objects)
    turned = (VELOCITY_REVERSED if position_change_sign < 0 else 0) | (
        TORQUE_REVERSED if torque_side < 0 else 0
    )
    port.set_polarity(turned)
    port.record["position"] = position
    return TravelLimits(objects, port)


def ends(made: TravelLimits) -> tuple[float, float]:
    """Return the smallest and the largest permissible position."""
    return made.position(-math.inf), made.position(math.inf)


@pytest.mark.parametrize(
    ("wanted", "given", "clipped"),
    [
        (0.0, 0.0, False),
        (LOW, LOW, False),
        (HIGH, HIGH, False),
        (LOW - 0.5, LOW, True),
        (HIGH + 0.5, HIGH, True),
        (-math.inf, LOW, True),
    ],
)
def test_position_is_clipped_at_the_limit_itself(wanted: float, given: float, clipped: bool) -> None:
    made = limits()
    assert not made.active
    assert (made.position(wanted), made.active) == (given, clipped)


def test_switch_narrows_the_travel_at_its_side_until_it_is_free() -> None:
    made = limits()
    assert (made.switched, made.blocks(1), made.blocks(-1)) == (False, False, False)
    made.block(1, 2000.0)
    assert ends(made) == (LOW, 2000.0)
    assert (made.switched, made.blocks(1), made.blocks(-1)) == (True, True, False)
    made.block(-1, -10.0)
    assert ends(made) == (-10.0, 2000.0)
    made.release(1)
    assert (made.switched, made.blocks(1), made.blocks(-1)) == (True, False, True)
    made.release(-1)
    made.release(-1)
    assert (*ends(made), made.switched) == (LOW, HIGH, False)


@pytest.mark.parametrize(("direction", "place"), [(1, HIGH + 50.0), (-1, LOW - 50.0)])
def test_switch_beyond_the_software_limit_widens_nothing(direction: int, place: float) -> None:
    made = limits()
    made.block(direction, place)
    assert ends(made) == (LOW, HIGH)


@pytest.mark.parametrize("direction", [1, -1])
def test_axis_beyond_a_closed_switch_is_not_pulled_back_and_goes_no_further(direction: int) -> None:
    made = limits()
    made.block(direction, direction * 500.0)
    made.keep_position_beyond(direction * 700.0)
    assert made.position(direction * 700.0) == direction * 700.0
    assert made.position(direction * 701.0) == direction * 700.0
    made.keep_position_beyond(direction * 600.0)
    assert made.position(direction * 701.0) == direction * 700.0


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(("beyond", "stays_at"), [(0.25, 0.25), (1.0, 1.0), (0.0, 0.0), (-0.25, 0.0)])
@pytest.mark.parametrize("place", [0.0, 500.0])
def test_switch_limit_moves_out_with_an_axis_beyond_it_and_never_inwards(
    direction: int, beyond: float, stays_at: float, place: float
) -> None:
    made = limits()
    made.block(direction, direction * place)
    made.keep_position_beyond(direction * (place + beyond))
    assert made.position(direction * (place + 900.0)) == direction * (place + stays_at)


speeds = st.floats(-1e6, 1e6, allow_nan=False).filter(lambda speed: speed != 0.0)


@given(speeds, st.floats(LOW - 100.0, HIGH + 100.0), st.floats(1.0, 1e6), st.sampled_from([1, -1]))
def test_velocity_is_the_largest_from_which_braking_ends_at_the_limit(
    wanted: float, position: float, deceleration: float, side: int
) -> None:
    """One period at v, then braking: v dt + v^2 / 2a is the remaining distance, or v the lower demand."""
    made = limits(position, position_change_sign=side)
    left = HIGH - position if wanted * side > 0.0 else position - LOW
    assume(not 0.0 < left < 1e-3)  # there the root is lost in rounding
    given_v = made.velocity(wanted, deceleration, DT_S)
    way = abs(given_v) * DT_S + given_v * given_v / (2.0 * deceleration)
    if left <= 0.0:
        assert (given_v, made.active) == (0.0, True)
    elif made.active:
        assert way == pytest.approx(left, rel=1e-6)
        assert 0.0 < abs(given_v) < abs(wanted)
        assert math.copysign(1.0, given_v) == math.copysign(1.0, wanted)
    else:
        assert given_v == wanted
        assert way <= left * (1.0 + 1e-9)


def test_axis_at_rest_at_its_limit_is_not_clipped() -> None:
    made = limits(HIGH)
    assert (made.velocity(0.0, 100.0, DT_S), made.active) == (0.0, False)
    assert (made.velocity(-1e-3, 100.0, DT_S), made.active) == (-1e-3, False)
    assert (made.velocity(1e-3, 100.0, DT_S), made.active) == (0.0, True)


@pytest.mark.parametrize("place", [LOW, HIGH])
def test_standing_at_a_limit_is_no_clip_and_creeping_outwards_is(place: int) -> None:
    outwards = 1.0 if place == HIGH else -1.0
    made = limits(place)
    assert (made.velocity(0.0, 100.0, DT_S), made.active) == (0.0, False)
    assert (made.velocity(outwards, 100.0, DT_S), made.active) == (0.0, True)


@pytest.mark.parametrize("beyond", [0.5, 50.0])
def test_axis_beyond_its_limit_may_only_come_back(beyond: float) -> None:
    made = limits(HIGH + beyond)
    assert (made.velocity(7.0, 100.0, DT_S), made.active) == (0.0, True)
    made = limits(HIGH + beyond)
    assert (made.velocity(-7.0, 100.0, DT_S), made.active) == (-7.0, False)


def test_rounding_allows_half_a_count_at_the_limit() -> None:
    made = limits(HIGH - 0.5)
    assert (made.velocity(1.0, 100.0, DT_S), made.active) == (1.0, False)


def test_largest_velocity_that_braking_allows_is_not_clipped() -> None:
    """Remaining distance 3000, a = 100000, dt = 1 ms: the largest velocity is sqrt(100^2 + 6e8) - 100."""
    largest = math.sqrt(100.0**2 + 2.0 * 100_000.0 * 3000.0) - 100.0
    made = limits()
    assert (made.velocity(largest, 100_000.0, DT_S), made.active) == (largest, False)
    assert made.velocity(-largest, 100_000.0, DT_S) == pytest.approx(
        -(math.sqrt(100.0**2 + 2.0 * 100_000.0 * 1000.0) - 100.0)
    )


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("switch", [1, -1])
def test_no_torque_into_a_switch_and_any_away_from_it(side: int, switch: int) -> None:
    made = limits(torque_side=side)
    into = switch * side * 5
    assert (made.torque(into), made.active) == (into, False)
    made.block(switch, 0.0)
    assert (made.torque(-into), made.torque(0), made.active) == (-into, 0, False)
    assert (made.torque(into), made.active) == (0, True)


def test_torque_of_one_per_mille_is_torque() -> None:
    made = limits()
    made.block(1, 0.0)
    assert (made.torque(1), made.torque(-1)) == (0, -1)
