"""CSP, CSV and CST over PDOs: the axis follows the set points one cycle later."""

import math
import struct

import canopen
import numpy as np
import pytest
from in_process_nodes import COUNTS_PER_MM, DRIVE, InProcessNodes, SdoDrive, counts, pack

from hil_sim.cyclic.drive_record import drive_records
from hil_sim.cyclic.drive_step import interpolate

ENABLED, LIMIT = 0x0F, 1 << 11
FOLLOWS = 1 << 12
TORQUE_TO_FORCE = 0.64e-3 * 2 * math.pi / 0.01  # N per mille of the rated torque 0.64 Nm, lead 10 mm
MASS_KG = 40.0 + 0.6e-4 * (2 * math.pi / 0.01) ** 2


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


class Cyclic:
    """Master of one drive: RPDO1 with the mode's set point, TPDO1 with the actual values."""

    def __init__(self, drive: SdoDrive, mode: int, set_point: int, bits: int, *more: int) -> None:
        self.drive = drive
        self.mode = mode
        node = drive.node
        node.tpdo.read()
        node.rpdo.read()
        node.tpdo[1].clear()
        for index in (0x6041, 0x6064, 0x6077):
            node.tpdo[1].add_variable(index)
        node.rpdo[1].clear()
        for index in (0x6040, 0x6060, set_point, *more):
            node.rpdo[1].add_variable(index)
        for pdo in (node.tpdo[1], node.rpdo[1]):
            pdo.trans_type = 1
            pdo.enabled = True
            pdo.save()
        self.format = "Hb" + {16: "h", 32: "i"}[bits] + "h" * len(more)
        drive.nodes.operational()
        for word in (0x06, 0x07, ENABLED):
            self.cycle(0, word=word)

    def cycle(self, value: int, *more: int, word: int = ENABLED) -> tuple[int, int, int]:
        """Run one cycle: RPDO, SYNC; return statusword, position, torque of the TPDO."""
        more = more or (0,) * (len(self.format) - 3)
        self.drive.nodes.put(0x200 + DRIVE, pack(self.format, word, self.mode, value, *more))
        self.drive.nodes.frames.clear()
        self.drive.nodes.sync()
        (data,) = self.drive.nodes.take(0x180 + DRIVE)
        return struct.unpack("<Hih", data)


def test_torque_accelerates_the_mass(drive: SdoDrive) -> None:
    master = Cyclic(drive, 10, 0x6071, 16, 0x60B2)
    master.cycle(0, 0)
    for _ in range(50):
        status, _, torque = master.cycle(200, 50)
    assert status & FOLLOWS
    assert torque == 250
    expected_mm_s = 250 * TORQUE_TO_FORCE / MASS_KG * 0.049 * 1e3
    assert drive.true_velocity_mm_s == pytest.approx(expected_mm_s, rel=0.01)


def test_torque_is_limited_by_6072_and_6073(drive: SdoDrive) -> None:
    drive.set(0x6072, 300)
    master = Cyclic(drive, 10, 0x6071, 16)
    for _ in range(5):
        *_, torque = master.cycle(2000)
    assert torque == 300
    assert drive.get(0x6074) == 300
    drive.set(0x6073, 100)  # per mille of 1.5 A: 0.15 A * 0.43 Nm/A = 64.5 mNm = 100.8 per mille of 640
    for _ in range(5):
        *_, torque = master.cycle(2000)
    assert torque == pytest.approx(0.15 * 0.43 / 0.64e-3, abs=1)


def test_position_follows_a_sine(drive: SdoDrive) -> None:
    drive.set(0x6065, counts(5))
    master = Cyclic(drive, 8, 0x607A, 32)
    omega = 2 * math.pi * 1.0
    lag_mm = []
    for k in range(1000):
        wanted_mm = 5.0 * (1 - math.cos(omega * k * 1e-3))
        _, position, _ = master.cycle(round(wanted_mm * COUNTS_PER_MM))
        before_mm = 5.0 * (1 - math.cos(omega * max(0, k - 1) * 1e-3))  # what the interval aimed at
        lag_mm.append(position / COUNTS_PER_MM - before_mm)
    assert np.max(np.abs(lag_mm[20:])) < 0.15


def test_position_offset_and_software_limit(drive: SdoDrive) -> None:
    drive.set(0x607D, counts(0.3), 2)
    drive.set(0x60B0, counts(0.1))
    master = Cyclic(drive, 8, 0x607A, 32)
    for _ in range(400):
        status, position, _ = master.cycle(counts(0.1))
    assert position == pytest.approx(counts(0.2), abs=5)
    assert not status & LIMIT
    for _ in range(400):
        status, position, _ = master.cycle(counts(0.9))
    assert position == pytest.approx(counts(0.3), abs=5)
    assert status & LIMIT


def test_velocity_follows_with_offset(drive: SdoDrive) -> None:
    drive.set(0x60B1, counts(2))
    master = Cyclic(drive, 9, 0x60FF, 32)
    for _ in range(400):
        master.cycle(counts(10))
    assert drive.true_velocity_mm_s == pytest.approx(12.0, abs=0.05)


def test_velocity_stops_at_the_software_limit(drive: SdoDrive) -> None:
    drive.set(0x607D, counts(5), 2)
    master = Cyclic(drive, 9, 0x60FF, 32)
    for _ in range(800):
        status, position, _ = master.cycle(counts(40))
    assert status & LIMIT
    assert position == pytest.approx(counts(5), abs=counts(0.2))


def test_mode_can_change_in_the_cycle(drive: SdoDrive) -> None:
    master = Cyclic(drive, 9, 0x60FF, 32)
    for _ in range(300):
        master.cycle(counts(10))
    master.mode = 3
    drive.set(0x60FF, 0)
    for _ in range(500):
        master.cycle(0)
    assert drive.get(0x6061) == 3
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize("option", [1, 2, 3])
def test_halt_stops_a_cyclic_mode(drive: SdoDrive, option: int) -> None:
    drive.set(0x605D, option)
    master = Cyclic(drive, 9, 0x60FF, 32)
    for _ in range(300):
        master.cycle(counts(10))
    for _ in range(300):
        status, *_ = master.cycle(counts(10), word=ENABLED | 0x100)
    assert status & 1 << 10
    assert drive.true_velocity_mm_s == pytest.approx(0.0, abs=0.1)
    for _ in range(300):
        status, *_ = master.cycle(counts(10))
    assert drive.true_velocity_mm_s == pytest.approx(10.0, abs=0.1)


def test_long_cycle_is_interpolated(drive: SdoDrive) -> None:
    """A 4 ms cycle has ticks of 1 ms, between which the set point is interpolated."""
    drive.set(0x1006, 4000)
    drive.set(0x6065, counts(5))
    master = Cyclic(drive, 8, 0x607A, 32)
    for k in range(100):
        master.cycle(counts(0.08 * k))  # 20 mm/s
    assert drive.get(0x606B) == pytest.approx(counts(20), rel=0.02)
    assert drive.true_velocity_mm_s == pytest.approx(20.0, abs=0.2)


def test_set_points_are_reached_by_time_not_by_advance() -> None:
    """A cycle of 1 ms advanced as 0.4 and 0.6 ms, then one of 1.1 ms: the demand has no step in its slope."""
    axis = drive_records(1)[0]
    axis["present"] = axis["start"] = axis["target"] = 100.0
    assert [interpolate(axis, 200.0, 0.4), interpolate(axis, 200.0, 0.6)] == pytest.approx([140.0, 200.0])
    assert interpolate(axis, 300.0, 0.9) == pytest.approx(290.0)
    assert interpolate(axis, 400.0, 1.1) == 400.0
    assert interpolate(axis, 400.0, 1.0) == 400.0


def test_the_scale_is_mirrored_as_additional_sensor(drive: SdoDrive) -> None:
    master = Cyclic(drive, 9, 0x60FF, 32)
    for _ in range(200):
        master.cycle(counts(10))
    table_um = drive.nodes.bench.plant.state["table_position_m"][0] * 1e6
    assert drive.get(0x60E4, 1) == pytest.approx(table_um / 0.1, abs=1)
    assert drive.get(0x60E5, 1) == pytest.approx(10e3 / 0.1, rel=0.02)


def test_rating_plate_is_that_of_the_plant_file(drive: SdoDrive) -> None:
    assert [drive.get(0x6075), drive.get(0x6076)] == [1500, 640]
    assert [drive.get(0x608F, 1), drive.get(0x6092, 1), drive.get(0x6091, 1)] == [1048576, 1048576, 1]
    assert drive.get(0x6073) == 10000  # 15 A peak of 1.5 A rated
    with pytest.raises(canopen.SdoAbortedError):
        drive.set(0x6075, 1)
