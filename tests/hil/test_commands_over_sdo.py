"""The real controller in lockstep, commanded by canopen's client with our EDS, and by ours in Python."""

import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import canopen
import pytest
from learned_examples import LEARNED
from node_client_bus import node_client_bus
from program_steps import circle

import servo_ctrl
from servo_ctrl.commands.stage import Stage
from servo_ctrl.config.load import load_machine
from servo_ctrl.learned.store import LearnedStore

NODE_ID = 127
EDS = Path(__file__).parents[2] / "eds" / "servo_ctrl.eds"
LIMIT_S = 120.0
READY, RUNNING, DISABLING, OFF = 2, 3, 6, 7
START, ABORT, PAUSE, RESUME, DISABLE, ROLL_BACK, START_PROGRAM = 1, 2, 3, 4, 6, 9, 10
IDLE, LEARNS, PAUSED, ABORTED = 0, 1, 3, 5
CIRCLES = circle(10.0, 3000.0, turns=4.0)


class Panel:
    """An operator panel on the bus: reads, writes, and received status PDOs."""

    def __init__(self, bus: can.BusABC) -> None:
        self._network = canopen.Network(bus)
        self._network.connect()
        self.remote: Any = self._network.add_node(NODE_ID, str(EDS))
        self.remote.sdo.RESPONSE_TIMEOUT = 5.0
        self.statuses: list[tuple[int, ...]] = []
        self.emergencies: list[bytes] = []
        self._network.subscribe(0x180 + NODE_ID, self._hear)
        self._network.subscribe(
            0x080 + NODE_ID, lambda _id, data, _time: self.emergencies.append(bytes(data))
        )

    def write(self, value: int, index: int, subindex: int = 0) -> int:
        """Write an object; return the abort code, 0 if it was written."""
        entry = self.remote.sdo[index]
        try:
            if isinstance(entry, canopen.sdo.SdoVariable):
                entry.raw = value
            else:
                entry[subindex].raw = value
        except canopen.SdoAbortedError as refused:
            return int(refused.code)
        return 0

    def read(self, index: int, subindex: int | None = None) -> Any:
        entry = self.remote.sdo[index]
        return entry.raw if subindex is None else entry[subindex].raw

    def command(self, value: int, axis: int = 0) -> int:
        return self.write(axis, 0x2101) or self.write(value, 0x2100)

    def wait(self, condition: Callable[[], object]) -> None:
        """Wait until the condition holds; fail after a time limit."""
        deadline_s = time.monotonic() + LIMIT_S
        while not condition():
            assert time.monotonic() < deadline_s, f"last status {self.statuses[-1:]}"
            time.sleep(0.02)

    def close(self) -> None:
        self._network.disconnect()

    def _hear(self, _can_id: int, data: bytearray, _timestamp_s: float) -> None:
        stage, state, due, axis = data[:4]
        progress, j = int.from_bytes(data[4:6], "little"), int.from_bytes(data[6:], "little")
        self.statuses.append((stage, state, due, axis, progress, j))


@pytest.fixture
def panel_of(bench: Any, tmp_path: Path) -> Iterator[Callable[..., Panel]]:
    """Start simulator and controller, and connect a panel once the machine is ready."""
    with contextlib.ExitStack() as stack:

        def start(*options: str, stage: int = READY) -> Panel:
            machine = bench.machine({})
            bench.simulate(machine)
            panel = Panel(node_client_bus(bench.bus_spec, NODE_ID))
            stack.callback(panel.close)
            command = ["run", "--machine", str(machine), "--bus", bench.bus_spec, "--pacing", "lockstep"]
            bench.run("servo-ctrl", *command, *options)
            panel.wait(lambda: panel.statuses and panel.statuses[-1][0] == stage)
            return panel

        yield start


def test_learning_is_started_watched_paused_resumed_and_aborted(panel_of: Callable[..., Panel]) -> None:
    panel = panel_of()
    assert panel.command(RESUME) == 0x08000022
    assert panel.command(START, axis=2) == 0
    panel.wait(lambda: panel.statuses[-1][:4] == (RUNNING, LEARNS, 0, 2))
    assert panel.command(START, axis=1) == 0x08000022
    assert panel.read(0x2105) == "learning is running already; abort it first"
    assert panel.command(START_PROGRAM) == 0x08000022
    panel.wait(lambda: panel.statuses[-1][4] > 0)  # progress
    assert panel.command(PAUSE) == 0
    panel.wait(lambda: panel.statuses[-1][:2] == (READY, PAUSED))
    done, total = panel.read(0x2110, 3), panel.read(0x2110, 4)
    assert 0 < done < total
    assert 0 < panel.read(0x2110, 5) < 0xFFFF_FFFF
    assert 0 < panel.read(0x2110, 6) < 20_000  # nm
    assert panel.read(0x2110, 7) == 1000 * done // total
    assert panel.read(0x2111) in {"interval", "duration", "coarse", "fine", "search", "trailing", "check"}
    assert panel.command(RESUME) == 0
    panel.wait(lambda: panel.read(0x2110, 3) > done)
    assert panel.command(ABORT) == 0
    panel.wait(lambda: panel.statuses[-1][:2] == (READY, ABORTED))
    assert panel.read(0x2112) == "aborted"
    assert panel.read(0x2132, 1) == 0  # nothing was learned
    assert panel.command(ABORT) == 0x08000022
    assert panel.emergencies == []


def test_moving_machine_refuses_to_learn_and_shows_learning_due(
    panel_of: Callable[..., Panel], tmp_path: Path
) -> None:
    program = tmp_path / "circles.toml"
    program.write_text(CIRCLES, encoding="utf-8")
    panel = panel_of("--serve", "--program", str(program), stage=RUNNING)
    assert panel.command(START) == 0x08000022
    assert panel.read(0x2105) == "the machine is running, not ready"
    assert panel.write(1000, 0x2104, 1) == 0  # J_required 1 um: nothing has been learned, so it is exceeded
    assert panel.command(DISABLE, axis=1) == 0
    assert [panel.read(0x2102, sub) for sub in (0, 1, 2)] == [2, 0, 1]
    panel.wait(lambda: panel.statuses[-1][0] == READY)
    assert panel.command(START_PROGRAM) == 0
    panel.wait(lambda: panel.statuses[-1][0] == RUNNING)
    panel.wait(lambda: panel.statuses[-1][:3] == (READY, IDLE, 0b11))
    last = panel.read(0x2113, 2)
    for axis in (1, 2):
        record = panel.remote.sdo[0x2120 + axis]
        due, reversals, j, peak, rms, contour, acceleration, direction, cycle = (
            record[sub].raw for sub in range(1, 10)
        )
        assert due == 1
        assert reversals >= 12
        assert 1000 < j <= rms <= peak < 50_000
        assert contour < 50_000
        # v^2/R of the circle
        assert acceleration == pytest.approx(0.05**2 / 0.01 * 1e6, rel=0.02)
        assert direction in {-1, 1}
        assert 0 < cycle <= panel.read(0x2002)
        if axis == last:
            assert abs(panel.statuses[-1][5] - j / 100) < 1.0
    assert panel.emergencies == []


def test_learned_functions_are_read_and_rolled_back(panel_of: Callable[..., Panel], tmp_path: Path) -> None:
    directory = tmp_path / "learned"
    store = LearnedStore(directory, load_machine(Path(__file__).parents[2] / "machines" / "xy_table"))
    dates = [store.add("y", LEARNED._replace(strokes=61 + n), {}).learned_at for n in range(2)]
    panel = panel_of("--learned", str(directory))
    result = panel.remote.sdo[0x2132]
    assert [result[sub].raw for sub in (1, 2, 3, 6)] == [2, dates[1], 0, 62]
    assert [result[sub].raw for sub in (4, 5, 7, 9, 10, 11)] == [5250, 1125, 412, 4, 4, 2]
    durations = bytes(panel.read(0x2142, 1))
    assert durations == b"".join(
        number.to_bytes(4, "little")
        for row in ((2000, 310_000), (8000, 190_000), (30_000, 100_000), (120_000, 33_333))
        for number in row
    )
    assert panel.read(0x2131, 1) == 0
    assert panel.command(ROLL_BACK, axis=2) == 0
    assert [result[sub].raw for sub in (1, 6)] == [1, 61]
    active = directory / "y" / "active.json"
    active.unlink()
    active.mkdir()
    (active / "in the way").touch()
    assert panel.command(ROLL_BACK, axis=2) == 0x08000020
    assert "cannot be rolled back" in panel.read(0x2105)
    assert result[1].raw == 1
    assert panel.command(ROLL_BACK, axis=1) == 0x08000022


def test_the_client_of_python_starts_the_program_and_learning_and_switches_the_drives_off(
    panel_of: Callable[..., Panel], bench: Any, tmp_path: Path
) -> None:
    program = tmp_path / "circles.toml"
    program.write_text(CIRCLES, encoding="utf-8")
    panel = panel_of("--serve", "--program", str(program))
    with servo_ctrl.Client("xy_table", bench.bus_spec) as client:

        def reached(stage: Stage) -> None:
            assert any(status.stage is stage for status in client.subscribe(period_s=0.01))

        heard = len(panel.statuses)
        client.run()
        panel.wait(lambda: RUNNING in {status[0] for status in panel.statuses[heard:]})
        client.command("abort-program")
        reached(Stage.READY)
        client.learn("y")
        panel.wait(lambda: panel.statuses[-1][:2] == (RUNNING, LEARNS))
        client.command("abort-learning")
        reached(Stage.READY)
        with pytest.raises(servo_ctrl.CommandRefusedError, match="refused: "):
            client.enable()  # its drives are on
        client.disable()
        panel.wait(lambda: panel.statuses[-1][0] in {DISABLING, OFF})
