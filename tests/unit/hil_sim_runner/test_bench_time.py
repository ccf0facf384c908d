"""Time of the bench: lockstep by SYNC, real time by the clock; same frames, same bits."""

import hashlib
from pathlib import Path

import canopen
import numpy as np
import pytest
from in_process_nodes import DRIVE, IDEAL_AXIS, SCALE, InProcessNodes, SdoDrive, counts, pack

from hil_sim.config import load_plant
from hil_sim.drive.mode import ModeCode
from hil_sim.runner.bench import SimulatedMachine
from hil_sim.runner.pacing import RealTime

MACHINES = Path(__file__).parents[3] / "machines"


def test_a_sync_advances_by_object_1006() -> None:
    nodes = InProcessNodes()
    nodes.sync(3)
    assert nodes.bench.clock.now_us == 3000
    nodes.remote(SCALE).sdo[0x1006].raw = 250
    nodes.sync(2)
    assert nodes.bench.clock.now_us == 3500
    assert nodes.bench.plant.state["time_s"][0] == pytest.approx(3500e-6)


@pytest.mark.parametrize("period_us", [30, 1010, 200_000])
def test_impossible_cycle_periods_are_refused(period_us: int) -> None:
    nodes = InProcessNodes()
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        nodes.remote(DRIVE).sdo[0x1006].raw = period_us
    assert refusal.value.code == 0x06090030


def test_cycle_period_zero_keeps_the_last_one() -> None:
    nodes = InProcessNodes()
    nodes.remote(DRIVE).sdo[0x1006].raw = 0
    nodes.sync()
    assert nodes.bench.clock.now_us == 1000


def positions_at_each_sync(drive_tick_ms: int) -> list[int]:
    """Move a drive in cyclic synchronous position mode there and back at cycles of 100 ms."""
    drive = SdoDrive(InProcessNodes(drive_tick_ms=drive_tick_ms))
    drive.enable(ModeCode.CYCLIC_POSITION)
    drive.set(0x1006, 100_000)
    found = []
    for target_mm in (1.0, 3.0, 4.0, 4.0, 2.0, 2.0):
        drive.set(0x607A, counts(target_mm))
        drive.nodes.sync()
        found.append(drive.get(0x6064))
    return found


def test_a_slower_drive_task_follows_the_same_path() -> None:
    often = positions_at_each_sync(1)
    assert abs(often[-1] - counts(2.0)) < counts(0.01)
    np.testing.assert_allclose(positions_at_each_sync(20), often, rtol=0.0, atol=counts(0.005))


def run_of_frames() -> str:
    """Return a digest of all frames of the nodes in a run with motion."""
    nodes = InProcessNodes(MACHINES / "xy_table")
    digest = hashlib.sha256()
    for node_id in (1, 2):
        node = nodes.remote(node_id)
        node.sdo[0x1017].raw = 7
        node.tpdo.read()
        node.rpdo.read()
        node.tpdo[1].clear()
        for index in (0x6041, 0x6064, 0x6078):
            node.tpdo[1].add_variable(index)
        node.rpdo[1].clear()
        for index in (0x6040, 0x6060, 0x6071):
            node.rpdo[1].add_variable(index)
        for pdo in (node.tpdo[1], node.rpdo[1]):
            pdo.trans_type = 1
            pdo.enabled = True
            pdo.save()
    nodes.operational()
    for k in range(500):
        word = (0x06, 0x07, 0x0F)[min(k, 2)]
        torque = (k * 37) % 400 - 100
        for node_id in (1, 2):
            nodes.put(0x200 + node_id, pack("Hbh", word, 10, torque))
        nodes.sync()
    for can_id, data in nodes.frames:
        digest.update(can_id.to_bytes(2, "little") + data)
    return digest.hexdigest()


def test_the_same_frames_give_the_same_bits() -> None:
    assert run_of_frames() == run_of_frames()


def test_tpdos_come_in_the_order_of_node_ids() -> None:
    nodes = InProcessNodes(MACHINES / "xy_table")
    for node_id in (1, 2, 11, 12):
        nodes.remote(node_id).sdo[0x1800][2].raw = 1
    nodes.operational()
    nodes.frames.clear()
    nodes.sync()
    assert [can_id for can_id, _ in nodes.frames] == [0x181, 0x182, 0x18B, 0x18C]


class Wall:
    """A clock that the test advances."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def realtime_bench() -> tuple[SimulatedMachine, RealTime, Wall, list[tuple[int, bytes]]]:
    frames: list[tuple[int, bytes]] = []
    bench = SimulatedMachine(load_plant(IDEAL_AXIS), lambda can_id, data: frames.append((can_id, data)))
    wall = Wall()
    pacing = RealTime(bench, wall)
    bench.start()
    return bench, pacing, wall, frames


def test_in_real_time_the_plant_follows_the_clock() -> None:
    bench, _, wall, _ = realtime_bench()
    for step_s in (0.001, 0.00102, 0.00498):
        wall.now_s += step_s
        bench.handle(0x80, b"")
        assert bench.clock.now_us == pytest.approx((wall.now_s - 100.0) * 1e6, abs=50.1)
        assert bench.clock.now_us <= (wall.now_s - 100.0) * 1e6 + 1e-3


def test_in_real_time_a_quiet_bus_still_gets_heartbeats() -> None:
    bench, pacing, wall, frames = realtime_bench()
    bench.slaves[0].dictionary.set_data(0x1017, 0, pack("H", 50))
    frames.clear()
    for _ in range(50):
        wall.now_s += 0.01
        pacing.on_quiet()
    assert [can_id for can_id, _ in frames].count(0x701) == 10


def test_in_real_time_asynchronous_rpdos_alone_keep_the_timers_going() -> None:
    bench, pacing, wall, frames = realtime_bench()
    bench.slaves[0].dictionary.set_data(0x1017, 0, pack("H", 50))
    bench.handle(0x000, bytes((1, 0)))
    frames.clear()
    for millisecond in range(500):
        wall.now_s += 0.001
        bench.handle(0x201, pack("H", 6))
        if millisecond % 10 == 9:
            pacing.on_quiet()
    assert [can_id for can_id, _ in frames].count(0x701) == 10


def test_in_real_time_a_heartbeat_counts_from_its_own_moment() -> None:
    bench, pacing, wall, frames = realtime_bench()
    bench.slaves[0].dictionary.set_data(0x1016, 1, pack("I", 127 << 16 | 20))
    wall.now_s += 0.009  # no SYNC in between
    bench.handle(0x77F, b"\x05")
    frames.clear()
    wall.now_s += 0.0195
    pacing.on_quiet()
    assert 0x081 not in [can_id for can_id, _ in frames]
    wall.now_s += 0.006
    pacing.on_quiet()
    assert 0x081 in [can_id for can_id, _ in frames]


def test_after_a_suspend_the_lost_time_is_not_simulated() -> None:
    bench, pacing, wall, _ = realtime_bench()
    wall.now_s += 3600.0
    pacing.on_quiet()
    assert bench.clock.now_us == pytest.approx(500_000, abs=51)


def test_asynchronous_rpdo_acts_at_its_moment_in_real_time() -> None:
    """The torque begins 4 ms after the last frame; 6 ms later the axis has v = a * 6 ms."""
    bench, _, wall, _ = realtime_bench()
    drive = bench.devices[0]
    bench.handle(0x000, b"\x01\x00")
    for word in (0x06, 0x07):
        bench.handle(0x201, pack("H", word))
    drive.objects.modes_of_operation = 10
    drive.objects.target_torque = 500
    wall.now_s += 0.004
    bench.handle(0x201, pack("H", 0x0F))
    assert bench.clock.now_us == pytest.approx(4000, abs=51)
    wall.now_s += 0.006
    bench.handle(0x80, b"")
    force_n = 0.5 * 0.64 * 2 * 3.141592653589793 / 0.01
    mass_kg = 40.0 + 0.6e-4 * (2 * 3.141592653589793 / 0.01) ** 2
    assert bench.plant.state["motor_velocity_m_s"][0] == pytest.approx(force_n / mass_kg * 0.006, rel=0.01)


def test_lockstep_and_real_time_agree_when_the_clock_is_exact() -> None:
    nodes = InProcessNodes()
    drive = SdoDrive(nodes)
    drive.set(0x60FF, counts(30))
    drive.enable(3)
    nodes.sync(100)
    bench, _, wall, _ = realtime_bench()
    objects = bench.devices[0].objects
    objects.target_velocity, objects.modes_of_operation = counts(30), 3
    for word in (0x06, 0x07, 0x0F):
        objects.controlword = word
        bench.devices[0].process()
    for k in range(1, 101):
        wall.now_s = 100.0 + k * 0.001 + 1e-9
        bench.handle(0x80, b"")
    mine = nodes.bench.plant.state["motor_position_m"][0]
    assert bench.plant.state["motor_position_m"][0] == mine
