"""`servo-ctrl demo`: the X-Y table runs circles on the embedded bus, with a table and pictures at the end."""

from __future__ import annotations

import asyncio
from pathlib import Path

from rich.console import Console

from servo_ctrl.cli.circle_report import draw_circles, indicator_table
from servo_ctrl.cli.options import OutOption, TableOption  # noqa: TC001  # typer reads them at run time
from servo_ctrl.cli.progress import progress_bar
from servo_ctrl.experiment.circles import analyse_circles
from servo_ctrl.experiment.simulated_run import simulated_run


def demo(out: OutOption = Path("out/demo"), machine: TableOption = Path("machines/xy_table")) -> None:
    """Run circles R = 25 mm at F = 500, 1000, 2000 and 3000 mm/min on the simulated X-Y table.

    Starts the CAN hub and the simulator as processes of their own, boots the drives over the bus, moves,
    and shows the errors that friction leaves at the reversals. Nothing but this program is needed.
    """
    console = Console()
    console.print("starting the CAN hub and hil-sim (the first start compiles the kernels) ...")
    with progress_bar() as show:
        program = machine / "programs" / "circles.toml"
        run = asyncio.run(simulated_run(machine, program, out, show))
    window_s = run.machine.monitoring.window_s
    results = analyse_circles(run.recording, window_s)
    console.print(indicator_table(results, window_s))
    report = run.report
    console.print(
        f"{report.cycles} cycles in {report.wall_s:.1f} s: {report.cycles / report.wall_s:.0f} cycles/s, "
        f"{report.cycles * run.machine.period_s / report.wall_s:.1f} times real time",
        highlight=False,
    )
    for picture in draw_circles(results, window_s, out):
        console.print(f"picture:   {picture}", highlight=False)
    console.print(f"recording: {run.recording.directory}", highlight=False)
