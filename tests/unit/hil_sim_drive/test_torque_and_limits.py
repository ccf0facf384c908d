"""Profile torque, torque limits by direction, motor speed, deceleration, slippage."""

import pytest
from in_process_nodes import InProcessNodes, SdoDrive, counts

REACHED, BIT_13 = 1 << 10, 1 << 13


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


def acceleration_mm_s2(drive: SdoDrive, cycles: int = 10) -> float:
    before = drive.true_velocity_mm_s
    drive.nodes.sync(cycles)
    return (drive.true_velocity_mm_s - before) / (cycles * 1e-3)


def test_the_torque_demand_runs_to_its_target_on_the_slope(drive: SdoDrive) -> None:
    drive.set(0x6087, 500)
    drive.set(0x6088, 0)
    drive.enable(4)
    assert drive.get(0x6061) == 4
    drive.set(0x6071, 50)
    demands = []
    for _ in range(110):
        drive.nodes.sync()
        demands.append(drive.get(0x6074))
    assert demands[19] == 10  # per mille, after 20 ms at 500 per mille/s
    assert demands[99] == 50
    assert drive.statusword & REACHED
    assert drive.get(0x6077) == pytest.approx(50, abs=1)
    drive.set(0x6071, -20)
    drive.nodes.sync()
    assert not drive.statusword & REACHED
    drive.nodes.sync(139)
    assert drive.get(0x6074) == -20


def test_profile_torque_keeps_to_the_largest_torque_and_leaves_no_demand(drive: SdoDrive) -> None:
    drive.set(0x6072, 30)
    drive.set(0x6087, 100_000)
    drive.set(0x6071, 80)
    drive.enable(4)
    drive.nodes.sync(5)
    assert drive.get(0x6074) == 30
    assert not drive.statusword & REACHED
    drive.set(0x6060, 3)
    drive.nodes.sync()
    assert drive.get(0x6074) == 0


@pytest.mark.parametrize(
    ("index", "polarity", "forward", "backward"),
    [(0x60E0, 0, 50, 100), (0x60E1, 0, 100, 50), (0x60E0, 0x20, 50, 100), (0x60E1, 0x20, 100, 50)],
)
def test_each_direction_has_its_torque_limit(
    drive: SdoDrive, index: int, polarity: int, forward: int, backward: int
) -> None:
    """Per mille of actual torque in user units, whatever the polarity."""
    drive.set(0x607E, polarity)
    drive.set(index, 50)
    drive.enable(10)
    for target, expected in ((100, forward), (-100, -backward)):
        drive.set(0x6071, target)
        drive.nodes.sync(20)
        assert drive.get(0x6077) == pytest.approx(expected, abs=1)


def test_a_torque_limit_holds_in_the_velocity_loop_too(drive: SdoDrive) -> None:
    drive.enable(9)
    drive.set(0x60FF, counts(200))
    free = acceleration_mm_s2(drive)
    drive.set(0x60FF, 0)
    drive.nodes.sync(300)
    drive.set(0x60E0, 100)
    drive.set(0x60FF, counts(200))
    limited = acceleration_mm_s2(drive)
    assert drive.get(0x6077) == pytest.approx(100, abs=2)
    assert limited < 0.2 * free


@pytest.mark.parametrize("mode", [1, 3, 9])
def test_the_motor_turns_no_faster_than_6080h(drive: SdoDrive, mode: int) -> None:
    drive.set(0x6080, 120)  # 2 turns/s of 10 mm
    drive.set(0x6081, counts(50))
    drive.enable(mode)
    if mode == 1:
        drive.set(0x607A, counts(15))
        drive.control(0x1F)
    else:
        drive.set(0x60FF, counts(50))
    drive.nodes.sync(400)
    assert drive.true_velocity_mm_s == pytest.approx(20.0, abs=0.1)
    assert bool(drive.statusword & 1 << 11) == (mode == 9)  # clipped where it is a set point


def test_a_jump_of_a_position_set_point_is_gone_at_the_motor_speed(drive: SdoDrive) -> None:
    drive.set(0x6080, 120)
    drive.enable(8)
    drive.set(0x607A, counts(8))
    drive.nodes.sync(200)
    assert drive.true_velocity_mm_s == pytest.approx(20.0, abs=0.1)
    assert drive.get(0x6062) == pytest.approx(counts(4), abs=counts(0.03))
    assert drive.statusword & 1 << 11
    drive.nodes.sync(400)
    assert drive.get(0x6062) == counts(8)
    assert not drive.statusword & 1 << 11


def test_interpolated_set_points_that_are_too_fast_are_caught_up_with_later(drive: SdoDrive) -> None:
    drive.set(0x6080, 120)
    drive.enable(7)
    drive.control(0x1F)
    for cycle in range(1, 41):
        drive.set(0x60C1, cycle * counts(0.1), 1)  # 100 mm/s
        drive.nodes.sync()
    assert drive.true_velocity_mm_s == pytest.approx(20.0, abs=0.3)
    assert drive.statusword & 1 << 11
    drive.nodes.sync(250)
    assert drive.get(0x6062) == pytest.approx(counts(4), abs=40)


@pytest.mark.parametrize("mode", [4, 10])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_torque_drives_no_faster_than_6080h_and_still_brakes(drive: SdoDrive, mode: int, sign: int) -> None:
    drive.set(0x6080, 120)
    drive.set(0x6087, 100_000)
    drive.set(0x6071, 20 * sign)
    drive.enable(mode)
    drive.nodes.sync(400)
    assert drive.true_velocity_mm_s * sign == pytest.approx(20.0, abs=1.5)
    assert drive.statusword & 1 << 11
    drive.set(0x6071, -20 * sign)
    drive.nodes.sync(30)
    assert 0.0 < drive.true_velocity_mm_s * sign < 19.5


def test_homing_keeps_to_the_motor_speed_too(drive: SdoDrive) -> None:
    drive.set(0x6080, 30)
    drive.set(0x6098, 17)
    drive.enable(6)
    drive.control(0x1F)
    drive.nodes.sync(300)
    assert drive.true_velocity_mm_s == pytest.approx(-5.0, abs=0.05)


def test_the_largest_deceleration_makes_the_way_longer(drive: SdoDrive) -> None:
    drive.set(0x6083, counts(5000))
    drive.set(0x6084, counts(5000))
    drive.set(0x60C6, counts(200))
    drive.enable(3)
    drive.set(0x60FF, counts(40))
    drive.nodes.sync(50)
    drive.set(0x60FF, 0)
    assert acceleration_mm_s2(drive, 100) == pytest.approx(-200, abs=15)


def test_the_largest_acceleration_is_60c5h(drive: SdoDrive) -> None:
    drive.set(0x6083, counts(5000))
    drive.set(0x60C5, counts(100))
    drive.enable(3)
    drive.set(0x60FF, counts(40))
    drive.nodes.sync(20)
    assert acceleration_mm_s2(drive, 100) == pytest.approx(100, abs=3)


def test_slippage_beyond_its_maximum_is_shown_in_profile_velocity(drive: SdoDrive) -> None:
    drive.set(0x60F8, counts(5))
    drive.set(0x6072, 20)  # too weak for the ramp
    drive.enable(3)
    drive.nodes.sync(5)
    assert not drive.statusword & BIT_13
    drive.set(0x60FF, counts(50))
    drive.nodes.sync(100)
    assert drive.statusword & BIT_13
    drive.sync_until(lambda: not drive.statusword & BIT_13, 5000)


def test_the_control_effort_is_the_position_loops_output(drive: SdoDrive) -> None:
    drive.enable(8)
    assert drive.get(0x60FA) == 0
    drive.set(0x6072, 0)
    drive.set(0x607A, counts(0.01))
    drive.nodes.sync(5)
    assert drive.get(0x60FA) == pytest.approx(40.0 * counts(0.01), rel=0.01)  # position_gain_1_s = 40
