"""Runs of the daemon, one after the other, on the same simulated nodes, in simulated time.

Stand, wire and clock are those of the campaign; what is added is that the nodes outlive a run.
"""

from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from tests.campaigns.campaign import life
from tests.campaigns.campaign.machine import CampaignMachine, parsed_files_kept
from tests.campaigns.campaign.stand import BUS, Stand

Condition = Callable[[], bool]
Script = Generator[Condition | int, None, None]

PATIENCE = 1500
"""Ticks that a condition is waited for."""


class ConsecutiveRuns:
    """A table that is on the bus from the beginning. `run` makes a run on it, with this operator's script.

    A script yields a number of ticks or a condition that it waits for; at its end the run gets SIGTERM.
    `pause_s` go by between two runs.
    """

    def __init__(
        self, machine: CampaignMachine, folder: Path, pacing: str = "realtime", pause_s: float = 0.3
    ) -> None:
        self._folder, self._pause_s = folder, pause_s
        with parsed_files_kept():
            self.stand = Stand(machine, folder, pacing)
        self.wire = self.stand.wire
        self.kept: Callable[[], object] = lambda: None
        """Undoes what a fault has done to the simulator."""
        self.last_refusal = ""
        """Why the operator was last refused something."""
        self.stand.power_up()

    @property
    def machine(self) -> Any:
        """The machine of the daemon that runs, or ran last."""
        return self.stand.daemon

    @property
    def servo(self) -> Any:
        """Its axis x."""
        return self.machine._drives._places[0].servo

    def at(self, *stages: Stage) -> Condition:
        """Whether the machine is in one of these stages."""
        return lambda: self.machine.stage in stages

    def ask(self, command: Command, axis: str = "") -> None:
        """Give a command, which must be accepted."""
        verdict = self.stand.handler.execute(CommandRequest(command, axis))
        assert verdict.accepted, verdict.reason

    def loaded(self) -> Script:
        """Put the machine's program in the place of the run's."""
        self.stand.handler.load_program(self.stand.machine.program)
        yield lambda: not self.stand.handler.status().program.preparing

    def ready_with_program(self) -> Script:
        """From boot: the machine's program is there, and the drives are on."""
        yield self.at(Stage.STANDBY)
        yield from self.loaded()
        self.ask(Command.ENABLE)
        yield self.at(Stage.READY)

    def run(
        self, script: Callable[[], Script], *, program: Any = None, recording: Path | None = None
    ) -> RunReport:
        """One run that stands by, from boot to its end. Raises what the script or the run raises."""
        stand = self.stand
        operator = _Operator(stand, script())
        stand.assembly, stand.on_tick = None, operator.act
        options: dict[str, Any] = {"stand_by": True, "learned_dir": self._folder / "learned"}
        pacing: Any = stand.pacing
        machine = run_machine(stand.machine.controller, program, BUS, pacing, recording, **options)
        try:
            with parsed_files_kept():
                report = life.to_its_end(stand, machine)
        finally:
            stand.begin_again()
            stand.afterlife(self._pause_s)
        if operator.trouble is not None:
            raise operator.trouble
        return report

    def close(self) -> None:
        """Nothing is left of it."""
        self.wire.end.shutdown()
        self.stand.loop.workers.shutdown()
        self.stand.loop.close()


class _Operator:
    """Goes through a script between ticks; what goes wrong in it ends the run and is kept."""

    def __init__(self, stand: Stand, script: Script) -> None:
        self.trouble: BaseException | None = None
        self._stand, self._script = stand, script
        self._wait: Condition | int = 0
        self._left = PATIENCE

    def act(self) -> None:
        """Called after every tick."""
        try:
            if not self._waits():
                self._wait, self._left = next(self._script), PATIENCE
        except StopIteration:
            self._end()
        except BaseException as trouble:  # noqa: BLE001  # raised again once the run is over
            self.trouble = trouble
            self._end()

    def _waits(self) -> bool:
        if isinstance(self._wait, int):
            self._wait -= 1
            return self._wait > 0
        self._left -= 1
        assert self._left, f"waited in vain: {self._stand.daemon.stage!r}, {self._stand.daemon.reason}"
        return not self._wait()

    def _end(self) -> None:
        self._stand.on_tick = lambda: None
        self._stand.signal("SIGTERM")
