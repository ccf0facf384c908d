"""How long a diagnosis takes, against the length of the recordings and the number of effects left out.

Run as `python -m tests.campaigns.bench.reconcile_time --json FILE [--profile]`, or as a part of `make
bench-reconcile`.
"""

import json
import math
import os
import re
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numba
import numpy as np
import pyarrow as pa
import typer
from pyarrow import parquet
from rich.console import Console
from rich.table import Table

from kernels.arrays import Array
from tests.campaigns.bench.main import machine_facts, write_whole

T, N = 1e-3, 25_000
RECORDINGS = (1, 2, 4, 8)
MOST_EFFECTS = 4
AIM_S, BAR_S, BAR_MIB = 20.0, 60.0, 1024.0
LEAD_M = 5e-3
COGGING_N, PLAY_M, STRIBECK_N, STRIBECK_M_S, LEAD_ERROR_M = 1.5, 3e-6, 6.0, 4e-3, 2e-6
MODEL = """
[axis.x.transmission]
lead_mm = 5.0
[axis.x.motor]
torque_constant_nm_a = 0.4
[axis.x.table]
mass_kg = 50.0
[axis.x.encoder]
counts_per_rev = 1000000
[axis.x.scale]
resolution_um = 0.1
[axis.x.viscous_friction]
viscous_n_s_m = 100.0
[axis.x.coulomb_friction]
coulomb_n = 12.0
"""
CHILD = """
import sys
from pathlib import Path
from reconcile.cli.main import main
try:
    main()
finally:
    print(Path("/proc/self/status").read_text(), file=sys.stderr)
"""
"""The process tells its own peak: what wait4 tells of a child has its parent's in it."""


class Cost(NamedTuple):
    """One fresh process of `reconcile diagnose`."""

    recordings: int
    effects: int
    wall_s: float
    processor_s: float
    """Of all its threads: what a busy machine does not lengthen much."""
    peak_mib: float
    named: list[str]


@numba.njit(cache=True)
def _carried(motor_m: Array, half_m: float) -> Array:
    table_m = np.empty_like(motor_m)
    place_m = motor_m[0]
    for i in range(len(motor_m)):
        if motor_m[i] - place_m > half_m:
            place_m = motor_m[i] - half_m
        elif place_m - motor_m[i] > half_m:
            place_m = motor_m[i] + half_m
        table_m[i] = place_m
    return table_m


def record(path: Path, seed: int, effects: int) -> Path:
    """An axis that sweeps at several speeds; `effects` of cogging, backlash, Stribeck, lead error."""
    rng = np.random.default_rng(seed)
    t = np.arange(N) * T
    slow_hz, fast_hz = rng.uniform(0.2, 0.4), rng.uniform(0.8, 1.4)
    x = 0.02 * np.sin(2.0 * math.pi * slow_hz * t) + 0.008 * np.sin(2.0 * math.pi * fast_hz * t + 1.0)
    v, a = np.gradient(x, T), np.gradient(np.gradient(x, T), T)
    force = 50.0 * a + 100.0 * v + 12.0 * np.sign(v) + 0.3 * rng.normal(size=N)
    scale = x.copy()
    if effects > 0:
        force += COGGING_N * np.sin(2.0 * math.pi / LEAD_M * x)
    if effects > 1:
        scale = _carried(x, PLAY_M)
    if effects > 2:
        force += STRIBECK_N * np.sign(v) * np.exp(-((v / STRIBECK_M_S) ** 2))
    if effects > 3:
        scale = scale + LEAD_ERROR_M * np.sin(2.0 * math.pi / LEAD_M * x + 0.7)
    columns = {
        "time_s": t,
        "motor_position_m": np.round(x / 5e-9) * 5e-9,
        "motor_force_n": force,
        "scale_position_m": np.round(scale / 1e-7) * 1e-7,
    }
    parquet.write_table(pa.table(columns), path)
    return path


def diagnose(directory: Path, recordings: int, effects: int, *, profile: Path | None = None) -> Cost:
    """A fresh process, from its start to its end. Raises RuntimeError where it fails."""
    files = [
        str(record(directory / f"{seed}_{effects}.parquet", seed, effects)) for seed in range(recordings)
    ]
    model, out = directory / "nominal.toml", directory / "out"
    model.write_text(MODEL, encoding="utf-8")
    measured = ["-m", "cProfile", "-o", str(profile)] if profile else []
    program = directory / "child.py"
    program.write_text(CHILD, encoding="utf-8")
    command = [sys.executable, *measured, str(program), "diagnose", *files]
    started_s, before_s = time.perf_counter(), _processor_s()
    ended = subprocess.run(
        [*command, "--model", str(model), "--out", str(out)],
        check=False,
        capture_output=True,
        text=True,
        timeout=600,
        env={**os.environ, "PYTHONPATH": str(Path.cwd())},
    )
    wall_s, processor_s = time.perf_counter() - started_s, _processor_s() - before_s
    if ended.returncode:
        raise RuntimeError(f"{recordings} recordings, {effects} effects: {ended.stderr[-2000:]}")
    peak = re.search(r"VmHWM:\s+(\d+) kB", ended.stderr)
    content = json.loads((out / "verdict.json").read_text(encoding="utf-8"))
    named = [finding["effect"] for finding in content["findings"]]
    return Cost(
        recordings, effects, wall_s, processor_s, int(peak.group(1)) / 1024.0 if peak else math.nan, named
    )


def _processor_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measure(progress: Callable[[str], None]) -> list[Cost]:
    """Every length without and with all the effects, every number of effects at the greatest length."""
    longest = RECORDINGS[-1]
    plan = [(count, effects) for count in RECORDINGS[:-1] for effects in (0, MOST_EFFECTS)]
    plan += [(longest, effects) for effects in range(MOST_EFFECTS + 1)]
    with tempfile.TemporaryDirectory() as name:
        diagnose(Path(name), 1, 1)  # kernels are compiled once in the life of an installation
        costs = []
        for recordings, effects in plan:
            progress(f"time: {recordings} x {N * T:g} s, {effects} effects")
            costs.append(diagnose(Path(name), recordings, effects))
    return costs


def as_json(costs: list[Cost]) -> dict[str, Any]:
    """The figures with their bars."""
    worst_s = max(cost.wall_s for cost in costs)
    worst_mib = max(cost.peak_mib for cost in costs)
    return {
        "seconds_each": N * T,
        "costs": [cost._asdict() for cost in costs],
        "aim_s": AIM_S,
        "bar_s": BAR_S,
        "bar_mib": BAR_MIB,
        "met": worst_s <= BAR_S and worst_mib <= BAR_MIB,
        "aim_met": worst_s <= AIM_S,
    }


def table_of(costs: list[Cost]) -> Table:
    """A line for each process."""
    table = Table(
        "recordings", "effects", "seconds", "processor s", "peak MiB", "named", title="time of a diagnosis"
    )
    for cost in costs:
        length = f"{cost.recordings} x {N * T:g} s"
        figures = (f"{cost.wall_s:.1f}", f"{cost.processor_s:.1f}", f"{cost.peak_mib:.0f}")
        table.add_row(length, str(cost.effects), *figures, ", ".join(cost.named))
    return table


def main(json_file: Annotated[Path, typer.Option("--json", help="Where the figures go.")]) -> None:
    """Measure, print, write."""
    console = Console()
    costs = measure(console.print)
    console.print(table_of(costs))
    result = {"machine": machine_facts(), "time": as_json(costs)}
    write_whole(json_file, json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    typer.run(main)
