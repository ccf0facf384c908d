"""ODrive: cogging torque of a brushless motor, measured by G. Chen, published with the firmware (2020).

A map is the current that holds the motor at each position of a turn. It is diagnosed as a recording of a
rotary axis: a millimetre stands for a degree (the lead, one turn, is 360 mm) and a newton for an ampere.
Nothing in a map depends on time; each point gets a hundredth of a second, so that the low pass of the
diagnosis keeps all of it.

Map a (forward) and map e (backward, another day, the encoder zeroed half a turn off) are diagnosed; the
cogging of the repaired model is tested on map b.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hil_sim.physics.motor import cogging
from kernels.arrays import Array
from reconcile.diagnosis.diagnose import diagnose
from reconcile.errors import ReconcileError
from reconcile.examples import pictures
from reconcile.examples.example import ExampleResult, Row, data_file, reports, write_figures
from reconcile.nominal_model.model_file import load_model
from reconcile.replay.replay import plant_of
from servo_ctrl.files.whole_file import write_text_whole, write_whole

NAME = "odrive_cogging"
TITLE = "ODrive, cogging of a brushless motor (G. Chen 2020)"
MAPS = "cogging_maps.npz"
PUBLISHER = (
    "the maps are published by G. Chen at https://github.com/gchenfc/ODrive (MIT licence), folder "
    "analysis/cogging_torque: put the arrays cogging_measure_final_*.npy into one cogging_maps.npz there, "
    "each by its name without .npy, or say where it is with --data"
)
FORWARD, BACKWARD, HELD_OUT = "a_4", "e_16r", "b_16"
OTHERS = ("d_16",)
"""Measured after a new index search: shows the effect of a slightly different encoder zero."""
COUNTS, PERIOD_S, MM_A_TURN = 8192, 0.01, 360.0
AXIS = "motor"
MARK_SHARE = 0.137
"""Residual share of the standard deviation of map b with the six strongest harmonics fitted on map a. A mark,
not published: computed when the data set was prepared (its PROVENANCE.md).
"""
MODEL = f"""# A rotary axis that has no cogging: 1 mm is 1 degree, 1 N is 1 A.
[axis.{AXIS}.transmission]
lead_mm = {MM_A_TURN}
[axis.{AXIS}.motor]
torque_constant_nm_a = {MM_A_TURN * 1e-3 / (2.0 * math.pi)!r}
[axis.{AXIS}.table]
mass_kg = 0.001
[axis.{AXIS}.encoder]
counts_per_rev = {COUNTS}
"""


class Map(NamedTuple):
    """Holding current over a turn, in the order of measurement; arrays (n,)."""

    position_mm: Array
    current_a: Array


def run(data: Path, out: Path, on_progress: Callable[[str], None]) -> ExampleResult:
    """Diagnose two maps, and test the identified cogging on a third. Raises ReconcileError."""
    file = data_file(data, [MAPS], PUBLISHER)
    maps = {name: read_map(file, name) for name in (FORWARD, BACKWARD, HELD_OUT, *OTHERS)}
    out.mkdir(parents=True, exist_ok=True)
    paths = [_recorded(out / f"map_{name}.csv", maps[name]) for name in (FORWARD, BACKWARD)]
    nominal = out / "nominal.toml"
    write_text_whole(nominal, MODEL)
    found = diagnose(paths, nominal, out / "diagnosis", on_progress=on_progress)
    on_progress("the map that was held out")
    effects = plant_of(load_model(found.model_file)).axes[AXIS].effects
    terms = effects.get("cogging", cogging.NEUTRAL)
    left = {name: unexplained_share(maps[name], terms) for name in (FORWARD, HELD_OUT, *OTHERS)}
    harmonics = [
        (round(n), abs(a)) for n, a in zip(terms.harmonic, terms.amplitude_n, strict=True) if a != 0.0
    ]
    harmonics.sort(key=lambda pair: -pair[1])
    friction_a = 0.5 * (maps[FORWARD].current_a.mean() - maps[BACKWARD].current_a.mean())
    named = [finding["effect"] for finding in found.verdict["findings"]]
    values = {
        "named": named,
        "harmonics": [{"harmonic": n, "amplitude_a": a} for n, a in harmonics],
        "left": left,
        "friction_a": friction_a,
    }
    listed = ", ".join(f"{n} ({a:.2f} A)" for n, a in harmonics)
    rows = [
        Row("named", ", ".join(named), "cogging"),
        Row("harmonics a turn, the strongest first", listed, "7, 28, 14, 36, 12, 84"),
        Row(f"left of map {FORWARD}, share of its std", f"{100.0 * left[FORWARD]:.1f} %", "13.4 %"),
        Row(
            f"left of map {HELD_OUT}, held out",
            f"{100.0 * left[HELD_OUT]:.1f} %",
            f"{100.0 * MARK_SHARE:.1f} %",
        ),
        *(Row(f"left of map {name}, index searched anew", f"{100.0 * left[name]:.1f} %") for name in OTHERS),
        Row("friction, half of forward less backward", f"{friction_a:.2f} A", "0.16 to 0.19 A"),
    ]
    remaining = f"{100.0 * left[HELD_OUT]:.1f} % of its deviation is left"
    one = maps[HELD_OUT]
    picture = pictures.odrive(
        out / "odrive.png", one.position_mm, one.current_a, holding_current_a(one, terms), remaining
    )
    files = [write_figures(out, values), found.model_file, *reports(found.verdict_file), picture]
    return ExampleResult(TITLE, rows, values, files)


def read_map(file: Path, name: str) -> Map:
    """Read one map; a backward one has falling positions. Raises ReconcileError."""
    key = f"cogging_measure_final_{name}"
    with np.load(file, allow_pickle=False) as arrays:
        if key not in arrays.files:
            raise ReconcileError(file, key, "is not in the file", PUBLISHER)
        values = np.asarray(arrays[key], dtype=np.float64)
    if values.shape != (COUNTS,):
        raise ReconcileError(file, key, f"has the shape {values.shape}, not ({COUNTS},)")
    measured = np.flatnonzero(values)  # 0 marks a position that was not measured
    order = measured[::-1] if name.endswith("r") or name.startswith("rev") else measured
    return Map(order / COUNTS * MM_A_TURN, values[order])


def unexplained_share(one: Map, terms: cogging.Params) -> float:
    """Return the residual standard deviation of a map with a cogging model, over that of the map."""
    return float(np.std(one.current_a - holding_current_a(one, terms)) / np.std(one.current_a))


def holding_current_a(one: Map, terms: cogging.Params) -> Array:
    """Return the current that holds the motor against the cogging, at the positions of a map."""
    angle_rad = one.position_mm / MM_A_TURN * 2.0 * math.pi
    force_n = np.zeros(len(angle_rad))
    for n, amplitude_n, phase_rad in zip(terms.harmonic, terms.amplitude_n, terms.phase_rad, strict=True):
        force_n += amplitude_n * np.sin(n * angle_rad + phase_rad)
    return -force_n


def _recorded(path: Path, one: Map) -> Path:
    """Write a map as a recording."""
    time_s = np.arange(len(one.current_a)) * PERIOD_S
    rows = np.stack((time_s, one.position_mm, one.current_a), axis=1)
    header = "time_s,motor_position_mm,motor_current_a"

    def write(temporary: Path) -> None:
        np.savetxt(temporary, rows, fmt="%.9g", delimiter=",", header=header, comments="")

    write_whole(path, write)
    return path
