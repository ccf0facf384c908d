"""A run as `candump -L` writes it, replayed: the nodes answer with the same frames, bit by bit."""

import re
from pathlib import Path

import pytest
from consecutive_runs import ConsecutiveRuns, Script

from can_frames.frame import FRAME
from hil_sim.config import PlantConfig
from hil_sim.runner.bench import SimulatedMachine
from hil_sim.runner.pacing import Lockstep
from servo_ctrl.commands.command import Command
from servo_ctrl.commands.stage import Stage
from tests.campaigns.campaign.machine import CampaignMachine, make_machine

LINE = re.compile(r"\((\d+\.\d+)\) (\S+) ([0-9A-F]{3})#((?:[0-9A-F]{2})*)")
FROM_NODES, FROM_CONTROLLER = "vcan0", "can0"
"""Interface names that mark the sender of a logged frame; `candump` would log one name."""
Frame = tuple[int, bytes]


class Candump:
    """Writes the frames of a bench and of its master."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="ascii")
        self.time_s = 0.0

    def log(self, interface: str, can_id: int, data: bytes) -> None:
        """Write one frame."""
        self._file.write(f"({self.time_s:017.6f}) {interface} {can_id:03X}#{data.hex().upper()}\n")

    def close(self) -> None:
        """Write the remaining frames."""
        self._file.close()


def recorded(runs: ConsecutiveRuns, log: Candump) -> None:
    """Run the machine's program and log every frame."""
    bench, wire = runs.stand.bench, runs.wire
    to_nodes = wire.nodes

    def from_controller(can_id: int, data: bytes) -> None:
        log.time_s = bench.clock.now_us * 1e-6
        log.log(FROM_CONTROLLER, can_id, bytes(data))
        to_nodes(can_id, data)

    from_nodes = wire.from_nodes

    def answered(can_id: int, data: bytes) -> None:
        log.log(FROM_NODES, can_id, bytes(data))
        from_nodes(can_id, data)

    def answered_in_one_go(burst: bytes) -> None:
        for can_id, size, data in FRAME.iter_unpack(burst):
            answered(can_id, data[:size])

    wire.nodes = from_controller
    bench.send_burst = answered_in_one_go
    for slave in bench.slaves:
        slave._host = slave._host._replace(send=answered)

    def script() -> Script:
        yield from runs.ready_with_program()
        runs.ask(Command.START_PROGRAM)
        yield 200
        assert runs.machine.stage is Stage.RUNNING

    runs.run(script)
    log.close()


def replayed(path: Path, plant: PlantConfig) -> tuple[list[Frame], list[Frame]]:
    """Return the nodes' frames in the log, and those of new nodes under the logged controller frames."""
    answers: list[Frame] = []
    bench = SimulatedMachine(plant, lambda can_id, data: answers.append((can_id, bytes(data))))
    Lockstep(bench)
    bench.start()
    answers.clear()
    logged: list[Frame] = []
    for line in path.read_text(encoding="ascii").splitlines():
        found = LINE.fullmatch(line)
        assert found, line
        frame = int(found[3], 16), bytes.fromhex(found[4])
        if found[2] == FROM_CONTROLLER:
            bench.handle(*frame)
        else:
            logged.append(frame)
    return logged, answers


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[CampaignMachine, Path]:
    """A machine and the log of one of its runs."""
    folder = tmp_path_factory.mktemp("run")
    machine, path = make_machine(folder), folder / "candump.log"
    runs = ConsecutiveRuns(machine, folder, "lockstep", pause_s=0.0)
    try:
        recorded(runs, Candump(path))
    finally:
        runs.close()
    return machine, path


def test_a_run_is_replayed_from_its_candump(run: tuple[CampaignMachine, Path]) -> None:
    machine, path = run
    logged, answers = replayed(path, machine.plant)
    assert len(logged) > 1000
    assert {can_id for can_id, _ in logged} >= {0x181, 0x182, 0x18B, 0x18C, 0x581, 0x701}
    assert logged == answers


def test_a_replay_with_one_different_set_point_is_reported(
    run: tuple[CampaignMachine, Path], tmp_path: Path
) -> None:
    """The comparison can fail."""
    machine, path = run
    text = path.read_text(encoding="ascii")
    led = [found for found in re.finditer(r"can0 201#0F000A([0-9A-F]{4})", text) if int(found[1], 16)]
    at = led[len(led) // 2].start(1)
    changed = tmp_path / "changed.log"
    changed.write_text(text[:at] + "FF0F" + text[at + 4 :], encoding="ascii")
    logged, answers = replayed(changed, machine.plant)
    assert logged != answers
