"""`hil_sim.Bench` serves a machine to any client; `servo_ctrl.Client` commands a controller on the bus."""

import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import pytest
from fake_command_handler import FakeCommandHandler

import hil_sim
import servo_ctrl
from servo_ctrl.canopen.node import ControllerNode
from servo_ctrl.canopen.stack import Network
from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.config.load import load_machine
from servo_ctrl.io.can_port import open_port

DEVICE_TYPE = b"\x40\x00\x10\x00\x00\x00\x00\x00"
"""SDO upload of object 1000h, CiA 301."""
CIA_402 = 402


@contextlib.contextmanager
def controller(bus_spec: str, machine: Path) -> Iterator[FakeCommandHandler]:
    """Return our node on the bus, read by the running event loop."""
    port = open_port(bus_spec)
    try:
        port.attach(asyncio.get_running_loop())
        network, handler = Network(port.send), FakeCommandHandler()
        port.fallback = network.notify
        ControllerNode(network, load_machine(machine), handler).boot_up()
        yield handler
    finally:
        port.close()


def test_a_bench_answers_anybodys_sdo_request_and_is_gone_after_the_block() -> None:
    with hil_sim.Bench("xy_table") as bench:
        folder = Path(bench.channel).parent
        with can.Bus(interface="localcan", channel=bench.channel) as bus:
            bus.send(can.Message(arbitration_id=0x601, is_extended_id=False, data=DEVICE_TYPE))
            answers = iter(lambda: bus.recv(10.0), None)
            answer = next(one for one in answers if one.arbitration_id == 0x581)
        assert int.from_bytes(answer.data[4:6], "little") == CIA_402
    assert not folder.exists()


def test_a_bench_that_cannot_start_reports_the_message_of_the_simulator(tmp_path: Path) -> None:
    with pytest.raises(hil_sim.BenchError, match=r"plant\.toml"), hil_sim.Bench(tmp_path):
        pass


def blocking_dialogue(machine: Path, bus: str) -> str:
    with servo_ctrl.Client(machine, bus) as client:
        client.learn("y")
        client.enable()
        with pytest.raises(servo_ctrl.CommandRefusedError, match="known are"):
            client.command("fly")
        return next(client.subscribe()).axes[0].name


@pytest.mark.usefixtures("hub")
async def test_both_clients_command_a_controller_and_read_its_status(bench: Any, xy_table: Path) -> None:
    with controller(bench.bus_spec, xy_table) as handler:
        first = await asyncio.to_thread(blocking_dialogue, xy_table, bench.bus_spec)
        async with servo_ctrl.AsyncClient(xy_table, bench.bus_spec) as client:
            await client.run()
            status = await client.status()
    assert first == status.axes[0].name == "x"
    assert handler.requests == [
        CommandRequest(Command.START_LEARNING, "y"),
        CommandRequest(Command.ENABLE, ""),
        CommandRequest(Command.START_PROGRAM, ""),
    ]
