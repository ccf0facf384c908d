"""Finds the nominal model of each axis of a fleet: its own file, that of its machine, or the default."""

from pathlib import Path
from typing import Any, NamedTuple

from reconcile.errors import ReconcileError
from reconcile.formats.toml_file import document_of, toml_text, with_absolute_paths

DEFAULT = "default.toml"


class FleetModel(NamedTuple):
    """A model file of one axis as text, because a worker may not have the directory."""

    file: str
    text: str


class FleetModels:
    """The models of a directory; reads each file once."""

    def __init__(self, directory: Path) -> None:
        """Raise ReconcileError where there is no such directory."""
        if not directory.is_dir():
            raise ReconcileError(directory, "", "there is no such directory of models")
        self._directory = directory.resolve()
        self._read: dict[Path, dict[str, Any]] = {}

    def of(self, machine: str, axis: str) -> FleetModel:
        """Return `MACHINE/AXIS.toml`, else `MACHINE.toml`, else `default.toml`. Raises ReconcileError."""
        own, shared = Path(machine) / f"{axis}.toml", Path(f"{machine}.toml")
        names = [name for name in (own, shared) if _plain(machine) and _plain(axis)]
        for name in (*names, Path(DEFAULT)):
            file = self._directory / name
            if file.is_file():
                return FleetModel(str(file), self._text(file, axis, any_name=name != shared))
        wanted = ", ".join(str(name) for name in (*names, Path(DEFAULT)))
        raise ReconcileError(self._directory, "", f"has no model of {machine}/{axis}", f"looked for {wanted}")

    def _text(self, file: Path, axis: str, *, any_name: bool) -> str:
        """Return the text of the model reduced to this axis; a single axis may have `any_name`."""
        if file not in self._read:
            self._read[file] = document_of(file)
        document = self._read[file]
        axes = document.get("axis")
        if not isinstance(axes, dict) or not axes:
            raise ReconcileError(file, "axis", "no axis", "describe it as [axis.x.table] mass_kg = ...")
        table = axes.get(axis, next(iter(axes.values())) if any_name and len(axes) == 1 else None)
        if not isinstance(table, dict):
            raise ReconcileError(file, "axis", f"there is no axis {axis}; it has {', '.join(axes)}")
        alone = {axis: table}
        for section in table.values():
            other = section.get("other_axis") if isinstance(section, dict) else None
            if isinstance(other, str) and other in axes:  # the section refers to it
                alone[other] = axes[other]
        return toml_text(with_absolute_paths({**document, "axis": alone}, file.parent))


def _plain(name: str) -> bool:
    """Whether a name of the dataset is safe as part of a path."""
    return name not in {"", ".", ".."} and not set(name) & set("/\\\0")
