"""`servo-ctrl experiment positioning`: the positioning study of Wang et al. 2014 on the precision stage."""

import asyncio
import contextlib
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from servo_ctrl.cli.figures_file import write_figures
from servo_ctrl.cli.progress import progress_bar
from studies.wang_2014.bus_study import BusCheck, position_over_bus
from studies.wang_2014.pictures import draw_positioning
from studies.wang_2014.plan import OVER_TRAVEL, SERIES, Series
from studies.wang_2014.report import print_study
from studies.wang_2014.stages import STAGES, Stage
from studies.wang_2014.study import summary
from studies.wang_2014.twin_study import TwinRequest, run_in_twin


def run_positioning(
    machine: Path,
    out: Path,
    json_file: Path | None,
    *,
    runs: int,
    points: int,
    only: Sequence[str] | None,
    bus_points: int,
    bus_runs: int,
) -> None:
    """Position from both sides, 100 times, without and with each compensation: tables, pictures, JSON."""
    begun_s = time.monotonic()
    console = Console()
    stages = [entry for name, entry in STAGES.items() if only is None or name in only]
    names = [entry.name for entry in stages]
    with _share_bar() as show:
        twin = run_in_twin(
            machine, out, TwinRequest(names, runs=runs, points=points, series=list(SERIES)), show
        )
    console.print(
        f"{twin.machine_time_s / 3600:.1f} h of machine time in {twin.wall_s:.0f} s, "
        f"{twin.machine_time_s / twin.wall_s:.0f} times real time",
        highlight=False,
    )
    series = OVER_TRAVEL._replace(targets_mm=OVER_TRAVEL.targets_mm[:bus_points])
    checks = (
        _checks(console, machine=machine, stages=stages, series=series, runs=bus_runs, out=out)
        if bus_points
        else []
    )
    print_study(console, twin.found, checks)
    for picture in draw_positioning(twin.found, checks, out):
        console.print(f"picture: {picture}", highlight=False)
    figures = summary(twin.found)
    figures["twin"] = {
        "repeats": runs,
        "machine_time_s": twin.machine_time_s,
        "wall_s": twin.wall_s,
        "times_real_time": twin.machine_time_s / twin.wall_s,
    }
    figures["bus"] = {
        check.bus.stage: {
            "readings": check.bus.scale_m.size,
            "largest_difference_um": check.difference_m * 1e6,
            "times_real_time": check.bus.times_real_time,
        }
        for check in checks
    }
    figures["wall_s"] = time.monotonic() - begun_s
    write_figures(json_file, figures)


def _checks(
    console: Console, machine: Path, stages: Sequence[Stage], series: Series, runs: int, out: Path
) -> list[BusCheck]:
    """Run a short series of every stage over the bus, and the same series in the twin."""
    learned = out / "learned"
    on_bus = []
    for stage in stages:
        console.print(f"over the bus: {stage.name} ...", highlight=False)
        with progress_bar() as show:
            run = position_over_bus(machine, stage, series, runs, out=out, learned=learned, on_progress=show)
            on_bus.append(asyncio.run(run))
    checks = []
    for cycles in sorted({bus.cycles_before for bus in on_bus}):
        alike = [bus for bus in on_bus if bus.cycles_before == cycles]
        names = [bus.stage for bus in alike]
        off_cycles, rest_cycles = cycles
        request = TwinRequest(
            stages=names,
            runs=runs,
            points=len(series.targets_mm),
            series=[series.name],
            learned=learned,
            off_cycles=off_cycles,
            rest_cycles=rest_cycles,
        )
        twin = run_in_twin(machine, out / "bus", request, lambda _share: None)
        checks += [BusCheck(bus, twin.found[series.name, bus.stage].scale_m) for bus in alike]
    return checks


@contextlib.contextmanager
def _share_bar() -> Iterator[Callable[[float], None]]:
    """Yield a function that shows the completed share: a bar on a terminal, else a line every tenth."""
    description, console = "positioning in the batch twin", Console(stderr=True)
    if not console.is_terminal:
        printed_tenths = -1

        def print_tenth(share: float) -> None:
            nonlocal printed_tenths
            if int(10.0 * share) > printed_tenths:
                printed_tenths = int(10.0 * share)
                console.print(f"{description}: {100.0 * share:.0f} %", highlight=False)

        yield print_tenth
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(description, total=1.0)
        yield lambda share: bar.update(task, completed=share)
