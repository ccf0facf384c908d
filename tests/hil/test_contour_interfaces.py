"""The contour error that the bus and MQTT tell is that of the cycle they name, as the recording has it."""

import asyncio
import signal
from pathlib import Path
from typing import Any

import canopen
import numpy as np
from mosquitto import Message, Mosquitto, needs_mosquitto
from node_client_bus import node_client_bus
from program_steps import circle, move

from servo_ctrl.recording.reader import load_recording

pytestmark = needs_mosquitto
ROOT = "servo_ctrl/xy_table"
NODE_ID = 127
EDS = Path(__file__).parents[2] / "eds" / "servo_ctrl.eds"
CYCLES, CONTOUR_ERROR, COUPLED = 0x2002, 0x2005, 0x2006
RADIUS_M, NM = 0.01, 1e-9
"""Between two cycles the error changes by some 50 nm."""
READINGS = 4
"""Of each interface on the circle, however fast the cycles pass beside other work."""
LONGEST_MOVE = 1000
"""Cycles of the move to the circle, at most: 10 mm at 50 mm/s."""
SECTION = '\n[contour_control]\naxes = ["x", "y"]\nkp_1_s = 50.0\n'
PROGRAM = move(10.0, 0.0, 3000.0) + circle(10.0, 3000.0, turns=1000.0)


class BusReader:
    """Another master's SDO client."""

    def __init__(self, bus_spec: str) -> None:
        self._network = canopen.Network(node_client_bus(bus_spec, NODE_ID))
        self._network.connect()
        self._node: Any = self._network.add_node(NODE_ID, str(EDS))
        self._node.sdo.RESPONSE_TIMEOUT = 5.0

    def read(self) -> tuple[int, int, int]:
        """The cycles before, the contour error in nm, the cycles after."""
        before, error_nm, after = (self._node.sdo[index].raw for index in (CYCLES, CONTOUR_ERROR, CYCLES))
        return before, error_nm, after

    def coupled(self) -> str:
        """The coupled axes."""
        return str(self._node.sdo[COUPLED].raw)

    def close(self) -> None:
        self._network.disconnect()


async def test_object_and_mqtt_tell_the_contour_error_of_their_cycle(bench: Any, tmp_path: Path) -> None:
    machine = bench.machine({})
    with (machine / "controller.toml").open("a", encoding="utf-8") as file:
        file.write(SECTION)
    program, record = tmp_path / "round.toml", tmp_path / "recording"
    program.write_text(PROGRAM, encoding="utf-8")
    bench.simulate(machine)
    command = ["run", "--machine", str(machine), "--bus", bench.bus_spec, "--pacing", "lockstep"]
    read: list[tuple[int, int, int]] = []
    async with Mosquitto(tmp_path) as broker, broker.listener(f"{ROOT}/#") as listener:
        options = ["--serve", "--program", str(program), "--record", str(record)]
        run = bench.run("servo-ctrl", *command, *options, "--mqtt", f"127.0.0.1:{broker.port}")
        state = await listener.until("/state", lambda state: state.content["stage"] == "running")
        on_circle = state.content["cycle"] + LONGEST_MOVE
        reader = BusReader(bench.bus_spec)
        while len(read) < READINGS:
            reading = await asyncio.to_thread(reader.read)
            if reading[0] > on_circle:
                read.append(reading)
            state = await listener.until("/state")
        last = state.content["cycle"]
        coupled = await asyncio.to_thread(reader.coupled)
        reader.close()
        states: list[Message] = [one for one in listener.received if one.topic.endswith("/state")]
        run.send_signal(signal.SIGTERM)
        await listener.until("/online", lambda online: online.payload == "offline")
        await asyncio.to_thread(run.wait, 60.0)

    assert {coupled, *(state.content["contour"]["coupled"] for state in states)} == {"x, y"}
    recording = load_recording(record)
    assert str(recording.header["events"]).count("accepted on their masses") == 1
    error_m = distance_from_the_circle_m(recording.columns, last)
    told = [(state.content["cycle"], state.content["contour"]["error_um"]) for state in states]
    over_mqtt = [(cycle, cycle, 1e-6 * error_um) for cycle, error_um in told if cycle - 2 in error_m]
    by_object = [(before, after, NM * error_nm) for before, error_nm, after in read if before - 2 in error_m]
    for readings in (over_mqtt, by_object):
        assert len(readings) >= READINGS
        for before, after, reading_m in readings:
            # the last whole cycle: the SYNC of the newest one may have been counted before its inputs came
            recorded = [error_m[cycle] for cycle in range(before - 2, after) if cycle in error_m]
            assert min(abs(reading_m - one) for one in recorded) < NM, (before, after)


def distance_from_the_circle_m(columns: Any, last: int) -> dict[int, float]:
    """By cycle of the program's circle, up to the last one: how far outside of it the table is, m.

    It is travelled counterclockwise, so that the path is on the left of a table outside.
    """
    x_m, y_m = (columns[f"{axis}.position_command_m"] for axis in ("x", "y"))
    round_ = (columns["segment"] == 1) & (columns["cycle"] <= last)  # a stop leaves it
    centre = [0.5 * (one[round_].max() + one[round_].min()) for one in (x_m, y_m)]
    actual = [columns[f"{axis}.scale_position_m"] for axis in ("x", "y")]
    distance = np.hypot(actual[0] - centre[0], actual[1] - centre[1]) - RADIUS_M
    speed = np.hypot(*(columns[f"{axis}.velocity_command_m_s"] for axis in ("x", "y")))
    chosen = round_ & (speed > 0.0)
    return dict(zip(columns["cycle"][chosen].tolist(), distance[chosen].tolist(), strict=True))
