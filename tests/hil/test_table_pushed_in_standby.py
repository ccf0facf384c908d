"""A table pushed by hand in standby: switched on at standstill, jogged back from a limit switch."""

from consecutive_runs import ConsecutiveRuns, Script
from fault_scripts import jogged

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.stage import Stage
from servo_ctrl.cyclic.drive_phases import Phase
from tests.campaigns.campaign.machine import SWITCH_MM

PUSHED_M_S = 0.08
STANDSTILL_M_S = 0.011
AT_THE_SWITCH = "axis x stands at its positive limit switch: jog it away"


def pushed(table: ConsecutiveRuns, to_m: float) -> Script:
    """Push the table to `to_m`; then friction stops it."""
    state = table.stand.bench.plant.state[0]

    def there() -> bool:
        for field in ("table_velocity_m_s", "motor_velocity_m_s"):
            state[field] = PUSHED_M_S
        return bool(state["table_position_m"] > to_m)

    yield there


def speed_m_s(table: ConsecutiveRuns) -> float:
    return float(table.stand.bench.plant.state[0]["table_velocity_m_s"])


def test_drive_is_switched_on_when_its_axis_stands_still(table: ConsecutiveRuns) -> None:
    def script() -> Script:
        yield table.at(Stage.STANDBY)
        yield from pushed(table, 0.002)
        table.ask(Command.ENABLE)
        yield 50
        assert speed_m_s(table) > STANDSTILL_M_S
        assert table.servo.phase is Phase.AWAITING_REST
        powered = table.stand.bench._drives.drives[0].motion
        yield lambda: powered.powered
        assert speed_m_s(table) < STANDSTILL_M_S
        yield table.at(Stage.READY)
        yield 100

    report = table.run(script)
    assert not report.failed
    assert report.events == ("stopped by SIGTERM",)


def test_neither_program_nor_learning_begins_at_a_limit_switch(table: ConsecutiveRuns) -> None:
    def script() -> Script:
        yield from table.ready_with_program()
        table.ask(Command.DISABLE)
        yield table.at(Stage.STANDBY)
        yield from pushed(table, SWITCH_MM * 1e-3)
        yield lambda: speed_m_s(table) < STANDSTILL_M_S
        table.ask(Command.ENABLE)
        yield table.at(Stage.READY)
        for command in (Command.START_PROGRAM, Command.START_LEARNING):
            verdict = table.stand.handler.execute(CommandRequest(command, "x"))
            assert not verdict.accepted
            assert verdict.reason.startswith(AT_THE_SWITCH)
            assert table.machine.stage is Stage.READY
        for _ in range(20):
            yield from jogged(table, -0.02, 100)
        assert table.machine.set_points_m()[0] < 0.010
        yield 50
        table.ask(Command.START_LEARNING, "x")
        yield table.at(Stage.RUNNING)
        yield 50

    report = table.run(script)
    assert "limit switch" not in report.reason
    assert not report.failed


def test_run_that_is_homed_at_a_limit_switch_begins_no_program(table: ConsecutiveRuns) -> None:
    """Without an operator: home would be at the switch."""
    state = table.stand.bench.plant.state[0]
    for field in ("table_position_m", "motor_position_m"):
        state[field] += 1.01e-3 * SWITCH_MM

    def script() -> Script:
        yield table.at(Stage.STANDBY)

    report = table.run(script, program=table.stand.machine.program)
    assert report.failed
    assert not report.completed
    assert report.reason.startswith(AT_THE_SWITCH)
