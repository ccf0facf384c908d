"""After each event, the recovery of docs/fault_policy.md makes the machine run again."""

import asyncio
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from consecutive_runs import ConsecutiveRuns, Script
from fault_scripts import bus_off, bus_restarts, jogged
from program_steps import circle, move
from recovery_rows import NEW_RUN, ROWS, SWITCH_ON, RecoveryRow

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.hmi.drive.faults import UNKNOWN_REASON, advice_for_reason
from tests.campaigns.campaign import spec
from tests.campaigns.campaign.machine import CampaignMachine, make_machine

Table = Callable[..., ConsecutiveRuns]

REFUSED = {"program refused"}
PROGRAM = move(3.0, -2.0, 6000.0, "out") + move(0.0, 0.0, 6000.0, "back")
IN_MOTION = 30
"""Time of the fault in the program, ticks."""


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> CampaignMachine:
    folder = tmp_path_factory.mktemp("machine")
    made = make_machine(folder)
    (folder / "short.toml").write_text(PROGRAM, encoding="utf-8")
    return made._replace(program=load_program(folder / "short.toml", made.controller))


@pytest.fixture
def table(machine: CampaignMachine, tmp_path: Path) -> Iterator[Table]:
    made: list[ConsecutiveRuns] = []

    def make(
        before: str = "", after: str = "", *, pacing: str = "realtime", at_once: bool = False
    ) -> ConsecutiveRuns:
        own = machine
        if before != after:
            text = machine.controller.source.read_text(encoding="utf-8")
            path = tmp_path / "controller.toml"
            path.write_text(text.replace(before, after), encoding="utf-8")
            own = machine._replace(controller=load_machine(path))
        made.append(ConsecutiveRuns(own, tmp_path, pacing, pause_s=0.0 if at_once else 0.3))
        return made[-1]

    yield make
    for each in made:
        each.close()


def switched_on(table: ConsecutiveRuns) -> Script:
    """Repeat enable until it is accepted, as an operator would."""

    def accepted() -> bool:
        verdict = table.stand.handler.execute(CommandRequest(Command.ENABLE))
        table.last_refusal = verdict.reason or table.last_refusal
        return bool(verdict.accepted)

    yield accepted
    yield table.at(Stage.READY)


def started(table: ConsecutiveRuns) -> Script:
    table.ask(Command.START_PROGRAM)
    yield table.at(Stage.RUNNING)


def run_program_to_its_end(table: ConsecutiveRuns) -> Script:
    yield from started(table)
    yield lambda: table.machine.stage is not Stage.RUNNING
    assert table.machine.stage is Stage.READY, table.machine.reason
    assert table.machine.completed
    assert not table.machine.failed


def prepared(table: ConsecutiveRuns) -> Script:
    yield table.at(Stage.STANDBY)
    yield from loaded(table)
    yield from switched_on(table)


def loaded(table: ConsecutiveRuns) -> Script:
    yield from table.loaded()
    assert table.stand.handler.status().program.name == "short.toml"


def fresh_run(table: ConsecutiveRuns) -> None:
    """Boot, switch on, and run the program to its end."""

    def script() -> Script:
        yield from prepared(table)
        yield from run_program_to_its_end(table)

    report = table.run(script)
    assert report.completed
    assert not report.failed
    assert report.reason == "stopped by SIGTERM"


NAMES = [f"{row.event}-{row.again}-{at}" for at, row in enumerate(ROWS)]


@pytest.mark.parametrize("row", ROWS, ids=NAMES)
def test_machine_runs_again_as_documented(table: Table, row: RecoveryRow) -> None:
    made = table(*row.machine)

    def script() -> Script:
        yield from prepared(made)
        yield from started(made)
        yield IN_MOTION
        assert made.machine.stage is Stage.RUNNING
        yield from row.happens(made)
        yield made.at(Stage.STANDBY)
        assert row.words in made.machine.reason
        if made.machine.failed and "EMCY" not in made.machine.reason:
            assert advice_for_reason(made.machine.reason) is not UNKNOWN_REASON
        row.passes(made)
        yield 5
        if row.again == SWITCH_ON:
            yield from switched_on(made)
            yield from row.repaired(made)
            yield from run_program_to_its_end(made)
        elif row.refused:
            yield 20
            verdict = made.stand.handler.execute(CommandRequest(Command.ENABLE))
            assert not verdict.accepted
            assert row.refused in verdict.reason
            assert "start it again" in verdict.reason

    report = made.run(script)
    assert row.words in report.reason or row.words in " ".join(report.events)
    if row.again == NEW_RUN:
        row.passes(made)
        fresh_run(made)
    else:
        assert not report.failed
        assert report.completed


def test_every_documented_fault_has_a_recovery_row() -> None:
    page = {row["event"]: row["how to go on"] for row in spec._tables() if "how to go on" in row}
    assert {row.event for row in ROWS} | REFUSED == set(page)
    for event, rows in itertools.groupby(ROWS, lambda row: row.event):
        for row in rows:
            assert row.again in page[event], event


def test_program_that_is_refused_from_where_the_axes_are_is_followed_by_another_one(
    table: Table, tmp_path: Path
) -> None:
    """Axes without homing: they are where the last run ended, 4 mm from where the circle fits."""
    made = table("homing_method = 37", "homing_method = 0")

    def aside() -> Script:
        yield made.at(Stage.STANDBY)
        yield from switched_on(made)
        yield from jogged(made, -0.04, 120)
        assert made.machine.set_points_m()[0] < -0.003

    def refused() -> Script:
        yield made.at(Stage.STANDBY)
        assert "position" in made.machine.reason
        yield from loaded(made)
        yield from switched_on(made)
        yield from run_program_to_its_end(made)

    (tmp_path / "far.toml").write_text(circle(5.0, 3000.0), encoding="utf-8")
    made.run(aside)
    report = made.run(refused, program=load_program(tmp_path / "far.toml", made.stand.machine.controller))
    assert not report.failed
    assert report.completed


def killed_run(table: ConsecutiveRuns, *, signed_off: bool) -> None:
    """Kill the controller in motion; `signed_off`: by an exception, after which it still stops the drives."""

    def killed() -> Script:
        yield from prepared(table)
        yield from started(table)
        yield IN_MOTION
        table.wire.controller_dead = not signed_off
        table.stand.kill()
        yield 100_000

    with pytest.raises(asyncio.CancelledError):
        table.run(killed)


@pytest.mark.parametrize("pacing", ["lockstep", "realtime"])
@pytest.mark.parametrize("signed_off", [False, True])
def test_new_run_finds_the_drives_of_a_controller_that_was_killed(
    table: Table, pacing: str, *, signed_off: bool
) -> None:
    """By SIGKILL, or by an exception of its own."""
    made = table(pacing=pacing)
    killed_run(made, signed_off=signed_off)
    fresh_run(made)


def test_new_run_finds_drives_still_under_control(table: Table) -> None:
    """The controller was killed so recently that no drive has missed its heartbeat."""
    made = table(at_once=True)
    killed_run(made, signed_off=False)
    motion = made.stand.bench._drives.drives[0].motion
    assert motion.powered
    assert not motion.stopping
    fresh_run(made)


def test_enable_is_refused_while_the_interface_is_off_the_bus(table: Table) -> None:
    made = table()

    def script() -> Script:
        yield from prepared(made)
        yield from bus_off(made)
        yield made.at(Stage.STANDBY)
        verdict = made.stand.handler.execute(CommandRequest(Command.ENABLE))
        assert not verdict.accepted
        assert "bus-off; the interface restarts by itself where restart-ms is set" in verdict.reason
        bus_restarts(made)
        yield from switched_on(made)

    assert not made.run(script).failed
