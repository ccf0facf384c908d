"""Axes 1 to 3 of an industrial robot with encoders on motor and link (Weigand et al. 2021).

The torque is that of the motor; times the gear ratio it is that of the joint. Rotor inertias and gear ratios
are published; the inertia of the links is that of the publishers' rigid-body model in the middle of its
motion, rounded to 100 kg m2.
"""

from pathlib import Path

from reconcile.examples.real.machine import Columns, Joint, Machine, arrays

FOLDER = "kuka_kr300_secondary_encoder"
PUBLISHER = (
    "the recordings are published at https://github.com/JonasWeigand/Robot_Identification (MIT): "
    f"put them as npz into {FOLDER}, or say where they are with --data"
)
TRAJECTORIES = ("trajA", "trajB")
GEAR = {1: 256.85714285714283, 2: 267.42857142857144, 3: 252.33333333333334}
ROTOR_KG_M2 = {1: 0.00923, 2: 0.0118, 3: 0.0118}
LINKS_KG_M2 = {1: 1300.0, 2: 1800.0, 3: 1100.0}


def robot(data: Path) -> Machine:
    """Read the robot. Raises ReconcileError."""
    joints = {
        f"a{axis}": Joint(LINKS_KG_M2[axis], ROTOR_KG_M2[axis] * gear**2, gear_ratio=gear)
        for axis, gear in GEAR.items()
    }
    return Machine(
        "kuka",
        "industrial robot, axes 1 to 3, link-side encoders",
        "gravity on axes 2 and 3, Coulomb, viscous and asymmetric friction, elastic gears, late encoders",
        joints,
        {name: _columns(data, name) for name in TRAJECTORIES},
    )


def _columns(data: Path, trajectory: str) -> Columns:
    columns: Columns = {}
    for axis, gear in GEAR.items():
        read = arrays(data / FOLDER / f"{trajectory}_axis{axis}.npz", PUBLISHER)
        columns["time_s"] = read["time_s"]
        columns[f"a{axis}.motor_position_rad"] = read["position_rad"]
        columns[f"a{axis}.scale_position_rad"] = read["load_position_rad"]
        columns[f"a{axis}.motor_force_nm"] = read["torque_nm"] * gear
        columns[f"a{axis}.position_command_rad"] = read["command_position_rad"]
    return columns
