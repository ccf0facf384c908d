"""Runs the controller as a process, in standby or with a program; its last line is the report, as JSON.

python -m tests.campaigns.hostile.controller MACHINE BUS standby|PROGRAM
"""

import asyncio
import json
import sys
from pathlib import Path

from servo_ctrl.config.load import load_machine, load_program
from servo_ctrl.daemon.run.report import Progress
from servo_ctrl.daemon.run.supervisor import run_machine
from servo_ctrl.errors import ServoCtrlError

REFUSED = 3


async def main(folder: Path, bus: str, what: str) -> int:
    """Run until SIGTERM or until the run ends; return the exit status."""
    machine = load_machine(folder)
    program = None if what == "standby" else load_program(Path(what), machine)
    printed = set()

    def progress(state: Progress) -> None:
        stage = state.stage.name
        if stage not in printed:
            printed.add(stage)
            print(f"stage {stage}", flush=True)

    try:
        report = await run_machine(
            machine, program, bus, "lockstep", on_progress=progress, stand_by=program is None
        )
    except ServoCtrlError as error:
        print(json.dumps({"reason": str(error), "refused": True}), flush=True)
        return REFUSED
    outcome = {
        "reason": report.reason,
        "failed": report.failed,
        "cycles": report.cycles,
        "events": len(report.events),
    }
    print(json.dumps(outcome), flush=True)
    return int(report.failed)


if __name__ == "__main__":
    sys.exit(asyncio.run(main(Path(sys.argv[1]), sys.argv[2], sys.argv[3])))
