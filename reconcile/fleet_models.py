"""The nominal model of each axis of a fleet: its own file, its machine's, or the one for all."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import tomli_w

from reconcile.errors import ReconcileError
from reconcile.toml_file import document_of

FOR_ALL = "default.toml"


class FleetModel(NamedTuple):
    """What a worker needs: a model file of one axis, as text; it need not see the directory."""

    file: str
    text: str


class FleetModels:
    """The models of a directory; each file is read once."""

    def __init__(self, directory: Path) -> None:
        """Raise ReconcileError where there is no such directory."""
        if not directory.is_dir():
            raise ReconcileError(directory, "", "there is no such directory of models")
        self._directory = directory.resolve()
        self._read: dict[Path, dict[str, Any]] = {}

    def of(self, machine: str, axis: str) -> FleetModel:
        """`MACHINE/AXIS.toml`, else `MACHINE.toml`, else `default.toml`. Raises ReconcileError."""
        own, shared = Path(machine) / f"{axis}.toml", Path(f"{machine}.toml")
        names = [name for name in (own, shared) if _plain(machine) and _plain(axis)]
        for name in (*names, Path(FOR_ALL)):
            file = self._directory / name
            if file.is_file():
                return FleetModel(str(file), self._text(file, axis, any_name=name != shared))
        wanted = ", ".join(str(name) for name in (*names, Path(FOR_ALL)))
        raise ReconcileError(self._directory, "", f"has no model of {machine}/{axis}", f"looked for {wanted}")

    def _text(self, file: Path, axis: str, *, any_name: bool) -> str:
        """The model with this axis alone. Of a file for one axis or for all, a single axis has any name."""
        if file not in self._read:
            self._read[file] = document_of(file)
        document = self._read[file]
        axes = document.get("axis")
        if not isinstance(axes, dict) or not axes:
            raise ReconcileError(file, "axis", "no axis", "describe it as [axis.x.table] mass_kg = ...")
        table = axes.get(axis, next(iter(axes.values())) if any_name and len(axes) == 1 else None)
        if not isinstance(table, dict):
            raise ReconcileError(file, "axis", f"there is no axis {axis}; it has {', '.join(axes)}")
        alone = {axis: _absolute(table, file.parent)}
        followed = table.get("cross_axis_coupling")
        other = followed.get("other") if isinstance(followed, dict) else None
        if isinstance(other, str) and other in axes:  # its model names the axis that it follows
            alone[other] = _absolute(axes[other], file.parent)
        return tomli_w.dumps({**document, "axis": alone})


def _absolute(table: dict[str, Any], directory: Path) -> dict[str, Any]:
    """The axis with paths that hold wherever its text is read."""
    return {
        section: {**values, "eds": str((directory / values["eds"]).resolve())}
        if isinstance(values, dict) and isinstance(values.get("eds"), str)
        else values
        for section, values in table.items()
    }


def _plain(name: str) -> bool:
    """Whether a name from the dataset may be part of a path."""
    return name not in {"", ".", ".."} and not set(name) & set("/\\\0")
