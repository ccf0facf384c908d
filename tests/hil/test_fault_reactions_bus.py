"""Fault policy in lockstep: lost nodes and faults of the bus."""

import numpy as np
import pytest
from fault_bench import BRAKE, FaultBench
from fault_reaction import FAULT_CYCLE, FAULT_TIME_S, LAST_CYCLE, XY_TABLE, X, assert_reaction_in_time

from hil_sim.node.nmt import NEVER_US
from servo_ctrl.axis.fault_bounds import BOUND_CYCLES, detection_cycles, drive_alone_cycles
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.io.error_frames import BusNews

# --- nodes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", ["", ",scale=1"])
def test_node_that_dies_stops_the_other_axis(which: str) -> None:
    bench = FaultBench(XY_TABLE, f"node_death:y@{FAULT_TIME_S}{which}").run(LAST_CYCLE)
    seen = bench.noted(Event.LOST_TPDO)
    assert 0 <= seen - FAULT_CYCLE <= detection_cycles(bench.config, lockstep=True)[Event.LOST_TPDO]
    assert bench.reacted(X, BRAKE) - seen <= BOUND_CYCLES[Event.LOST_TPDO]
    assert bench.at_rest(0)
    assert bench.emcy() == [0x8250]


def test_drive_that_recovers_from_bus_off_sends_an_emergency_and_stays_stopped() -> None:
    bench = FaultBench(XY_TABLE, f"mute_node:y@{FAULT_TIME_S},duration_s=0.02").run(LAST_CYCLE)
    assert bench.noted(Event.LOST_TPDO) - FAULT_CYCLE <= 2
    assert any("EMCY 8140h, recovered from bus off" in text for text in bench.machine.events.kept)
    assert bench.at_rest(0)
    assert bench.at_rest(1)


def test_controller_that_dies_is_missed_by_the_drives_which_brake_by_themselves() -> None:
    """SYNCs continue, as from another producer: the controller's heartbeat is missing."""
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    braking = drive_alone_cycles(bench.config) + 60
    assert not bench.at_rest(0)
    died_m = list(bench.truth_m[-1])
    positions = []
    for _ in range(braking):
        bench.nodes.handle(0x080, b"")
        positions.append(bench.nodes.plant.state["table_position_m"].tolist())
    assert np.ptp(np.array(positions)[-20:], axis=0).max() < 20e-6
    ramp_m = 0.05**2 / (2.0 * 2.0)  # v^2 / 2a, of either axis no more
    coasted_m = 0.05 * drive_alone_cycles(bench.config) * 1e-3
    assert np.abs(np.array(positions[-1]) - died_m).max() < coasted_m + ramp_m + 2e-3
    states = {int(drive.objects.statusword) & 0x6F for drive in bench.nodes._drives.drives}
    assert 0x27 not in states


def test_node_without_heartbeats_is_detected_in_time() -> None:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    bench.nodes.slaves[0].nmt.due_us = NEVER_US
    bench.run(LAST_CYCLE)
    assert_reaction_in_time(bench, Event.LOST_HEARTBEAT, since=FAULT_CYCLE)
    assert bench.emcy() == [0x8130]


# --- the bus ------------------------------------------------------------------------------------------


def tpdo_of(bench: FaultBench, node: int) -> bytes:
    """Return the payload of a node's TPDO with its present values."""
    slave = next(slave for slave in bench.nodes.slaves if slave.node_id == node)
    return slave.pdos.synchronous[0].sample()


def injected(can_id: int, payload: bytes) -> tuple[FaultBench, int]:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    cycle = bench.inject(can_id, payload)
    return bench.run(LAST_CYCLE), cycle


@pytest.mark.parametrize("size", [0, 3, 7])
def test_pdo_of_another_length_makes_the_drives_brake(size: int) -> None:
    bench, cycle = injected(0x181, bytes(size))
    assert_reaction_in_time(bench, Event.WRONG_PDO, since=cycle)
    assert bench.emcy() == [0x8210]


def test_second_node_of_the_same_id_makes_the_drives_brake() -> None:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    own = tpdo_of(bench, X)
    cycle = bench.inject(0x181, own[:2] + bytes((own[2] ^ 0x05,)) + own[3:])
    bench.run(LAST_CYCLE)
    assert_reaction_in_time(bench, Event.DUPLICATE_NODE, since=cycle)
    assert bench.emcy() == [0x8150]


@pytest.mark.parametrize(
    ("request_hex", "what"),
    [
        ("23 65 60 00 10 27 00 00", "6065h:00 (following_error_window)"),
        ("2b 5a 60 00 06 00 00 00", "605Ah:00 (quick_stop_option_code)"),
        ("c6 00 16 01 04 00 00 00", "1600h:01"),
    ],
)
def test_sdo_write_of_another_client_stops_the_axes(request_hex: str, what: str) -> None:
    bench, cycle = injected(0x601, bytes.fromhex(request_hex))
    assert_reaction_in_time(bench, Event.OBJECT_CHANGED, since=cycle)
    assert f"axis.x.drive (node 1): another participant writes {what}" in bench.machine.reason


@pytest.mark.parametrize("request_hex", ["40 65 60 00 00 00 00 00", "2b 65 60 00 00 00 00 00"])
def test_sdo_read_or_refused_write_of_another_client_stops_nothing(request_hex: str) -> None:
    bench, _ = injected(0x601, bytes.fromhex(request_hex))
    assert not bench.machine.failed


def test_foreign_frames_stop_nothing() -> None:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    for can_id in (0x123, 0x3FF, 0x455, 0x6A0, 0x7E5, 0x7FF):
        bench.inject(can_id, b"\x01\x02\x03")
    assert not bench.run(LAST_CYCLE).machine.failed


@pytest.mark.parametrize("can_id", [0x080, 0x201, 0x77F])
def test_frames_of_another_controller_make_the_drives_brake(can_id: int) -> None:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    cycle = bench.cycle.number
    bench._wire.appendleft((False, can_id, b"" if can_id == 0x080 else bytes(7)))
    bench.run(LAST_CYCLE)
    assert_reaction_in_time(bench, Event.FOREIGN_MASTER, since=cycle)


@pytest.mark.parametrize(
    ("news", "event"), [(BusNews("receive overrun", frames_lost=True, down=False), Event.FRAMES_LOST)]
)
def test_overrun_stops_the_axes_with_a_ramp(news: BusNews, event: Event) -> None:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    cycle = bench.cycle.number
    bench.on_error_frame(news)
    bench.run(LAST_CYCLE)
    assert_reaction_in_time(bench, event, since=cycle)


def test_bus_off_ends_the_cycle_and_the_drives_brake_by_themselves() -> None:
    bench = FaultBench(XY_TABLE).run(FAULT_CYCLE)
    bench.on_error_frame(BusNews("bus-off", frames_lost=True, down=True))
    assert bench.off
    assert bench.machine.failed
    for _ in range(drive_alone_cycles(bench.config) + 60):
        bench.nodes.advance_cycle()
        bench.nodes.run_timers()
    assert np.abs(bench.nodes.plant.state["table_velocity_m_s"]).max() < 1e-3
