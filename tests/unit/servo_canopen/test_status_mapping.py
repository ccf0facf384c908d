"""The mapping of the controller's status TPDO, 1A00h, changed by a client."""

import pytest
from canopen import SdoAbortedError
from controller_node_bench import NODE_ID, ControllerNodeBench

ON, OFF = 0x4000_0000 | 0x180 + NODE_ID, 0xC000_0000 | 0x180 + NODE_ID
STATE, PROGRESS, DUE = 0x2000_0008, 0x2110_0710, 0x2113_0108
CANNOT_BE_MAPPED, TOO_MANY_BITS = 0x0604_0041, 0x0604_0042
NO_OBJECT, INVALID, DEVICE_STATE = 0x0602_0000, 0x0609_0030, 0x0800_0022


@pytest.fixture
def bench() -> ControllerNodeBench:
    return ControllerNodeBench.booted()


def write(bench: ControllerNodeBench, index: int, subindex: int, value: int) -> int:
    """Write an entry; return the abort code, 0 for none."""
    try:
        bench.remote.sdo[index][subindex].raw = value
    except SdoAbortedError as refused:
        return refused.code
    return 0


def remap(bench: ControllerNodeBench, *entries: int) -> None:
    """Map these objects, as CiA 301 wants it done."""
    assert write(bench, 0x1800, 1, OFF) == 0
    assert write(bench, 0x1A00, 0, 0) == 0
    for place, entry in enumerate(entries, start=1):
        assert write(bench, 0x1A00, place, entry) == 0
    assert write(bench, 0x1A00, 0, len(entries)) == 0
    assert write(bench, 0x1800, 1, ON) == 0


def sent(bench: ControllerNodeBench) -> bytes:
    """The next status TPDO."""
    bench.node.operational(True)
    bench.node.count_cycles(1)
    return bench.status_pdos[-1]


def test_the_tpdo_carries_what_a_client_maps(bench: ControllerNodeBench) -> None:
    as_delivered = sent(bench)
    assert len(as_delivered) == 8
    remap(bench, PROGRESS, STATE)
    assert sent(bench) == as_delivered[4:6] + as_delivered[:1]
    assert [bench.remote.sdo[0x1A00][place].raw for place in range(3)] == [2, PROGRESS, STATE]


def test_nothing_is_remapped_while_the_tpdo_is_on_or_has_entries(bench: ControllerNodeBench) -> None:
    assert write(bench, 0x1A00, 0, 0) == DEVICE_STATE
    write(bench, 0x1800, 1, OFF)
    assert write(bench, 0x1A00, 1, STATE) == DEVICE_STATE
    assert write(bench, 0x1A00, 0, 0) == 0
    assert write(bench, 0x1A00, 1, STATE) == 0


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        (0x2FFF_0008, NO_OBJECT),
        (0x2000_0010, CANNOT_BE_MAPPED),  # it has 8 bits
        (0x1018_0120, CANNOT_BE_MAPPED),
        (0x2100_0008, CANNOT_BE_MAPPED),  # a command
        (0x2123_0108, CANNOT_BE_MAPPED),  # of an axis that the machine has not
    ],
)
def test_what_is_no_status_number_cannot_be_mapped(bench: ControllerNodeBench, entry: int, code: int) -> None:
    write(bench, 0x1800, 1, OFF)
    write(bench, 0x1A00, 0, 0)
    assert write(bench, 0x1A00, 1, entry) == code


def test_eight_bytes_and_eight_objects_are_the_most(bench: ControllerNodeBench) -> None:
    write(bench, 0x1800, 1, OFF)
    write(bench, 0x1A00, 0, 0)
    for place in range(1, 6):
        assert write(bench, 0x1A00, place, PROGRESS) == 0
    assert write(bench, 0x1A00, 0, 5) == TOO_MANY_BITS
    assert write(bench, 0x1A00, 0, 9) == INVALID
    assert write(bench, 0x1A00, 0, 4) == 0


def test_a_stored_mapping_is_that_of_the_next_start_where_it_fits() -> None:
    kept: list[dict[str, int] | None] = []
    bench = ControllerNodeBench(store=kept.append)
    bench.node.boot_up()
    remap(bench, DUE, STATE)
    assert write(bench, 0x1010, 1, 0x6576_6173) == 0
    stored = kept[-1]
    assert stored is not None
    again = ControllerNodeBench(stored=stored)
    again.node.boot_up()
    assert [again.remote.sdo[0x1A00][place].raw for place in range(3)] == [2, DUE, STATE]
    remap(again, STATE)
    again.put(0x000, bytes((0x82, NODE_ID)))
    assert again.remote.sdo[0x1A00][0].raw == 2  # as stored, after a reset of the communication
    other = ControllerNodeBench(stored={**stored, "mapping_1": 0x2FFF_0008})
    other.node.boot_up()
    assert other.remote.sdo[0x1A00][0].raw == 6  # as delivered
