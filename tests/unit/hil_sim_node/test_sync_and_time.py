"""SYNC counter, window and supervision, TIME and the high-resolution time stamp (CiA 301, 7.2)."""

import canopen
import pytest
from in_process_nodes import DRIVE, InProcessNodes, SdoDrive

from hil_sim.runner.pacing import RealTime

EMCY = 0x80 + DRIVE
TPDO, RPDO = 0x180 + DRIVE, 0x200 + DRIVE
OFF = 0x8000_0000


@pytest.fixture
def drive() -> SdoDrive:
    return SdoDrive(InProcessNodes())


class Elapsed:
    """Simulated time that a test advances."""

    def __init__(self, nodes: InProcessNodes) -> None:
        self.now_s = 0.0
        self._nodes = nodes
        self._pacing = RealTime(nodes.bench, lambda: self.now_s)

    def quiet(self, seconds: float) -> None:
        """Advance time without a SYNC."""
        self.now_s += seconds
        self._pacing.on_quiet()

    def sync(self, after_s: float = 0.001) -> None:
        """Advance time up to a SYNC."""
        self.now_s += after_s
        self._nodes.sync()


def refused(drive: SdoDrive, index: int, value: int, subindex: int | None = None) -> int:
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        drive.set(index, value, subindex)
    return int(refusal.value.code)


def cyclic(drive: SdoDrive, every: int, start: int) -> None:
    """Configure the first TPDO with a SYNC start value, and a SYNC counter up to 10."""
    drive.set(0x1006, 0)
    drive.set(0x1019, 10)
    drive.set(0x1800, OFF | TPDO, 1)
    drive.set(0x1800, every, 2)
    drive.set(0x1800, start, 6)
    drive.set(0x1800, TPDO, 1)
    drive.nodes.operational()


def syncs_with_a_frame(drive: SdoDrive, counters: range) -> list[int]:
    answered = []
    for counter in counters:
        drive.nodes.frames.clear()
        drive.nodes.put(0x80, bytes((counter,)))
        answered += [counter] * len(drive.nodes.take(TPDO))
    return answered


@pytest.mark.parametrize(
    ("every", "start", "answered"), [(1, 4, [4, 5, 6, 7, 8, 9, 10]), (3, 4, [6, 9]), (3, 0, [3, 6, 9])]
)
def test_a_tpdo_counts_from_its_sync_start_value(
    drive: SdoDrive, every: int, start: int, answered: list[int]
) -> None:
    cyclic(drive, every, start)
    assert syncs_with_a_frame(drive, range(1, 11)) == answered


def test_the_start_value_is_of_no_account_without_a_counter(drive: SdoDrive) -> None:
    cyclic(drive, 1, 7)
    drive.set(0x1019, 0)
    drive.nodes.frames.clear()
    drive.nodes.sync(2)
    assert len(drive.nodes.take(TPDO)) == 2


def test_a_sync_without_its_counter_is_reported_until_one_has_it(drive: SdoDrive) -> None:
    cyclic(drive, 1, 0)
    drive.nodes.frames.clear()
    drive.nodes.sync()
    assert drive.nodes.take(EMCY) == [b"\x40\x82\x11\0\0\0\0\0"]  # 8240h, length 0
    drive.nodes.put(0x80, b"\x01")
    assert drive.nodes.take(EMCY) == [bytes(8)]


def test_counter_and_start_value_keep_their_ranges_and_conditions(drive: SdoDrive) -> None:
    assert refused(drive, 0x1019, 10) == 0x08000022  # 1006h is not 0
    drive.set(0x1006, 0)
    assert refused(drive, 0x1019, 1) == 0x06090030
    assert refused(drive, 0x1019, 241) == 0x06090031
    assert refused(drive, 0x1800, 5, 6) == 0x08000022  # the PDO is on
    drive.set(0x1800, OFF | TPDO, 1)
    assert refused(drive, 0x1800, 241, 6) == 0x06090031


def test_a_missing_sync_is_an_error_with_a_window(drive: SdoDrive) -> None:
    time = Elapsed(drive.nodes)
    drive.set(0x1007, 500)
    drive.nodes.operational()
    drive.enable(3)
    time.quiet(0.1)
    assert drive.state == "enabled"  # no SYNC yet: nothing to miss
    for _ in range(5):
        time.sync()
    assert drive.state == "enabled"
    drive.nodes.frames.clear()
    time.quiet(0.02)
    assert drive.nodes.take(EMCY)[0][:3] == b"\x00\x87\x11"
    assert drive.get(0x603F) == 0x8700
    assert drive.state in {"fault reaction", "fault"}
    time.sync()
    assert (drive.get(0x1001), drive.get(0x603F)) == (0, 0x8700)  # the fault remains until it is reset


def test_syncs_may_stay_away_without_a_window(drive: SdoDrive) -> None:
    time = Elapsed(drive.nodes)
    drive.nodes.operational()
    drive.enable(3)
    time.sync()
    time.quiet(0.2)
    assert drive.state == "enabled"


@pytest.mark.parametrize(("late_s", "taken"), [(0.0003, 0x06), (0.0008, 0x00)])
def test_a_synchronous_rpdo_behind_the_window_is_dropped(drive: SdoDrive, late_s: float, taken: int) -> None:
    time = Elapsed(drive.nodes)
    drive.set(0x1007, 500)
    drive.set(0x1400, 1, 2)
    drive.nodes.operational()
    time.sync()
    time.now_s += late_s
    drive.nodes.put(RPDO, b"\x06\x00")
    time.sync(0.001 - late_s)
    assert drive.get(0x6040) == taken


def test_time_sets_the_high_resolution_time_stamp(drive: SdoDrive) -> None:
    at_noon = (12 * 3600 * 1000).to_bytes(4, "little") + (15_000).to_bytes(2, "little")
    drive.nodes.put(0x100, at_noon)
    assert drive.get(0x1013) == 0  # not consumed
    drive.set(0x1012, 0x8000_0100)
    drive.nodes.put(0x100, at_noon)
    drive.nodes.sync(25)
    assert drive.get(0x1013) == (12 * 3600 * 1_000_000 + 25_000) % (1 << 32)
    drive.nodes.put(0x100, at_noon[:5])  # no TIME_OF_DAY
    drive.set(0x1013, 4_294_967_000)
    drive.nodes.sync()
    assert drive.get(0x1013) == 704  # it wraps


def test_time_comes_from_the_master_and_by_an_identifier_of_its_own(drive: SdoDrive) -> None:
    assert refused(drive, 0x1012, 0x4000_0100) == 0x06090030  # producer
    assert refused(drive, 0x1012, 0x8000_0601) == 0x06090030
