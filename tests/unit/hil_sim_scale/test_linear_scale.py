"""The CiA 406 scale: position, preset, direction, speed, reference mark, timer."""

import struct

import canopen
import pytest
from in_process_nodes import EDS, IDEAL_AXIS, SCALE, InProcessNodes, SdoDrive, counts

TPDO1 = 0x180 + SCALE
STEPS_PER_MM = 10000  # 0.1 um


@pytest.fixture
def nodes() -> InProcessNodes:
    return InProcessNodes()


@pytest.fixture
def scale(nodes: InProcessNodes) -> canopen.RemoteNode:
    return nodes.remote(SCALE)


def moving(nodes: InProcessNodes, millimetres_s: float) -> SdoDrive:
    """Run the drive of the axis at constant speed; return it."""
    drive = SdoDrive(nodes)
    drive.set(0x60FF, counts(millimetres_s))
    drive.enable(3)
    nodes.sync(200)
    return drive


def table_mm(nodes: InProcessNodes) -> float:
    return float(nodes.bench.plant.state["table_position_m"][0]) * 1e3


def test_position_counts_the_table_in_steps(nodes: InProcessNodes, scale: canopen.RemoteNode) -> None:
    moving(nodes, 25.0)
    assert scale.sdo[0x6004].raw == pytest.approx(table_mm(nodes) * STEPS_PER_MM, abs=1)
    assert scale.sdo[0x6020][1].raw == scale.sdo[0x6004].raw
    assert scale.sdo[0x6005][1].raw == 100  # nm


def test_position_is_sampled_at_sync_and_sent(nodes: InProcessNodes, scale: canopen.RemoteNode) -> None:
    scale.sdo[0x1800][2].raw = 1
    moving(nodes, 25.0)
    nodes.operational()
    nodes.frames.clear()
    nodes.sync()
    (frame,) = nodes.take(TPDO1)
    assert struct.unpack("<i", frame)[0] == scale.sdo[0x6004].raw


@pytest.mark.parametrize("address", [(0x6003, None), (0x6010, 1)])
def test_preset_makes_the_present_position_read_the_preset(
    nodes: InProcessNodes, scale: canopen.RemoteNode, address: tuple[int, int | None]
) -> None:
    moving(nodes, 25.0)
    raw = scale.sdo[0x6004].raw
    entry = scale.sdo[address[0]] if address[1] is None else scale.sdo[address[0]][address[1]]
    entry.raw = 123456
    assert scale.sdo[0x6004].raw == 123456
    assert scale.sdo[0x6509].raw == 123456 - raw
    nodes.sync(100)
    assert scale.sdo[0x6004].raw == pytest.approx(123456 + 25 * 0.1 * STEPS_PER_MM, abs=5)


def test_direction_reverses_without_a_jump(nodes: InProcessNodes, scale: canopen.RemoteNode) -> None:
    moving(nodes, 25.0)
    before = scale.sdo[0x6004].raw
    scale.sdo[0x6000].raw = 8
    assert scale.sdo[0x6004].raw == before
    nodes.sync(100)
    assert scale.sdo[0x6004].raw == pytest.approx(before - 25 * 0.1 * STEPS_PER_MM, abs=5)
    assert scale.sdo[0x6030][1].raw == pytest.approx(-2500, abs=5)  # 0.01 mm/s


def test_reference_mark_at_2_mm_is_counted_and_located(
    nodes: InProcessNodes, scale: canopen.RemoteNode
) -> None:
    drive = SdoDrive(nodes)
    drive.enable(1)
    scale.sdo[0x6003].raw = 1000
    for target_mm in (4.0, 0.0, 1.0):
        drive.set(0x607A, counts(target_mm))
        drive.control(0x0F)
        drive.control(0x1F)
        drive.sync_until(lambda: drive.statusword & 1 << 10, 2000)
    assert scale.sdo[0x2001][1].raw == 2
    assert scale.sdo[0x2001][2].raw == 1000 + 2 * STEPS_PER_MM


def test_cyclic_timer_is_the_event_timer_of_the_first_pdo(
    nodes: InProcessNodes, scale: canopen.RemoteNode
) -> None:
    scale.sdo[0x6200].raw = 20
    assert scale.sdo[0x1800][5].raw == 20
    nodes.operational()
    nodes.sync()
    nodes.frames.clear()
    nodes.sync(100)
    assert len(nodes.take(TPDO1)) == 5
    scale.sdo[0x1800][5].raw = 10
    assert scale.sdo[0x6200].raw == 10


def test_reset_forgets_the_preset(nodes: InProcessNodes, scale: canopen.RemoteNode) -> None:
    scale.sdo[0x6003].raw = 5000
    nodes.put(0, bytes((129, SCALE)))
    assert scale.sdo[0x6004].raw == 0
    assert scale.sdo[0x2001][1].raw == 0


def test_identity_is_that_of_the_eds(scale: canopen.RemoteNode) -> None:
    expected = canopen.import_od(str(EDS / "linear_scale.eds"), SCALE)
    for subindex in (1, 2, 3):
        assert scale.sdo[0x1018][subindex].raw == expected[0x1018][subindex].default
    assert scale.sdo[0x1000].raw == 0x00080196
    assert IDEAL_AXIS.exists()


def test_operating_status_shows_the_direction_and_nothing_else_can_be_chosen(
    scale: canopen.RemoteNode,
) -> None:
    scale.sdo[0x6000].raw = 8
    assert scale.sdo[0x6500].raw == 8
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        scale.sdo[0x6000].raw = 4  # scaling
    assert refusal.value.code == 0x06090030
    assert scale.sdo[0x6500].raw == 8
