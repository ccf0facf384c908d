"""Stopping distances by v^2 / 2a, fault reactions, following error, limit switches."""

import pytest
from in_process_nodes import DRIVE, InProcessNodes, SdoDrive, counts

LIMIT = 1 << 11
EMCY = 0x80 + DRIVE


@pytest.fixture
def drive() -> SdoDrive:
    drive = SdoDrive(InProcessNodes())
    drive.set(0x6083, counts(1000))
    drive.set(0x6084, counts(400))
    drive.set(0x6085, counts(2000))
    return drive


def at_speed(drive: SdoDrive, millimetres_s: float = 40.0) -> None:
    """Run in profile velocity mode until the speed is steady."""
    drive.set(0x60FF, counts(millimetres_s))
    drive.enable(3)
    drive.nodes.sync(300)
    assert drive.true_velocity_mm_s == pytest.approx(millimetres_s, abs=0.2)


def distance_to_rest(drive: SdoDrive) -> tuple[float, float]:
    """Overshoot-free stopping distance (mm): the furthest point, and the time to first standstill (ms)."""
    start = furthest = drive.true_position_mm
    stopped = 0
    for cycle in range(600):
        drive.nodes.sync()
        furthest = max(furthest, drive.true_position_mm)
        if not stopped and drive.true_velocity_mm_s < 0.5:
            stopped = cycle
    return furthest - start, stopped


@pytest.mark.parametrize(
    ("option", "deceleration_mm_s2", "state"),
    [
        (1, 400, "switch on disabled"),
        (2, 2000, "switch on disabled"),
        (5, 400, "quick stop"),
        (6, 2000, "quick stop"),
    ],
)
def test_quick_stop_distance_is_v_squared_over_2a(
    drive: SdoDrive, option: int, deceleration_mm_s2: float, state: str
) -> None:
    drive.set(0x605A, option)
    at_speed(drive)
    drive.control(0x02)
    assert drive.state == "quick stop"
    distance_mm, time_ms = distance_to_rest(drive)
    closed_form_mm = 40.0**2 / (2 * deceleration_mm_s2)
    assert distance_mm == pytest.approx(closed_form_mm, abs=0.16)  # the velocity loop lags by a few ms
    assert time_ms == pytest.approx(40.0 / deceleration_mm_s2 * 1e3, abs=8)
    assert drive.state == state


def test_quick_stop_option_0_lets_the_axis_coast(drive: SdoDrive) -> None:
    drive.set(0x605A, 0)
    at_speed(drive)
    drive.control(0x02)
    assert drive.state == "switch on disabled"
    drive.nodes.sync(100)
    assert drive.true_velocity_mm_s == pytest.approx(40.0, abs=0.2)


@pytest.mark.parametrize("option", [3, 4])
def test_quick_stop_at_the_current_limit_is_the_shortest(drive: SdoDrive, option: int) -> None:
    """15 A * 0.43 Nm/A on 10 mm lead: 4053 N on 63.7 kg, 63.6 m/s^2; 40 mm/s would stop within 0.02 mm."""
    drive.set(0x605A, option)
    at_speed(drive)
    drive.control(0x02)
    distance_mm, time_ms = distance_to_rest(drive)
    assert distance_mm < 0.25
    assert time_ms <= 12


def test_quick_stop_in_profile_position_brakes_in_the_position_loop(drive: SdoDrive) -> None:
    drive.set(0x605A, 6)
    drive.set(0x6081, counts(40))
    drive.enable(1)
    drive.set(0x607A, counts(30))
    drive.control(0x1F)
    drive.nodes.sync(300)
    before = drive.get(0x6062)
    drive.control(0x02)
    drive.nodes.sync(300)
    closed_form_mm = 40.0**2 / (2 * 2000)
    assert drive.get(0x6062) - before == pytest.approx(counts(closed_form_mm), abs=2)
    assert drive.get(0x6064) == pytest.approx(drive.get(0x6062), abs=counts(0.002))


def test_leaving_quick_stop_by_enable_operation(drive: SdoDrive) -> None:
    drive.set(0x605A, 6)
    at_speed(drive)
    drive.control(0x02)
    drive.nodes.sync(100)
    drive.control(0x0F)
    drive.nodes.sync(300)
    assert drive.state == "enabled"
    assert drive.true_velocity_mm_s == pytest.approx(40.0, abs=0.2)


@pytest.mark.parametrize(
    ("option", "deceleration_mm_s2"), [(0, None), (1, 400), (2, 2000), (3, 1e6), (4, 1e6)]
)
def test_fault_reaction(drive: SdoDrive, option: int, deceleration_mm_s2: float | None) -> None:
    drive.set(0x605E, option)
    at_speed(drive)
    drive.nodes.frames.clear()
    drive.device.fault(0x2310, 0x02)
    drive.nodes.sync()
    assert drive.nodes.take(EMCY) == [bytes.fromhex("1023 03 0000000000")]
    assert drive.state == ("fault" if deceleration_mm_s2 is None else "fault reaction")
    distance_mm, _ = distance_to_rest(drive)
    assert drive.state == "fault"
    assert drive.get(0x603F) == 0x2310
    if deceleration_mm_s2 is None:
        assert drive.true_velocity_mm_s == pytest.approx(40.0, abs=0.2)
    else:
        assert distance_mm == pytest.approx(40.0**2 / (2 * deceleration_mm_s2), abs=0.25)
    drive.nodes.frames.clear()
    drive.control(0x80)
    drive.nodes.sync()
    assert drive.nodes.take(EMCY) == [bytes(8)]
    assert (drive.state, drive.get(0x603F), drive.get(0x1001)) == ("switch on disabled", 0, 0)


def test_following_error_in_csp_is_a_fault(drive: SdoDrive) -> None:
    drive.set(0x6065, counts(1))
    drive.set(0x6066, 20)
    drive.set(0x6072, 0)  # no torque: the axis cannot follow
    drive.enable(8)
    drive.nodes.sync(10)
    drive.set(0x607A, counts(2))
    drive.nodes.frames.clear()
    assert drive.sync_until(lambda: drive.state != "enabled", 100) == 21
    assert drive.get(0x603F) == 0x8611
    assert [frame[:2] for can_id, frame in drive.nodes.frames if can_id == EMCY] == [b"\x11\x86"]
    drive.nodes.sync(10)
    assert drive.state == "fault"


@pytest.mark.parametrize("window", [counts(3), 0xFFFFFFFF])
def test_following_error_inside_the_window_or_switched_off_is_none(drive: SdoDrive, window: int) -> None:
    drive.set(0x6065, window)
    drive.set(0x6072, 0)
    drive.enable(8)
    drive.set(0x607A, counts(2))
    drive.nodes.sync(100)
    assert drive.state == "enabled"
    assert drive.get(0x60F4) == counts(2)


def test_limit_switch_stops_blocks_and_lets_the_axis_back(drive: SdoDrive) -> None:
    at_speed(drive, 100.0)
    drive.nodes.sync(600)
    assert drive.get(0x60FD) == 2
    assert drive.statusword & LIMIT
    stop_mm = drive.true_position_mm
    assert 40.0 < stop_mm < 40.0 + 100.0**2 / 4000 + 0.7
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.2)
    assert drive.state == "enabled"
    drive.nodes.sync(300)
    assert drive.true_position_mm == pytest.approx(stop_mm, abs=0.05)
    drive.set(0x60FF, counts(-50))
    drive.nodes.sync(300)
    assert drive.get(0x60FD) == 0
    assert not drive.statusword & LIMIT
    assert drive.true_velocity_mm_s == pytest.approx(-50.0, abs=0.3)


def test_limit_switch_in_torque_mode_blocks_one_direction_only(drive: SdoDrive) -> None:
    drive.set(0x6071, 300)
    drive.enable(10)
    drive.nodes.sync(900)
    assert drive.statusword & LIMIT
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.3)
    drive.nodes.sync(50)
    assert drive.get(0x6074) == 0
    drive.set(0x6071, -300)
    drive.sync_until(lambda: drive.get(0x60FD) == 0, 400)
    assert drive.true_position_mm < 40.0
    assert not drive.statusword & LIMIT


def test_halt_during_the_stop_at_a_switch_keeps_the_axis_halted(drive: SdoDrive) -> None:
    at_speed(drive, 100.0)
    drive.sync_until(lambda: drive.get(0x60FD) == 2, 600)
    drive.control(0x10F)
    drive.set(0x60FF, counts(-50))
    drive.nodes.sync(300)
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.2)
    drive.control(0x0F)
    drive.nodes.sync(300)
    assert drive.true_velocity_mm_s == pytest.approx(-50.0, abs=0.3)


def test_target_beyond_an_active_switch_stops_at_the_switch(drive: SdoDrive) -> None:
    drive.set(0x6081, counts(50))
    drive.enable(1)
    drive.set(0x607A, counts(60))
    drive.control(0x1F)
    drive.nodes.sync(2500)
    assert 40.0 < drive.true_position_mm < 41.5
    drive.control(0x0F)
    drive.set(0x607A, counts(10))
    drive.control(0x1F)
    drive.sync_until(lambda: drive.statusword & 1 << 10, 2500)
    assert drive.position_mm == pytest.approx(10.0, abs=0.002)


def test_a_stop_that_rebounds_from_the_switch_does_not_block_for_ever(drive: SdoDrive) -> None:
    """At 20 m/s^2 the loop overshoots and stops before the edge: bit 11 is set by a closed switch only."""
    drive.set(0x6085, counts(20000))
    drive.set(0x6081, counts(20))
    drive.enable(1)
    drive.set(0x607A, counts(40.5))
    drive.control(0x1F)
    drive.control(0x0F)
    drive.nodes.sync(3000)
    assert drive.get(0x60FD) == 2
    assert bool(drive.statusword & LIMIT)
    drive.set(0x607A, counts(39))
    drive.control(0x1F)
    drive.sync_until(lambda: drive.statusword & 1 << 10, 3000)
    assert drive.get(0x60FD) == 0
    assert not drive.statusword & LIMIT
