"""Health check: is a CANopen node on the bus? `python deploy/node_alive.py INTERFACE:CHANNEL NODE_ID`.

It first only listens, for a node in operation sends by itself. Only a silent node is asked for its device
type, object 1000h, since the SDO channel belongs to the controller.
"""

import sys
import time

from kernels.lean_import import as_if_absent

with as_if_absent("asammdf"):  # python-can's reader of MDF files, which loads pandas and pyarrow
    import can

LISTEN_S = 1.5
ANSWER_S = 1.5
# COB-IDs of the pre-defined connection set that a node sends with: EMCY, TPDO 1 to 4, SDO answer, heartbeat.
SENT_BY_NODE = (0x080, 0x180, 0x280, 0x380, 0x480, 0x580, 0x700)
UPLOAD_DEVICE_TYPE = b"\x40\x00\x10\x00\x00\x00\x00\x00"


def hears(bus: can.BusABC, node_id: int, limit_s: float) -> bool:
    """Whether the node sends anything within `limit_s` seconds."""
    deadline_s = time.monotonic() + limit_s
    while (left_s := deadline_s - time.monotonic()) > 0:
        message = bus.recv(left_s)
        if message is not None and message.arbitration_id - node_id in SENT_BY_NODE:
            return True
    return False


def main(bus_spec: str, node_id: int) -> int:
    """0 if the node is there, 1 if not or if there is no such bus."""
    interface, _, channel = bus_spec.partition(":")
    try:
        with can.Bus(interface=interface, channel=channel) as bus:
            if hears(bus, node_id, LISTEN_S):
                return 0
            bus.send(
                can.Message(arbitration_id=0x600 + node_id, is_extended_id=False, data=UPLOAD_DEVICE_TYPE)
            )
            return 0 if hears(bus, node_id, ANSWER_S) else 1
    except (can.CanError, OSError) as error:
        print(f"{bus_spec}: {error}")
        return 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2])))
