"""Power, faults and homing by operator commands."""

import numpy as np
import pytest
from ideal_drives import COUNT_M, PERIOD_S, Operate

from servo_ctrl.axis.fault_policy import Event
from servo_ctrl.commands.command import JOG_RENEWAL_S, Command
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.program_model import ProgramConfig
from servo_ctrl.telemetry.mqtt.commands import MqttCommands

RENEWAL = round(JOG_RENEWAL_S / PERIOD_S)
OFF = [0x0240, 0x0240]


def test_run_without_a_program_begins_in_standby_and_switches_on_when_asked(operated: Operate) -> None:
    made = operated()
    made.run(200)
    assert (made.machine.stage, made.status.reason) == (Stage.STANDBY, "")
    assert [drive.statusword for drive in made.drives] == OFF
    assert not any(word in {0x06, 0x07, 0x0F} for drive in made.drives for word in drive.controlwords)
    assert made.ask(Command.ENABLE).accepted
    assert made.machine.stage is Stage.STARTING
    made.run(100)
    assert made.machine.stage is Stage.READY
    x = made.status.drives[0]
    assert (x.axis, x.phase, x.state, x.ready, x.limits_m) == (
        "x",
        "servo",
        "operation enabled",
        True,
        (-0.1, 0.1),
    )


def test_drive_that_is_found_with_power_brakes_before_standby(operated: Operate) -> None:
    made = operated()
    made.drives[1].statusword = 0x0227
    made.run(10)
    assert made.drives[1].controlwords[0] == 0x02
    assert made.machine.stage is Stage.STANDBY


def test_disable_ramps_down_and_ends_in_standby_with_its_reason(
    enabled: Operate, round_program: ProgramConfig
) -> None:
    made = enabled()
    assert made.handler.load_program(round_program).accepted
    assert made.ask(Command.START_PROGRAM).accepted
    made.run(300)
    assert made.ask(Command.DISABLE).accepted
    assert made.machine.stage is Stage.STOPPING
    made.run(300)
    assert (made.machine.stage, made.machine.failed) == (Stage.STANDBY, False)
    assert made.status.reason == "switched off by the operator"
    assert np.abs(np.diff(made.commanded_m(), 2, axis=0)).max() <= 2.0 * PERIOD_S**2 * 1.001
    verdict = made.ask(Command.DISABLE)
    assert verdict.reason == "the machine is standby, and has no power that could be switched off"


def test_quick_stop_reaches_every_drive_in_the_next_cycle(enabled: Operate) -> None:
    made = enabled()
    assert made.handler.jog("x", 0.05).accepted
    made.run(50)
    assert made.ask(Command.QUICK_STOP).accepted
    made.run(1)
    assert [drive.controlwords[-1] for drive in made.drives] == [0x02, 0x02]
    made.run(20)
    assert (made.machine.stage, made.status.reason) == (Stage.STANDBY, "quick stop by the operator")
    assert not made.machine.failed
    assert made.ask(Command.QUICK_STOP).accepted, "a stop is never refused"


def test_fault_is_kept_until_the_machine_is_enabled_again(enabled: Operate) -> None:
    made = enabled()
    made.drives[1].statusword = 0x0208
    made.run(50)
    assert made.machine.stage is Stage.STANDBY
    assert (made.status.reason, made.machine.failed) == ("axis y: the drive is in fault", True)
    assert made.status.drives[1].state == "fault"
    assert made.ask(Command.ENABLE).accepted
    made.run(100)
    assert (made.machine.stage, made.status.reason, made.machine.failed) == (Stage.READY, "", False)
    assert 0x80 in made.drives[1].controlwords


def test_events_in_standby_are_noted_and_nothing_moves(operated: Operate) -> None:
    made = operated()
    made.run(5)
    for event in set(Event) - {Event.STOP_SIGNAL, Event.BUS_DOWN, Event.FOREIGN_MASTER}:
        made.machine.event(event, event.value)
    made.run(5)
    assert (made.machine.stage, made.status.reason) == (Stage.STANDBY, "")
    assert Event.EMCY.value in made.machine.events.kept


@pytest.mark.parametrize("event", [Event.STOP_SIGNAL, Event.FOREIGN_MASTER])
def test_a_run_ends_from_standby_and_during_a_stop_that_leads_there(
    operated: Operate, enabled: Operate, event: Event
) -> None:
    for made in (operated().run(5), enabled()):
        if made.machine.stage is Stage.READY:
            made.ask(Command.QUICK_STOP)
        made.machine.event(event, "over")
        made.run(50)
        assert made.machine.stage is Stage.OFF


def test_axis_that_is_homed_keeps_its_home_when_it_is_enabled_again(enabled: Operate) -> None:
    made = enabled(homing_method=37)
    assert all(drive.homed for drive in made.status.drives)
    made.handler.jog("x", 0.05)
    made.run(400)
    at = made.drives[0].position
    assert at > 1000
    made.ask(Command.DISABLE)
    made.run(50)
    made.ask(Command.ENABLE)
    made.run(100)
    assert (made.machine.stage, made.drives[0].position) == (Stage.READY, at)
    assert made.status.drives[0].homed


def test_one_axis_is_homed_again_while_the_other_stays(enabled: Operate) -> None:
    made = enabled(homing_method=37)
    for axis in ("x", "y"):
        made.handler.jog(axis, 0.05)
    made.run(400)
    at_y = made.drives[1].position
    assert made.ask(Command.HOME, "x").accepted
    assert made.machine.stage is Stage.STARTING
    assert not made.status.drives[0].homed
    made.run(60)
    assert made.machine.stage is Stage.READY
    assert made.status.drives[0].homed
    assert (made.drives[0].position, made.drives[1].position) == (0, at_y)
    assert made.machine.set_points_m() == pytest.approx([0.0, at_y * COUNT_M], abs=COUNT_M)
    assert made.handler.jog("y", -0.05).accepted
    made.run(1)
    assert abs(made.drives[1].position - at_y) * COUNT_M < 2e-6, "it goes on from where it stands"


def test_axis_without_a_homing_method_is_not_homed(enabled: Operate) -> None:
    made = enabled()
    assert made.ask(Command.HOME, "y").reason == "axis y has no homing method (homing_method = 0)"


def test_machine_that_does_not_stand_by_ends_as_before(operated: Operate) -> None:
    made = operated(stand_by=False, serve=True)
    made.run(100)
    assert made.machine.stage is Stage.READY
    assert made.ask(Command.ENABLE).reason == "the machine is ready, not in standby"
    assert made.ask(Command.DISABLE).accepted
    made.run(50)
    assert (made.machine.stage, made.machine.failed) == (Stage.OFF, False)


def test_commands_arrive_by_mqtt(operated: Operate) -> None:
    made = operated().run(5)
    messages = MqttCommands(made.handler)
    answer = messages.answer(b'{"id": "1", "command": "enable"}', retained=False)
    assert answer.refusal == "none"
    made.run(100)
    assert made.machine.stage is Stage.READY
    answer = messages.answer(b'{"id": "2", "command": "hold_program"}', retained=False)
    assert (answer.refusal, answer.reason) == ("wrong_state", "no program is running")
    messages.answer(b'{"id": "3", "command": "quick_stop"}', retained=False)
    made.run(1)
    assert [drive.controlwords[-1] for drive in made.drives] == [0x02, 0x02]
