"""Bounds of the reactions, from how each event reaches us; times to see it, from machine files."""

from pathlib import Path
from typing import Any

import pytest

from servo_ctrl.axis.fault_bounds import BOUND_CYCLES, detection_cycles, drive_alone_cycles
from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.config.load import load_machine
from servo_ctrl.config.model import AxisConfig, MachineConfig

TABLE = load_machine(Path(__file__).parents[3] / "machines" / "xy_table")  # 1 kHz, heartbeat 100 ms
OF_THE_CYCLE = {
    Event.LOST_TPDO,
    Event.LATE_TICK,
    Event.DRIVE_FAULT,
    Event.FOLLOWING_ERROR,
    Event.LIMIT,
    Event.SENSORS_DISAGREE,
    Event.RUNAWAY,
    Event.SATURATED,
    Event.BAD_COMMAND,
    Event.BAD_PROGRAM,
}
"""Found in the inputs of a cycle, in its clock, or in what is computed from them."""
NOTHING_CAN_BE_SENT = {Event.BUS_DOWN, Event.BUS_OFF}


def axis_with(axis: AxisConfig, *, switch_syncs: int = 10, **limits: Any) -> AxisConfig:
    return axis.model_copy(
        update={
            "drive": axis.drive.model_copy(update={"limit_switch_syncs": switch_syncs}),
            "limits": axis.limits.model_copy(update=limits),
        }
    )


def machine_with(
    *, period_us: int = 1000, heartbeat_ms: int = 100, x: dict[str, Any], y: dict[str, Any]
) -> MachineConfig:
    return TABLE.model_copy(
        update={
            "bus": TABLE.bus.model_copy(update={"sync_period_us": period_us}),
            "controller": TABLE.controller.model_copy(update={"heartbeat_ms": heartbeat_ms}),
            "axes": {"x": axis_with(TABLE.axes["x"], **x), "y": axis_with(TABLE.axes["y"], **y)},
        }
    )


@pytest.mark.parametrize("event", Event)
def test_what_a_cycle_reads_is_answered_by_its_rpdos_and_a_frame_of_its_own_by_the_next(event: Event) -> None:
    wanted = 0 if event in NOTHING_CAN_BE_SENT else 1 if event in OF_THE_CYCLE else 2
    assert BOUND_CYCLES[event] == wanted


def test_every_event_has_a_bound() -> None:
    assert set(BOUND_CYCLES) == set(Event)


def test_detection_time_follows_from_the_machine_file() -> None:
    real, lockstep = (detection_cycles(TABLE, lockstep=which) for which in (False, True))
    assert real == {
        Event.LOST_TPDO: 21,
        Event.LATE_TICK: 21,
        Event.LOST_HEARTBEAT: 500,
        Event.SATURATED: 500,
        Event.RUNAWAY: 15,
        Event.LIMIT_SWITCH: 10,
        Event.DUPLICATE_NODE: 4,
    }
    assert lockstep == {**real, Event.LOST_TPDO: 1}


@pytest.mark.parametrize("turned", [False, True])
def test_slowest_axis_sets_the_time_of_the_machine(turned: bool) -> None:
    slow = {"switch_syncs": 7, "saturation_ms": 30.0, "runaway_ms": 8.0}
    quick = {"switch_syncs": 2, "saturation_ms": 4.0, "runaway_ms": 3.0}
    machine = machine_with(x=slow, y=quick) if turned else machine_with(x=quick, y=slow)
    seen = detection_cycles(machine, lockstep=False)
    assert (seen[Event.LIMIT_SWITCH], seen[Event.SATURATED], seen[Event.RUNAWAY]) == (7, 30, 24)


def test_unmapped_switches_have_the_bound_of_a_cycle() -> None:
    unread = {"switch_syncs": 0}
    assert detection_cycles(machine_with(x=unread, y=unread), lockstep=False)[Event.LIMIT_SWITCH] == 1


@pytest.mark.parametrize(
    ("period_us", "gap", "heartbeats", "alone"),
    [(250, 81, 5 * 400, 1201), (3000, 8, 5 * 33, 101), (6000, 5, 5 * 17, 51), (7000, 4, 5 * 14, 44)],
)
def test_gaps_end_with_a_whole_cycle_and_heartbeats_are_the_cycles_that_come_nearest(
    period_us: int, gap: int, heartbeats: int, alone: int
) -> None:
    """20 ms and a cycle more; five heartbeat times; for a drive, three of them and a cycle more."""
    machine = machine_with(period_us=period_us, x={}, y={})
    seen = detection_cycles(machine, lockstep=False)
    assert (seen[Event.LOST_TPDO], seen[Event.LATE_TICK]) == (gap, gap)
    assert seen[Event.LOST_HEARTBEAT] == heartbeats
    assert drive_alone_cycles(machine) == alone


def test_heartbeat_that_is_off_or_faster_than_the_cycle_counts_as_a_cycle() -> None:
    for heartbeat_ms, period_us in ((0, 1000), (1, 4000)):
        machine = machine_with(period_us=period_us, heartbeat_ms=heartbeat_ms, x={}, y={})
        assert detection_cycles(machine, lockstep=False)[Event.LOST_HEARTBEAT] == 5
