"""Stores learned results on disk: immutable numbered versions, and a file that names the version in use.

    DIR/x/v0001.json, v0002.json, ...   pulse functions, immutable
    DIR/x/active.json                   which of them is in use
    DIR/x/screw/...                     the screw, likewise
    DIR/x/waveform/...                  the waveform, likewise

All are written under a temporary name, synchronised and renamed: after a crash at any point all files are
complete, and active.json names the previous or the new version.
"""

from collections.abc import Callable
from datetime import UTC, datetime
from importlib.metadata import version as version_of_package
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

from servo_ctrl.config.model import MachineConfig
from servo_ctrl.errors import ServoCtrlError, reason_of
from servo_ctrl.files.directory import locked, make_directory
from servo_ctrl.learned.file_model import FORMAT, LearnedContent, LearnedFile
from servo_ctrl.learned.files import (
    ACTIVE_FILE,
    Active,
    json_scalar,
    read_active,
    read_version,
    version_numbers,
    version_path,
    write_active,
    write_version,
)
from servo_ctrl.learned.pulse_model import LearnedFunctions
from servo_ctrl.learned.screw_model import ScrewTable
from servo_ctrl.learned.waveform_model import LearnedWaveform
from servo_ctrl.learning.reversal_waveform import WaveformLearned
from servo_ctrl.learning.screw import ScrewLearned
from servo_ctrl.learning.types import Learned
from shipped_files import is_installed, state_directory

Result = TypeVar("Result", Learned, ScrewLearned, WaveformLearned)


class StoreError(ServoCtrlError):
    """A learned result or journal cannot be used or written; the text has file, reason and remedy."""


class StoredResult(NamedTuple, Generic[Result]):
    """An intact version of a learned result."""

    version: int
    axis: str
    learned_at: str
    """UTC, ISO 8601."""
    conditions: dict[str, Any]
    learned: Result


class VersionEntry(NamedTuple):
    """A version on the disk, intact or not."""

    version: int
    in_use: bool
    result: LearnedFile[Any] | None
    """The content; None if the file is damaged."""
    problem: str
    """Why it cannot be used, else ""."""


def default_directory(machine: MachineConfig) -> Path:
    """Return the default directory: beside the machine file, or the user's for an installed machine."""
    folder = machine.source.parent
    return (state_directory() / folder.name if is_installed(folder) else folder) / "learned"


def utc_now() -> datetime:
    """Return the date for a new version."""
    return datetime.now(UTC)


class VersionStore(Generic[Result]):
    """The learned results of one machine, of one kind, below `directory`, which the first `add` creates.

    All methods raise StoreError.
    """

    content: type[LearnedContent]
    subdirectory = ""
    """Directory below that of the axis."""
    option = ""
    """The option that selects this kind in `servo-ctrl learned`."""

    def __init__(
        self, directory: Path, machine: MachineConfig, *, now: Callable[[], datetime] = utc_now
    ) -> None:
        self.directory = directory
        self._file: type[LearnedFile[Any]] = LearnedFile[self.content]  # type: ignore[name-defined]
        self._machine = machine
        self._now = now

    def active(self, axis: str) -> StoredResult[Result] | None:
        """Return the version in use, checked; None without one."""
        active = self._active(axis)
        if active.version == 0:
            return None
        result, problem = self._checked(axis, active.version)
        if result is not None and not problem and result.sha256 != active.sha256:
            problem = f"is not the version {active.version} that {ACTIVE_FILE} names"
        if result is None or problem:
            raise self._error(version_path(self._directory(axis), active.version), problem, axis)
        return _stored(result)

    def versions(self, axis: str) -> list[VersionEntry]:
        """Return all versions, oldest first, intact or not."""
        try:
            in_use = self._active(axis).version
        except StoreError:
            in_use = 0
        return [
            VersionEntry(number, number == in_use, *self._checked(axis, number))
            for number in self._numbers(axis)
        ]

    def add(self, axis: str, learned: Result, conditions: dict[str, Any]) -> StoredResult[Result]:
        """Store a new version and put it into use."""
        directory = self._directory(axis)
        try:
            make_directory(directory)
            with locked(directory):
                number = max(version_numbers(directory), default=0) + 1
                result = self._new(axis, number, learned, conditions)
                write_version(directory, result)
                write_active(directory, result)
        except OSError as error:
            raise StoreError(f"{directory}: what was learned cannot be stored: {reason_of(error)}") from None
        return _stored(result)

    def roll_back(self, axis: str) -> StoredResult[Result] | None:
        """Put the intact version before the one in use into use, or none (None); delete no version.

        If active.json cannot be read, the newest intact version is put into use.
        """
        directory = self._directory(axis)
        if not directory.is_dir():
            return None
        try:
            with locked(directory):
                numbers = self._numbers(axis)
                try:
                    in_use = self._active(axis).version
                except StoreError:
                    in_use = max(numbers, default=0) + 1
                result = self._newest_intact(axis, [number for number in numbers if number < in_use])
                write_active(directory, result)
        except OSError as error:
            raise StoreError(f"{directory}: cannot be rolled back: {reason_of(error)}") from None
        return None if result is None else _stored(result)

    def _new(self, axis: str, number: int, learned: Result, conditions: dict[str, Any]) -> LearnedFile[Any]:
        """Make a version, and check it as a later read does."""
        content = {
            "format": FORMAT,
            "version": number,
            "machine": self._machine.machine.name,
            "axis": axis,
            "learned_at": self._now().strftime("%Y-%m-%dT%H:%M:%SZ"),
            "software": version_of_package("servo-ctrl"),
            "basis": self.content.basis(self._machine, axis),
            "conditions": {key: json_scalar(value) for key, value in conditions.items()},
        }
        try:
            result = self._file.sealed({**content, "learned": self.content.values(learned)})
        except ValueError as error:
            raise StoreError(f"axis {axis}: what was learned is not stored: {error}") from None
        if problem := result.objection(self._machine, axis):
            raise StoreError(f"axis {axis}: what was learned is not stored: it {problem}")
        return result

    def _newest_intact(self, axis: str, numbers: list[int]) -> LearnedFile[Any] | None:
        newest_first = (self._checked(axis, number) for number in reversed(numbers))
        return next((result for result, problem in newest_first if not problem), None)

    def _checked(self, axis: str, number: int) -> tuple[LearnedFile[Any] | None, str]:
        """Return a version, None if damaged, and why it must not be used, else ""."""
        try:
            result = read_version(self._file, self._directory(axis), number)
        except FileNotFoundError:
            return None, f"is missing, and {ACTIVE_FILE} names it"
        except OSError as error:
            return None, f"cannot be read: {reason_of(error)}"
        except ValueError as error:
            return None, str(error)
        return result, result.objection(self._machine, axis)

    def _active(self, axis: str) -> Active:
        path = self._directory(axis) / ACTIVE_FILE
        try:
            return read_active(path.parent)
        except OSError as error:
            problem = f"cannot be read: {reason_of(error)}"
        except ValueError as error:
            problem = str(error)
        raise self._error(path, problem, axis)

    def _numbers(self, axis: str) -> list[int]:
        directory = self._directory(axis)
        try:
            return version_numbers(directory)
        except OSError as error:
            raise StoreError(f"{directory}: cannot be read: {reason_of(error)}") from None

    def _directory(self, axis: str) -> Path:
        if axis not in self._machine.axes:
            known = ", ".join(self._machine.axes)
            raise StoreError(f'machine {self._machine.machine.name} has no axis "{axis}", only {known}')
        return self.directory / axis / self.subdirectory

    def _error(self, path: Path, problem: str, axis: str) -> StoreError:
        return StoreError(
            f"{path}: {problem}; learn axis {axis} again, or take an earlier version with "
            f'"servo-ctrl learned rollback --axis {axis}{self.option}"'
        )


class LearnedStore(VersionStore[Learned]):
    """The store of pulse functions."""

    content = LearnedFunctions


class ScrewStore(VersionStore[ScrewLearned]):
    """The store of screw error tables and lost motion."""

    content = ScrewTable
    subdirectory = "screw"
    option = " --kind screw"


class WaveformStore(VersionStore[WaveformLearned]):
    """The store of waveforms."""

    content = LearnedWaveform
    subdirectory = "waveform"
    option = " --kind waveform"


def _stored(result: LearnedFile[Any]) -> StoredResult[Any]:
    return StoredResult(
        result.version, result.axis, result.learned_at, dict(result.conditions), result.learned.learned()
    )
