"""The hub: order, loss, pacing, socket file."""

import os
import select
import signal
import socket
import struct
import subprocess
import sys
import time
from typing import Any

import can
import pytest
from bus_messages import Attach, message, receive

from local_can.bus import pack

FRAMES = 300_000


def stop_when_read(hub: Any, listener: can.BusABC, senders: list[can.BusABC]) -> None:
    """Stop the hub once it has read all that `senders` sent on attaching (their filters come unanswered)."""
    for sender in senders:
        sender.send(message(0x7FF))
    receive(listener, len(senders))
    hub.signal(signal.SIGSTOP)
    os.waitid(os.P_PID, hub.process.pid, os.WSTOPPED | os.WNOWAIT)


def numbered_frames(hub: Any, count: int) -> subprocess.Popen[bytes]:
    """Start a process that sends `count` frames, each with its number as 8 bytes."""
    program = (
        "import can, sys\n"
        "with can.Bus(interface='localcan', channel=sys.argv[1]) as bus:\n"
        "    message = can.Message(arbitration_id=0x181, is_extended_id=False, data=bytes(8))\n"
        f"    for number in range({count}):\n"
        "        message.data[:] = number.to_bytes(8, 'little')\n"
        "        bus.send(message, timeout=60.0)\n"
    )
    return subprocess.Popen([sys.executable, "-c", program, str(hub.path)])


def test_the_lowest_identifier_among_the_heads_goes_first(hub: Any, attach: Attach) -> None:
    listener, *senders = (attach(hub) for _ in range(4))
    stop_when_read(hub, listener, senders)  # so that all have something to send when it looks
    sent = ([0x300, 0x100], [0x200, 0x600], [0x500, 0x080])
    for sender, identifiers in zip(senders, sent, strict=True):
        for identifier in identifiers:
            sender.send(message(identifier))
    hub.signal(signal.SIGCONT)
    # Each client's own frames stay in order; of the heads the lowest wins every time.
    expected = [0x200, 0x300, 0x100, 0x500, 0x080, 0x600]
    assert [frame.arbitration_id for frame in receive(listener, 6)] == expected


def test_frames_of_one_packet_compete_one_by_one(hub: Any, attach: Attach) -> None:
    listener, *senders = (attach(hub) for _ in range(3))
    stop_when_read(hub, listener, senders)
    for sender, identifiers in zip(senders, ([0x300, 0x100], [0x200, 0x600]), strict=True):
        sender.send_burst(b"".join(pack(message(identifier)) for identifier in identifiers))
    hub.signal(signal.SIGCONT)
    expected = [0x200, 0x300, 0x100, 0x600]
    assert [frame.arbitration_id for frame in receive(listener, 4)] == expected


def test_who_takes_bursts_gets_a_burst_in_one_packet_and_others_frame_by_frame(
    hub: Any, attach: Attach
) -> None:
    sender, other, taker = (attach(hub) for _ in range(3))
    taker.start_bursts()
    taker.send(message(0x001))  # the hub has read what was before it, once this has come
    receive(other, 1)
    frames = [pack(message(0x181, number.to_bytes(2, "little"))) for number in range(100)]
    sender.send_burst(b"".join(frames))
    assert [pack(frame) for frame in receive(other, 100)] == frames
    bursts: list[bytes] = []
    while sum(map(len, bursts)) < 1600:
        select.select([taker], [], [], 10.0)
        bursts.append(bytes(taker.receive_burst()))
    assert b"".join(bursts) == b"".join(frames)
    assert [len(burst) for burst in bursts] == [64 * 16, 36 * 16]


def test_all_clients_receive_the_same_order(hub: Any, attach: Attach) -> None:
    buses = [attach(hub, receive_own_messages=True) for _ in range(3)]
    for number in range(300):
        buses[number % 3].send(message(number % 7, number.to_bytes(2, "little")))
    received = [[bytes(frame.data) for frame in receive(bus, 300)] for bus in buses]
    assert received[0] == received[1] == received[2]


def test_a_flood_arrives_completely(hub: Any, attach: Attach) -> None:
    receiver = attach(hub)
    with numbered_frames(hub, FRAMES) as sender:
        for number in range(FRAMES):
            frame = receiver.recv(30.0)
            assert frame is not None
            assert (frame.is_error_frame, int.from_bytes(frame.data, "little")) == (False, number)
    assert sender.returncode == 0
    status, log = hub.stop()
    assert status == 0
    assert "lost" not in log


def test_an_overrun_is_reported_where_the_frames_are_missing(start_hub: Any, attach: Attach) -> None:
    hub = start_hub("--queue-frames", "10", "--patience-ms", "0")
    sleeper, witness, sender = (attach(hub) for _ in range(3))
    sent = 3000
    for number in range(sent):
        sender.send(message(0x181, number.to_bytes(2, "little")))
        receive(witness, 1)
    numbers = []
    while not (frame := receive(sleeper, 1)[0]).is_error_frame:
        numbers.append(int.from_bytes(frame.data, "little"))
    lost = int.from_bytes(frame.data[5:8], "big")
    assert numbers == list(range(len(numbers)))
    assert lost > 0
    assert len(numbers) + lost == sent
    assert sleeper.lost_frames == lost
    assert frame.data[1] == 0x01  # CAN_ERR_CRTL_RX_OVERFLOW
    sender.send(message(0x182))
    assert receive(sleeper, 1)[0].arbitration_id == 0x182
    _, log = hub.stop()
    assert f"lost {lost} frames" in log


@pytest.mark.parametrize(("passing", "lost"), [(0x181, True), (0x7FF, False)])
def test_filtered_frames_take_no_buffer_and_hide_no_overrun(
    start_hub: Any, attach: Attach, passing: int, lost: bool
) -> None:
    hub = start_hub("--queue-frames", "0", "--patience-ms", "0")
    sleeper = attach(hub, can_filters=[{"can_id": passing, "can_mask": 0x7FF, "extended": False}])
    sender = attach(hub, receive_own_messages=True)
    for identifier in [0x181] * 1000 + [0x7FF]:
        sender.send(message(identifier))
        receive(sender, 1)
    while (frame := receive(sleeper, 1)[0]).arbitration_id == 0x181:
        pass
    assert frame.is_error_frame == lost == bool(sleeper.lost_frames)


def test_the_unpaced_bus_waits_for_a_slow_reader(start_hub: Any, attach: Attach) -> None:
    hub = start_hub("--queue-frames", "1", "--patience-ms", "60000")
    reader = attach(hub)
    with numbered_frames(hub, 2000) as sender:
        received = receive(reader, 1, 60.0)  # a busy computer is slow to start it
        # the sender has started; now read as slowly as 2,000 frames need
        time.sleep(0.3)
        received += receive(reader, 1999, 60.0)
    assert sender.returncode == 0
    assert [int.from_bytes(frame.data, "little") for frame in received] == list(range(2000))


@pytest.mark.parametrize(("filters", "received"), [(None, 41), ([{"can_id": 0x7FF, "can_mask": 0x7FF}], 1)])
def test_a_paced_bus_keeps_its_bit_rate_also_for_frames_without_a_receiver(
    start_hub: Any, attach: Attach, filters: Any, received: int
) -> None:
    hub = start_hub("--bitrate", "50000")
    sender = attach(hub)
    receiver = attach(hub, can_filters=filters)
    count, nominal_bits = 40, 47 + 64
    start_s = time.monotonic()
    for _ in range(count):
        sender.send(message(0x2AA, b"\xa5" * 8))
    sender.send(message(0x7FF))
    assert len(receive(receiver, received)) == received
    assert time.monotonic() - start_s >= count * nominal_bits / 50_000


def test_all_frames_of_a_disconnected_client_arrive(hub: Any, attach: Attach) -> None:
    listener = attach(hub)
    with can.Bus(interface="localcan", channel=str(hub.path)) as leaver:
        listener.send(message(0x001))  # the leaver never reads it
        for number in range(100):
            leaver.send(message(number))
    assert [frame.arbitration_id for frame in receive(listener, 100)] == list(range(100))


def test_more_senders_and_identifiers_than_the_hub_keeps_routes_for(hub: Any, attach: Attach) -> None:
    even = attach(hub, can_filters=[{"can_id": 0, "can_mask": 1, "extended": False}])
    senders = attach(hub), attach(hub)
    for identifier in range(0x800):
        for sender in senders:
            sender.send(message(identifier))
            if identifier % 2 == 0:
                assert receive(even, 1)[0].arbitration_id == identifier
    assert even.recv(0) is None


FILTERS_THAT_ARE_NONE = (
    b"f1234567",
    b"f" + bytes(513 * 8),
    b"f" + struct.pack("=II", 0x2000_0080, 0x7FF),  # SocketCAN: all but these
    b"f" + struct.pack("=II", 0, 0x2000_0000),  # SocketCAN: error frames
)


@pytest.mark.parametrize(
    "packet",
    [b"hello", bytes(17), b"\x00\x00\x00\x00\x09" + bytes(11), bytes(100_000), *FILTERS_THAT_ARE_NONE],
)
def test_a_client_that_sends_no_can_frame_is_cut_off(hub: Any, attach: Attach, packet: bytes) -> None:
    first, second = attach(hub), attach(hub)
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as client:
        client.settimeout(10.0)
        client.connect(str(hub.path))
        client.send(b"a")
        assert client.recv(1) == b"!"
        client.send(packet)
        assert client.recv(16) == b""
    first.send(message(0x10))
    assert receive(second, 1)[0].arbitration_id == 0x10
