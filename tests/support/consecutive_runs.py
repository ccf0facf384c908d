"""Runs of the daemon, one after the other, on the same simulated nodes, in simulated time.

Stand, wire and clock are those of the campaign; here the nodes survive a run.
"""

from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.stage import Stage
from servo_ctrl.daemon.run.report import RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from tests.campaigns.campaign import daemon_run
from tests.campaigns.campaign.machine import CampaignMachine, parsed_files_cached
from tests.campaigns.campaign.stand import BUS, Stand

Condition = Callable[[], bool]
Script = Generator[Condition | int, None, None]

CONDITION_TICKS = 1500
"""Bound of the wait for a condition, in ticks; chosen."""


class ConsecutiveRuns:
    """A table on the bus. `run` makes a run on it, with an operator's script.

    A script yields a number of ticks or a condition to wait for; at its end the run gets SIGTERM.
    `pause_s` is the time between two runs.
    """

    def __init__(
        self, machine: CampaignMachine, folder: Path, pacing: str = "realtime", pause_s: float = 0.3
    ) -> None:
        self._folder, self._pause_s = folder, pause_s
        with parsed_files_cached():
            self.stand = Stand(machine, folder, pacing)
        self.wire = self.stand.wire
        self.undo: Callable[[], object] = lambda: None
        """Restores what a fault has changed in the simulator."""
        self.last_refusal = ""
        """Reason of the last refused command."""
        self.stand.power_up()

    @property
    def machine(self) -> Any:
        """The machine of the present or last run."""
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
        """Load the machine's program in place of the run's."""
        self.stand.handler.load_program(self.stand.machine.program)
        yield lambda: not self.stand.handler.status().program.preparing

    def ready_with_program(self) -> Script:
        """From boot until the machine's program is loaded and the drives are on."""
        yield self.at(Stage.STANDBY)
        yield from self.loaded()
        self.ask(Command.ENABLE)
        yield self.at(Stage.READY)

    def run(
        self, script: Callable[[], Script], *, program: Any = None, recording: Path | None = None
    ) -> RunReport:
        """One run with standby, from boot to its end. Raises what the script or the run raises."""
        stand = self.stand
        operator = _Operator(stand, script())
        stand.on_tick = operator.act
        options: dict[str, Any] = {"stand_by": True, "learned_dir": self._folder / "learned"}
        pacing: Any = stand.pacing
        machine = run_machine(stand.machine.controller, program, BUS, pacing, recording, **options)
        try:
            with parsed_files_cached():
                report = daemon_run.run_to_end(stand, machine)
        finally:
            stand.begin_next_run()
            stand.advance_nodes(self._pause_s)
        if operator.error is not None:
            raise operator.error
        return report

    def close(self) -> None:
        """Release bus, threads and event loop."""
        self.wire.controller_port.shutdown()
        self.stand.loop.workers.shutdown()
        self.stand.loop.close()


class _Operator:
    """Advances a script between ticks; an exception of the script ends the run and is kept in `error`."""

    def __init__(self, stand: Stand, script: Script) -> None:
        self.error: BaseException | None = None
        self._stand, self._script = stand, script
        self._wait: Condition | int = 0
        self._left = CONDITION_TICKS

    def act(self) -> None:
        """Called after every tick."""
        try:
            if not self._waits():
                self._wait, self._left = next(self._script), CONDITION_TICKS
        except StopIteration:
            self._end()
        except BaseException as error:  # noqa: BLE001  # raised again once the run is over
            self.error = error
            self._end()

    def _waits(self) -> bool:
        if isinstance(self._wait, int):
            self._wait -= 1
            return self._wait > 0
        self._left -= 1
        assert self._left, (
            f"the condition did not come true: {self._stand.daemon.stage!r}, {self._stand.daemon.reason}"
        )
        return not self._wait()

    def _end(self) -> None:
        self._stand.on_tick = lambda: None
        self._stand.signal("SIGTERM")
