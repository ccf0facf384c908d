"""A double pendulum on two quasi-direct drives, in two builds (Wiebe et al. 2023).

Torques are those that the drives report from their currents. Inertias are estimates from masses and lengths
of the links, not the published fits; the encoder of a joint has 16 bits over 25 rad.
"""

import math
from pathlib import Path

from reconcile.examples.real.machine import Columns, Joint, Machine, arrays

FOLDER = "dfki_double_pendulum_ak80_6"
PUBLISHER = (
    "the recordings are published at https://github.com/dfki-ric-underactuated-lab/double_pendulum (BSD-3): "
    f"put them as npz into {FOLDER}, or say where they are with --data"
)
BUILD_A = ("00", "01", "02", "03", "04", "05", "11", "12", "13")
BUILD_C = ("00", "02", "04", "06", "12", "13")
COUNTS_1_TURN = round(65536 * 2.0 * math.pi / 25.0)
ROTOR_KG_M2 = 0.0028
"""Published, at the joint: 36 times that of the rotor."""
GEAR = 6.0
EXPECTED = "gravity, coupling of the two joints, Coulomb friction of 0.08 to 0.12 N m, viscous friction"


def build_a(data: Path) -> Machine:
    """Read the build with links of 0.3 and 0.2 m. Raises ReconcileError."""
    title = "double pendulum, build A (0.3 and 0.2 m)"
    return _build(
        data, name="dfki_a", title=title, stem="designA_sysid", numbers=BUILD_A, inertias=(0.12, 0.024)
    )


def build_c(data: Path) -> Machine:
    """Read the build with links of 0.2 and 0.3 m. Raises ReconcileError."""
    title = "double pendulum, build C (0.2 and 0.3 m)"
    return _build(
        data, name="dfki_c", title=title, stem="designC0_sysid", numbers=BUILD_C, inertias=(0.1, 0.05)
    )


def _build(
    data: Path, name: str, title: str, stem: str, numbers: tuple[str, ...], inertias: tuple[float, float]
) -> Machine:
    joints = {
        f"j{k}": Joint(own, ROTOR_KG_M2, COUNTS_1_TURN, GEAR) for k, own in enumerate(inertias, start=1)
    }
    recordings = {f"{stem}{number}": _columns(data, f"{stem}{number}") for number in numbers}
    return Machine(name, title, EXPECTED, joints, recordings)


def _columns(data: Path, name: str) -> Columns:
    read = arrays(data / FOLDER / f"{name}.npz", PUBLISHER)
    columns = {"time_s": read["time_s"]}
    for k in (1, 2):
        columns[f"j{k}.motor_position_rad"] = read[f"position{k}_rad"]
        columns[f"j{k}.motor_force_nm"] = read[f"torque{k}_nm"]
        columns[f"j{k}.force_command_nm"] = read[f"command_torque{k}_nm"]
    return columns
