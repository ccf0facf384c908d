"""The python-can side: frames, filters, waiting, errors."""

import asyncio
import contextlib
import errno
import select
import signal
import socket
import threading
from pathlib import Path
from typing import Any

import can
import pytest
from bus_messages import Attach
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

IDENTIFIERS = (0x000, 0x080, 0x181, 0x1FF, 0x7FF)


@st.composite
def messages(draw: st.DrawFn) -> can.Message:
    extended = draw(st.booleans())
    remote = draw(st.booleans())
    identifier = draw(st.sampled_from(IDENTIFIERS) | st.integers(0, 0x1FFFFFFF if extended else 0x7FF))
    if remote:
        length = draw(st.integers(0, 8))
        return can.Message(
            arbitration_id=identifier, is_extended_id=extended, is_remote_frame=True, dlc=length, check=True
        )
    data = draw(st.binary(max_size=8))
    return can.Message(arbitration_id=identifier, is_extended_id=extended, data=data, check=True)


@given(message=messages())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_a_frame_arrives_as_it_was_sent(pair: tuple[Any, Any], message: can.Message) -> None:
    sender, receiver = pair
    sender.send(message)
    received = receiver.recv(5.0)
    assert received is not None
    assert received.equals(message, timestamp_delta=None, check_channel=False)


@pytest.fixture
def pair(hub: Any, attach: Attach) -> tuple[Any, Any]:
    return attach(hub), attach(hub)


def test_the_received_message_has_every_attribute(pair: tuple[Any, Any]) -> None:
    pair[0].send(can.Message(arbitration_id=0x181, is_extended_id=False, data=[1, 2]))
    received = pair[1].recv(5.0)
    assert received is not None
    assert "181" in str(received)
    assert received.timestamp > 0.0
    assert received.channel == pair[1].channel


def test_a_sender_receives_its_own_frames_only_on_request(hub: Any, attach: Attach) -> None:
    plain, curious = attach(hub), attach(hub, receive_own_messages=True)
    curious.send(can.Message(arbitration_id=0x10))
    own = curious.recv(5.0)  # before the other sends: whose frame the hub sees first is nobody's promise
    plain.send(can.Message(arbitration_id=0x20))
    other = curious.recv(5.0)
    assert own is not None
    assert other is not None
    assert (own.arbitration_id, own.is_rx) == (0x10, False)
    assert (other.arbitration_id, other.is_rx) == (0x20, True)
    received = plain.recv(5.0)
    assert received is not None
    assert (received.arbitration_id, received.is_rx) == (0x10, True)
    assert plain.recv(0) is None


def test_filters_keep_what_matches(hub: Any, attach: Attach) -> None:
    sender = attach(hub)
    receiver = attach(hub, can_filters=[{"can_id": 0x180, "can_mask": 0x780, "extended": False}])
    for identifier in (0x080, 0x181, 0x281, 0x182):
        sender.send(can.Message(arbitration_id=identifier, is_extended_id=False))
    sender.send(can.Message(arbitration_id=0x181, is_extended_id=True))
    sender.send(can.Message(arbitration_id=0x1FF, is_extended_id=False))
    identifiers = [message.arbitration_id for message in iter(lambda: receiver.recv(0.5), None)]
    assert identifiers == [0x181, 0x182, 0x1FF]


MASKS = (0, 1, 0x700, 0x7FF, 0x800, 0x1FFF_FFFF, 0xFFFF_FFFF, 1 << 31)


@st.composite
def can_filters(draw: st.DrawFn) -> list[dict[str, Any]]:
    made = {
        "can_id": st.sampled_from(IDENTIFIERS) | st.integers(0, 0xFFFF_FFFF),
        "can_mask": st.sampled_from(MASKS) | st.integers(0, 0xFFFF_FFFF),
    }
    return draw(st.lists(st.fixed_dictionaries(made, optional={"extended": st.booleans()}), max_size=4))


MARKER = can.Message(arbitration_id=0x040, is_error_frame=True, is_extended_id=False)
"""An error frame: no filter stops it."""


def receives_by(filters: list[dict[str, Any]], sent: list[can.Message], pair: tuple[Any, Any]) -> None:
    """The receiver gets what python-can's own filters let pass of what is sent from now on."""
    sender, receiver = pair
    receiver.set_filters(filters)
    receiver.send(MARKER)  # behind the filters: when it comes, the hub has them
    assert sender.recv(10.0).is_error_frame
    for message in (*sent, MARKER):
        sender.send(message)
    for message in filter(receiver._matches_filters, sent):
        assert receiver.recv(10.0).equals(message, timestamp_delta=None, check_channel=False)
    assert receiver.recv(10.0).is_error_frame


@given(filters=can_filters(), sent=st.lists(messages(), max_size=12))
@example(filters=[{"can_id": 1 << 31, "can_mask": 1 << 31}], sent=[can.Message(arbitration_id=0x80)])
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_the_hub_filters_as_python_can_does(
    pair: tuple[Any, Any], filters: list[dict[str, Any]], sent: list[can.Message]
) -> None:
    receives_by(filters, sent, pair)


@pytest.mark.parametrize("count", [512, 513])
def test_more_filters_than_the_hub_takes_filter_all_the_same(pair: tuple[Any, Any], count: int) -> None:
    filters = [{"can_id": 2 * number, "can_mask": 0x7FF, "extended": False} for number in range(count)]
    sent = [can.Message(arbitration_id=number, is_extended_id=False) for number in range(0, 0x800, 37)]
    receives_by(filters, sent, pair)


def test_a_filter_stops_own_frames_too(hub: Any, attach: Attach) -> None:
    filters = [{"can_id": 0x10, "can_mask": 0x7FF, "extended": False}]
    curious = attach(hub, receive_own_messages=True, can_filters=filters)
    for identifier in (0x20, 0x10):
        curious.send(can.Message(arbitration_id=identifier, is_extended_id=False))
    assert curious.recv(5.0).arbitration_id == 0x10


def test_recv_gives_up_after_its_timeout(pair: tuple[Any, Any]) -> None:
    assert pair[0].recv(0) is None
    assert pair[0].recv(0.01) is None


def test_readiness_is_seen_by_file_descriptor(pair: tuple[Any, Any]) -> None:
    pair[0].send(can.Message(arbitration_id=1))
    assert select.select([pair[1].fileno()], [], [], 5.0)[0]


async def test_python_cans_notifier_on_asyncio_gets_every_frame(pair: tuple[Any, Any]) -> None:
    reader = can.AsyncBufferedReader()
    notifier = can.Notifier(pair[1], [reader], loop=asyncio.get_running_loop())
    for identifier in range(20):
        pair[0].send(can.Message(arbitration_id=identifier))
    received = [await asyncio.wait_for(reader.get_message(), 5.0) for _ in range(20)]
    notifier.stop()
    assert [message.arbitration_id for message in received] == list(range(20))


def test_without_a_hub_the_error_advises_how_to_start_one(tmp_path: Path) -> None:
    path = tmp_path / "nobody.sock"
    with pytest.raises(can.CanInitializationError, match=rf"no hub at {path}.*python -m local_can {path}"):
        can.Bus(interface="localcan", channel=str(path))


def test_a_hub_that_does_not_answer_is_an_error(hub: Any, attach: Attach) -> None:
    hub.signal(signal.SIGSTOP)
    with pytest.raises(can.CanInitializationError, match="does not answer within"):
        attach(hub, attach_timeout_s=0.05)


def test_a_client_waits_while_others_wait_to_be_let_in(hub: Any, attach: Attach) -> None:
    """The kernel refuses at once when so many are waiting."""
    hub.signal(signal.SIGSTOP)
    with contextlib.ExitStack() as stack:
        refused = 0
        while not refused:
            waiting = stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET))
            waiting.setblocking(False)
            refused = waiting.connect_ex(str(hub.path))
        assert refused == errno.EAGAIN
        timer = threading.Timer(0.1, hub.signal, (signal.SIGCONT,))
        timer.start()
        attach(hub, attach_timeout_s=60.0)
        timer.join()


def test_can_fd_is_refused(hub: Any, attach: Attach) -> None:
    with pytest.raises(can.CanInitializationError, match="classic CAN"):
        attach(hub, fd=True)
    with pytest.raises(can.CanOperationError, match="classic CAN"):
        attach(hub).send(can.Message(arbitration_id=1, is_fd=True, data=bytes(12)))


@pytest.mark.parametrize(("identifier", "extended"), [(0x800, False), (0x2000_0000, True)])
def test_an_identifier_that_is_too_great_is_refused(
    hub: Any, attach: Attach, identifier: int, extended: bool
) -> None:
    message = can.Message(arbitration_id=identifier, is_extended_id=extended)
    with pytest.raises(can.CanOperationError, match="too great"):
        attach(hub).send(message)


def test_send_gives_up_when_the_bus_takes_nothing(hub: Any, attach: Attach) -> None:
    bus = attach(hub)
    hub.signal(signal.SIGSTOP)

    def fill() -> None:
        for _ in range(100_000):
            bus.send(can.Message(arbitration_id=1), timeout=0.02)

    with pytest.raises(can.CanOperationError, match=r"took no frame from this client for 0\.02 s"):
        fill()


def test_a_hub_that_goes_is_noticed(hub: Any, attach: Attach) -> None:
    bus = attach(hub)
    hub.stop()
    with pytest.raises(can.CanOperationError, match="has ended"):
        bus.recv(5.0)
    with pytest.raises(can.CanOperationError, match="has ended"):
        bus.send(can.Message(arbitration_id=1))
