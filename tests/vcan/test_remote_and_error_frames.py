"""What is not a data frame, on both buses: node guarding and TPDOs on request, bus-off and restart."""

import asyncio
import time
from collections.abc import Callable, Iterator

import can
import canopen
import pytest

from servo_ctrl.io.can_port import CanPort, open_port
from servo_ctrl.io.error_frames import BusNews

NODE, SCALE = 1, 11
GUARD, TPDO1, TPDO2, EMCY, SYNC = 0x701, 0x181, 0x281, 0x081, 0x080
OPERATIONAL, TOGGLE = 5, 0x80
LONGEST_S = 60.0


class Station:
    """A third one on the bus."""

    def __init__(self, bus: can.BusABC) -> None:
        self.bus = bus

    def send(self, can_id: int, data: bytes = b"", **kind: bool) -> None:
        self.bus.send(can.Message(arbitration_id=can_id, data=data, is_extended_id=False, **kind))

    def answers(self, *wanted: int) -> list[tuple[int, bytes]]:
        """Data frames with these identifiers until the scale has answered an SDO request sent now."""
        found = []
        self.send(0x600 + SCALE, bytes.fromhex("40 00 10 00 00 00 00 00"))
        until_s = time.monotonic() + LONGEST_S
        while (message := self.bus.recv(max(0.0, until_s - time.monotonic()))) is not None:
            if message.is_remote_frame or message.is_error_frame:
                continue
            if message.arbitration_id == 0x580 + SCALE:
                return found
            if message.arbitration_id in wanted:
                found.append((message.arbitration_id, bytes(message.data)))
        raise AssertionError("the scale does not answer")


@pytest.fixture(scope="module")
def station(bus_spec: str, start_simulator: Callable[[str], object]) -> Iterator[Station]:
    start_simulator(bus_spec)
    interface, _, channel = bus_spec.partition(":")
    with can.Bus(interface=interface, channel=channel) as bus:
        yield Station(bus)


@pytest.fixture(scope="module")
def drive(bus_spec: str, station: Station) -> Iterator[canopen.RemoteNode]:
    del station
    interface, _, channel = bus_spec.partition(":")
    with canopen.Network() as network:
        network.connect(interface=interface, channel=channel)
        node = network.add_node(NODE, canopen.ObjectDictionary())
        node.sdo.RESPONSE_TIMEOUT = LONGEST_S
        yield node


def test_a_remote_frame_guards_a_node_under_a_toggle_bit(station: Station, drive: canopen.RemoteNode) -> None:
    drive.sdo.download(0x1017, 0, bytes(2))
    station.answers()  # takes the boot-up away, which a station sees that was on the bus before the drive
    states = []
    for _ in range(3):
        station.send(GUARD, is_remote_frame=True)
        states += station.answers(GUARD)
    first = states[0][1][0] & TOGGLE
    assert [state ^ first for _, (state,) in states] == [127, 127 | TOGGLE, 127]


def test_tpdos_of_types_252_and_253_come_at_a_remote_frame_alone(
    station: Station, drive: canopen.RemoteNode
) -> None:
    for place, can_id, kind in ((0, TPDO1, 252), (1, TPDO2, 253)):
        off = (0x8000_0000 | can_id).to_bytes(4, "little")
        drive.sdo.download(0x1800 + place, 1, off)
        drive.sdo.download(0x1800 + place, 2, bytes((kind,)))
        drive.sdo.download(0x1A00 + place, 0, bytes(1))
        drive.sdo.download(0x1A00 + place, 1, (0x6061_0008).to_bytes(4, "little"))
        drive.sdo.download(0x1A00 + place, 0, b"\1")
        drive.sdo.download(0x1800 + place, 1, can_id.to_bytes(4, "little"))
    drive.sdo.download(0x6060, 0, b"\x08")
    station.send(0x000, bytes((1, NODE)))
    station.send(SYNC)
    assert station.answers(TPDO1, TPDO2) == []
    drive.sdo.download(0x6060, 0, b"\x09")
    for can_id in (TPDO1, TPDO2):
        station.send(can_id, is_remote_frame=True)
    # 252: as it was at the SYNC; 253: as it is
    assert station.answers(TPDO1, TPDO2) == [(TPDO1, b"\x08"), (TPDO2, b"\x09")]
    station.send(SYNC)
    station.send(TPDO1, is_remote_frame=True)
    assert station.answers(TPDO1, TPDO2) == [(TPDO1, b"\x09")]


async def test_bus_off_silences_both_sides_until_the_restart(
    bus_spec: str, station: Station, drive: canopen.RemoteNode
) -> None:
    del drive
    news: asyncio.Queue[BusNews] = asyncio.Queue()
    port: CanPort = open_port(bus_spec)
    port.on_error_frame = news.put_nowait
    port.attach(asyncio.get_running_loop())
    try:
        station.send(0x040, bytes(8), is_error_frame=True)
        off = await asyncio.wait_for(news.get(), LONGEST_S)
        assert port.off
        port.send(SYNC, b"")
        station.send(0x100, bytes(8), is_error_frame=True)
        on = await asyncio.wait_for(news.get(), LONGEST_S)
    finally:
        port.close()
    assert [(each.text, each.down, each.restarted) for each in (off, on)] == [
        ("bus-off", True, False),
        ("controller restarted", False, True),
    ]
    station.send(SYNC)
    emergencies = [data[:2] for _, data in station.answers(EMCY)]
    assert b"\x40\x81" in emergencies  # recovered from bus-off
