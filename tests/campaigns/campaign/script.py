"""The operator of a run: brings the machine into a state, lets the fault happen, ends the run.

A script yields the number of ticks that it waits, or a condition that it waits for; it acts between two
ticks, so that every run with the same seed is the same.
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
PATIENCE = 900
"""Ticks that a condition is waited for; then the run goes on without it."""
SLOW_S = 4.0
"""Lockstep without nodes: every tick waits for its inputs."""
FAST_M_S, TO_A_LIMIT = 0.05, 16
"""16 times 20 ms at this speed: more than the 12 mm to any limit."""
LONGEST = {
    "starting": 30,
    "ready": 60,
    "running": 420,
    "jogging": 120,
    "at a limit": 60,
    "held": 60,
    "learning": 700,
}
"""Ticks in a state before the fault, at most."""


class Operator:
    """Of one run. `happen` lets the fault happen; the run is ended `watched` ticks after it.

    `arrived` says whether the state was reached.
    """

    def __init__(
        self,
        stand: Stand,
        rng: Random,
        state: str,
        happen: Callable[[], None],
        watched: int,
        *,
        stand_by: bool,
    ) -> None:
        self.arrived = False
        self.frames_before_stop: int | None = None
        """Frames that were on the bus when the stop was requested."""
        self.second: Callable[[], None] | None = None
        """Lets another fault happen, `pause` ticks behind the first."""
        self.pause = 0
        self._stand, self._rng, self._state, self._happen = stand, rng, state, happen
        self._watched = watched
        self._script = self._whole(stand_by=stand_by)
        self._wait: Condition | int = 0
        self._waited = 0
        stand.on_tick = self._act

    def _act(self) -> None:
        while True:
            if isinstance(self._wait, int):
                if self._wait > 0:
                    self._wait -= 1
                    return
            elif not self._wait():
                self._waited += 1
                if self._waited < PATIENCE:
                    return
            try:
                self._wait, self._waited = next(self._script), 0
            except StopIteration:
                self._stand.on_tick = _nothing
                return

    def _until(self, ticks: int) -> Condition:
        """So many ticks; or some time, where ticks are slow."""
        left, end_s = iter(range(ticks)), self._stand.loop.time() + SLOW_S
        return lambda: next(left, None) is None or self._stand.loop.time() > end_s

    def at(self, *stages: Stage) -> Condition:
        """Whether the machine is in one of these stages."""
        return lambda: self._stand.daemon.stage in stages

    def ask(self, command: Command, axis: str = "") -> bool:
        """Give a command; whether it was accepted."""
        return bool(self._stand.handler.execute(CommandRequest(command, axis)).accepted)

    def _whole(self, *, stand_by: bool) -> Script:
        if self._state != "booting":
            yield from self._towards(stand_by=stand_by)
            self.arrived = True
            self._happen()
            if self.second is not None:
                yield self._until(self.pause)
                self.second()
        yield self._until(self._watched)
        if stand_by and self._stand.daemon.stage is Stage.STANDBY and self._rng.random() < 0.5:
            self.ask(Command.ENABLE)
            yield 80
        self.frames_before_stop = len(self._stand.wire.frames)
        self._stand.signal("SIGTERM")
        yield self._until(PATIENCE)
        self._stand.signal("SIGTERM")

    def _towards(self, *, stand_by: bool) -> Script:
        """To the state, and some way into it."""
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
            yield lambda: self.ask(Command.ENABLE)
        if state == "starting":
            yield rng.randint(0, LONGEST[state])
            return
        yield self.at(Stage.READY, Stage.RUNNING)
        yield from self._moving(rng.choice(("running", "jogging")) if state == "stopping" else state)
        if state == "stopping":
            self.ask(Command.DISABLE)
            yield rng.randint(0, 30)

    def _standby(self) -> Script:
        """Before the drives were ever on, or after they have been."""
        yield self.at(Stage.STANDBY)
        if self._rng.random() < 0.5:
            self.ask(Command.ENABLE)
            yield self.at(Stage.READY)
            self.ask(Command.DISABLE)
            yield self.at(Stage.STANDBY)
        yield self._rng.randint(0, 60)

    def _moving(self, state: str) -> Script:
        rng, handler = self._rng, self._stand.handler
        if state == "running":
            self.ask(Command.START_PROGRAM)
            yield self.at(Stage.RUNNING)
        elif state == "jogging":
            handler.jog(rng.choice("xy"), rng.choice((-1, 1)) * rng.uniform(0.005, 0.05))
        elif state == "at a limit":
            axis, side = rng.choice("xy"), rng.choice((-1, 1))
            for _ in range(TO_A_LIMIT):
                handler.jog(axis, side * FAST_M_S)
                yield 20
        elif state == "held":
            self.ask(Command.START_PROGRAM)
            yield rng.randint(20, LONGEST["running"])
            self.ask(Command.HOLD_PROGRAM)
        elif state == "learning":
            self.ask(Command.START_LEARNING, rng.choice("xy"))
        yield rng.randint(0, LONGEST[state])


def _nothing() -> None:
    """The script is over."""
