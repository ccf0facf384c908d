"""Inputs and set points of an axis that are spread over several PDOs, some of them sent at a change."""

from collections.abc import Callable
from typing import Any

from servo_ctrl.axis.drive import HOMED, Phase, Route, Sequence, advance
from servo_ctrl.axis.set_points import SetPoints
from servo_ctrl.canopen.cia402 import Mode
from servo_ctrl.canopen.pdo import MappedObject, PdoCodec
from servo_ctrl.daemon.cycle.drives import _joined
from servo_ctrl.daemon.cycle.event_timer import EventTimer

ENABLED, HOMED_ENABLED, DISABLED, READY = 0x0637, 0x1637, 0x0640, 0x0631
ROUTE = Route(Mode.CYCLIC_SYNC_POSITION, homing=True, period_s=1e-3, mode_switch_disabled=True)


def codec(*objects: tuple[str, int]) -> PdoCodec:
    return PdoCodec([MappedObject(f"{index:04x}", index, 0, form) for form, index in objects])


def test_offsets_go_in_a_further_rpdo() -> None:
    points = SetPoints([codec(("H", 0x6040), ("i", 0x607A)), codec(("i", 0x60B1), ("h", 0x60B2))])
    step = advance(ROUTE, Sequence(Phase.SERVO, 0, Mode.CYCLIC_SYNC_POSITION), ENABLED)
    first = points.led(step, (1, 2, 3, 4, 5))
    assert first == b"\x0f\0\x04\0\0\0"
    assert points.further == [b"\x05\0\0\0\x02\0"]
    alone = SetPoints([codec(("H", 0x6040)), codec(("i", 0x607A))])
    assert alone.led(step, (1, 2, 3, 4, 5)) == b"\x0f\0"
    assert alone.further == [b"\x04\0\0\0"]


def test_values_that_come_at_a_change_hold(machine_with: Callable[..., Any], servo_of: Any) -> None:
    servo, _plan = servo_of(machine_with())
    inputs = servo.inputs
    inputs.take_event(codec(("H", 0x6041), ("b", 0x6061)), (ENABLED, 8))
    assert (inputs.statusword, inputs.mode_shown) == (ENABLED, 8)


def test_a_node_has_answered_when_all_its_tpdos_are_there() -> None:
    assert _joined((1, 2), (3,)) == (1, 2, 3)
    assert _joined((1, 2), None) is None
    assert _joined(None, (3,)) is None


def test_a_drive_that_takes_its_mode_without_power_is_switched_off_behind_homing() -> None:
    sequence = Sequence(Phase.HOMING, 20, Mode.HOMING)
    sent = []
    for word in (HOMED_ENABLED, HOMED_ENABLED, 0x0617, DISABLED, READY, 0x0633, ENABLED, ENABLED):
        step = advance(ROUTE, sequence, word, mode_shown=8 if word == ENABLED else 6)
        sequence = step.sequence
        sent.append((step.controlword, step.sent_mode or sequence.mode))
    assert [word for word, _ in sent] == [0x02, 0x02, 0x02, 0x06, 0x07, 0x0F, 0x0F, 0x0F]
    assert [mode for _, mode in sent][:3] == [Mode.HOMING] * 3
    assert {mode for _, mode in sent[3:]} == {Mode.CYCLIC_SYNC_POSITION}
    assert sequence.phase is Phase.SETTLING
    assert Phase.TAKING_OVER in HOMED


def test_a_drive_that_does_not_take_the_mode_is_not_led() -> None:
    sequence = Sequence(Phase.SWITCHING_ON, 0, Mode.CYCLIC_SYNC_POSITION)
    for _ in range(5002):
        step = advance(ROUTE, sequence, ENABLED, mode_shown=1)
        sequence = step.sequence
        assert sequence.phase is Phase.SWITCHING_ON
    assert step.problem == "stays in mode 1 instead of 8"


def test_the_silence_of_an_event_timer_is_told_once() -> None:
    class Count:
        number = 0

    class Timed:
        event_timer_ms = 10

    timer = EventTimer("axis.x.drive, TPDO 2", Timed(), 1e-3, Count())  # type: ignore[arg-type]  # all it uses
    told = [timer.advance(cycle) for cycle in range(40)]
    assert [cycle for cycle, text in enumerate(told) if text] == [31]
    assert "has not come for 31 cycles" in told[31]
