"""The seven frames of a cycle with nothing around them: two processes, bare sockets, ready-made bytes.

No CAN message objects, no callbacks, no values: what the hub lets through, so an upper bound for everybody.
Run as `python bare_exchange.py devices|controller SOCKET [CYCLES]`, like `stock_canopen.py`.
"""

import socket
import sys
import time

from local_can import wire

DRIVE_TPDO, SCALE_TPDO, RPDO = bytes(8), bytes(4), bytes(7)
TPDOS = ((0x181, DRIVE_TPDO), (0x182, DRIVE_TPDO), (0x18B, SCALE_TPDO), (0x18C, SCALE_TPDO))
RPDOS = ((0x201, RPDO), (0x202, RPDO))
PEER_TIMEOUT_S = 5.0


def frame(can_id: int, payload: bytes) -> bytes:
    """A frame as the hub takes it."""
    return wire.FRAME.pack(can_id, len(payload), 0, payload)


SYNC, NMT_STOP = frame(0x80, b""), frame(0x000, b"\2\0")


def connect(path: str) -> socket.socket:
    """A client of the hub."""
    client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    client.settimeout(PEER_TIMEOUT_S)
    client.connect(path)
    client.send(wire.ATTACH)
    if client.recv(1) != wire.ATTACHED:
        sys.exit("the hub does not answer")
    client.settimeout(None)  # a timeout would cost a poll at every call
    return client


def serve_devices(path: str) -> None:
    """Answer every SYNC with four frames, until the controller sends NMT stop."""
    client = connect(path)
    answers = [frame(can_id, payload) for can_id, payload in TPDOS]
    print("ready", flush=True)
    while (received := client.recv(wire.FRAME_BYTES)) and received != NMT_STOP:
        if received == SYNC:
            for answer in answers:
                client.send(answer)


def run_controller(path: str, cycles: int) -> None:
    """Do `cycles` exchanges and print how many a second."""
    client = connect(path)
    setpoints = [frame(can_id, payload) for can_id, payload in RPDOS]
    start_s = time.perf_counter()
    for _ in range(cycles):
        client.send(SYNC)
        for _ in TPDOS:
            client.recv(wire.FRAME_BYTES)
        for setpoint in setpoints:
            client.send(setpoint)
    elapsed_s = time.perf_counter() - start_s
    client.send(NMT_STOP)
    client.close()
    print(cycles / elapsed_s, flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "devices":
        serve_devices(sys.argv[2])
    else:
        run_controller(sys.argv[2], int(sys.argv[3]))
