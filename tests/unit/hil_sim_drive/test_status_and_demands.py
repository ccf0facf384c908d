"""Statusword and demand values while a mode ends, stops or is replaced."""

import pytest
from in_process_nodes import InProcessNodes, SdoDrive, counts


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


@pytest.mark.parametrize("option", [5, 6, 7, 8])
def test_bit_10_shows_the_standstill_of_a_quick_stop_that_stays(drive: SdoDrive, option: int) -> None:
    drive.set(0x605A, option)
    drive.set(0x60FF, counts(40))
    drive.enable(3)
    drive.nodes.sync(300)
    drive.control(0x02)
    assert not drive.statusword & 1 << 10
    drive.nodes.sync(300)
    assert (drive.state, drive.statusword >> 10 & 1) == ("quick stop", 1)


def test_bit_13_shows_a_following_error_until_the_fault_is_reset(drive: SdoDrive) -> None:
    drive.set(0x6072, 0)
    drive.enable(8)
    drive.set(0x607A, counts(20))
    drive.sync_until(lambda: drive.state == "fault", 1000)
    assert drive.statusword & 1 << 13
    drive.control(0x80)
    assert not drive.statusword & 1 << 13


def test_demands_of_another_mode_do_not_linger(drive: SdoDrive) -> None:
    drive.set(0x6072, 100)
    drive.enable(8)
    drive.set(0x607A, counts(0.2))
    drive.nodes.sync(2)
    assert drive.get(0x60FC) == drive.get(0x6062) == counts(0.2)
    assert drive.get(0x60F4) != 0
    drive.set(0x6060, 10)
    drive.set(0x6071, 50)
    drive.nodes.sync(2)
    assert (drive.get(0x60F4), drive.get(0x6074)) == (0, 50)
    drive.set(0x6060, 8)
    drive.set(0x607A, drive.get(0x6064))
    drive.nodes.sync()
    assert abs(drive.get(0x606B)) < counts(20)
    assert drive.get(0x6074) == 0
