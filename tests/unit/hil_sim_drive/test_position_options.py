"""Options of a profile position move: end velocity, reference of a relative move, jerk, windows."""

from itertools import pairwise

import pytest
from in_process_nodes import InProcessNodes, SdoDrive, counts

REACHED = 1 << 10
START, RELATIVE = 0x10, 0x40


@pytest.fixture
def drive() -> SdoDrive:
    drive = SdoDrive(InProcessNodes())
    drive.set(0x6081, counts(50))
    drive.set(0x6083, counts(500))
    drive.set(0x6084, counts(500))
    return drive


def go(drive: SdoDrive, millimetres: float, bits: int = 0) -> None:
    drive.set(0x607A, counts(millimetres))
    drive.control(0x0F | bits | START)
    drive.control(0x0F | bits)


def demand_mm(drive: SdoDrive) -> float:
    return drive.get(0x6062) / counts(1)


def test_a_set_point_with_an_end_velocity_is_passed_at_it(drive: SdoDrive) -> None:
    drive.set(0x6082, counts(20))
    drive.enable(1)
    go(drive, 5.0)
    drive.sync_until(lambda: demand_mm(drive) >= 5.0, 400)
    assert drive.get(0x606B) / counts(1) == pytest.approx(20.0, abs=0.6)
    assert drive.statusword & REACHED
    drive.nodes.sync(200)
    assert demand_mm(drive) == pytest.approx(5.0 + 20**2 / 1000, abs=0.001)  # it brakes behind the target


def test_the_next_set_point_is_gone_to_without_a_stop(drive: SdoDrive) -> None:
    drive.set(0x6082, counts(50))
    drive.enable(1)
    go(drive, 5.0)
    drive.set(0x6082, 0)
    go(drive, 10.0)
    slowest = 99.0
    while demand_mm(drive) < 7.4:
        drive.nodes.sync()
        if demand_mm(drive) > 3.0:
            slowest = min(slowest, drive.get(0x606B) / counts(1))
    assert slowest == pytest.approx(50.0, abs=0.1)
    drive.sync_until(lambda: drive.statusword & REACHED and drive.get(0x6062) == counts(10), 500)


@pytest.mark.parametrize(("option", "ends_mm"), [(0, 12.0), (1, None), (2, None)])
def test_a_relative_move_starts_from_target_demand_or_actual_position(
    drive: SdoDrive, option: int, ends_mm: float | None
) -> None:
    drive.set(0x60F2, option)
    drive.enable(1)
    go(drive, 10.0)
    drive.nodes.sync(150)
    here = drive.get(0x6062) if option == 1 else drive.get(0x6064)
    go(drive, 2.0, RELATIVE | 0x20)
    drive.nodes.sync(600)
    assert drive.get(0x6062) == pytest.approx(here + counts(2) if ends_mm is None else counts(ends_mm), abs=1)


def test_ramps_of_type_3_keep_to_the_jerk_and_end_at_the_target(drive: SdoDrive) -> None:
    drive.set(0x6086, 3)
    drive.set(0x60A4, counts(20_000), 1)
    drive.enable(1)
    go(drive, 5.0)
    velocities = [0.0]
    for _ in range(400):
        drive.nodes.sync()
        velocities.append(drive.get(0x606B) / counts(1))
    accelerations = [(now - before) / 1e-3 for before, now in pairwise(velocities)]
    jerks = [(now - before) / 1e-3 for before, now in pairwise(accelerations)]
    assert max(map(abs, jerks)) < 20_000 * 1.02
    assert max(accelerations) == pytest.approx(500, rel=0.02)
    assert drive.get(0x6062) == counts(5)
    assert drive.statusword & REACHED


def test_linear_ramps_are_steeper(drive: SdoDrive) -> None:
    drive.set(0x6086, 0)
    drive.enable(1)
    go(drive, 5.0)
    drive.nodes.sync(2)
    assert drive.get(0x606B) / counts(1) == pytest.approx(1.0, abs=0.02)  # 500 mm/s^2 at once


def test_the_target_is_reached_inside_the_window_for_its_time(drive: SdoDrive) -> None:
    drive.set(0x6067, counts(0.5))
    drive.set(0x6068, 100)
    drive.enable(1)
    go(drive, 2.0)
    ended = drive.sync_until(lambda: drive.get(0x606B) == 0 and drive.get(0x6062) == counts(2), 400)
    assert drive.sync_until(lambda: drive.statusword & REACHED, 200) == pytest.approx(100, abs=2), ended


def test_velocity_reached_and_standstill_have_windows_and_times(drive: SdoDrive) -> None:
    drive.set(0x606D, 0xFFFF)  # 0.6 mm/s
    drive.set(0x606E, 50)
    drive.set(0x606F, 0xFFFF)
    drive.set(0x6070, 80)
    drive.enable(3)
    drive.set(0x60FF, counts(0.4))
    assert drive.sync_until(lambda: drive.statusword & REACHED, 200) == pytest.approx(50, abs=3)
    assert drive.sync_until(lambda: drive.statusword & 1 << 12, 200) == pytest.approx(30, abs=3)
