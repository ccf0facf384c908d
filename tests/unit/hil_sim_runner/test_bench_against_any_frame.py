"""Whatever comes from the bus, the bench goes on: no frame raises, time passes, nodes answer."""

from __future__ import annotations

from desk_bench import DRIVE, SCALE, DeskBench
from hypothesis import given, settings
from hypothesis import strategies as st

IDS = [0x000, 0x080, 0x200 + DRIVE, 0x300 + DRIVE, 0x600 + DRIVE, 0x600 + SCALE, 0x701, 0x77F]
frames = st.lists(
    st.tuples(st.sampled_from(IDS) | st.integers(0, 0x7FF), st.binary(max_size=8)), min_size=1, max_size=40
)
index = st.sampled_from(
    [0x1003, 0x1005, 0x1006, 0x1010, 0x1014, 0x1016, 0x1017, 0x1029, 0x1400, 0x1600, 0x1800, 0x1A00, 0x2000]
) | st.integers(0x6000, 0x6600)
writes = st.lists(st.tuples(index, st.integers(0, 5), st.binary(min_size=4, max_size=4), st.integers(0, 3)))


@given(sent=frames)
@settings(max_examples=60, deadline=None)
def test_random_frames(sent: list[tuple[int, bytes]]) -> None:
    desk = DeskBench()
    desk.operational()
    for can_id, data in sent:
        desk.put(can_id, data)
    before = desk.bench.clock.now_us
    desk.put(0x80 if 0x80 in desk.bench.routes else desk.bench.slaves[0].sync_id)
    assert desk.bench.clock.now_us > before


@given(written=writes)
@settings(max_examples=100, deadline=None)
def test_random_expedited_writes(written: list[tuple[int, int, bytes, int]]) -> None:
    desk = DeskBench()
    desk.operational()
    for address, subindex, value, unused in written:
        desk.frames.clear()
        request = bytes((0x23 | unused << 2,)) + address.to_bytes(2, "little") + bytes((subindex,)) + value
        desk.put(0x600 + DRIVE, request)
        answers = [data for can_id, data in desk.frames if can_id == 0x580 + DRIVE]
        assert len(answers) == 1
        assert answers[0][0] in {0x60, 0x80}
        assert answers[0][4:] != (0x08000000).to_bytes(4, "little"), f"{address:04X}:{subindex:02X}"
        desk.put(desk.bench.slaves[0].sync_id)
        desk.bench.run_timers()
