"""Frames of a socket in batches, on a socket pair that keeps messages apart as SocketCAN does."""

import errno
import socket
from collections.abc import Iterator

import pytest

from can_frames.frame import FRAME_BYTES, pack_frame
from can_frames.message_batch import MOST_FRAMES, BatchSocket


@pytest.fixture
def pair() -> Iterator[tuple[socket.socket, socket.socket]]:
    near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    with near, far:
        yield near, far


def frames(count: int) -> list[bytes]:
    return [pack_frame(0x100 + number, bytes((number,))) for number in range(count)]


def test_waiting_frames_come_in_one_call_and_no_more_than_fit(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    near, far = pair
    batch = BatchSocket(near)
    assert batch.receive() == b""
    sent = frames(MOST_FRAMES + 3)
    for frame in sent:
        far.send(frame)
    assert batch.receive() == b"".join(sent[:MOST_FRAMES])
    assert batch.receive() == b"".join(sent[MOST_FRAMES:])
    assert batch.receive() == b""


@pytest.mark.parametrize("count", [1, 2, 7, MOST_FRAMES])
def test_each_frame_of_a_burst_is_a_message(pair: tuple[socket.socket, socket.socket], count: int) -> None:
    near, far = pair
    sent = frames(count)
    assert BatchSocket(near).send(b"".join(sent)) == count
    assert [far.recv(FRAME_BYTES + 1) for _ in sent] == sent


def test_as_many_go_as_there_is_room_for_and_then_the_error_of_a_full_queue(
    pair: tuple[socket.socket, socket.socket],
) -> None:
    near, far = pair
    batch, sent, left = BatchSocket(near), 0, b"".join(frames(MOST_FRAMES))
    while count := batch.send(left):
        sent += count
        if count < MOST_FRAMES:
            break
    with pytest.raises(BlockingIOError) as caught:
        batch.send(left)
    assert caught.value.errno == errno.EAGAIN
    assert 0 < len([far.recv(FRAME_BYTES) for _ in range(sent)]) == sent
    assert batch.send(left) == MOST_FRAMES


@pytest.fixture
def narrow() -> Iterator[tuple[socket.socket, socket.socket]]:
    """A socket that drops what its queue has no room for, as SocketCAN does, and its sender."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as near,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as far,
    ):
        near.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1)  # the kernel's least
        near.bind(("127.0.0.1", 0))
        far.connect(near.getsockname())
        yield near, far


def received(batch: BatchSocket) -> tuple[int, int]:
    """Frames received, and frames reported as lost."""
    count = lost = 0
    while burst := batch.receive():
        count += len(burst) // FRAME_BYTES
        lost += batch.lost
    return count, lost


def test_frames_that_the_queue_has_no_room_for_are_counted_once(
    narrow: tuple[socket.socket, socket.socket],
) -> None:
    near, far = narrow
    batch = BatchSocket(near)
    far.send(pack_frame(0x181, b""))
    assert received(batch) == (1, 0)
    for frame in frames(40):
        far.send(frame)
    kept, lost = received(batch)
    assert 0 < kept < 40
    assert lost == 0  # nothing has come since: the kernel tells it with the next frame
    far.send(pack_frame(0x181, b""))
    assert received(batch) == (1, 40 - kept)
    far.send(pack_frame(0x181, b""))
    assert received(batch) == (1, 0)
