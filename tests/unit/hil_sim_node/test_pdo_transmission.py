"""PDOs on the bus: transmission types, latching at SYNC, lengths, timers."""

import struct

import pytest
from in_process_nodes import DRIVE, SCALE, SHUTDOWN, InProcessNodes, SdoDrive, pack

OFF = 0x80000000
RPDO1, TPDO1, EMCY = 0x200 + DRIVE, 0x180 + DRIVE, 0x80 + DRIVE


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


def configure(
    drive: SdoDrive, index: int, cob_id: int, transmission: int, *entries: int, **timers: int
) -> None:
    """The standard sequence: off, type, timers, no entries, entries, number, on."""
    drive.set(index, cob_id | OFF, 1)
    drive.set(index, transmission, 2)
    for name, subindex in (("inhibit", 3), ("event", 5)):
        if name in timers:
            drive.set(index, timers[name], subindex)
    drive.set(index + 0x200, 0, 0)
    for number, entry in enumerate(entries, 1):
        drive.set(index + 0x200, entry, number)
    drive.set(index + 0x200, len(entries), 0)
    drive.set(index, cob_id, 1)


def test_no_pdo_outside_operational(drive: SdoDrive) -> None:
    configure(drive, 0x1800, TPDO1, 1, 0x60410010)
    configure(drive, 0x1400, RPDO1, 255, 0x60400010)
    drive.nodes.frames.clear()
    drive.nodes.sync(3)
    drive.nodes.put(RPDO1, pack("H", SHUTDOWN))
    assert drive.nodes.take(TPDO1) == []
    assert drive.state == "switch on disabled"


def test_type_1_sends_the_mapped_values_at_every_sync(drive: SdoDrive) -> None:
    configure(drive, 0x1800, TPDO1, 1, 0x60410010, 0x60640020, 0x60780010)
    drive.nodes.operational()
    drive.nodes.frames.clear()
    drive.nodes.sync(3)
    assert drive.nodes.take(TPDO1) == [pack("Hih", drive.statusword, 0, 0)] * 3


@pytest.mark.parametrize("every", [2, 7, 240])
def test_type_n_sends_at_every_nth_sync(drive: SdoDrive, every: int) -> None:
    configure(drive, 0x1800, TPDO1, every, 0x60410010)
    drive.nodes.operational()
    drive.nodes.frames.clear()
    drive.nodes.sync(2 * every)
    assert len(drive.nodes.take(TPDO1)) == 2


def test_type_0_sends_at_the_sync_after_a_change(drive: SdoDrive) -> None:
    configure(drive, 0x1800, TPDO1, 0, 0x60410010)
    drive.nodes.operational()
    drive.nodes.sync(5)
    assert len(drive.nodes.take(TPDO1)) == 1
    drive.control(SHUTDOWN)
    assert drive.nodes.take(TPDO1) == []
    drive.nodes.sync(5)
    assert drive.nodes.take(TPDO1) == [pack("H", 0x231)]


def test_type_255_sends_on_change_and_by_the_event_timer(drive: SdoDrive) -> None:
    configure(drive, 0x1800, TPDO1, 255, 0x60410010, event=10)
    drive.nodes.operational()
    drive.nodes.sync()
    drive.nodes.frames.clear()
    drive.nodes.sync(30)
    assert len(drive.nodes.take(TPDO1)) == 3
    drive.control(SHUTDOWN)
    drive.nodes.sync()
    assert drive.nodes.take(TPDO1) == [pack("H", 0x231)]


def test_inhibit_time_spaces_the_frames(drive: SdoDrive) -> None:
    configure(drive, 0x1800, TPDO1, 254, 0x60FC0020, inhibit=50)  # 5 ms
    drive.nodes.operational()
    drive.nodes.sync()
    drive.nodes.frames.clear()
    for value in range(20):
        drive.device.objects.position_demand_internal_value = value
        drive.nodes.sync()
    assert [struct.unpack("<i", data)[0] for data in drive.nodes.take(TPDO1)] == [4, 9, 14, 19]


def test_synchronous_rpdo_acts_at_the_next_sync(drive: SdoDrive) -> None:
    configure(drive, 0x1400, RPDO1, 1, 0x60400010)
    drive.nodes.operational()
    drive.nodes.put(RPDO1, pack("H", SHUTDOWN))
    assert drive.state == "switch on disabled"
    drive.nodes.sync()
    assert drive.state == "ready"


def test_asynchronous_rpdo_acts_at_once(drive: SdoDrive) -> None:
    configure(drive, 0x1400, RPDO1, 255, 0x60400010)
    drive.nodes.operational()
    drive.nodes.put(RPDO1, pack("H", SHUTDOWN))
    assert drive.state == "ready"


def test_set_point_of_a_cycle_shows_one_cycle_after_its_sync(drive: SdoDrive) -> None:
    """Cycle k: RPDO; SYNC k+1 applies it; the TPDO after SYNC k+2 shows the effect."""
    configure(drive, 0x1400, RPDO1, 1, 0x60400010, 0x60600008, 0x60710010)
    configure(drive, 0x1800, TPDO1, 1, 0x60770010)
    drive.nodes.operational()
    for word in (0x06, 0x07, 0x0F):
        drive.nodes.put(RPDO1, pack("Hbh", word, 10, 0))
        drive.nodes.sync()
    drive.nodes.put(RPDO1, pack("Hbh", 0x0F, 10, 500))
    drive.nodes.frames.clear()
    drive.nodes.sync(2)
    first, second = (struct.unpack("<h", data)[0] for data in drive.nodes.take(TPDO1))
    assert first == 0
    assert second == pytest.approx(500, abs=2)


def test_dummy_entries_leave_a_gap(drive: SdoDrive) -> None:
    configure(drive, 0x1400, RPDO1, 255, 0x00070020, 0x60400010)
    drive.nodes.operational()
    drive.nodes.put(RPDO1, pack("IH", 0xFFFFFFFF, SHUTDOWN))
    assert drive.state == "ready"


@pytest.mark.parametrize(
    ("data", "code", "state"), [(b"\x06", 0x8210, "switch on disabled"), (b"\x06\0\0", 0x8220, "ready")]
)
def test_wrong_length_is_reported(drive: SdoDrive, data: bytes, code: int, state: str) -> None:
    drive.nodes.operational()
    drive.nodes.frames.clear()
    drive.nodes.put(RPDO1, data)
    drive.nodes.sync()
    assert [struct.unpack("<H", frame[:2])[0] for frame in drive.nodes.take(EMCY)] == [code]
    assert drive.state == state


def test_sync_with_data_is_reported_and_still_a_sync(drive: SdoDrive) -> None:
    drive.nodes.frames.clear()
    drive.nodes.put(0x80, b"\x01")
    assert drive.nodes.bench.clock.now_us == 1000
    assert [frame[:2] for can_id, frame in drive.nodes.frames if can_id == EMCY] == [pack("H", 0x8240)]


def test_a_value_that_does_not_fit_wraps(drive: SdoDrive) -> None:
    configure(drive, 0x1800, TPDO1, 1, 0x60410010, 0x60640020)
    drive.nodes.operational()
    drive.device.port.origin = 2**31 + 5
    drive.nodes.frames.clear()
    drive.nodes.sync()
    (frame,) = drive.nodes.take(TPDO1)
    assert struct.unpack("<Hi", frame)[1] == -(2**31) + 5


def test_sync_identifier_can_be_moved(drive: SdoDrive) -> None:
    drive.set(0x1005, 0x90)
    drive.nodes.frames.clear()
    drive.nodes.put(0x90)
    assert drive.nodes.bench.clock.now_us == 1000


@pytest.mark.parametrize(
    ("entry", "low", "high"),
    [
        (0x60830020, 0, None),  # an acceleration of zero would be divided by
        (0x60850020, 0, None),
        (0x609A0020, 0, None),
        (0x60C50020, 0, None),
        (0x607F0020, 0, 0x80000000),
        (0x60990120, 0, 0xFFFFFFFF),
    ],
)
def test_a_value_outside_the_limits_of_its_object_is_not_taken(
    drive: SdoDrive, entry: int, low: int | None, high: int | None
) -> None:
    index, subindex = entry >> 16, entry >> 8 & 0xFF or None
    configure(drive, 0x1400, RPDO1, 255, 0x60400010, entry)
    drive.nodes.operational()
    before = drive.get(index, subindex)
    for value in (low, high):
        if value is not None:
            drive.nodes.put(RPDO1, pack("HI", SHUTDOWN, value))
            assert (drive.state, drive.get(index, subindex)) == ("ready", before)
    drive.nodes.put(RPDO1, pack("HI", SHUTDOWN, 4321))
    assert drive.get(index, subindex) == 4321


def test_what_sdo_reads_wraps_as_the_pdo_does(drive: SdoDrive) -> None:
    drive.device.port.origin = 2**31 + 5
    drive.nodes.sync()
    assert drive.get(0x6064) == -(2**31) + 5


def test_only_the_nodes_that_listen_to_a_sync_answer_it(drive: SdoDrive) -> None:
    scale = drive.nodes.remote(SCALE)
    for node in (drive.node, scale):
        node.sdo[0x1800][2].raw = 1
    scale.sdo[0x1005].raw = 0x85
    drive.nodes.operational()
    for identifier, answer in ((0x80, TPDO1), (0x85, 0x180 + SCALE)):
        drive.nodes.frames.clear()
        drive.nodes.put(identifier)
        assert [can_id for can_id, _ in drive.nodes.frames] == [answer]
