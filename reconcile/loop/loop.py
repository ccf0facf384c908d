"""`reconcile loop`: run a program, record, diagnose, run the next experiment, until nothing is open."""

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator, Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from reconcile.design.limits import AxisLimits, limits_from_machine
from reconcile.design.program import PROGRAM_FILE
from reconcile.diagnosis.diagnose import WrittenDiagnosis, diagnose
from reconcile.errors import ReconcileError
from reconcile.loop.start import first_program, refuse_unsafe
from reconcile.nominal_model.model_file import load_model
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.program import check_steps
from servo_ctrl.config.steps import program_steps
from servo_ctrl.daemon.run.report import Pacing, Progress, RunReport
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.errors import ServoCtrlError
from servo_ctrl.files.whole_file import write_text_whole
from servo_ctrl.hil_rig.simulated_machine import simulated_machine

LOG = "loop.json"
START_S = 900.0
"""Bounds booting and referencing; the first run compiles kernels, which takes minutes of a busy computer."""
MAX_TIME_RATIO = 60.0
"""Bounds the time of a lockstep run, over the machine's own time: a hang. At 30 processes that compute on two
processors a run took 17 times it."""
DECIDED, BUDGET, STOPPED = "decided", "budget used", "stopped"


class LoopOptions(NamedTuple):
    """Machine, model and output of a loop, where the axes are, and how many recordings it may take."""

    machine: Path
    model: Path
    out: Path
    most_recordings: int = 6
    plant: Path | None = None
    """Plant of the simulator; None: the machine's own."""
    bus: str | None = None
    """Bus of a running machine; None: a simulator on a bus of its own."""
    program: Path | None = None
    """First motion; None: a mix of excitations, axis by axis."""
    pacing: Pacing = "lockstep"


class Outcome(NamedTuple):
    """How a loop ended."""

    why: str
    """decided, budget used, or stopped."""
    rounds: list[dict[str, Any]]
    last: WrittenDiagnosis | None
    log: Path


def run_loop(
    options: LoopOptions,
    on_text: Callable[[str], None] = lambda _text: None,
    on_progress: Callable[[Progress], None] = lambda _progress: None,
) -> Outcome:
    """Run the loop; `loop.json` is rewritten after each round. Raises ReconcileError.

    Ctrl-C during a motion: the daemon brings the axes to rest, and the loop ends.
    """
    try:
        machine = load_machine(options.machine)
        model = load_model(options.model)
        refuse_unsafe(machine, model)
        if (options.out / LOG).exists():
            raise ReconcileError(options.out / LOG, "", "is there already", "name another directory")
        limits = {name: limits_from_machine(machine, name, axis) for name, axis in model.axes.items()}
        options.out.mkdir(parents=True, exist_ok=True)
        program = options.program or first_program(machine, limits, options.out)
        return asyncio.run(_Rounds(options, machine, limits, on_text, on_progress).until_decided(program))
    except ServoCtrlError as error:
        raise ReconcileError(options.machine, "", str(error)) from error


class _Rounds:
    """The rounds of one loop."""

    def __init__(
        self,
        options: LoopOptions,
        machine: MachineConfig,
        limits: Mapping[str, AxisLimits],
        on_text: Callable[[str], None],
        on_progress: Callable[[Progress], None],
    ) -> None:
        self._options, self._machine, self._limits = options, machine, limits
        self._on_text, self._on_progress = on_text, on_progress
        self._rounds: list[dict[str, Any]] = []
        self._recordings: list[Path] = []
        self._made: list[str] = []

    async def until_decided(self, program: Path) -> Outcome:
        """Run rounds until nothing is open or the recordings are used up."""
        last: WrittenDiagnosis | None = None
        why = BUDGET
        async with self._bus() as bus:
            for number in range(1, self._options.most_recordings + 1):
                folder = self._options.out / f"round_{number}"
                proposed = self._rounds[-1]["next_experiment"] if self._rounds else {}
                self._on_text(f"recording {number}: {proposed.get('motion') or program}")
                report = await self._run_program(program, bus, folder / "recording")
                if report.signal or not report.completed:
                    why = STOPPED
                    self._log({"number": number, "program": str(program), "stopped": report.reason}, why)
                    if report.failed:
                        raise ReconcileError(program, "", f"the run was not completed: {report.reason}")
                    break
                self._recordings.append(folder / "recording")
                last = await asyncio.to_thread(self._diagnose, folder)
                self._made.append(last.next_experiment.kind)
                decided = not last.next_experiment.program
                why = DECIDED if decided else BUDGET
                self._log(_round_entry(number, program, folder, report, last), why)
                if decided:
                    break
                program = folder / PROGRAM_FILE
        return Outcome(why, self._rounds, last, self._options.out / LOG)

    @contextlib.asynccontextmanager
    async def _bus(self) -> AsyncIterator[str]:
        """Yield the machine's bus, or that of a simulator that stays on between rounds as a machine does."""
        if self._options.bus is not None:
            yield self._options.bus
            return
        plant = self._options.plant or self._machine.source.parent
        async with simulated_machine(plant, self._options.pacing) as bus:
            yield bus

    async def _run_program(self, file: Path, bus: str, recording: Path) -> RunReport:
        """Check a program, then run it within a time bound."""
        program = load_program(file, self._machine)
        cycles = check_steps(program_steps(program, self._machine), file, self._machine).cycles
        bound_s = START_S + MAX_TIME_RATIO * cycles * self._machine.period_s
        try:
            async with asyncio.timeout(bound_s):
                pacing, show = self._options.pacing, self._on_progress
                return await run_machine(
                    self._machine,
                    program,
                    bus,
                    pacing=pacing,
                    record_dir=recording,
                    on_progress=show,
                    compensation="off",
                )
        except TimeoutError:
            raise ReconcileError(file, "", f"the run was not over after {bound_s:.0f} s") from None

    def _diagnose(self, folder: Path) -> WrittenDiagnosis:
        model, show = self._options.model, self._on_text
        return diagnose(
            self._recordings, model, folder, on_progress=show, limits=self._limits, made=self._made
        )

    def _log(self, entry: dict[str, Any], why: str) -> None:
        self._rounds.append(entry)
        content = {
            "machine": str(self._options.machine),
            "model": str(self._options.model),
            "ended": why,
            "rounds": self._rounds,
        }
        write_text_whole(self._options.out / LOG, json.dumps(content, indent=1) + "\n")


def _round_entry(
    number: int, program: Path, folder: Path, report: RunReport, found: WrittenDiagnosis
) -> dict[str, Any]:
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
