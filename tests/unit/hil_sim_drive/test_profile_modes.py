"""Profile position and profile velocity: handshake, targets, limits."""

import pytest
from in_process_nodes import InProcessNodes, SdoDrive, counts

ACKNOWLEDGE, REACHED, LIMIT = 1 << 12, 1 << 10, 1 << 11
START, IMMEDIATELY, RELATIVE, HALT = 0x10, 0x20, 0x40, 0x100


@pytest.fixture
def drive() -> SdoDrive:
    drive = SdoDrive(InProcessNodes())
    drive.set(0x6081, counts(100))
    drive.set(0x6083, counts(1000))
    drive.set(0x6084, counts(1000))
    return drive


def go(drive: SdoDrive, millimetres: float, bits: int = 0) -> None:
    """New set-point, handshake complete."""
    drive.set(0x607A, counts(millimetres))
    drive.control(0x0F | bits)
    drive.control(0x0F | bits | START)
    drive.control(0x0F | bits)


def reached(drive: SdoDrive) -> bool:
    return bool(drive.statusword & REACHED)


def test_move_takes_the_time_of_the_trapezoid_and_ends_at_the_target(drive: SdoDrive) -> None:
    """20 mm at 100 mm/s and 1000 mm/s^2: 2 x 0.1 s of ramps over 10 mm, and 0.1 s for the rest: 300 ms."""
    drive.enable(1)
    go(drive, 20.0)
    assert drive.sync_until(lambda: drive.get(0x606B) == 0 and drive.get(0x6062) == counts(20), 400) == 300
    drive.sync_until(lambda: reached(drive), 200)
    assert drive.position_mm == pytest.approx(20.0, abs=0.0015)
    assert drive.true_position_mm == pytest.approx(20.0, abs=0.0015)


def test_handshake_of_set_point_and_acknowledge(drive: SdoDrive) -> None:
    drive.enable(1)
    assert drive.statusword & (ACKNOWLEDGE | REACHED) == REACHED
    drive.set(0x607A, counts(5))
    drive.control(0x1F)
    assert drive.statusword & (ACKNOWLEDGE | REACHED) == ACKNOWLEDGE
    drive.control(0x0F)
    assert drive.statusword & (ACKNOWLEDGE | REACHED) == 0


def test_second_set_point_waits_and_a_third_is_ignored(drive: SdoDrive) -> None:
    drive.enable(1)
    go(drive, 5.0)
    go(drive, 8.0)
    assert drive.statusword & ACKNOWLEDGE  # the buffer is full
    go(drive, 1.0)
    drive.sync_until(lambda: not drive.statusword & ACKNOWLEDGE, 600)
    assert drive.position_mm == pytest.approx(5.0, abs=0.002)
    drive.sync_until(lambda: reached(drive), 600)
    assert drive.position_mm == pytest.approx(8.0, abs=0.002)


def test_change_set_immediately_does_not_stop_in_between(drive: SdoDrive) -> None:
    drive.enable(1)
    go(drive, 20.0)
    drive.nodes.sync(150)
    go(drive, 35.0, IMMEDIATELY)
    slowest = []
    for _ in range(150):
        drive.nodes.sync()
        slowest.append(drive.get(0x606B))
    assert min(slowest) == counts(100)
    drive.sync_until(lambda: reached(drive), 600)
    assert drive.position_mm == pytest.approx(35.0, abs=0.002)


def test_relative_moves_add_up(drive: SdoDrive) -> None:
    drive.enable(1)
    for _ in range(3):
        go(drive, 2.0, RELATIVE)
        drive.sync_until(lambda: reached(drive), 600)
    assert drive.position_mm == pytest.approx(6.0, abs=0.002)


def test_halt_stops_and_release_goes_on_to_the_target(drive: SdoDrive) -> None:
    drive.enable(1)
    go(drive, 30.0)
    drive.nodes.sync(150)
    start = drive.get(0x6062)
    drive.control(0x0F | HALT)
    drive.sync_until(lambda: reached(drive), 600)
    assert drive.get(0x6062) - start == pytest.approx(counts(100.0**2 / 2 / 1000), abs=counts(0.01))
    drive.nodes.sync(100)
    drive.control(0x0F)
    assert not reached(drive)
    drive.sync_until(lambda: reached(drive), 600)
    assert drive.position_mm == pytest.approx(30.0, abs=0.002)


def test_target_beyond_the_software_limit_ends_at_the_limit(drive: SdoDrive) -> None:
    drive.set(0x607D, counts(12), 2)
    drive.enable(1)
    go(drive, 20.0)
    drive.sync_until(lambda: reached(drive), 600)
    assert drive.position_mm == pytest.approx(12.0, abs=0.002)


def test_speed_is_limited_by_max_profile_velocity(drive: SdoDrive) -> None:
    drive.set(0x607F, counts(30))
    drive.enable(1)
    go(drive, 20.0)
    drive.nodes.sync(200)
    assert drive.get(0x606B) == counts(30)


def test_target_window_and_time_decide_when_it_is_reached(drive: SdoDrive) -> None:
    drive.set(0x6068, 40)
    drive.enable(1)
    go(drive, 1.0)
    drive.sync_until(lambda: abs(drive.get(0x6064) - counts(1.0)) <= 105 and drive.get(0x606B) == 0, 900)
    assert drive.sync_until(lambda: reached(drive), 200) >= 35


def test_velocity_ramps_with_acceleration_and_deceleration(drive: SdoDrive) -> None:
    drive.set(0x6084, counts(500))
    drive.set(0x60FF, counts(50))
    drive.enable(3)
    assert drive.sync_until(lambda: drive.get(0x606B) == counts(50), 100) == 50
    drive.sync_until(lambda: reached(drive), 300)
    assert drive.true_velocity_mm_s == pytest.approx(50.0, abs=0.5)
    drive.set(0x60FF, 0)
    assert drive.sync_until(lambda: drive.get(0x606B) == 0, 200) == 100
    drive.sync_until(lambda: drive.statusword & ACKNOWLEDGE, 300)  # bit 12: standstill
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.2)


def test_velocity_mode_stops_at_the_software_limit(drive: SdoDrive) -> None:
    drive.set(0x607D, counts(10), 2)
    drive.set(0x60FF, counts(50))
    drive.enable(3)
    furthest = 0.0
    for _ in range(600):
        drive.nodes.sync()
        furthest = max(furthest, drive.true_position_mm)
    assert 9.5 < furthest < 10.1
    assert drive.statusword & LIMIT
    drive.set(0x60FF, counts(-50))
    drive.nodes.sync(200)
    assert drive.true_velocity_mm_s == pytest.approx(-50.0, abs=1.0)


def test_polarity_inverts_position_and_velocity(drive: SdoDrive) -> None:
    drive.set(0x607E, 0xC0)
    drive.enable(1)
    go(drive, 5.0)
    drive.sync_until(lambda: reached(drive), 600)
    assert drive.true_position_mm == pytest.approx(-5.0, abs=0.002)
    drive.set(0x6060, 3)
    drive.set(0x60FF, counts(10))
    drive.nodes.sync(300)
    assert drive.true_velocity_mm_s == pytest.approx(-10.0, abs=0.1)
    assert drive.get(0x606C) == pytest.approx(counts(10), abs=counts(0.1))
