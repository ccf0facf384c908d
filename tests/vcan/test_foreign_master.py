"""`canopen.profiles.p402.BaseNode402`, a CiA 402 master that is not ours, leads the x drive.

It waits by wall clock and often only logs that it waited in vain, so every step is checked by its outcome.
The simulator is in lockstep: a SYNC moves it 10 ms on, and the next one waits for the answer to the last,
so that a slow machine falls behind the wall clock but never behind its master.
"""

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

EDS = Path(__file__).resolve().parents[2] / "eds" / "servo_drive.eds"
SYNC_S = 0.01
COUNTS_PER_MM = 104_857.6
INDEX_COUNTS = round(1.3 * COUNTS_PER_MM)
WAIT_S = 240.0
BOOT_UP = bytes(1)
QUICK_STOP_OPTION, STAY_IN_QUICK_STOP = 0x605A, 6
POSITION, TARGET_POSITION, TARGET_VELOCITY, TARGET_TORQUE = 0x6064, 0x607A, 0x60FF, 0x6071


class Master:
    """The drive through BaseNode402, its RPDOs asynchronous, its TPDO with every SYNC."""

    def __init__(self, network: canopen.Network) -> None:
        self.node = BaseNode402(1, str(EDS))
        network.add_node(self.node)
        self.node.TIMEOUT_SWITCH_OP_MODE = self.node.TIMEOUT_SWITCH_STATE_FINAL = WAIT_S
        self.node.TIMEOUT_SWITCH_STATE_SINGLE = self.node.TIMEOUT_CHECK_TPDO = WAIT_S
        self.node.sdo.RESPONSE_TIMEOUT = WAIT_S
        self.positions: list[int] = []  # after every SYNC
        self.node.nmt.state = "PRE-OPERATIONAL"
        self.node.pdo.read()
        self._map(self.node.rpdo[1], 255, 0x6040, 0x6060, TARGET_POSITION)
        self._map(self.node.rpdo[2], 255, TARGET_VELOCITY, TARGET_TORQUE)
        self._map(self.node.tpdo[1], 1, 0x6041, 0x6061, POSITION)
        self.node.sdo[0x1006].raw = round(SYNC_S * 1e6)
        self.node.setup_402_state_machine()
        self.node.tpdo[1].add_callback(self._on_answer)
        self.node.nmt.state = "OPERATIONAL"
        self._sync = network.sync
        self._answered, self._stopped = threading.Event(), threading.Event()
        self._leader = threading.Thread(target=self._lead)
        self._leader.start()
        self.cycles(2)

    def _lead(self) -> None:
        while not self._stopped.wait(SYNC_S):
            self._answered.clear()
            self._sync.transmit()
            self._answered.wait(WAIT_S)

    def _on_answer(self, pdo: canopen.pdo.PdoMap) -> None:
        self.positions.append(pdo[POSITION].raw)
        self._answered.set()

    def stop(self) -> None:
        """Send no further SYNC."""
        self._stopped.set()
        self._answered.set()
        self._leader.join()

    @staticmethod
    def _map(pdo: canopen.pdo.PdoMap, transmission_type: int, *indices: int) -> None:
        pdo.clear()
        for index in indices:
            pdo.add_variable(index)
        pdo.trans_type = transmission_type
        pdo.enabled = True
        pdo.save()

    @property
    def position(self) -> int:
        return int(self.node.tpdo_values[POSITION])

    def cycles(self, count: int) -> None:
        """Let `count` SYNCs pass, or a few more."""
        goal = len(self.positions) + count
        while len(self.positions) < goal:
            assert self.node.tpdo[1].wait_for_reception(WAIT_S) is not None

    def command(self, index: int, value: int) -> None:
        """Send a set point by its RPDO."""
        self.node.rpdo_pointers[index].raw = value
        self.node.rpdo_pointers[index].pdo_parent.transmit()

    def enter(self, mode: str) -> None:
        """Switch to `mode` with the power on, at rest where the drive is."""
        self.command(TARGET_POSITION, self.position)
        self.command(TARGET_VELOCITY, 0)
        self.command(TARGET_TORQUE, 0)
        self.node.op_mode = mode
        assert self.node.op_mode == mode
        self.node.state = "OPERATION ENABLED"
        self.cycles(2)


@pytest.fixture(scope="module")
def network(bus_spec: str, start_simulator: Callable[[str], object]) -> Iterator[canopen.Network]:
    """A bus with the X-Y table on it."""
    start_simulator(bus_spec)
    interface, _, channel = bus_spec.partition(":")
    with canopen.Network() as network:
        network.connect(interface=interface, channel=channel)
        yield network


@pytest.fixture
def master(network: canopen.Network) -> Iterator[Master]:
    """Of a drive that was reset: it has its defaults, and no power."""
    leader = Master(network)
    yield leader
    leader.stop()
    reset(leader.node)
    del network[leader.node.id]


def reset(node: canopen.RemoteNode) -> None:
    """Reset the node, until it has booted. canopen's own wait misses a boot-up that came before it."""
    booted = threading.Event()

    def on_heartbeat(_identifier: int, data: bytearray, _timestamp: float) -> None:
        if data == BOOT_UP:
            booted.set()

    node.network.subscribe(0x700 + node.id, on_heartbeat)
    node.nmt.state = "RESET"
    assert booted.wait(WAIT_S)
    node.network.unsubscribe(0x700 + node.id, on_heartbeat)


def test_it_walks_the_drive_through_its_states(master: Master) -> None:
    node = master.node
    node.sdo[QUICK_STOP_OPTION].raw = STAY_IN_QUICK_STOP
    assert node.state == "SWITCH ON DISABLED"
    for state in (
        "READY TO SWITCH ON",
        "SWITCHED ON",
        "OPERATION ENABLED",
        "SWITCHED ON",
        "READY TO SWITCH ON",
        "OPERATION ENABLED",
        "QUICK STOP ACTIVE",
        "OPERATION ENABLED",
        "SWITCH ON DISABLED",
    ):
        node.state = state
        assert node.state == state


def test_it_brings_the_drive_back_from_a_fault(master: Master) -> None:
    master.enter("CYCLIC SYNCHRONOUS POSITION")
    master.command(TARGET_POSITION, master.position + round(50 * COUNTS_PER_MM))  # a jump no table can follow
    master.cycles(50)
    assert master.node.state == "FAULT"
    assert master.node.sdo[0x603F].raw == 0x8611
    master.command(TARGET_POSITION, master.position)
    master.node.reset_from_fault()
    assert master.node.state == "OPERATION ENABLED"


def test_it_homes_on_the_index_pulse(master: Master) -> None:
    node = master.node
    node.sdo[0x6098].raw = 34
    assert node.homing(timeout=WAIT_S)
    # It stops behind the index, which is now zero: power-up was 1.3 mm before it.
    assert 0 <= master.position < INDEX_COUNTS
    node.state = "READY TO SWITCH ON"
    node.sdo[0x6098].raw = 37
    node.op_mode = "NO MODE"
    assert node.homing(timeout=WAIT_S)
    assert abs(master.position) < 0.01 * COUNTS_PER_MM


def test_it_moves_in_profile_position_mode(master: Master) -> None:
    node = master.node
    node.sdo[0x6081].raw = round(20 * COUNTS_PER_MM)
    master.enter("PROFILED POSITION")
    target = master.position + round(3 * COUNTS_PER_MM)
    master.command(TARGET_POSITION, target)
    node.controlword = 0x3F  # new set point, change at once
    master.cycles(3)
    assert node.statusword & 1 << 12  # set point acknowledged
    assert not node.statusword & 1 << 10
    node.controlword = 0x0F
    master.cycles(60)
    assert node.statusword & 1 << 10  # target reached
    assert abs(master.position - target) < 0.01 * COUNTS_PER_MM


def test_it_streams_positions(master: Master) -> None:
    master.enter("CYCLIC SYNCHRONOUS POSITION")
    target = master.position
    for _ in range(50):
        target += round(0.05 * COUNTS_PER_MM)  # 5 mm/s
        master.command(TARGET_POSITION, target)
        master.cycles(1)
    master.cycles(50)
    assert abs(master.position - target) < 0.01 * COUNTS_PER_MM
    assert master.node.state == "OPERATION ENABLED"


def test_it_streams_a_velocity(master: Master) -> None:
    master.enter("CYCLIC SYNCHRONOUS VELOCITY")
    master.command(TARGET_VELOCITY, round(5 * COUNTS_PER_MM))
    master.cycles(70)
    steady = master.positions[-50:]
    assert steady[-1] - steady[0] == pytest.approx(5 * 49 * SYNC_S * COUNTS_PER_MM, rel=0.01)
    master.command(TARGET_VELOCITY, 0)
    master.cycles(30)
    rest = master.position
    master.cycles(10)
    assert abs(master.position - rest) < 0.001 * COUNTS_PER_MM


def test_it_streams_a_torque(master: Master) -> None:
    master.enter("CYCLIC SYNCHRONOUS TORQUE")
    start = master.position
    # 30 % of 0.64 Nm on a 10 mm screw is 120 N: more than friction holds.
    master.command(TARGET_TORQUE, 300)
    master.cycles(10)
    master.command(TARGET_TORQUE, 0)
    master.cycles(1)
    assert master.position - start > 0.1 * COUNTS_PER_MM
    master.node.state = "SWITCH ON DISABLED"
    assert master.node.state == "SWITCH ON DISABLED"
