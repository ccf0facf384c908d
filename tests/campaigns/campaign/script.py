"""The operator of a run: brings the machine into a state, injects the fault, and ends the run.

A script yields a number of ticks or a condition to wait for. It acts between two ticks, so that runs with
the same seed are equal.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING

from servo_ctrl.commands.command import Command, CommandRequest
from servo_ctrl.commands.stage import Stage

if TYPE_CHECKING:
    from random import Random

    from tests.campaigns.campaign.stand import Stand

Condition = Callable[[], bool]
Script = Generator[Condition | int, None, None]
CONDITION_TICKS_MAX = 900
"""Bounds the wait for a condition, ticks; then the script continues. Chosen."""
WAIT_MAX_S = 4.0
"""Bounds a wait in simulated time, seconds, because in lockstep without nodes each tick is slow; chosen."""
FAST_M_S, TO_A_LIMIT = 0.05, 16
"""Jog speed and number of jogs to a limit: 16 times 20 ms at this speed exceed the 12 mm to any limit."""
STATE_TICKS_MAX = {
    "starting": 30,
    "ready": 60,
    "running": 420,
    "jogging": 120,
    "at a limit": 60,
    "held": 60,
    "learning": 700,
}
"""Largest number of ticks in a state before the fault; chosen."""


class Operator:
    """The operator of one run. `inject` injects the fault; the run ends `ticks_after` ticks later.

    `state_reached`: whether the script reached the state.
    """

    def __init__(
        self,
        stand: Stand,
        rng: Random,
        state: str,
        inject: Callable[[], None],
        ticks_after: int,
        *,
        stand_by: bool,
    ) -> None:
        self.state_reached = False
        self.frames_before_stop: int | None = None
        """Number of frames on the bus when the stop was requested."""
        self.second: Callable[[], None] | None = None
        """Injects another fault, `pause` ticks after the first."""
        self.pause = 0
        self._stand, self._rng, self._state, self._inject = stand, rng, state, inject
        self._ticks_after = ticks_after
        self._script = self._run_script(stand_by=stand_by)
        self._wait: Condition | int = 0
        self._waited = 0
        stand.on_tick = self._advance

    def _advance(self) -> None:
        while True:
            if isinstance(self._wait, int):
                if self._wait > 0:
                    self._wait -= 1
                    return
            elif not self._wait():
                self._waited += 1
                if self._waited < CONDITION_TICKS_MAX:
                    return
            try:
                self._wait, self._waited = next(self._script), 0
            except StopIteration:
                self._stand.on_tick = _no_action
                return

    def _until(self, ticks: int) -> Condition:
        """Return a condition that holds after these ticks, or after `WAIT_MAX_S`."""
        left, end_s = iter(range(ticks)), self._stand.loop.time() + WAIT_MAX_S
        return lambda: next(left, None) is None or self._stand.loop.time() > end_s

    def at(self, *stages: Stage) -> Condition:
        """Return the condition that the machine is in one of these stages."""
        return lambda: self._stand.daemon.stage in stages

    def give_command(self, command: Command, axis: str = "") -> bool:
        """Give a command; return whether it was accepted."""
        return bool(self._stand.handler.execute(CommandRequest(command, axis)).accepted)

    def _run_script(self, *, stand_by: bool) -> Script:
        if self._state != "booting":
            yield from self._reach_state(stand_by=stand_by)
            self.state_reached = True
            self._inject()
            if self.second is not None:
                yield self._until(self.pause)
                self.second()
        yield self._until(self._ticks_after)
        if stand_by and self._stand.daemon.stage is Stage.STANDBY and self._rng.random() < 0.5:
            self.give_command(Command.ENABLE)
            yield 80
        self.frames_before_stop = len(self._stand.wire.frames)
        self._stand.signal("SIGTERM")
        yield self._until(CONDITION_TICKS_MAX)
        self._stand.signal("SIGTERM")

    def _reach_state(self, *, stand_by: bool) -> Script:
        """Reach the state, and wait a random time in it."""
        state, rng = self._state, self._rng
        if state == "standby":
            yield from self._standby()
            return
        if stand_by:
            yield self.at(Stage.STANDBY)
            if state in {"running", "held", "stopping"}:
                self._stand.handler.load_program(self._stand.machine.program)
                yield lambda: self._stand.handler.status().program.loaded
            yield rng.randint(0, 5)
            yield lambda: self.give_command(Command.ENABLE)
        if state == "starting":
            yield rng.randint(0, STATE_TICKS_MAX[state])
            return
        yield self.at(Stage.READY, Stage.RUNNING)
        yield from self._reach_motion(rng.choice(("running", "jogging")) if state == "stopping" else state)
        if state == "stopping":
            self.give_command(Command.DISABLE)
            yield rng.randint(0, 30)

    def _standby(self) -> Script:
        """Reach standby, before the drives were first on or after."""
        yield self.at(Stage.STANDBY)
        if self._rng.random() < 0.5:
            self.give_command(Command.ENABLE)
            yield self.at(Stage.READY)
            self.give_command(Command.DISABLE)
            yield self.at(Stage.STANDBY)
        yield self._rng.randint(0, 60)

    def _reach_motion(self, state: str) -> Script:
        rng, handler = self._rng, self._stand.handler
        if state == "running":
            self.give_command(Command.START_PROGRAM)
            yield self.at(Stage.RUNNING)
        elif state == "jogging":
            handler.jog(rng.choice("xy"), rng.choice((-1, 1)) * rng.uniform(0.005, 0.05))
        elif state == "at a limit":
            axis, direction = rng.choice("xy"), rng.choice((-1, 1))
            for _ in range(TO_A_LIMIT):
                handler.jog(axis, direction * FAST_M_S)
                yield 20
        elif state == "held":
            self.give_command(Command.START_PROGRAM)
            yield rng.randint(20, STATE_TICKS_MAX["running"])
            self.give_command(Command.HOLD_PROGRAM)
        elif state == "learning":
            self.give_command(Command.START_LEARNING, rng.choice("xy"))
        yield rng.randint(0, STATE_TICKS_MAX[state])


def _no_action() -> None:
    """Do nothing: the script has ended."""
