"""A machine recorded over the bus, and held against a plant file."""

import asyncio
from pathlib import Path
from typing import Any

from reconcile.diagnosis.diagnose import diagnose
from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.learning.learned_compensation import Compensation
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.hil_rig.simulated_machine import simulated_machine

RUN_LIMIT_S = 300.0
"""Bounds a lockstep run; chosen."""


def recorded(
    folder: Path,
    program_name: str,
    out: Path,
    compensation: Compensation = "as configured",
    plant: Path | None = None,
) -> Path:
    """Record a program of a machine, run by the daemon on a simulator of its own plant, or of another."""
    machine = load_machine(folder)
    program = load_program(folder / "programs" / program_name, machine)
    simulated = plant or folder / "plant.toml"

    async def run() -> None:
        async with asyncio.timeout(RUN_LIMIT_S), simulated_machine(simulated, "lockstep") as bus:
            report = await run_machine(machine, program, bus, "lockstep", out, compensation=compensation)
        assert report.completed, report.reason

    asyncio.run(run())
    return out


def diagnosed(recording: Path, model: Path) -> dict[str, Any]:
    """Return the verdict on a recording and a model; its files go beside the recording."""
    out = recording.parent / f"{model.stem}_verdict"
    return diagnose([recording], model, out, with_report=False, with_next=False).verdict
