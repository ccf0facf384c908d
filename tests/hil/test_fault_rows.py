"""Row by row of the fault policy, in lockstep: a fault, its event, its reaction in time, and rest."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from fault_bench import BRAKE, COLUMN, POWER_OFF, SHARED, FaultBench

from hil_sim.node.nmt import NEVER_US
from servo_ctrl.axis.fault_bounds import BOUND_CYCLES, detection_cycles, drive_alone_cycles
from servo_ctrl.axis.fault_policy import Event, Reaction, Stage, reaction
from servo_ctrl.io.can_port import BusNews

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).parents[2]
XY_TABLE = ROOT / "machines" / "xy_table"
AT_S, AT = 0.4005, 400
"""When it happens, ahead of this cycle's inputs: at full speed."""
END = 1500
X, Y = 1, 2
"""Node ids of the drives."""


@pytest.fixture
def table_with(tmp_path: Path) -> Callable[..., Path]:
    """The X-Y table with texts of its machine file replaced."""

    def make(**replacements: str) -> Path:
        text = (XY_TABLE / "controller.toml").read_text(encoding="utf-8")
        for old, new in replacements.items():
            assert old in text
            text = text.replace(old, new)
        text = text.replace("../../eds", str(ROOT / "eds"))
        (tmp_path / "controller.toml").write_text(text, encoding="utf-8")
        return tmp_path

    return make


def in_time(bench: FaultBench, event: Event, *, since: int = AT) -> None:
    """Seen and reacted to within the bounds, as the table says, told to the bus, and off in the end."""
    seen = bench.noted(event)
    allowed = detection_cycles(bench.config, lockstep=True).get(event, 1)
    assert 0 <= seen - since <= allowed + 1, f"seen {seen - since} cycles after the cause"
    wanted = reaction(Stage.RUNNING, event)
    if wanted is Reaction.HOLD:
        answered = [bench.ramp()]
    elif wanted is Reaction.QUICK_STOP:
        answered = [bench.reacted(X, BRAKE), bench.reacted(Y, BRAKE)]
    else:
        answered = [bench.reacted(X, POWER_OFF), bench.reacted(Y, BRAKE)]
    assert all(0 <= cycle - seen <= BOUND_CYCLES[event] for cycle in answered), (seen, answered)
    assert bench.machine.failed
    assert bench.off
    assert bench.machine.stage is Stage.OFF
    assert len(bench.emcy()) == 1


# --- what breaks at an axis ---------------------------------------------------------------------------


def test_broken_scale_makes_the_drives_brake_before_the_following_error_would() -> None:
    bench = FaultBench(XY_TABLE, f"broken_scale:x@{AT_S}").run(END)
    in_time(bench, Event.SENSORS_DISAGREE, since=apart_since(bench))
    assert Event.FOLLOWING_ERROR not in {event for _, event in bench.events}
    assert "encoder and scale are" in bench.machine.reason
    assert bench.emcy() == [0x7320]
    assert bench.at_rest(0)
    assert bench.at_rest(1)


def apart_since(bench: FaultBench) -> int:
    """The first cycle in which encoder and scale of axis x are further apart than allowed."""
    motor, scale = (SHARED + COLUMN[name] for name in ("motor_position_m", "scale_position_m"))
    return next(int(row[1]) for row in bench.rows if abs(row[motor] - row[scale]) > 0.5e-3)


def test_slipped_coupling_makes_the_drives_brake() -> None:
    bench = FaultBench(XY_TABLE, f"slipped_coupling:x@{AT_S}").run(END)
    in_time(bench, Event.SENSORS_DISAGREE, since=apart_since(bench))


def test_axis_that_runs_away_loses_its_power_and_the_other_brakes() -> None:
    bench = FaultBench(XY_TABLE, f"runaway_sign:x@{AT_S}").run(END)
    runaway = bench.noted(Event.RUNAWAY)
    told = [word for cycle, node, word in bench.told if node == X and cycle > runaway]
    assert told
    assert set(told) == {POWER_OFF}
    assert bench.reacted(Y, BRAKE) - runaway <= BOUND_CYCLES[Event.RUNAWAY]
    assert bench.at_rest(1)
    assert bench.off


def test_wrong_sign_at_a_standstill_is_found_before_the_following_error() -> None:
    bench = FaultBench(XY_TABLE, "runaway_sign:x@0.03").run(END)
    assert bench.machine.reason.startswith("axis x: runs away from its set point")
    assert Event.FOLLOWING_ERROR not in {event for _, event in bench.events}
    moved_mm = abs(np.array(bench.truth_m)[:, 0]).max() * 1e3
    assert moved_mm < 10.0


def test_axis_that_is_held_saturates_and_both_are_led_to_rest(table_with: Any) -> None:
    patient = "following_error_mm = 50.0\nsaturation_ms = 50.0"
    machine_dir = table_with(**{"following_error_mm = 1.0": patient})
    bench = FaultBench(machine_dir, f"jammed_axis:x@{AT_S}", plant=XY_TABLE).run(END)
    force = {int(row[1]): abs(row[SHARED + COLUMN["force_command_n"]]) for row in bench.rows}
    full = next(cycle for cycle in range(AT, END) if force[cycle] >= 600.0)
    in_time(bench, Event.SATURATED, since=full)
    assert bench.noted(Event.SATURATED) - full < 50  # 98 % of the current count as all of it
    assert bench.emcy() == [0x2310]


@pytest.mark.parametrize(("side", "word"), [(1, "positive"), (-1, "negative")])
def test_limit_switch_that_closes_makes_the_drives_brake(side: int, word: str) -> None:
    bench = FaultBench(XY_TABLE, f"limit_switch:x@{AT_S},side={side}").run(END)
    in_time(bench, Event.LIMIT_SWITCH)
    assert bench.machine.reason == f"axis x: the {word} limit switch has closed"


def test_following_error_makes_the_drives_brake(table_with: Any) -> None:
    machine_dir = table_with(**{"following_error_mm = 1.0": "following_error_mm = 0.3"})
    bench = FaultBench(machine_dir, f"jammed_axis:x@{AT_S}", plant=XY_TABLE).run(END)
    error = SHARED + COLUMN["position_error_m"]
    since = next(int(row[1]) for row in bench.rows if abs(row[error]) > 0.3e-3)
    in_time(bench, Event.FOLLOWING_ERROR, since=since)


def test_position_limit_leads_the_axes_to_rest(table_with: Any) -> None:
    machine_dir = table_with(**{"position_mm = [-100.0, 100.0]": "position_mm = [-10.0, 10.0]"})
    bench = FaultBench(machine_dir, plant=XY_TABLE).run(END)
    motor = SHARED + COLUMN["motor_position_m"]
    since = next(int(row[1]) for row in bench.rows if row[motor] > 11e-3)
    in_time(bench, Event.LIMIT, since=since)


def test_supply_of_one_drive_that_gives_way_stops_both() -> None:
    bench = FaultBench(XY_TABLE, f"brownout:y@{AT_S}").run(END)
    in_time(bench, Event.EMCY)
    assert any("EMCY 3220h, DC link under-voltage" in text for text in bench.machine.events.kept)
    assert bench.at_rest(0)
    assert bench.at_rest(1)


# --- nodes --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("which", ["", ",scale=1"])
def test_node_that_dies_stops_the_other_axis(which: str) -> None:
    bench = FaultBench(XY_TABLE, f"node_death:y@{AT_S}{which}").run(END)
    seen = bench.noted(Event.LOST_TPDO)
    assert 0 <= seen - AT <= detection_cycles(bench.config, lockstep=True)[Event.LOST_TPDO]
    assert bench.reacted(X, BRAKE) - seen <= BOUND_CYCLES[Event.LOST_TPDO]
    assert bench.at_rest(0)
    assert bench.emcy() == [0x8250]


def test_drive_that_was_off_the_bus_for_a_while_says_so_and_stays_stopped() -> None:
    bench = FaultBench(XY_TABLE, f"mute_node:y@{AT_S},duration_s=0.02").run(END)
    assert bench.noted(Event.LOST_TPDO) - AT <= 2
    assert any("EMCY 8140h, recovered from bus-off" in text for text in bench.machine.events.kept)
    assert bench.at_rest(0)
    assert bench.at_rest(1)


def test_controller_that_dies_is_missed_by_the_drives_which_brake_by_themselves() -> None:
    """SYNCs go on, as from another producer: what is missing is our heartbeat."""
    bench = FaultBench(XY_TABLE).run(AT)
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
    states = {int(drive.objects.statusword) & 0x6F for drive in bench.nodes._drives}
    assert 0x27 not in states


def test_node_without_heartbeats_is_missed_in_time() -> None:
    bench = FaultBench(XY_TABLE).run(AT)
    bench.nodes.slaves[0].nmt.due_us = NEVER_US
    bench.run(END)
    in_time(bench, Event.LOST_HEARTBEAT, since=AT)
    assert bench.emcy() == [0x8130]


# --- the bus ------------------------------------------------------------------------------------------


def tpdo_of(bench: FaultBench, node: int) -> bytes:
    """What a node's process objects are now, as its TPDO would have it."""
    slave = next(slave for slave in bench.nodes.slaves if slave.node_id == node)
    return slave._on_sync[0].sample()


def injected(can_id: int, payload: bytes) -> tuple[FaultBench, int]:
    bench = FaultBench(XY_TABLE).run(AT)
    cycle = bench.inject(can_id, payload)
    return bench.run(END), cycle


@pytest.mark.parametrize("size", [0, 3, 7])
def test_pdo_of_another_length_makes_the_drives_brake(size: int) -> None:
    bench, cycle = injected(0x181, bytes(size))
    in_time(bench, Event.WRONG_PDO, since=cycle)
    assert bench.emcy() == [0x8210]


def test_second_node_of_the_same_id_makes_the_drives_brake() -> None:
    bench = FaultBench(XY_TABLE).run(AT)
    own = tpdo_of(bench, X)
    cycle = bench.inject(0x181, own[:2] + bytes((own[2] ^ 0x05,)) + own[3:])
    bench.run(END)
    in_time(bench, Event.DUPLICATE_NODE, since=cycle)
    assert bench.emcy() == [0x8150]


@pytest.mark.parametrize(
    ("request_hex", "what"),
    [
        ("23 65 60 00 10 27 00 00", "6065h:00 (following_error_window)"),
        ("2b 5a 60 00 06 00 00 00", "605Ah:00 (quick_stop_option_code)"),
        ("c6 00 16 01 04 00 00 00", "1600h:01"),
    ],
)
def test_write_of_somebody_else_to_a_drive_leads_the_axes_to_rest(request_hex: str, what: str) -> None:
    bench, cycle = injected(0x601, bytes.fromhex(request_hex))
    in_time(bench, Event.OBJECT_CHANGED, since=cycle)
    assert f"axis.x.drive (node 1): somebody else writes {what}" in bench.machine.reason


def test_read_of_somebody_else_stops_nothing() -> None:
    bench, _ = injected(0x601, bytes.fromhex("40 65 60 00 00 00 00 00"))
    assert not bench.machine.failed


def test_foreign_frames_stop_nothing() -> None:
    bench = FaultBench(XY_TABLE).run(AT)
    for can_id in (0x123, 0x3FF, 0x455, 0x6A0, 0x7E5, 0x7FF):
        bench.inject(can_id, b"\x01\x02\x03")
    assert not bench.run(END).machine.failed


@pytest.mark.parametrize("can_id", [0x080, 0x201, 0x77F])
def test_frames_of_another_controller_make_the_drives_brake(can_id: int) -> None:
    bench = FaultBench(XY_TABLE).run(AT)
    cycle = bench.cycle.number
    bench._wire.appendleft((False, can_id, b"" if can_id == 0x080 else bytes(7)))
    bench.run(END)
    in_time(bench, Event.FOREIGN_MASTER, since=cycle)


@pytest.mark.parametrize(
    ("news", "event"), [(BusNews("receive overrun", frames_lost=True, down=False), Event.FRAMES_LOST)]
)
def test_overrun_leads_the_axes_to_rest(news: BusNews, event: Event) -> None:
    bench = FaultBench(XY_TABLE).run(AT)
    cycle = bench.cycle.number
    bench.on_error_frame(news)
    bench.run(END)
    in_time(bench, event, since=cycle)


def test_bus_off_ends_the_cycle_and_the_drives_brake_by_themselves() -> None:
    bench = FaultBench(XY_TABLE).run(AT)
    bench.on_error_frame(BusNews("bus-off", frames_lost=True, down=True))
    assert bench.off
    assert bench.machine.failed
    for _ in range(drive_alone_cycles(bench.config) + 60):
        bench.nodes.advance_cycle()
        bench.nodes.run_timers()
    assert np.abs(bench.nodes.plant.state["table_velocity_m_s"]).max() < 1e-3


# --- and on again ---------------------------------------------------------------------------------------


def stood_by(bench: FaultBench) -> FaultBench:
    """The same, in standby after its stop."""
    bench.machine.stand_by = bench.machine.served = True
    return bench


def test_axis_is_switched_on_again_after_a_fault_that_has_passed() -> None:
    bench = stood_by(FaultBench(XY_TABLE, f"brownout:y@{AT_S}")).run(1000)
    assert bench.machine.stage is Stage.STANDBY
    assert bench.machine.enable() == ""
    assert bench.run(300).machine.stage in {Stage.READY, Stage.RUNNING}


def test_machine_whose_nodes_were_written_to_needs_another_boot() -> None:
    bench = stood_by(FaultBench(XY_TABLE)).run(AT)
    bench.inject(0x601, bytes.fromhex("23 65 60 00 10 27 00 00"))
    bench.run(600)
    assert bench.machine.stage is Stage.STANDBY
    assert "somebody else writes 6065h:00" in bench.machine.enable()
    assert bench.machine.stage is Stage.STANDBY


def test_second_node_is_noted_in_standby_too_and_stops_the_next_attempt() -> None:
    bench = stood_by(FaultBench(XY_TABLE)).run(AT)
    bench.inject(0x181, bytes(3))
    bench.run(600)
    assert bench.machine.stage is Stage.STANDBY
    assert bench.machine.enable() == ""
    bench.inject(0x181, bytes(3))
    bench.run(300)
    assert bench.machine.stage is Stage.STANDBY
    assert bench.machine.failed
