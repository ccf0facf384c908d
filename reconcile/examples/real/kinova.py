"""Joints 1, 2, 4 and 6 of a cobot with strain-wave gears: trapezoids of one joint, and runs of all (2024).

The torque is that of the publishers: current times 9.13 (joints 1, 2, 4) or 5.852 N m/A (joint 6). Inertias
are not published; those here are estimates for an arm of 8 kg and 0.9 m, correct to a factor of two.
"""

from pathlib import Path

from reconcile.examples.real.machine import Columns, Joint, Machine, arrays

FOLDER = "kinova_gen3"
PUBLISHER = (
    "the recordings are published at https://github.com/wissem01chiha/dynamic-identification (MIT, CC0): "
    f"put them as npz into {FOLDER}, or say where they are with --data"
)
INERTIA_KG_M2 = {1: 1.2, 2: 2.0, 4: 1.0, 6: 0.5}
GEAR = 100.0
"""Gear ratio of the strain-wave gears, from the data sheet of the arm."""
RUNS = ("multi_opti1", "multi_quadratic")


def cobot(data: Path) -> Machine:
    """Read the arm. Raises ReconcileError."""
    recordings = {run: _columns(data, run, tuple(INERTIA_KG_M2)) for run in RUNS}
    recordings |= {f"joint{k}_trapez": _columns(data, f"joint{k}_trapez", (k,)) for k in INERTIA_KG_M2}
    return Machine(
        "kinova",
        "cobot, joints 1, 2, 4 and 6",
        "gravity on joints 2, 4 and 6, friction of strain-wave gears; nothing in numbers",
        {f"j{k}": Joint(inertia, gear_ratio=GEAR) for k, inertia in INERTIA_KG_M2.items()},
        recordings,
    )


def _columns(data: Path, run: str, joints: tuple[int, ...]) -> Columns:
    columns: Columns = {}
    for k in joints:
        read = arrays(data / FOLDER / f"{run}_j{k}.npz", PUBLISHER)
        columns["time_s"] = read["time_s"]
        columns[f"j{k}.motor_position_rad"] = read["position_rad"]
        columns[f"j{k}.motor_force_nm"] = read["torque_from_current_nm"]
    return columns
