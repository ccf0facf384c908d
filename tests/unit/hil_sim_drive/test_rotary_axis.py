"""A rotary axis: positions wrap at 607Bh, and 60F2h selects the direction of a move."""

import canopen
import pytest
from hypothesis import given
from hypothesis import strategies as st
from in_process_nodes import InProcessNodes, SdoDrive, counts

from hil_sim.drive.position_range import LINEAR, NEGATIVE, POSITIVE, SHORTEST, PositionRange

TURN = counts(8)
REACHED = 1 << 10
MM = counts(1)


@pytest.fixture
def drive() -> SdoDrive:
    drive = SdoDrive(InProcessNodes())
    drive.set(0x607B, 0, 1)
    drive.set(0x607B, TURN - 1, 2)
    drive.set(0x6081, counts(100))
    drive.set(0x6083, counts(2000))
    drive.set(0x6084, counts(2000))
    return drive


def move(drive: SdoDrive, millimetres: float, bits: int = 0) -> float:
    """Move to a position; return the travel of the motor (mm)."""
    before = drive.true_position_mm
    drive.set(0x607A, round(millimetres * MM))
    drive.control(0x1F | bits)
    drive.control(0x0F | bits)
    drive.nodes.sync(2)
    drive.sync_until(lambda: drive.statusword & REACHED, 600)
    return drive.true_position_mm - before


@pytest.mark.parametrize(
    ("option", "first", "second", "moves"),
    [
        (LINEAR, 6.0, 1.0, (6.0, -5.0)),
        (SHORTEST, 6.0, 1.0, (-2.0, 3.0)),
        (POSITIVE, 6.0, 1.0, (6.0, 3.0)),
        (NEGATIVE, 6.0, 1.0, (-2.0, -5.0)),
        (SHORTEST, 9.0, 4.0, (1.0, 3.0)),  # 9 looks like 1
        (LINEAR, 9.0, 3.0, (9.0, 2.0)),  # as far as the numbers say, by a whole turn
    ],
)
def test_the_way_round(
    drive: SdoDrive, option: int, first: float, second: float, moves: tuple[float, float]
) -> None:
    drive.set(0x60F2, option)
    drive.enable(1)
    for place, way in zip((first, second), moves, strict=True):
        assert move(drive, place) == pytest.approx(way, abs=0.01)
        assert drive.get(0x6062) == pytest.approx(place % 8.0 * MM, abs=5)
        assert drive.get(0x6064) == pytest.approx(place % 8.0 * MM, abs=110)
        assert abs(drive.get(0x60F4)) < 200


def test_a_relative_move_may_be_of_several_turns(drive: SdoDrive) -> None:
    drive.set(0x60F2, POSITIVE)
    drive.enable(1)
    assert move(drive, -20.0, 0x40) == pytest.approx(-20.0, abs=0.01)
    assert drive.get(0x6064) == pytest.approx(4 * MM, abs=110)


@pytest.mark.parametrize("mode", [8, 7])
def test_cyclic_and_interpolated_set_points_run_on_over_the_end(drive: SdoDrive, mode: int) -> None:
    drive.enable(mode)
    drive.control(0x1F)
    for cycle in range(1, 301):
        place = -cycle * MM // 20 % TURN
        drive.set(0x607A, place) if mode == 8 else drive.set(0x60C1, place, 1)
        drive.nodes.sync()
    drive.nodes.sync(150)
    assert drive.state == "enabled"
    assert drive.true_position_mm == pytest.approx(-15.0, abs=0.02)
    assert drive.get(0x6064) == pytest.approx(1 * MM, abs=1500)


def test_positions_are_seen_in_the_range_whatever_moved_them(drive: SdoDrive) -> None:
    drive.set(0x60FF, counts(100))
    drive.enable(3)
    seen = []
    for _ in range(250):
        drive.nodes.sync()
        seen.append(drive.get(0x6064))
    assert 0 <= min(seen) < MM < TURN - MM < max(seen) < TURN
    assert drive.true_velocity_mm_s == pytest.approx(100.0, abs=1.0)
    assert drive.get(0x6063) > 2 * TURN  # the encoder's own counts go on


@pytest.mark.parametrize(("low", "high"), [(1.0, 6.0), (-100.0, 6.0), (1.0, 100.0)])
def test_a_software_limit_inside_the_range_keeps_it_from_wrapping(
    drive: SdoDrive, low: float, high: float
) -> None:
    drive.set(0x607D, counts(low), 1)
    drive.set(0x607D, counts(high), 2)
    drive.set(0x60F2, POSITIVE)
    drive.enable(1)
    move(drive, 3.0)
    ends = [move(drive, -20.0, 0x40) and drive.get(0x6062), move(drive, 20.0, 0x40) and drive.get(0x6062)]
    assert ends == [counts(max(low, 0.0)), min(counts(high), TURN - 1)]


def test_a_position_many_turns_away_is_moved_into_the_range_at_the_next_enable(drive: SdoDrive) -> None:
    drive.enable(1)
    move(drive, 19.0, 0x40)
    drive.control(0x06)
    drive.set(0x607D, counts(1), 1)
    drive.set(0x607D, counts(6), 2)
    drive.enable(1)
    assert move(drive, 5.0) == pytest.approx(2.0, abs=0.01)


def test_the_range_is_refused_where_it_is_none_or_the_motor_has_power(drive: SdoDrive) -> None:
    for value, subindex, code in ((TURN, 1, 0x06090030), (0, 2, 0x06090030)):
        with pytest.raises(canopen.SdoAbortedError) as error:
            drive.set(0x607B, value, subindex)
        assert error.value.code == code
    drive.enable(1)
    with pytest.raises(canopen.SdoAbortedError) as error:
        drive.set(0x607B, 2 * TURN, 2)
    assert error.value.code == 0x08000022


@pytest.mark.parametrize("option", [0x04, 0x10, 0x100, 0x8000, 0x03])
def test_options_that_the_drive_has_not_are_refused(drive: SdoDrive, option: int) -> None:
    with pytest.raises(canopen.SdoAbortedError) as error:
        drive.set(0x60F2, option)
    assert error.value.code == 0x06090030


@given(
    low=st.integers(-1000, 1000),
    span=st.integers(2, 5000),
    wanted=st.integers(-10_000, 10_000),
    here=st.integers(-10_000, 10_000),
)
def test_every_direction_ends_at_the_commanded_position(low: int, span: int, wanted: int, here: int) -> None:
    made = PositionRange()
    made.set_limits(low, low + span - 1)
    ends = {way: made.towards(wanted, here, way) for way in (LINEAR, NEGATIVE, POSITIVE, SHORTEST)}
    for end in ends.values():
        assert (end - wanted) % span == 0
        assert low <= made.wrapped(int(end)) <= low + span - 1
    assert -span < ends[NEGATIVE] - here <= 0 <= ends[POSITIVE] - here < span
    assert -span / 2 < ends[SHORTEST] - here <= span / 2
