"""The stations of load and soak: one counts what the bus carries, the other fills it to a rate."""

import can
import pytest

from local_can.wire import FRAME, frame_bits
from tests.campaigns.endurance.counting_station import SYNC, BusCounts
from tests.campaigns.endurance.foreign_station import LOWEST_PRIORITY, random_frames
from tests.campaigns.endurance.rig import rig, station
from tests.campaigns.endurance.run_counts import compare_counts


def test_observer_counts_frames_bits_and_gaps() -> None:
    counts = BusCounts()
    sync, tpdo = FRAME.pack(SYNC, 0, 0, b""), FRAME.pack(0x181, 8, 0, bytes(range(8)))
    for at_s in (10.0, 10.001, 10.002, 10.024):
        counts.add_frame(sync)
        counts.add_sync(at_s)
        counts.add_frame(tpdo)
    counted = counts.as_json()
    assert counted["frames"] == {"080": 4, "181": 4}
    assert counted["bits"] == 4 * (frame_bits(sync) + frame_bits(tpdo))
    # the last SYNC ends the span, so its TPDO does not count
    assert counted["sync_bits"] == 3 * (frame_bits(sync) + frame_bits(tpdo))
    assert counted["sync_seconds"] == pytest.approx(0.024)
    assert counted["longest_sync_gap_ms"] == pytest.approx(22.0)
    assert sum(counted["sync_gaps_above_ms"].values()) == 3
    assert counted["sync_gaps_above_ms"]["20.5"] == 1


def test_frames_of_the_load_station_have_the_lowest_priority() -> None:
    frames = random_frames(8)
    assert random_frames(8) == frames
    assert {FRAME.unpack(frame)[0] for frame, _ in frames} == set(LOWEST_PRIORITY)
    assert min(LOWEST_PRIORITY) > 0x77F  # the highest heartbeat
    assert {bits for _, bits in frames} > {115}
    assert all(111 <= bits <= 135 for _, bits in frames)


async def test_load_station_counts_match_those_of_the_observer() -> None:
    async with (
        rig("lockstep") as table,
        station("counting_station", str(table.socket)) as observer,
        station("foreign_station", str(table.socket), "0") as foreign,
    ):
        await observer.request("begin")
        await foreign.request("rate 500000")
        sent = await foreign.request("ready")
        while sent["frames"] < 50:
            sent = await foreign.request("ready")
        sent = await foreign.request("rate 0")
        with can.Bus(interface="localcan", channel=str(table.socket)) as bus:
            # of the lowest priority, so that it follows all of them
            bus.send(can.Message(arbitration_id=0x7FF, is_extended_id=False))
        counted: dict[str, int] = {}
        while "7FF" not in counted:
            counted = (await observer.request("count"))["frames"]
    foreign_frames = sum(count for key, count in counted.items() if int(key, 16) in LOWEST_PRIORITY)
    assert foreign_frames == sent["frames"] >= 50


class Report:
    """The fields of a run report that are compared with the counts of the bus."""

    def __init__(self, cycles: int, missed_ticks: int) -> None:
        self.cycles, self.missed_ticks = cycles, missed_ticks


COUNTED = {"frames": {"080": 98, "201": 97, "202": 97, "181": 98, "1FF": 3, "201F": 5}, "lost": 0}


def test_counts_agree_if_every_tick_has_one_frame_of_each() -> None:
    assert compare_counts(Report(100, 2), COUNTED, None).faults == ()


@pytest.mark.parametrize(
    ("frames", "fault"),
    [
        ({"080": 97}, "SYNCs on the bus: 97, not 98"),
        ({"202": 96}, "set points 202h: 96, not 97"),
        ({"181": 97}, "TPDOs 181h: 97, not 98"),
        ({"181": 99}, "TPDOs 181h: 99, not 98"),
    ],
)
def test_one_frame_too_few_or_too_many_is_found(frames: dict[str, int], fault: str) -> None:
    counted = {"frames": COUNTED["frames"] | frames, "lost": 0}
    assert fault in compare_counts(Report(100, 2), counted, None).faults


def test_tpdos_may_be_missing_on_a_full_bus_but_never_too_many() -> None:
    few, many = ({"frames": COUNTED["frames"] | {"181": n}, "lost": 0} for n in (90, 99))
    assert compare_counts(Report(100, 2), few, None, tpdos_may_be_missing=True).faults == ()
    assert len(compare_counts(Report(100, 2), many, None, tpdos_may_be_missing=True).faults) == 1


def test_an_observer_that_lost_frames_is_rejected() -> None:
    (fault,) = compare_counts(Report(100, 2), COUNTED | {"lost": 4}, None).faults
    assert "incomplete" in fault
