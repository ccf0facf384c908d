"""Values that a drive refuses by CiA 301 and 402, and values that it stores until it can apply them."""

import canopen
import pytest
from in_process_nodes import DRIVE, SCALE, InProcessNodes, SdoDrive, counts

TARGET_REACHED = 1 << 10


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


def test_a_set_point_waits_for_a_profile_velocity(drive: SdoDrive) -> None:
    drive.set(0x6081, 0)
    drive.enable(1)
    drive.set(0x607A, counts(2.0))
    drive.control(0x1F)
    drive.nodes.sync(300)
    assert not drive.statusword & TARGET_REACHED
    assert abs(drive.position_mm) < 0.01
    drive.set(0x6081, counts(100.0))
    drive.sync_until(lambda: drive.statusword & TARGET_REACHED, 2000)
    assert drive.position_mm == pytest.approx(2.0, abs=0.01)


@pytest.mark.parametrize(
    ("index", "subindex", "value", "code"),
    [
        (0x607E, None, 0x01, 0x06090030),  # reserved bit of the polarity
        (0x607E, None, 0x10, 0x06090030),
        (0x60C2, 1, 0, 0x06090032),
        (0x1400, 1, 0x80, 0x06040043),  # the SYNC
        (0x1800, 1, 0x80, 0x06040043),
        (0x1400, 1, 0x80 + DRIVE, 0x06040043),  # its own EMCY
        (0x1801, 1, 0x180 + DRIVE, 0x06040043),  # the first TPDO's
    ],
)
def test_a_value_that_cannot_be_is_refused(
    drive: SdoDrive, index: int, subindex: int | None, value: int, code: int
) -> None:
    with pytest.raises(canopen.SdoAbortedError) as refused:
        drive.set(index, value, subindex)
    assert refused.value.code == code


def test_no_two_devices_have_one_serial_number(drive: SdoDrive) -> None:
    serial = {node_id: drive.nodes.remote(node_id).sdo[0x1018][4].raw for node_id in (DRIVE, SCALE)}
    assert all(serial.values())
    assert len(set(serial.values())) == len(serial)


@pytest.mark.parametrize("index", [0x6072, 0x6073])
def test_the_limits_of_the_amplifier_are_not_in_the_eds(drive: SdoDrive, index: int) -> None:
    assert drive.node.object_dictionary[index].default is None
    assert drive.get(index) > 0
