"""Monitoring objects of the scale (cams, work area, range, acceleration), and its identification."""

import canopen
import pytest
from in_process_nodes import SCALE, InProcessNodes, SdoDrive, counts

STEPS_PER_MM = 10_000


@pytest.fixture
def nodes() -> InProcessNodes:
    return InProcessNodes()


@pytest.fixture
def scale(nodes: InProcessNodes) -> canopen.RemoteNode:
    return nodes.remote(SCALE)


def at_steps(nodes: InProcessNodes, scale: canopen.RemoteNode, position: int) -> None:
    """Set the present position to this value by preset."""
    scale.sdo[0x6003].raw = position
    nodes.sync()


def cam(scale: canopen.RemoteNode, number: int, low: int, high: int, hysteresis: int = 0) -> None:
    for first, value in ((0x6310, low), (0x6320, high), (0x6330, hysteresis)):
        scale.sdo[first + number - 1][1].raw = value


def test_cams_are_on_between_their_limits(nodes: InProcessNodes, scale: canopen.RemoteNode) -> None:
    cam(scale, 1, 100, 200)
    cam(scale, 3, 150, 300)
    cam(scale, 8, 0, 1000)
    at_steps(nodes, scale, 180)
    assert scale.sdo[0x6300][1].raw == 0  # none is enabled
    scale.sdo[0x6301][1].raw = 0b0000_0101
    for position, state in (
        (99, 0b000),
        (100, 0b001),
        (150, 0b101),
        (201, 0b100),
        (300, 0b100),
        (301, 0b000),
    ):
        at_steps(nodes, scale, position)
        assert scale.sdo[0x6300][1].raw == state, position
    scale.sdo[0x6302][1].raw = 0b1000_0001
    assert scale.sdo[0x6300][1].raw == 0b001  # turned over, where it is enabled
    scale.sdo[0x6301][1].raw = 0
    assert scale.sdo[0x6300][1].raw == 0


@pytest.mark.parametrize("number", range(1, 9))
def test_every_cam_has_its_limits_and_hysteresis(
    nodes: InProcessNodes, scale: canopen.RemoteNode, number: int
) -> None:
    assert 0x6310 <= 0x6310 + number - 1 <= 0x6317
    cam(scale, number, 100, 200, 20)
    scale.sdo[0x6301][1].raw = 1 << number - 1
    states = []
    for position in (90, 120, 90, 80, 79, 90, 200, 220, 221):
        at_steps(nodes, scale, position)
        states.append(scale.sdo[0x6300][1].raw >> number - 1)
    assert states == [0, 1, 1, 1, 0, 0, 1, 1, 0]


def test_the_cam_state_goes_with_a_pdo(nodes: InProcessNodes, scale: canopen.RemoteNode) -> None:
    cam(scale, 1, -10, 10)
    scale.sdo[0x6301][1].raw = 1
    scale.tpdo.read()
    pdo = scale.tpdo[1]
    pdo.clear()
    for index in (0x6300, 0x6400, 0x6040):
        pdo.add_variable(index, 1)
    pdo.trans_type = 1
    pdo.enabled = True
    pdo.save()
    nodes.operational()
    nodes.sync()
    assert [entry.raw for entry in pdo.map] == [1, 0, 0]


@pytest.mark.parametrize(("position", "state"), [(-501, 0b101), (-500, 0), (500, 0), (501, 0b011)])
def test_the_work_area_is_watched(
    nodes: InProcessNodes, scale: canopen.RemoteNode, position: int, state: int
) -> None:
    scale.sdo[0x6401][1].raw = -500
    scale.sdo[0x6402][1].raw = 500
    at_steps(nodes, scale, position)
    assert scale.sdo[0x6400][1].raw == state


def test_a_position_beyond_the_measuring_range_is_an_alarm(
    nodes: InProcessNodes, scale: canopen.RemoteNode
) -> None:
    assert (scale.sdo[0x6504].raw, scale.sdo[0x6506].raw) == (1, 0)  # supported: position error; no warnings
    scale.sdo[0x6002].raw = 1000
    for position, alarm in ((1000, 0), (1001, 1), (-1001, 1), (0, 0)):
        at_steps(nodes, scale, position)
        assert (scale.sdo[0x6503].raw, scale.sdo[0x6505].raw) == (alarm, 0)


def test_the_acceleration_is_that_of_the_table(nodes: InProcessNodes, scale: canopen.RemoteNode) -> None:
    drive = SdoDrive(nodes)
    drive.set(0x6083, counts(500))
    drive.enable(3)
    drive.set(0x60FF, counts(100))
    nodes.sync(50)
    assert scale.sdo[0x6040][1].raw > 0
    nodes.sync(50)
    assert scale.sdo[0x6040][1].raw == pytest.approx(500, abs=10)
    nodes.sync(300)
    assert scale.sdo[0x6040][1].raw > 0
    nodes.sync(50)
    assert scale.sdo[0x6040][1].raw == pytest.approx(0, abs=2)


def test_operating_time_counts_tenths_of_an_hour(nodes: InProcessNodes, scale: canopen.RemoteNode) -> None:
    assert scale.sdo[0x6508].raw == 0
    nodes.bench.clock.now_us = 3_600_000_000
    assert scale.sdo[0x6508].raw == 10


def test_what_it_is(scale: canopen.RemoteNode) -> None:
    sdo = scale.sdo
    assert sdo[0x650B].raw == sdo[0x1018][4].raw > 0
    assert sdo[0x6501].raw == sdo[0x6005][1].raw == 100  # nm
    assert sdo[0x6507].raw >> 16 == 0x0100
    assert (sdo[0x650A][1].raw, sdo[0x650A][2].raw, sdo[0x650A][3].raw) == (0, -(1 << 31), (1 << 31) - 1)
    assert all(sdo[index].raw for index in (0x1008, 0x1009, 0x100A))
    assert sdo[0x1022].raw == 0
