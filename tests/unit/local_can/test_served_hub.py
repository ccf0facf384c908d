"""A bus that one of its clients serves in its own process: the same to everybody else, and to itself."""

import os
import random
import select
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import pytest
from bus_messages import message

from local_can.bus import LocalCanBus, pack
from local_can.hub import Hub
from local_can.served_hub import InProcessClient
from local_can.wire import ATTACH, pack_filters


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "served.sock"


@pytest.fixture
def server(path: Path) -> Iterator[LocalCanBus]:
    with LocalCanBus(str(path), serve=True) as bus:
        yield bus


@pytest.fixture
def client(path: Path, server: LocalCanBus) -> Iterator[Any]:
    bus = attached(path, server)
    yield bus
    bus.shutdown()


def attached(path: Path, server: LocalCanBus, **options: Any) -> Any:
    """Another client: the hub answers while the server is read, so both sides take turns in this thread."""
    made: list[Any] = []
    thread = threading.Thread(target=lambda: made.append(LocalCanBus(str(path), **options)))
    thread.start()
    while thread.is_alive():
        assert server.recv(0.01) is None
    thread.join()
    return made[0]


def test_the_first_serves_and_the_next_joins(path: Path, server: LocalCanBus) -> None:
    second = attached(path, server, serve=True)
    with second:
        assert server.serves
        assert not second.serves
        second.send(message(0x181, b"\1"))
        received = server.recv(5.0)
        assert received is not None
        assert (received.arbitration_id, bytes(received.data)) == (0x181, b"\1")


def test_frames_go_both_ways_and_the_file_tells(server: LocalCanBus, client: Any) -> None:
    server.send(message(0x181, b"\1"))
    assert client.recv(5.0).arbitration_id == 0x181
    client.send(message(0x201, b"\2"))
    assert select.select([server], [], [], 5.0)[0]
    assert pack(server.recv(0) or message(0)) == pack(message(0x201, b"\2"))
    assert server.recv(0) is None
    assert not server.more


def test_bursts_go_as_through_any_hub(server: LocalCanBus, client: Any) -> None:
    server.start_bursts()
    frames = b"".join(pack(message(0x100 + number)) for number in range(100))
    server.send_burst(frames)
    assert b"".join(pack(client.recv(5.0)) for _ in range(100)) == frames
    client.send_burst(frames)
    assert bytes(server.receive_burst()) == frames[: 64 * 16]
    assert server.more or select.select([server], [], [], 5.0)[0]
    assert bytes(server.receive_burst()) == frames[64 * 16 :]


def test_its_filters_and_own_frames_are_those_of_a_client(path: Path) -> None:
    filters: Any = [{"can_id": 0x181, "can_mask": 0x7FF, "extended": False}]
    with LocalCanBus(str(path), serve=True, receive_own_messages=True, can_filters=filters) as server:
        server.send(message(0x182))
        server.send(message(0x181))
        own = server.recv(0)
        assert own is not None
        assert (own.arbitration_id, own.is_rx) == (0x181, False)
        assert server.recv(0) is None


def test_a_packet_goes_whole_or_in_the_parts_that_a_filter_passes(path: Path) -> None:
    hub = Hub(path, bitrate=0, queue_frames=1, patience_s=0.0)
    sender, whole, part = (InProcessClient() for _ in range(3))
    for client in (sender, whole, part):
        hub.join(client)
        assert hub.take(client, ATTACH)
    assert hub.take(part, pack_filters(((0x100, 0x700),)))
    draw = random.Random(21)
    packets = [
        [pack(message(draw.choice((0x080, 0x181, 0x201)))) for _ in range(n % 6 + 1)] for n in range(99)
    ]
    for packet in packets:
        hub.take(sender, b"".join(packet))
        hub.turn(0.0)
    hub.close()
    frames = [frame for packet in packets for frame in packet]
    assert bytes(whole.inbox) == b"".join(frames)
    assert bytes(part.inbox) == b"".join(frame for frame in frames if frame[1] == 1)
    assert not sender.inbox


def test_frames_that_wait_for_too_long_are_lost_with_a_report(
    server: LocalCanBus, client: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("local_can.served_hub.QUEUE_FRAMES", 2)
    for number in range(5):
        client.send(message(number + 1))
    for _ in range(20):
        server._socket._hub.turn(0.0)  # type: ignore[union-attr]  # the bus goes on, and nobody reads
    assert [received.arbitration_id for _ in range(2) if (received := server.recv(0))] == [1, 2]
    client.send(message(6))
    report = server.recv(5.0)
    assert report is not None
    assert report.is_error_frame
    assert server.lost_frames == 3


def test_the_socket_is_there_as_long_as_the_server_and_for_its_owner(path: Path) -> None:
    server = LocalCanBus(str(path), serve=True)
    assert path.stat().st_mode & 0o777 == 0o600
    server.shutdown()
    assert not path.exists()
    Hub(path, bitrate=0, queue_frames=1, patience_s=0.0).close()


def test_a_place_without_a_folder_is_named() -> None:
    with pytest.raises(can.CanInitializationError, match="no hub can be at /nonexistent/"):
        LocalCanBus("/nonexistent/bus.sock", serve=True)


def test_each_side_tells_the_processes_of_the_other(server: LocalCanBus, client: Any) -> None:
    assert server.peers == client.peers == [os.getpid()]
