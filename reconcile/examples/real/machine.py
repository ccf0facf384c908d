"""A published machine: recordings with named columns, and a nominal model of rotary axes from data sheets."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.arrays import Array
from reconcile.errors import ReconcileError
from reconcile.formats.toml_file import toml_text
from servo_ctrl.files.whole_file import write_text_whole, write_whole

Columns = dict[str, Array]


class Joint(NamedTuple):
    """One rotary axis from its data sheet, SI; 0 where the data sheet has no value."""

    inertia_kg_m2: float
    """Inertia of everything that the motor moves without its rotor, at the joint."""
    rotor_kg_m2: float = 0.0
    """Inertia of the rotor, at the joint."""
    counts_1_turn: int = 0
    """Encoder counts per turn of the joint."""
    gear_ratio: float = 1.0


class Machine(NamedTuple):
    """Recordings and nominal model of a published machine."""

    name: str
    title: str
    expected: str
    """Published statements on its physics."""
    joints: Mapping[str, Joint]
    recordings: Mapping[str, Columns]
    """By name; `<joint>.<channel>` in rad, N m, A and s."""

    def nominal(self) -> dict[str, Any]:
        """Return the nominal model as the content of a model file."""
        axes: dict[str, Any] = {}
        for name, joint in self.joints.items():
            axes[name] = {
                "motion": "rotary",
                "transmission": {"gear_ratio": joint.gear_ratio},
                "motor": {"inertia_kg_cm2": 1e4 * joint.rotor_kg_m2 / joint.gear_ratio**2},
                "table": {"inertia_kg_m2": joint.inertia_kg_m2},
            }
            if joint.counts_1_turn:
                axes[name]["encoder"] = {"counts_per_rev": joint.counts_1_turn / joint.gear_ratio}
        return {"axis": axes}

    def written(self, directory: Path) -> tuple[Path, list[Path]]:
        """Write nominal.toml and a file for each recording. Raises OSError."""
        directory.mkdir(parents=True, exist_ok=True)
        nominal = directory / "nominal.toml"
        write_text_whole(nominal, toml_text(self.nominal()))
        return nominal, [self._written(directory, name) for name in self.recordings]

    def _written(self, directory: Path, name: str) -> Path:
        path = directory / f"{name}.npz"

        def write(temporary: Path) -> None:
            with temporary.open("wb") as file:
                np.savez(file, **self.recordings[name])  # type: ignore[arg-type]  # NumPy's stub reads the names as options

        write_whole(path, write)
        return path


def arrays(file: Path, publisher: str) -> dict[str, Array]:
    """Read the columns of a published recording. Raises ReconcileError: it is not there."""
    if not file.is_file():
        raise ReconcileError(file.parent, "", f"holds no {file.name}", publisher)
    with np.load(file, allow_pickle=False) as content:
        return {name: np.asarray(content[name], dtype=np.float64) for name in content.files}


Read = Callable[[Path], Machine]
"""Reads a machine from the directory of all sets. Raises ReconcileError."""
