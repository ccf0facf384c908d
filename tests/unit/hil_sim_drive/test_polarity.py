"""Polarity 607Eh: every mode and its limits in user directions, also with only one of the bits."""

import canopen
import pytest
from in_process_nodes import InProcessNodes, SdoDrive, counts

POSITION, VELOCITY, TORQUE = 0x80, 0x40, 0x20
LIMIT = 1 << 11
SOME = [0, POSITION, VELOCITY, TORQUE, POSITION | VELOCITY, VELOCITY | TORQUE, POSITION | VELOCITY | TORQUE]
NEGATIVE_SWITCH_MM, POSITIVE_SWITCH_MM = -30.0, 40.0  # ideal_axis.toml


def drive_with(polarity: int) -> SdoDrive:
    drive = SdoDrive(InProcessNodes())
    drive.set(0x607E, polarity)
    drive.set(0x6083, counts(2000))
    drive.set(0x6084, counts(2000))
    drive.set(0x6085, counts(2000))
    return drive


def sign(polarity: int, bit: int) -> int:
    return -1 if polarity & bit else 1


@pytest.mark.parametrize("polarity", SOME)
@pytest.mark.parametrize("mode", [1, 8])
def test_position_modes_follow_the_position_bit(polarity: int, mode: int) -> None:
    drive = drive_with(polarity)
    drive.enable(mode)
    drive.set(0x607A, counts(2))
    drive.control(0x1F)
    drive.nodes.sync(300)
    assert drive.true_position_mm == pytest.approx(2.0 * sign(polarity, POSITION), abs=0.003)
    assert drive.position_mm == pytest.approx(2.0, abs=0.003)
    assert drive.get(0x60F4) == pytest.approx(0, abs=counts(0.003))


@pytest.mark.parametrize("polarity", SOME)
@pytest.mark.parametrize("mode", [3, 9])
def test_velocity_modes_follow_the_velocity_bit(polarity: int, mode: int) -> None:
    drive = drive_with(polarity)
    drive.set(0x60FF, counts(10))
    drive.enable(mode)
    drive.nodes.sync(150)
    assert drive.true_velocity_mm_s == pytest.approx(10.0 * sign(polarity, VELOCITY), abs=0.1)
    assert drive.get(0x606C) == pytest.approx(counts(10), abs=counts(0.1))


@pytest.mark.parametrize("polarity", SOME)
def test_torque_follows_the_torque_bit(polarity: int) -> None:
    drive = drive_with(polarity)
    drive.set(0x6071, 100)
    drive.enable(10)
    drive.nodes.sync(50)
    assert drive.true_velocity_mm_s * sign(polarity, TORQUE) > 10.0
    assert drive.get(0x6077) == pytest.approx(100, abs=1)


@pytest.mark.parametrize("polarity", SOME)
@pytest.mark.parametrize("mode", [3, 9])
def test_velocity_modes_end_at_the_software_limit_ahead(polarity: int, mode: int) -> None:
    """The limit acts in the direction of motion, and not in the opposite one."""
    drive = drive_with(polarity)
    ahead = sign(polarity, VELOCITY) * sign(polarity, POSITION)
    drive.set(0x607D, counts(5 * ahead), 2 if ahead > 0 else 1)
    drive.set(0x60FF, counts(40))
    drive.enable(mode)
    drive.nodes.sync(600)
    assert drive.position_mm == pytest.approx(5.0 * ahead, abs=0.05)
    assert drive.statusword & LIMIT
    drive.set(0x60FF, counts(-40))
    drive.nodes.sync(400)
    assert drive.true_velocity_mm_s == pytest.approx(-40.0 * sign(polarity, VELOCITY), abs=0.3)


@pytest.mark.parametrize("polarity", SOME)
def test_torque_is_blocked_towards_the_switch_and_free_away_from_it(polarity: int) -> None:
    drive = drive_with(polarity)
    drive.set(0x6071, 300)
    drive.enable(10)
    drive.nodes.sync(1000)
    assert drive.get(0x60FD) == (2 if sign(polarity, TORQUE) > 0 else 1)
    assert drive.get(0x6074) == 0
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.3)
    drive.set(0x6071, -300)
    drive.sync_until(lambda: drive.get(0x60FD) == 0, 500)
    assert NEGATIVE_SWITCH_MM < drive.true_position_mm < POSITIVE_SWITCH_MM


@pytest.mark.parametrize("polarity", [POSITION, VELOCITY])
def test_position_mode_takes_a_moving_axis_over_without_turning_back(polarity: int) -> None:
    """40 mm/s braked at 2000 mm/s^2 stops 0.4 mm further on; a wrong sign would first go backwards."""
    drive = drive_with(polarity)
    drive.set(0x60FF, counts(40))
    drive.enable(3)
    drive.nodes.sync(150)
    start_mm, forwards = drive.true_position_mm, sign(polarity, VELOCITY)
    drive.set(0x6060, 1)
    assert drive.get(0x606B) == pytest.approx(counts(40), abs=counts(0.3))
    drive.nodes.sync(2)
    assert drive.get(0x606B) == pytest.approx(counts(36), abs=counts(0.5))
    drive.nodes.sync(200)
    assert (drive.true_position_mm - start_mm) * forwards == pytest.approx(0.4, abs=0.15)


def test_polarity_cannot_change_under_power_nor_by_pdo() -> None:
    drive = drive_with(0)
    drive.enable(3)
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(0x607E, POSITION)
    assert refusal.value.code == 0x08000022
    drive.set(0x1401, 0x80000301, 1)
    drive.set(0x1601, 0, 0)
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(0x1601, 0x607E0008, 1)
    assert refusal.value.code == 0x06040041
