"""After any frame from the bus nothing raises, time advances, and the nodes answer."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from in_process_nodes import DRIVE, SCALE, InProcessNodes, SdoDrive, pack

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
    nodes = InProcessNodes()
    nodes.operational()
    for can_id, data in sent:
        nodes.put(can_id, data)
    before = nodes.bench.clock.now_us
    nodes.put(0x80 if 0x80 in nodes.bench.frames.routes else nodes.bench.slaves[0].sync_id)
    assert nodes.bench.clock.now_us > before


@given(written=writes)
@settings(max_examples=100, deadline=None)
def test_random_expedited_writes(written: list[tuple[int, int, bytes, int]]) -> None:
    nodes = InProcessNodes()
    nodes.operational()
    for address, subindex, value, unused in written:
        nodes.frames.clear()
        request = bytes((0x23 | unused << 2,)) + address.to_bytes(2, "little") + bytes((subindex,)) + value
        nodes.put(0x600 + DRIVE, request)
        answers = [data for can_id, data in nodes.frames if can_id == 0x580 + DRIVE]
        assert len(answers) == 1
        assert answers[0][0] in {0x60, 0x80}
        assert answers[0][4:] != (0x08000000).to_bytes(4, "little"), f"{address:04X}:{subindex:02X}"
        nodes.put(nodes.bench.slaves[0].sync_id)
        nodes.bench.run_timers()


RECEIVED = [
    *(0x60650020, 0x60670020, 0x606D0010, 0x60710010, 0x60720010, 0x607A0020, 0x607C0020, 0x607D0120),
    *(0x607D0220, 0x607F0020, 0x60810020, 0x60830020, 0x60840020, 0x60850020, 0x60980008, 0x60990120),
    *(0x609A0020, 0x60B00020, 0x60B10020, 0x60B20010, 0x60C50020, 0x60FF0020),
]
EXTREMES = [bytes(4), b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\1\0\0\0"]


@pytest.mark.parametrize("entry", RECEIVED, ids=lambda entry: f"{entry:08X}")
def test_extreme_values_by_pdo_under_power(entry: int) -> None:
    """Run every mode: set point, halt and release, quick stop, enable again."""
    nodes = InProcessNodes()
    drive = SdoDrive(nodes)
    drive.set(0x1400, 0x80000201, 1)
    drive.set(0x1600, 0, 0)
    for number, mapped in enumerate((0x60400010, 0x60600008, entry), 1):
        drive.set(0x1600, mapped, number)
    drive.set(0x1600, 3, 0)
    drive.set(0x1400, 0x201, 1)
    nodes.operational()
    drive.enable(3)
    for mode in (1, 3, 6, 8, 9, 10):
        for value in EXTREMES:
            for word in (0x0F, 0x3F, 0x10F, 0x0F, 0x02, 0x80, 0x06, 0x07, 0x1F):
                nodes.put(0x201, pack("Hb", word, mode) + value[: (entry & 0xFF) // 8])
                nodes.sync()
    assert np.isfinite(nodes.bench.plant.state["motor_position_m"]).all()
