"""Counts of a run by the controller, by the recording and by a station on the bus, and whether they agree."""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow.parquet as pq

from servo_ctrl.daemon.run.report import RunReport

SYNC = "080"


class RunCounts(NamedTuple):
    """The counts of one run; `faults` names those that do not agree."""

    cycles: int
    missed_ticks: int
    rows: int
    rows_lost: int
    gaps_in_rows: int
    """Cycles without a row, up to the last row."""
    syncs: int
    set_points: dict[str, int]
    """By identifier of the RPDO."""
    answers: dict[str, int]
    """By identifier of the TPDO."""
    faults: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        return self._asdict()


def recorded_cycles(directory: Path) -> np.ndarray[Any, np.dtype[np.int64]]:
    """The cycle column of a recording, part by part: an hour does not fit in memory as a whole.

    Without Arrow's pools, whose threads start one by one and would look like a leak of the controller.
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
    answers_may_lack: bool = False,
) -> RunCounts:
    """Compare the counts of a finished run.

    Every tick sends one SYNC, records one row, and sends one set point to each drive; the last tick sends
    none, because the machine is off. `answers_may_lack`: on an overloaded bus, or with a simulator without
    processor time, inputs may come late or never.
    """
    frames: dict[str, int] = counted["frames"]
    cycles = recorded_cycles(directory) if directory is not None else np.zeros(0, dtype=np.int64)
    steps = np.diff(cycles)
    gaps = int(cycles[-1]) + 1 - len(cycles) if len(cycles) else 0
    syncs = frames.get(SYNC, 0)
    standard = {key: count for key, count in frames.items() if len(key) == 3}
    set_points = {key: count for key, count in standard.items() if "201" <= key <= "27F"}
    answers = {key: count for key, count in standard.items() if "181" <= key <= "1FE"}
    ticks = report.cycles - report.missed_ticks
    faults = []

    def same(what: str, found: int, wanted: int) -> None:
        if found != wanted:
            faults.append(f"{what}: {found}, not {wanted}")

    if counted["lost"]:
        faults.append(f"the station has lost {counted['lost']} frames: its counts are no witness")
    same("SYNCs on the bus", syncs, ticks)
    for key, count in set_points.items():
        same(f"set points {key}h", count, syncs - 1)
    for key, count in answers.items():
        if not answers_may_lack or count > syncs:
            same(f"answers {key}h", count, syncs)
    if directory is not None:
        same("rows and rows reported as lost", len(cycles) + rows_lost, ticks)
        if np.any(steps <= 0):
            faults.append("rows are out of order or twice")
        if not rows_lost:
            same("cycles without a row", gaps, report.missed_ticks)
    return RunCounts(
        report.cycles,
        report.missed_ticks,
        len(cycles),
        rows_lost,
        gaps,
        syncs,
        set_points,
        answers,
        tuple(faults),
    )
