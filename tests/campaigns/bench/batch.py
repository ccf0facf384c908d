"""Closed-loop batch simulation of the X-Y table: in multiples of real time, and against the same kernel in C.

Ours is `twin.rollout`, the control law and the plant compiled by numba. The C program is a
transcription of both (`batch_kernel.c` and its headers), fed from the same records; before any time is taken
the two trajectories are compared.
"""

import ctypes
import re
import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hil_sim.physics.registry import EFFECTS
from hil_sim.plant.layout import AXIS_PARAMS, AXIS_STATE, SETPOINT
from kernels.arrays import Array
from kernels.quantities import section_of
from tests.campaigns.bench.batch_case import AxisCase, Case, axis_cases, load_case
from tests.campaigns.bench.c_records import declarations, record_of
from tests.campaigns.bench.outcome import Ratio, Section, Skip
from twin.axis_rollout import COLUMNS, AxisRollout
from twin.bus_scaling import substeps_of
from twin.rollout import rollout

HERE = Path(__file__).parent
FLAGS = ("-O2", "-std=c11", "-fPIC", "-shared", "-Wall", "-Werror")
"""Default x86-64 (SSE2, no contraction to fused multiply-add), no -ffast-math: IEEE doubles as written."""
COMPILE_TIMEOUT_S = 60.0
REPEATS = 15
LARGEST_DIFFERENCE = 1e-9
"""Of a column's own size: a transcription is exact up to the rounding of another exp() or sin()."""


def run_ours(case: Case, axes: list[AxisCase]) -> list[Array]:
    """Rows (n, COLUMNS) of every axis by our kernel."""
    twins = [AxisRollout(case.machine, case.plant, a.name, a.params, a.plant) for a in axes]
    rows = [twin.rows(axis.reference) for twin, axis in zip(twins, axes, strict=True)]
    return [own.view(np.float64).reshape(len(own), -1)[:, : len(COLUMNS)] for own in rows]


def run_c(library: ctypes.CDLL, case: Case, axes: list[AxisCase]) -> list[Array]:
    """The same by the C kernel; NotImplementedError where it would leave effects out."""
    for axis in axes:
        refuse_effects_unknown_to_c(axis)
    substeps, dt_s = substeps_of(case.machine, case.plant), case.plant.dt_s
    results = []
    for axis in axes:
        rows = np.full((len(axis.reference), len(COLUMNS)), np.nan)
        records = [
            record_of(axis.params),
            record_of(axis.scaling),
            *(array[axis.index] for array in (axis.plant.params, axis.plant.state, axis.plant.setpoint)),
        ]
        library.run_axis(
            *(ctypes.c_void_p(record.__array_interface__["data"][0]) for record in records),
            ctypes.c_int64(substeps),
            ctypes.c_double(dt_s),
            ctypes.c_void_p(axis.reference.ctypes.data),
            ctypes.c_int64(len(rows)),
            ctypes.c_int64(0),
            ctypes.c_void_p(rows.ctypes.data),
        )
        results.append(rows)
    return results


def effects_in_c() -> set[str]:
    """The effects that the C kernel computes: the sections it reads."""
    source = "".join(file.read_text() for file in (HERE / "plant_kernel.h", HERE / "amplifier_kernel.h"))
    return set(re.findall(r"p->(\w+)\.", source)) & {section_of(effect) for effect in EFFECTS}


def refuse_effects_unknown_to_c(axis: AxisCase) -> None:
    """Raise NotImplementedError, by name, for what C would leave out."""
    p = axis.plant.params[axis.index]
    unknown = [name for name in map(section_of, EFFECTS) if p[name]["enabled"] and name not in effects_in_c()]
    if unknown:
        raise NotImplementedError(f"the C kernel does not know {', '.join(unknown)}")


def compile_c(axis: AxisCase, folder: Path) -> ctypes.CDLL:
    """The C kernel as a shared library made in `folder`.

    Raises:
        FileNotFoundError: there is no gcc.
        subprocess.CalledProcessError: it does not compile.

    """
    header = declarations(
        {
            "AxisPlant": AXIS_PARAMS,
            "AxisPlantState": AXIS_STATE,
            "SetPoint": SETPOINT,
            "AxisControl": record_of(axis.params).dtype,
            "BusScaling": record_of(axis.scaling).dtype,
        }
    )
    (folder / "batch_records.h").write_text(header)
    library = folder / "batch_kernel.so"
    source = HERE / "batch_kernel.c"
    command = ["gcc", *FLAGS, f"-I{folder}", f"-I{HERE}", "-o", str(library), str(source), "-lm"]
    subprocess.run(command, check=True, timeout=COMPILE_TIMEOUT_S, capture_output=True, text=True)
    return ctypes.CDLL(str(library))


def largest_difference(ours: list[Array], theirs: list[Array]) -> float:
    """Largest difference of the trajectories, each column as a share of its own largest value."""
    largest = 0.0
    for left, right in zip(ours, theirs, strict=True):
        if not np.array_equal(np.isnan(left), np.isnan(right)):
            return float("inf")
        size = np.nanmax(np.abs(left), axis=0)
        difference = np.nanmax(np.abs(left - right), axis=0)
        largest = max(largest, float(np.max(difference / np.where(size > 0.0, size, 1.0))))
    return largest


def measure(progress: Callable[[str], None]) -> Section:
    """Both figures. Ours and C run in turn, each from power-up."""
    case = load_case()
    progress("batch: compiling our kernels")
    trajectory = run_ours(case, axis_cases(case))
    whole_s = [_whole_call_s(case) for _ in range(REPEATS)]
    speed = case.simulated_s / statistics.median(whole_s)
    facts: dict[str, Any] = {
        "simulated_s": case.simulated_s,
        "axes": len(case.reference),
        "substep_us": case.plant.substep_us,
        "effects": sorted({effect for axis in case.plant.axes.values() for effect in axis.effects}),
        "whole_call_s": {"min": min(whole_s), "median": statistics.median(whole_s)},
    }
    ratios = [
        Ratio("batch simulation, times real time", case.simulated_s, statistics.median(whole_s), "s", 200.0)
    ]
    progress(f"batch: {speed:.0f} times real time")
    if shutil.which("gcc") is None:
        return Section("batch", facts, ratios, [Skip("batch against C", "gcc is not installed")])
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        library = compile_c(axis_cases(case)[0], Path(folder))
        difference = largest_difference(trajectory, run_c(library, case, axis_cases(case)))
        if not difference <= LARGEST_DIFFERENCE:
            raise ValueError(f"the C kernel computes another trajectory: {difference:g} of a column's size")
        ours_s, c_s = [], []
        for repeat in range(REPEATS):
            progress(f"batch: against C, repeat {repeat + 1} of {REPEATS}")
            ours_s.append(_seconds(lambda axes: run_ours(case, axes), case))
            c_s.append(_seconds(lambda axes: run_c(library, case, axes), case))
    facts |= {
        "c_compiler": f"{_gcc_version()} {' '.join(FLAGS)}",
        "largest_difference": difference,
        "ours_s": {"min": min(ours_s), "median": statistics.median(ours_s)},
        "c_s": {"min": min(c_s), "median": statistics.median(c_s)},
    }
    against_c = Ratio(
        "batch kernel, time of ours / time of C at -O2",
        statistics.median(ours_s),
        statistics.median(c_s),
        "s",
        1.3,
        at_most=True,
    )
    return Section("batch", facts, [*ratios, against_c], [])


def _whole_call_s(case: Case) -> float:
    start_s = time.perf_counter()
    rollout(case.machine, case.plant, case.params, case.reference)
    return time.perf_counter() - start_s


def _seconds(run: Callable[[list[AxisCase]], list[Array]], case: Case) -> float:
    """Processor time: what else runs on this computer then matters less to the ratio."""
    axes = axis_cases(case)
    start_s = time.thread_time()
    run(axes)
    return time.thread_time() - start_s


def _gcc_version() -> str:
    done = subprocess.run(
        ["gcc", "--version"], check=True, timeout=COMPILE_TIMEOUT_S, capture_output=True, text=True
    )
    return done.stdout.splitlines()[0]
