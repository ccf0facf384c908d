"""The daemon's cyclic exchange written the stock way: canopen's PDO objects and a Notifier thread.

It stands beside our cycle in the benchmark as the thing to beat. It does less than we do: no control law,
no plant, no recording; only SYNC, four TPDOs with their values read, two RPDOs with their values set.
Run as `python stock_canopen.py devices|controller SOCKET [CYCLES]`.
"""

import sys
import threading
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import canopen

EDS = Path(__file__).parents[3] / "eds"
DRIVES, SCALES = (1, 2), (11, 12)
RPDO = ("Controlword", "Modes of operation", "Target torque", "Torque offset")
DRIVE_TPDO = ("Statusword", "Position actual value", "Current actual value")
SCALE_TPDO = ("Position value",)
PEER_TIMEOUT_S = 5.0


def map_pdo(pdo: Any, cob_id: int, names: Iterable[str]) -> None:
    """Give a canopen PDO map its variables, enabled and listening."""
    pdo.clear()
    for name in names:
        pdo.add_variable(name)
    pdo.cob_id, pdo.enabled = cob_id, True


def connect(socket: str) -> canopen.Network:
    network = canopen.Network()
    network.connect(interface="localcan", channel=socket)
    return network


def serve_devices(socket: str) -> None:
    """Answer every SYNC with the TPDOs of two drives and two scales, until the controller sends NMT stop."""
    network = connect(socket)
    drives, scales = [], []
    for node_id in DRIVES:
        node = canopen.LocalNode(node_id, str(EDS / "servo_drive.eds"))
        network.add_node(node)
        map_pdo(node.rpdo[1], 0x200 + node_id, RPDO)
        node.rpdo[1].subscribe()
        map_pdo(node.tpdo[1], 0x180 + node_id, DRIVE_TPDO)
        drives.append(node)
    for node_id in SCALES:
        node = canopen.LocalNode(node_id, str(EDS / "linear_scale.eds"))
        network.add_node(node)
        map_pdo(node.tpdo[1], 0x180 + node_id, SCALE_TPDO)
        scales.append(node)
    stopped = threading.Event()
    network.subscribe(0, lambda *_: stopped.set())

    def on_sync(_can_id: int, _data: bytearray, _timestamp: float) -> None:
        for node in drives:
            torque = sum(variable.raw for variable in node.rpdo[1].map)
            node.tpdo[1]["Statusword"].raw = 0x1237
            node.tpdo[1]["Position actual value"].raw = torque
            node.tpdo[1]["Current actual value"].raw = 0
            node.tpdo[1].transmit()
        for node in scales:
            node.tpdo[1]["Position value"].raw = 1000
            node.tpdo[1].transmit()

    network.subscribe(0x80, on_sync)
    print("ready", flush=True)
    stopped.wait(600.0)
    network.disconnect()


def run_controller(socket: str, cycles: int) -> None:
    """Do `cycles` exchanges in lockstep and print how many a second."""
    network = connect(socket)
    inputs = threading.Semaphore(0)
    drives, inputs_of = [], []
    for node_id in (*DRIVES, *SCALES):
        drive = node_id in DRIVES
        eds = EDS / ("servo_drive.eds" if drive else "linear_scale.eds")
        node = canopen.RemoteNode(node_id, str(eds))
        network.add_node(node)
        map_pdo(node.tpdo[1], 0x180 + node_id, DRIVE_TPDO if drive else SCALE_TPDO)
        node.tpdo[1].subscribe()
        node.tpdo[1].add_callback(lambda _message: inputs.release())
        inputs_of.append(node.tpdo[1])
        if drive:
            map_pdo(node.rpdo[1], 0x200 + node_id, RPDO)
            drives.append(node.rpdo[1])
    start_s = time.perf_counter()
    for _ in range(cycles):
        network.sync.transmit()
        for _ in inputs_of:
            if not inputs.acquire(timeout=PEER_TIMEOUT_S):
                sys.exit("no answer to SYNC")
        position = sum(variable.raw for pdo in inputs_of for variable in pdo.map)
        for pdo in drives:
            pdo["Controlword"].raw = 0x0F
            pdo["Modes of operation"].raw = 10
            pdo["Target torque"].raw = position % 100
            pdo["Torque offset"].raw = 0
            pdo.transmit()
    elapsed_s = time.perf_counter() - start_s
    network.send_message(0, [2, 0])
    network.disconnect()
    print(cycles / elapsed_s, flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "devices":
        serve_devices(sys.argv[2])
    else:
        run_controller(sys.argv[2], int(sys.argv[3]))
