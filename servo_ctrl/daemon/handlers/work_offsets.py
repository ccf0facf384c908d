"""The work offsets of a run: reads them at its start, sets them where the axes stand, writes every change."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from servo_ctrl.commands.command import CommandResult, Refusal
from servo_ctrl.commands.machine_status import WorkOffset
from servo_ctrl.config.model import MachineConfig
from servo_ctrl.config.work_offsets import OFFSETS_FILE, Offsets, read_offsets, within_reach, write_offsets
from servo_ctrl.daemon.cycle.background_worker import BackgroundWorker
from servo_ctrl.errors import ConfigError, ServoCtrlError
from servo_ctrl.units import MM


class OffsetsNotWrittenError(ServoCtrlError):
    """The file of the work offsets could not be written."""


class WorkOffsets:
    """Calls `on_change` after an offset has changed. `note` logs an event."""

    def __init__(
        self,
        config: MachineConfig,
        directory: Path,
        worker: BackgroundWorker,
        note: Callable[[str], None],
        on_change: Callable[[], None],
    ) -> None:
        self._axes = {
            name: (axis.limits.position_mm[0] * MM, axis.limits.position_mm[1] * MM)
            for name, axis in config.axes.items()
        }
        self._directory, self._worker, self._note, self._on_change = directory, worker, note, on_change
        self._offsets: Offsets = {}
        self.chosen = "G54"
        """The work offset that is in effect."""
        self.problem = ""
        """Why the file cannot be read, else ""; no part program is read until the offsets are cleared."""
        try:
            self._offsets = read_offsets(directory, self._axes)
        except ConfigError as error:
            self.problem = str(error)

    def for_part_programs(self) -> Offsets:
        """Return the offsets for reading a part program. Raises ConfigError if the file was unreadable."""
        if self.problem:
            reason = f"the work offsets are unknown, clear them first: {self.problem}"
            raise ConfigError(self._directory / OFFSETS_FILE, "", reason)
        return {name: dict(of_axis) for name, of_axis in self._offsets.items()}

    def status(self) -> tuple[WorkOffset, ...]:
        """Return the offsets that were set, and the chosen one."""
        names = sorted({self.chosen, *self._offsets})
        return tuple(
            WorkOffset(name, tuple(self._offsets.get(name, {}).get(axis, 0.0) for axis in self._axes))
            for name in names
        )

    def choose(self, name: str) -> None:
        """Choose the work offset that takes effect."""
        self.chosen = name

    def set(self, axes: Sequence[str], at_m: Sequence[float], value_m: float) -> CommandResult:
        """Shift the chosen offset so that the positions `at_m` of these axes get the coordinate `value_m`."""
        if self.problem:
            return CommandResult(Refusal.STORAGE, f"clear the work offsets first: {self.problem}")
        zeros = {axis: at - value_m for axis, at in zip(axes, at_m, strict=True)}
        for axis, zero_m in zeros.items():
            if not within_reach(zero_m, self._axes[axis]):
                reason = f"axis {axis}: a zero at {zero_m / MM:g} mm is out of reach of its travel"
                return CommandResult(Refusal.OUT_OF_RANGE, reason)
        self._offsets.setdefault(self.chosen, {}).update(zeros)
        where = ", ".join(f"{axis} {zero_m / MM:.4f} mm" for axis, zero_m in zeros.items())
        return self._changed(f"work offset {self.chosen}: zero at {where}")

    def clear(self, axes: Sequence[str]) -> CommandResult:
        """Set the chosen offset to 0 for these axes; if the file was unreadable, discard all offsets."""
        if self.problem:
            self._offsets, self.problem = {}, ""
        self._offsets.setdefault(self.chosen, {}).update(dict.fromkeys(axes, 0.0))
        return self._changed(f"work offset {self.chosen} cleared for {', '.join(axes)}")

    def _changed(self, text: str) -> CommandResult:
        self._note(text)
        self._on_change()
        problems: list[str] = []

        def failed(reason: str) -> None:
            self._note(reason)
            problems.append(reason)

        self._worker.do(partial(self._write, self.for_part_programs()), lambda _done: None, failed)
        return CommandResult(Refusal.STORAGE, problems[0]) if problems else CommandResult()

    def _write(self, offsets: Offsets) -> None:
        try:
            write_offsets(self._directory, offsets)
        except OSError as error:
            text = (
                f"{self._directory / OFFSETS_FILE}: cannot be written, it holds until the run ends: {error}"
            )
            raise OffsetsNotWrittenError(text) from None
