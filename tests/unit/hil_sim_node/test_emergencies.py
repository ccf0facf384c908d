"""Emergency objects: error register, history, identifier, inhibit time."""

import canopen
import pytest
from in_process_nodes import DRIVE, InProcessNodes, SdoDrive, pack

EMCY = 0x80 + DRIVE


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


def too_short(drive: SdoDrive) -> None:
    drive.nodes.put(0x200 + DRIVE, b"\x06")
    drive.nodes.sync()


def right(drive: SdoDrive) -> None:
    drive.nodes.put(0x200 + DRIVE, b"\x00\x00")
    drive.nodes.sync()


def codes(frames: list[bytes]) -> list[int]:
    return [int.from_bytes(frame[:2], "little") for frame in frames]


def test_history_keeps_the_newest_first_and_is_cleared_by_zero(drive: SdoDrive) -> None:
    drive.nodes.operational()
    too_short(drive)
    drive.nodes.put(0x200 + DRIVE, b"\x06\0\0")
    drive.nodes.sync()
    assert drive.get(0x1003, 0) == 2
    assert [drive.get(0x1003, 1), drive.get(0x1003, 2)] == [0x8220, 0x8210]
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.get(0x1003, 3)
    assert refusal.value.code == 0x08000024
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(0x1003, 1, 0)
    assert refusal.value.code == 0x06090030
    drive.set(0x1003, 0, 0)
    assert drive.get(0x1003, 0) == 0


def test_an_error_that_goes_on_is_reported_once_and_its_end_too(drive: SdoDrive) -> None:
    drive.nodes.operational()
    drive.nodes.frames.clear()
    for _ in range(5):
        too_short(drive)
    assert drive.get(0x1001) == 0x11
    assert codes(drive.nodes.take(EMCY)) == [0x8210]
    right(drive)
    right(drive)
    assert drive.get(0x1001) == 0
    assert codes(drive.nodes.take(EMCY)) == [0]


def test_a_missing_rpdo_is_reported_after_its_event_timer(drive: SdoDrive) -> None:
    drive.set(0x1400, 20, 5)
    drive.nodes.operational()
    drive.nodes.sync(100)
    right(drive)
    drive.nodes.frames.clear()
    drive.nodes.sync(19)
    assert codes(drive.nodes.take(EMCY)) == []
    drive.nodes.sync(100)
    assert codes(drive.nodes.take(EMCY)) == [0x8250]
    right(drive)
    assert codes(drive.nodes.take(EMCY)) == [0]


def test_history_holds_eight(drive: SdoDrive) -> None:
    drive.nodes.operational()
    for _ in range(12):
        too_short(drive)
        right(drive)
    assert drive.get(0x1003, 0) == 8


def test_identifier_can_be_moved_and_switched_off(drive: SdoDrive) -> None:
    drive.nodes.operational()
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(0x1014, 0x95)  # not while it is on
    assert refusal.value.code == 0x08000022
    drive.set(0x1014, 0x80000081)
    drive.set(0x1014, 0x95)
    drive.nodes.frames.clear()
    too_short(drive)
    assert codes(drive.nodes.take(0x95)) == [0x8210]
    drive.set(0x1014, 0x80000095)
    right(drive)
    too_short(drive)
    assert drive.nodes.take(0x95) == []
    assert drive.get(0x1003, 0) == 2


@pytest.mark.parametrize(
    ("index", "value"), [(0x1014, 0x601), (0x1014, 0x20000081), (0x1005, 0x0), (0x1005, 0x40000080)]
)
def test_identifiers_of_other_services_are_refused(drive: SdoDrive, index: int, value: int) -> None:
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(index, value)
    assert refusal.value.code == 0x06090030


def test_lost_frames_are_reported_by_every_node(drive: SdoDrive) -> None:
    drive.nodes.frames.clear()
    drive.nodes.bench.on_overrun()
    drive.nodes.sync()
    assert [codes([data]) for _, data in drive.nodes.frames] == [[0x8110], [0], [0x8110], [0]]
    assert drive.get(0x1003, 1) == 0x8110


def test_inhibit_time_keeps_emergencies_apart(drive: SdoDrive) -> None:
    drive.nodes.operational()
    drive.set(0x1015, 50)  # 5 ms
    drive.nodes.frames.clear()
    drive.nodes.put(0x200 + DRIVE, b"\x06")
    drive.nodes.put(0x200 + DRIVE, b"\x06\0\0")
    drive.nodes.sync()
    assert codes(drive.nodes.take(EMCY)) == [0x8210]
    drive.nodes.sync(4)
    assert drive.nodes.take(EMCY) == []
    drive.nodes.sync()
    assert codes(drive.nodes.take(EMCY)) == [0x8220]


def test_canopens_consumer_understands_the_frames(drive: SdoDrive) -> None:
    drive.nodes.operational()
    too_short(drive)
    (entry,) = drive.node.emcy.log
    assert (entry.code, entry.register) == (0x8210, 0x11)
    assert entry.data[:3] == pack("BBB", 1, 1, 2)


def test_a_wrong_length_ends_when_the_pdo_is_configured_again(drive: SdoDrive) -> None:
    drive.nodes.operational()
    too_short(drive)
    assert drive.get(0x1001) == 0x11
    drive.set(0x1400, 0x80000201, 1)
    assert drive.get(0x1001) == 0
