"""`servo-ctrl ask` as a process, on the embedded bus, against a node with a fake command handler."""

import asyncio
import contextlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from fake_command_handler import LEARNED, OUTLOOK, REVERSAL, SCREW, FakeCommandHandler

from servo_ctrl.canopen.node import ControllerNode
from servo_ctrl.canopen.stack import Network
from servo_ctrl.commands.command import Command, CommandRequest, CommandResult, Refusal
from servo_ctrl.commands.learning_status import LearningState
from servo_ctrl.config.load import load_machine
from servo_ctrl.io.can_port import open_port

pytestmark = pytest.mark.usefixtures("hub")
ASK_LIMIT_S = 60.0


class Answer(NamedTuple):
    exit_code: int
    out: str
    err: str


async def ask(bus_spec: str, xy_table: Path, *words: str) -> Answer:
    program = str(Path(sys.executable).with_name("servo-ctrl"))
    options = ["--machine", str(xy_table), "--bus", bus_spec]
    process = await asyncio.create_subprocess_exec(
        program,
        "ask",
        *options,
        *words,
        env={"COLUMNS": "200", "PATH": ""},
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        async with asyncio.timeout(ASK_LIMIT_S):
            out, err = await process.communicate()
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
    assert process.returncode is not None
    return Answer(process.returncode, out.decode(), err.decode())


@contextlib.contextmanager
def controller(bus_spec: str, xy_table: Path) -> Iterator[FakeCommandHandler]:
    """Return our node on the bus, read by the running event loop."""
    port = open_port(bus_spec)
    try:
        port.attach(asyncio.get_running_loop())
        network, handler = Network(port.send), FakeCommandHandler()
        port.fallback = network.notify
        ControllerNode(network, load_machine(xy_table), handler).boot_up()
        yield handler
    finally:
        port.close()


async def test_a_command_for_an_axis_is_carried_out(bench: Any, xy_table: Path) -> None:
    with controller(bench.bus_spec, xy_table) as handler:
        answer = await ask(bench.bus_spec, xy_table, "start-learning", "--axis", "y")
        assert answer == (0, "", "")
        assert handler.requests == [CommandRequest(Command.START_LEARNING, "y")]


async def test_a_refusal_is_one_line_with_its_reason(bench: Any, xy_table: Path) -> None:
    with controller(bench.bus_spec, xy_table) as handler:
        handler.verdict = CommandResult(Refusal.WRONG_STATE, "axis x: the machine moves")
        answer = await ask(bench.bus_spec, xy_table, "start-learning")
        assert answer == (1, "", "servo-ctrl: refused: axis x: the machine moves\n")


async def test_settings_arrive_in_si(bench: Any, xy_table: Path) -> None:
    with controller(bench.bus_spec, xy_table) as handler:
        for words in (("required-um", "3.5"), ("learner", "paper"), ("adaptation", "on")):
            assert (await ask(bench.bus_spec, xy_table, "set", *words)).exit_code == 0
        assert handler.changes == [("required_m", 3.5e-6), ("learner", "paper"), ("adaptation", True)]


async def test_the_status_is_a_table_or_json(bench: Any, xy_table: Path) -> None:
    with controller(bench.bus_spec, xy_table) as handler:
        handler.set_learning("y", LearningState.RUNNING)
        handler.set_axis(0, learning_due=True, reversals=17, last=REVERSAL)
        handler.set_axis(1, version=3, learned_at="2026-11-21T10:00:00+00:00", learned=LEARNED, screw=SCREW)
        table = await ask(bench.bus_spec, xy_table, "status")
        assert table.exit_code == 0
        assert "learning: running, axis y, 12 of 48 strokes (coarse, 8 mm/s2), best J 2.50 um" in table.out
        shown = [[cell.strip() for cell in line.split("│")[1:-1]] for line in table.out.splitlines()]
        assert ["learning due", "yes", "no"] in shown
        assert ["J, um", "2.40", ""] in shown
        assert ["at, mm/s2", "27.8", ""] in shown
        assert ["functions", "none", "version 3"] in shown
        assert ["J after, um", "", "1.60"] in shown
        assert ["screw table", "none", "version 2"] in shown
        assert ["lost motion, um", "", "5.90"] in shown
        document = json.loads((await ask(bench.bus_spec, xy_table, "status", "--json")).out)
        assert document["stage"] == "ready"
        assert document["learning"]["strokes_done"] == OUTLOOK.strokes_done
        assert document["axis"]["x"]["last_reversal"]["error_rms_um"] == pytest.approx(3.1)
        assert document["axis"]["y"]["functions"]["amplitudes"][0] == {
            "acceleration_mm_s2": 2.0,
            "amplitude_mm_s": 0.31,
        }


async def test_watching_ends_with_the_learning(bench: Any, xy_table: Path) -> None:
    with controller(bench.bus_spec, xy_table) as handler:
        handler.set_learning(
            "x", LearningState.DONE, OUTLOOK._replace(strokes_done=48), "axis x: J 9.50 -> 1.60 um"
        )
        done = await ask(bench.bus_spec, xy_table, "watch")
        assert done == (0, "done, axis x, 48 of 48 strokes: axis x: J 9.50 -> 1.60 um\n", "")
        handler.set_learning("x", LearningState.RUNNING)
        watching = asyncio.create_task(ask(bench.bus_spec, xy_table, "watch"))
        while not watching.done():
            await asyncio.sleep(0.5)  # long enough for a look at the running one
            handler.set_learning("x", LearningState.FAILED, OUTLOOK, "axis x: following error")
        failed = watching.result()
        assert failed.exit_code == 1
        assert failed.err == (
            "servo-ctrl: learning failed, axis x, 12 of 48 strokes: axis x: following error\n"
        )


async def test_asking_on_a_bus_without_a_controller_is_an_error(bench: Any, xy_table: Path) -> None:
    answer = await ask(bench.bus_spec, xy_table, "status")
    complaint = "reading 1018h:02 was not answered (2 tries); is it running?"
    assert answer == (1, "", f"servo-ctrl: controller (node 127) on {bench.bus_spec}: {complaint}\n")


async def test_asking_a_node_of_another_kind_is_an_error(bench: Any, xy_table: Path) -> None:
    bench.simulate(xy_table)
    machine = bench.machine({"node_id = 11\n": "node_id = 99\n", "node_id = 127\n": "node_id = 11\n"})
    answer = await ask(bench.bus_spec, machine, "status")
    assert answer.exit_code == 1
    assert "product code" in answer.err
    assert "is not that of a servo-ctrl (53435452h)" in answer.err
