"""`reconcile loop`: move by the daemon, record, diagnose, ask for the next motion, until it is decided."""

from __future__ import annotations

import asyncio
import contextlib
import json
from typing import TYPE_CHECKING, Any, NamedTuple

from reconcile.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.loop_start import first_program, refuse_unsafe
from reconcile.model_file import load_model
from reconcile.next_experiment_limits import limits_of
from reconcile.next_experiment_program import PROGRAM
from servo_ctrl.config.errors import ServoCtrlError
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.program import check_steps
from servo_ctrl.config.steps import program_steps
from servo_ctrl.daemon.supervisor import run_machine
from servo_ctrl.experiment.simulated_machine import simulated_machine
from servo_ctrl.telemetry.parquet import write_whole

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Callable, Mapping
    from pathlib import Path

    from reconcile.diagnose import Diagnosis
    from reconcile.next_experiment_limits import Limits
    from servo_ctrl.config.model import MachineConfig
    from servo_ctrl.daemon.report import Pacing, Progress, RunReport

LOG = "loop.json"
STARTING_S = 120.0
"""Bound of booting and referencing."""
SLOWNESS = 10.0
"""A run in lockstep may take so many times the machine's own time; one in real time takes it once."""
DECIDED, BUDGET, STOPPED = "decided", "budget used", "stopped"


class Circle(NamedTuple):
    """What goes round: the files, where the axes are, and how often."""

    machine: Path
    model: Path
    out: Path
    most_recordings: int = 6
    plant: Path | None = None
    """Of the simulator that is started; None: the machine's own."""
    bus: str | None = None
    """Where the machine is already; None: a simulator on a bus of its own."""
    program: Path | None = None
    """The first motion; None: a bit of each, axis by axis."""
    pacing: Pacing = "lockstep"


class Outcome(NamedTuple):
    """How it ended."""

    why: str
    """decided, budget used, or stopped."""
    rounds: list[dict[str, Any]]
    last: Diagnosis | None
    log: Path


def run_loop(
    circle: Circle,
    on_text: Callable[[str], None] = lambda _text: None,
    on_progress: Callable[[Progress], None] | None = None,
) -> Outcome:
    """The whole circle; `loop.json` is written anew after each round. Raises ReconcileError.

    Ctrl-C while the axes move: the daemon brings them to rest, and the circle ends there.
    """
    try:
        machine = load_machine(circle.machine)
        model = load_model(circle.model)
        refuse_unsafe(machine, model)
        if (circle.out / LOG).exists():
            raise ReconcileError(circle.out / LOG, "", "is there already", "name another directory")
        limits = {name: limits_of(machine, name, axis) for name, axis in model.axes.items()}
        circle.out.mkdir(parents=True, exist_ok=True)
        program = circle.program or first_program(machine, limits, circle.out)
        return asyncio.run(_Rounds(circle, machine, limits, on_text, on_progress).until_decided(program))
    except ServoCtrlError as error:
        raise ReconcileError(circle.machine, "", str(error)) from error


class _Rounds:
    """Round by round."""

    def __init__(
        self,
        circle: Circle,
        machine: MachineConfig,
        limits: Mapping[str, Limits],
        on_text: Callable[[str], None],
        on_progress: Callable[[Progress], None] | None,
    ) -> None:
        self._circle, self._machine, self._limits = circle, machine, limits
        self._on_text, self._on_progress = on_text, on_progress
        self._rounds: list[dict[str, Any]] = []
        self._recordings: list[Path] = []
        self._made: list[str] = []

    async def until_decided(self, program: Path) -> Outcome:
        """Move, record, diagnose, ask."""
        last: Diagnosis | None = None
        why = BUDGET
        async with self._bus() as bus:
            for number in range(1, self._circle.most_recordings + 1):
                folder = self._circle.out / f"round_{number}"
                asked = self._rounds[-1]["next_experiment"] if self._rounds else {}
                self._on_text(f"recording {number}: {asked.get('motion') or program}")
                report = await self._moved(program, bus, folder / "recording")
                if report.signal or not report.completed:
                    why = STOPPED
                    self._log({"number": number, "program": str(program), "stopped": report.reason}, why)
                    if report.failed:
                        raise ReconcileError(program, "", f"the run was not completed: {report.reason}")
                    break
                self._recordings.append(folder / "recording")
                last = await asyncio.to_thread(self._diagnosed, folder)
                self._made.append(last.asked.kind)
                decided = not last.asked.program
                why = DECIDED if decided else BUDGET
                self._log(_round(number, program, folder, report, last), why)
                if decided:
                    break
                program = folder / PROGRAM
        return Outcome(why, self._rounds, last, self._circle.out / LOG)

    @contextlib.asynccontextmanager
    async def _bus(self) -> AsyncIterator[str]:
        """The machine's own, or that of a simulator, which stays on from round to round as a machine does."""
        if self._circle.bus is not None:
            yield self._circle.bus
            return
        plant = self._circle.plant or self._machine.source.parent
        async with simulated_machine(plant, self._circle.pacing) as bus:
            yield bus

    async def _moved(self, file: Path, bus: str, recording: Path) -> RunReport:
        """One program, checked before anything moves, within a bound."""
        program = load_program(file, self._machine)
        cycles = check_steps(program_steps(program, self._machine), file, self._machine).cycles
        bound_s = STARTING_S + SLOWNESS * cycles * self._machine.period_s
        try:
            async with asyncio.timeout(bound_s):
                return await run_machine(
                    self._machine,
                    program,
                    bus,
                    self._circle.pacing,
                    recording,
                    self._on_progress,
                    compensation="off",
                )
        except TimeoutError:
            raise ReconcileError(file, "", f"the run was not over after {bound_s:.0f} s") from None

    def _diagnosed(self, folder: Path) -> Diagnosis:
        return diagnose(
            self._recordings,
            self._circle.model,
            folder,
            on_progress=self._on_text,
            limits=self._limits,
            made=self._made,
        )

    def _log(self, entry: dict[str, Any], why: str) -> None:
        self._rounds.append(entry)
        content = {
            "machine": str(self._circle.machine),
            "model": str(self._circle.model),
            "ended": why,
            "rounds": self._rounds,
        }
        text = json.dumps(content, indent=1) + "\n"
        write_whole(self._circle.out / LOG, lambda file: file.write_text(text, encoding="utf-8"))


def _round(number: int, program: Path, folder: Path, report: RunReport, found: Diagnosis) -> dict[str, Any]:
    verdict = found.verdict
    return {
        "number": number,
        "program": str(program),
        "recording": str(folder / "recording"),
        "cycles": report.cycles,
        "verdict": verdict["verdict"],
        "findings": [
            {key: one[key] for key in ("axis", "effect", "confidence", "equivalent", "heldout_gain")}
            for one in verdict["findings"]
        ],
        "next_experiment": verdict["next_experiment"],
    }
