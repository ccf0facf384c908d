"""Interpolated position: one record of the buffer per period, written by SDO or by PDO."""

import canopen
import pytest
from in_process_nodes import DRIVE, InProcessNodes, SdoDrive, pack

ACTIVE, OFF = 1 << 12, 0x8000_0000


@pytest.fixture
def drive() -> SdoDrive:
    drive = SdoDrive(InProcessNodes())
    drive.set(0x60C0, 0)
    drive.set(0x60C2, 10, 1)  # ms
    drive.enable(7)
    return drive


def test_set_points_are_joined_by_lines_of_one_period(drive: SdoDrive) -> None:
    for set_point in (1000, 3000, 2000):
        drive.set(0x60C1, set_point, 1)
    assert drive.get(0x60C4, 4) == 3
    drive.nodes.sync(5)
    assert drive.get(0x6062) == 0  # not started
    assert not drive.statusword & ACTIVE
    drive.control(0x1F)
    assert drive.statusword & ACTIVE
    demands = []
    for _ in range(40):
        drive.nodes.sync()
        demands.append(drive.get(0x6062))
    assert [demands[place] for place in (0, 4, 9, 14, 19, 24, 29, 39)] == [
        100,
        500,
        1000,
        2000,
        3000,
        2500,
        2000,
        2000,
    ]
    assert drive.get(0x60C4, 4) == 0


def test_it_stops_with_bit_4_and_goes_on_with_it(drive: SdoDrive) -> None:
    drive.set(0x60C1, 1000, 1)
    drive.control(0x1F)
    drive.nodes.sync(5)
    drive.control(0x0F)
    drive.nodes.sync(20)
    assert drive.get(0x6062) == 500
    drive.control(0x1F)
    drive.nodes.sync(5)
    assert drive.get(0x6062) == 1000


def test_the_buffer_has_a_size_and_can_be_cleared(drive: SdoDrive) -> None:
    assert drive.get(0x60C4, 1) == 64
    drive.set(0x60C4, 2, 2)
    drive.set(0x60C1, 1, 1)
    drive.set(0x60C1, 1, 1)  # the same again is another set point
    with pytest.raises(canopen.SdoAbortedError) as refused:
        drive.set(0x60C1, 1, 1)
    assert refused.value.code == 0x05040005
    assert drive.get(0x60C1, 1) == 1
    drive.set(0x60C4, 0, 6)
    assert drive.get(0x60C4, 4) == 0
    drive.set(0x60C4, 4, 5)
    drive.set(0x60C4, 0, 3)


def test_every_frame_of_a_pdo_is_a_set_point(drive: SdoDrive) -> None:
    drive.set(0x60C2, 1, 1)
    drive.set(0x1401, OFF | 0x300 + DRIVE, 1)
    drive.set(0x1601, 0, 0)
    drive.set(0x1601, 0x60C1_0120, 1)
    drive.set(0x1601, 1, 0)
    drive.set(0x1401, 1, 2)
    drive.set(0x1401, 0x300 + DRIVE, 1)
    drive.nodes.operational()
    drive.control(0x1F)
    demands = []
    for set_point in (10, 20, 20, 40):
        drive.nodes.put(0x300 + DRIVE, pack("i", set_point))
        drive.nodes.sync(1)
        demands.append(drive.get(0x6062))
    drive.nodes.sync()
    assert [*demands[1:], drive.get(0x6062)] == [10, 20, 20, 40]


def test_another_mode_forgets_the_set_points(drive: SdoDrive) -> None:
    drive.set(0x60C1, 1000, 1)
    drive.set(0x6060, 1)
    drive.set(0x6060, 7)
    assert drive.get(0x60C4, 4) == 0
