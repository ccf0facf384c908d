"""Compares the counts of a run by the controller, by its recording and by a station on the bus."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow.parquet as pq

from servo_ctrl.daemon.run.report import RunReport

SYNC = "080"


class RunCounts(NamedTuple):
    """The counts of one run; `faults` lists those that disagree."""

    cycles: int
    missed_ticks: int
    rows: int
    rows_lost: int
    gaps_in_rows: int
    """Cycles without a row before the last row."""
    syncs: int
    set_points: dict[str, int]
    """Frames by identifier of the RPDO."""
    answers: dict[str, int]
    """Frames by identifier of the TPDO."""
    faults: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        return self._asdict()


def recorded_cycles(directory: Path) -> np.ndarray[Any, np.dtype[np.int64]]:
    """Return the cycles of a recording (n,), read part by part because an hour does not fit in memory.

    Arrow's thread pools are off: their threads start one by one and would look like a leak of the controller.
    """
    columns = [
        pq.read_table(part, columns=["cycle"], use_threads=False, pre_buffer=False)["cycle"].to_numpy()
        for part in sorted(directory.glob("part-*.parquet"))
    ]
    return np.concatenate(columns) if columns else np.zeros(0, dtype=np.int64)


def compare_counts(
    report: RunReport,
    counted: dict[str, Any],
    directory: Path | None,
    rows_lost: int = 0,
    *,
    tpdos_may_be_missing: bool = False,
) -> RunCounts:
    """Compare the counts of a finished run.

    Every tick sends one SYNC, records one row, and sends one set point to each drive; the last tick sends
    no set points, because the machine is off. `tpdos_may_be_missing`: inputs may arrive late or not at all,
    because the bus is overloaded or the simulator gets no processor time.
    """
    frames: dict[str, int] = counted["frames"]
    cycles = recorded_cycles(directory) if directory is not None else np.zeros(0, dtype=np.int64)
    cycle_steps = np.diff(cycles)
    gaps = int(cycles[-1]) + 1 - len(cycles) if len(cycles) else 0
    syncs = frames.get(SYNC, 0)
    standard = {key: count for key, count in frames.items() if len(key) == 3}
    set_points = {key: count for key, count in standard.items() if "201" <= key <= "27F"}
    answers = {key: count for key, count in standard.items() if "181" <= key <= "1FE"}
    ticks = report.cycles - report.missed_ticks
    faults = []

    def expect_equal(name: str, actual: int, expected: int) -> None:
        if actual != expected:
            faults.append(f"{name}: {actual}, not {expected}")

    if counted["lost"]:
        faults.append(f"the station has lost {counted['lost']} frames: its counts are incomplete")
    expect_equal("SYNCs on the bus", syncs, ticks)
    for key, count in set_points.items():
        expect_equal(f"set points {key}h", count, syncs - 1)
    for key, count in answers.items():
        if not tpdos_may_be_missing or count > syncs:
            expect_equal(f"TPDOs {key}h", count, syncs)
    if directory is not None:
        expect_equal("rows and reported lost rows", len(cycles) + rows_lost, ticks)
        if np.any(cycle_steps <= 0):
            faults.append("rows are out of order or twice")
        if not rows_lost:
            expect_equal("cycles without a row", gaps, report.missed_ticks)
    return RunCounts(
        cycles=report.cycles,
        missed_ticks=report.missed_ticks,
        rows=len(cycles),
        rows_lost=rows_lost,
        gaps_in_rows=gaps,
        syncs=syncs,
        set_points=set_points,
        answers=answers,
        faults=tuple(faults),
    )
