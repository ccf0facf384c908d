"""Inputs and set points of an axis that are spread over several PDOs, some of them sent at a change."""

import math
import struct
from collections.abc import Callable
from typing import Any

import pytest

from servo_ctrl.axis.axis_parts import axis_parts
from servo_ctrl.axis.cycle_memory import CycleMemory
from servo_ctrl.canopen.errors import EdsError
from servo_ctrl.canopen.pdo import MappedObject, PdoCodec
from servo_ctrl.config.kernel_params import axis_params
from servo_ctrl.cyclic.cia402 import Mode
from servo_ctrl.cyclic.drive_phases import Phase, problem_text
from servo_ctrl.cyclic.sequence import advance
from servo_ctrl.cyclic.sequence_state import Route, Sequence
from servo_ctrl.daemon.cycle.event_timer import EventTimer

ENABLED, HOMED_ENABLED, DISABLED, READY = 0x0637, 0x1637, 0x0640, 0x0631
ROUTE = Route(int(Mode.CYCLIC_SYNC_POSITION), homing=True, period_s=1e-3, mode_switch_disabled=True)


def codec(*objects: tuple[str, int]) -> PdoCodec:
    return PdoCodec([MappedObject(f"{index:04x}", index, 0, form) for form, index in objects])


def spread(machine: Any) -> CycleMemory:
    """An axis whose drive sends two TPDOs with every SYNC, inputs 0 and 2, and is sent two RPDOs."""
    rpdos = [codec(("H", 0x6040), ("i", 0x607A)), codec(("b", 0x6060), ("h", 0x60B2))]
    tpdos = {0: codec(("H", 0x6041), ("b", 0x6061)), 2: codec(("h", 0x6078), ("i", 0x6064))}
    scale = 1, codec(("i", 0x6004))
    parts = axis_parts(machine.axes["x"], axis_params(machine, "x"), rpdos, tpdos, scale)
    return CycleMemory([parts], [rpdos], 3)


def test_inputs_and_set_points_may_be_spread(machine_with: Callable[..., Any]) -> None:
    memory = spread(machine_with())
    came = [struct.pack("<Hb", DISABLED, -1), struct.pack("<i", -5), struct.pack("<hi", -7, -70000)]
    memory.step(came, None, 0.0, 0, -1)
    inputs = memory.record(0)["inputs"]
    assert (inputs["statusword"], inputs["mode_shown"], inputs["counts"]) == (DISABLED, -1, -70000)
    assert inputs["current_a"] == -7 * memory.record(0)["wiring"]["ampere_per_permille"]
    assert memory.payloads() == [struct.pack("<Hi", 0x06, -70000), struct.pack("<bh", 10, 0)]


def test_a_drive_has_answered_when_all_its_tpdos_are_there(machine_with: Callable[..., Any]) -> None:
    for missing in (0, 2):
        memory = spread(machine_with())
        came: list[bytes | None] = [bytes(3), bytes(4), bytes(6)]
        came[missing] = None
        memory.step(came, None, 0.0, 0, -1)
        assert math.isnan(memory.record(0)["inputs"]["motor_m"])


@pytest.mark.parametrize("form", ["f", "d", "q", "Q"])
def test_an_object_of_the_cycle_that_is_no_integer_of_32_bits_is_refused_by_name(
    machine_with: Callable[..., Any], form: str
) -> None:
    table = machine_with()
    config, params = table.axes["x"], axis_params(table, "x")
    inputs = {0: codec(("H", 0x6041), ("i", 0x6064))}
    with pytest.raises(EdsError, match="60b2 is not an integer of 8, 16 or 32 bits"):
        CycleMemory([axis_parts(config, params, [], inputs, None)], [[codec((form, 0x60B2))]], 1)
    with pytest.raises(EdsError, match="6064 is not an integer"):
        axis_parts(config, params, [], {0: codec(("H", 0x6041)), 1: codec((form, 0x6064))}, None)
    axis_parts(config, params, [], inputs | {1: codec((form, 0x2000))}, None)  # the cycle does not need it


def test_values_that_come_at_a_change_hold(machine_with: Callable[..., Any], servo_of: Any) -> None:
    servo, _plan = servo_of(machine_with())
    servo.take_event_tpdo(codec(("H", 0x6041), ("b", 0x6061)), (ENABLED, 8))
    assert (servo.inputs.statusword, servo.inputs.mode_shown) == (ENABLED, 8)


def test_a_drive_that_takes_its_mode_without_power_is_switched_off_behind_homing() -> None:
    sequence = Sequence(int(Phase.HOMING), 20, int(Mode.HOMING))
    sent = []
    for word in (HOMED_ENABLED, HOMED_ENABLED, 0x0617, DISABLED, READY, 0x0633, ENABLED, ENABLED):
        step = advance(ROUTE, sequence, word, True, 0, True, 8 if word == ENABLED else 6)
        sequence = step.sequence
        sent.append((step.controlword, step.sent_mode))
    assert [word for word, _ in sent] == [0x02, 0x02, 0x02, 0x06, 0x07, 0x0F, 0x0F, 0x0F]
    assert [mode for _, mode in sent][:3] == [Mode.HOMING] * 3
    assert {mode for _, mode in sent[3:]} == {Mode.CYCLIC_SYNC_POSITION}
    assert sequence.phase == Phase.SETTLING


def test_a_drive_that_does_not_take_the_mode_is_not_led() -> None:
    sequence = Sequence(int(Phase.SWITCHING_ON), 0, int(Mode.CYCLIC_SYNC_POSITION))
    for _ in range(5002):
        step = advance(ROUTE, sequence, ENABLED, True, 0, True, 1)
        sequence = step.sequence
        assert sequence.phase == Phase.SWITCHING_ON
    assert problem_text(step.problem, ENABLED, 1, 8) == "stays in mode 1 instead of 8"


def test_an_overdue_event_timer_is_reported_once() -> None:
    class Count:
        number = 0

    class Timed:
        event_timer_ms = 10

    timer = EventTimer("axis.x.drive, TPDO 2", Timed(), 1e-3, Count())  # type: ignore[arg-type]  # all it uses
    texts = [timer.advance(cycle) for cycle in range(40)]
    assert [cycle for cycle, text in enumerate(texts) if text] == [31]
    assert "not received for 31 cycles" in texts[31]
