"""vcan0 exists and carries frames, for the project's tools and for can-utils."""

import shutil
import subprocess

import can
import pytest

pytestmark = pytest.mark.vcan


def test_a_frame_crosses_vcan0() -> None:
    with (
        can.Bus(interface="socketcan", channel="vcan0") as sender,
        can.Bus(interface="socketcan", channel="vcan0") as receiver,
    ):
        sender.send(can.Message(arbitration_id=0x181, is_extended_id=False, data=b"\x01\x02\x03"))
        received = receiver.recv(10.0)
    assert received is not None
    assert (received.arbitration_id, bytes(received.data)) == (0x181, b"\x01\x02\x03")


@pytest.mark.skipif(shutil.which("candump") is None, reason="candump (can-utils) is missing")
def test_candump_sees_the_frame() -> None:
    with (
        subprocess.Popen(
            ["candump", "-n", "1", "-T", "20000", "-L", "vcan0"], stdout=subprocess.PIPE, text=True
        ) as dump,
        can.Bus(interface="socketcan", channel="vcan0") as sender,
    ):
        # candump says nothing when it is ready, so send until it has had its one frame.
        while dump.poll() is None:
            sender.send(can.Message(arbitration_id=0x701, is_extended_id=False, data=b"\x05"))
        assert dump.stdout is not None
        assert "vcan0 701#05" in dump.stdout.read()
