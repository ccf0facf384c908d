"""`servo-ctrl demo`: the simulated X-Y table runs circles on the embedded bus, with table and pictures."""

import os
import sys
from pathlib import Path
from typing import Annotated

import typer

from servo_ctrl.cli.options import OutOption, TableOption

FIRST_CLICKS = (
    "first: Take control (top right), then Enable on page Drive and hold a jog button; STOP or Esc stops.\n"
    "then: page Motion loads and starts a program, page Friction shows J and learns the friction away."
)
"""Printed hint: what to do in the operator's bench after the circles."""


def demo(
    out: OutOption = Path("out/demo"),
    machine: TableOption = Path("machines/xy_table"),
    hmi: Annotated[
        str,
        typer.Option(metavar="HOST:PORT", help="Of the operator's bench; another port where it is taken."),
    ] = "127.0.0.1:8080",
    no_hmi: Annotated[bool, typer.Option("--no-hmi", help="Without the operator's bench.")] = False,
) -> None:
    """Run circles R = 25 mm at F = 500, 1000, 2000 and 3000 mm/min on the simulated X-Y table.

    Starts the simulator as a process of its own, which serves the bus, boots the drives over the bus, moves,
    and shows the errors that friction leaves at the reversals. Nothing but this program is needed.

    The operator's bench shows it in a browser meanwhile. In a terminal the table stays there afterwards, in
    real time, to be enabled and moved, until Ctrl-C.
    """
    import asyncio

    from rich.console import Console

    from servo_ctrl.cli.circle_report import draw_circles, indicator_table
    from servo_ctrl.cli.operator_page import free_address, page_at, page_installed, url_of
    from servo_ctrl.cli.progress import progress_bar
    from servo_ctrl.hil_rig.simulated_run import simulated_run, simulated_standby
    from servo_ctrl.metrology.circles import analyse_circles

    console = Console()
    page, address = None, ""
    if not no_hmi and not page_installed():
        console.print(
            "without the operator's bench, which needs: pip install 'servo-ctrl\\[hmi]'", highlight=False
        )
    elif not no_hmi:
        address = free_address(hmi)
        page = page_at(address, recordings=out)
        console.print(f"operator's bench: {url_of(address)}", highlight=False)
    console.print("starting hil-sim (the first start compiles the kernels) ...")
    with progress_bar() as show:
        program = machine / "programs" / "circles.toml"
        run = asyncio.run(simulated_run(machine, program, out, show, page=page))
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
    console.print(f"recording: {newest(run.recording.directory, out / 'recording')}", highlight=False)
    if page is not None and sys.stdin.isatty():
        console.print(f"the table waits at {url_of(address)}; Ctrl-C ends it", highlight=False)
        console.print(FIRST_CLICKS, highlight=False)
        with progress_bar() as show:
            asyncio.run(simulated_standby(machine, page, show))


def newest(recording: Path, link: Path) -> Path:
    """Point `link` to the demo's last recording; return it, or the recording if the name is taken."""
    if link.is_symlink():
        link.unlink()
    elif link.exists():  # the user's own
        return recording
    link.symlink_to(os.path.relpath(recording, link.parent))
    return link
