"""Every homing method ends with the home position of CiA 402: at switch, index pulse, or actual position."""

import canopen
import pytest
from in_process_nodes import InProcessNodes, SdoDrive, counts

MASK, IN_PROGRESS, NOT_STARTED, HOMED, ERROR = 0x3400, 0x0000, 0x0400, 0x1400, 0x2000
NEGATIVE_MM, POSITIVE_MM, INDEX_MM, LEAD_MM = -30.0, 40.0, 1.3, 10.0  # ideal_axis.toml
SLOW_STEP_MM = 0.002 * 1.5  # a switch is looked at every tick: 2 mm/s in 1 ms
COUNT_MM = 1e-5 * 1.1


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


def home(drive: SdoDrive, method: int, limit: int = 12000) -> float:
    """Run a homing; return where the machine coordinate of the user's zero is (mm)."""
    drive.set(0x6098, method)
    if drive.state != "enabled":
        drive.enable(6)
    drive.set(0x6060, 6)
    drive.control(0x0F)
    drive.control(0x1F)
    drive.sync_until(lambda: drive.statusword & MASK == HOMED, limit)
    drive.control(0x0F)
    assert drive.statusword & MASK == HOMED
    return drive.true_position_mm - drive.position_mm


def start_at(drive: SdoDrive, millimetres: float) -> None:
    """Move there in profile position mode."""
    drive.enable(1)
    drive.set(0x607A, counts(millimetres))
    drive.control(0x1F)
    drive.control(0x0F)
    drive.sync_until(lambda: drive.statusword & 1 << 10, 3000)


def test_method_17_homes_on_the_negative_switch(drive: SdoDrive) -> None:
    assert home(drive, 17) == pytest.approx(NEGATIVE_MM, abs=SLOW_STEP_MM)


def test_method_18_homes_on_the_positive_switch(drive: SdoDrive) -> None:
    assert home(drive, 18) == pytest.approx(POSITIVE_MM, abs=SLOW_STEP_MM)


def test_method_1_homes_on_the_first_index_right_of_the_negative_switch(drive: SdoDrive) -> None:
    assert home(drive, 1) == pytest.approx(INDEX_MM - 3 * LEAD_MM, abs=COUNT_MM)


def test_method_2_homes_on_the_first_index_left_of_the_positive_switch(drive: SdoDrive) -> None:
    assert home(drive, 2) == pytest.approx(INDEX_MM + 3 * LEAD_MM, abs=COUNT_MM)


@pytest.mark.parametrize(
    ("method", "start_mm", "index"), [(33, 3.0, 0), (34, 3.0, 1), (33, -3.0, -1), (34, -3.0, 0), (34, 0.0, 0)]
)
def test_methods_33_and_34_home_on_the_next_index(
    drive: SdoDrive, method: int, start_mm: float, index: int
) -> None:
    if start_mm:
        start_at(drive, start_mm)
    assert home(drive, method) == pytest.approx(INDEX_MM + index * LEAD_MM, abs=COUNT_MM)


@pytest.mark.parametrize("method", [35, 37])
def test_methods_35_and_37_home_here_without_moving(drive: SdoDrive, method: int) -> None:
    start_at(drive, 7.0)
    before = drive.true_position_mm
    assert home(drive, method, limit=2) == pytest.approx(7.0, abs=0.003)
    assert drive.true_position_mm == pytest.approx(before, abs=0.003)


def test_home_offset_moves_the_zero_to_the_positive_side(drive: SdoDrive) -> None:
    drive.set(0x607C, counts(5))
    assert home(drive, 34) == pytest.approx(INDEX_MM + 5.0, abs=COUNT_MM)


def test_the_speeds_of_the_search_and_its_acceleration_are_6099h_and_609ah(drive: SdoDrive) -> None:
    drive.set(0x6099, counts(8), 1)
    drive.set(0x6099, counts(1), 2)
    drive.set(0x609A, counts(100))
    drive.set(0x6098, 17)
    start_at(drive, -28.0)
    drive.set(0x6060, 6)
    drive.control(0x1F)
    speeds = []
    for _ in range(1200):
        drive.nodes.sync()
        speeds.append(drive.true_velocity_mm_s)
    assert speeds[40] == pytest.approx(-4.0, abs=0.3)  # 100 mm/s^2
    assert min(speeds) == pytest.approx(-8.0, abs=0.4)
    assert max(speeds) == pytest.approx(1.0, abs=0.4)


def test_homing_again_gives_the_same_zero(drive: SdoDrive) -> None:
    first = home(drive, 1)
    drive.set(0x607A, counts(10))
    drive.set(0x6060, 1)
    drive.control(0x1F)
    drive.sync_until(lambda: drive.statusword & 1 << 10, 2000)
    assert home(drive, 1) == pytest.approx(first, abs=COUNT_MM)


def test_homing_under_reversed_polarity_keeps_directions_in_user_terms(drive: SdoDrive) -> None:
    """With 607Eh = C0h the negative user direction ends at the positive switch of the machine."""
    drive.set(0x607E, 0xC0)
    drive.set(0x6098, 17)
    drive.enable(6)
    drive.control(0x1F)
    drive.sync_until(lambda: drive.statusword & MASK == HOMED, 12000)
    zero_mm = drive.true_position_mm + drive.position_mm
    assert zero_mm == pytest.approx(POSITIVE_MM, abs=SLOW_STEP_MM)


def test_position_demand_has_no_jump_when_the_zero_moves(drive: SdoDrive) -> None:
    home(drive, 34)
    errors = []
    for _ in range(50):
        drive.nodes.sync()
        errors.append(abs(drive.get(0x60F4)))
    assert max(errors) < counts(0.02)


def test_status_before_during_and_after(drive: SdoDrive) -> None:
    drive.set(0x6098, 34)
    drive.enable(6)
    assert drive.statusword & MASK == NOT_STARTED
    drive.control(0x1F)
    assert drive.statusword & MASK == IN_PROGRESS
    drive.control(0x0F)
    assert drive.statusword & MASK == NOT_STARTED  # interrupted
    drive.nodes.sync(500)
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.05)


def test_halt_interrupts(drive: SdoDrive) -> None:
    drive.set(0x6098, 17)
    drive.enable(6)
    drive.control(0x1F)
    drive.nodes.sync(300)
    drive.control(0x11F)
    drive.nodes.sync(500)
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.05)
    drive.control(0x1F)
    drive.nodes.sync(100)
    assert drive.statusword & MASK == NOT_STARTED
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.05)


def test_the_drive_lists_the_methods_that_it_takes(drive: SdoDrive) -> None:
    listed = {drive.get(0x60E3, number) for number in range(1, drive.get(0x60E3, 0) + 1)}
    for method in range(-128, 128):
        if method in listed | {0}:
            drive.set(0x6098, method)
            continue
        with pytest.raises(canopen.SdoAbortedError):
            drive.set(0x6098, method)


def test_method_0_searches_nothing(drive: SdoDrive) -> None:
    drive.enable(6)
    drive.control(0x1F)
    assert drive.statusword & 0x3400 == 0x0400


def test_the_wrong_switch_is_an_error(drive: SdoDrive) -> None:
    drive.set(0x6098, 17)
    drive.enable(6)
    drive.control(0x1F)
    drive.nodes.sync(5)
    drive.device.objects.digital_inputs = 2
    drive.device.motion.mode.check(0.001)
    assert drive.statusword & MASK in {IN_PROGRESS, ERROR}
    drive.nodes.sync(400)
    assert drive.statusword & MASK == ERROR
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.05)


def test_homing_ignores_software_limits(drive: SdoDrive) -> None:
    drive.set(0x607D, counts(-1), 1)
    assert home(drive, 17) == pytest.approx(NEGATIVE_MM, abs=SLOW_STEP_MM)


@pytest.mark.parametrize(("method", "start_mm"), [(17, -30.5), (17, 40.5), (18, -30.5), (18, 40.5)])
def test_switch_homing_may_begin_on_either_switch(drive: SdoDrive, method: int, start_mm: float) -> None:
    drive.set(0x6085, counts(200))
    start_at(drive, start_mm)
    drive.nodes.sync(1000)
    assert drive.get(0x60FD)
    expected_mm = NEGATIVE_MM if method == 17 else POSITIVE_MM
    assert home(drive, method) == pytest.approx(expected_mm, abs=SLOW_STEP_MM)


@pytest.mark.parametrize("method", [33, 34])
def test_index_search_does_not_run_through_a_limit_switch(drive: SdoDrive, method: int) -> None:
    """The index lies at 41.3 and -38.7 mm, behind the switches."""
    start_at(drive, 39.5 if method == 34 else -29.5)
    drive.set(0x6098, method)
    drive.set(0x6060, 6)
    drive.control(0x1F)
    drive.sync_until(lambda: drive.statusword & MASK == ERROR, 2000)
    drive.nodes.sync(100)
    edge_mm = POSITIVE_MM if method == 34 else NEGATIVE_MM
    assert abs(drive.true_position_mm - edge_mm) < 0.05
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.05)


def test_homing_chosen_during_a_halt_is_not_in_progress(drive: SdoDrive) -> None:
    drive.enable(3)
    drive.control(0x10F)
    drive.set(0x6060, 6)
    drive.control(0x0F)
    drive.nodes.sync(5)
    assert drive.statusword & MASK == NOT_STARTED
